"""The catalogue as data: which physics can be missing, and what must not be mistaken for it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

from pikanid import errors
from pikanid.formula import units
from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue import channels, decoys, delays, forces, friction
from pikanid.mismatch.catalogue.backlash import input_backlash
from pikanid.mismatch.catalogue.candidate import Candidate, Family
from pikanid.mismatch.catalogue.coupled_state import coupled_state
from pikanid.mismatch.catalogue.cross_axis import cross_axis
from pikanid.mismatch.catalogue.fading_memory import fading_memory, without_store
from pikanid.mismatch.catalogue.neighbouring_forms import neighbouring_forms
from pikanid.mismatch.catalogue.own_effects import own_effects, with_twins
from pikanid.mismatch.catalogue.reversed_signs import input_sign, sensor_sign
from pikanid.mismatch.catalogue.second_mode import second_mode
from pikanid.mismatch.catalogue.site import Site
from pikanid.model import Effect, Model

Make = Callable[[Site], list[Candidate]]
# each with the families of physics that it belongs to
ENTRIES: tuple[tuple[Make, tuple[Family, ...]], ...] = (
    (friction.coulomb_friction, ("dry friction",)),
    (friction.linear_drag, ("drag",)),
    (friction.quadratic_drag, ("drag",)),
    (friction.power_drag, ("drag",)),
    (friction.amplitude_damping, ("drag",)),
    (forces.cubic_stiffness, ("restoring force",)),
    (forces.free_spring, ("restoring force",)),
    (forces.static_bias, ("constant force",)),
    (forces.parameter_drift, ("slow change",)),
    (second_mode, ("mode",)),
    (forces.wall_impact, ("restoring force",)),
    (cross_axis, ("other axis",)),
    (forces.disturbance, ("once",)),
    (friction.boundary_layer, ("drag",)),
    (friction.hysteresis, ("dry friction",)),
    (delays.delay, ("timing",)),
    (delays.input_delay, ("timing",)),
    (delays.input_lead, ("timing",)),
    (delays.clock_error, ("timing",)),
    (channels.lags, ("timing",)),
    (channels.input_gain, ("gain",)),
    (channels.sensor_gain, ("gain",)),
    (channels.input_limits, ("input curve",)),
    (input_backlash, ("input curve",)),
    (channels.sensor_offset, ("constant force",)),
    (channels.sensor_drift, ("slow change",)),
    (channels.sensor_fading, ("slow change",)),
    (channels.sensor_saturation, ("sensor curve",)),
    (channels.sensor_nonlinearity, ("sensor curve",)),
    (coupled_state, ("coupling",)),
    (forces.initial_state, ("once",)),
    (channels.input_hold, ("timing",)),
    (input_sign, ("gain",)),
    (sensor_sign, ("gain",)),
)
DECOYS: tuple[tuple[Make, tuple[Family, ...]], ...] = (
    (decoys.even_stiffness, ("restoring force",)),
    (decoys.quintic_stiffness, ("restoring force",)),
    (decoys.linear_stiffness, ("restoring force",)),
    (decoys.even_drag, ("one-sided drag",)),
    # half of the difference between forth and back is a constant force
    (decoys.one_way_friction, ("dry friction", "constant force")),
    (decoys.stribeck_friction, ("dry friction",)),
    (decoys.dissipating_wall, ("restoring force",)),
    (decoys.rigid_stop, ("restoring force",)),
    (decoys.velocity_coupled_drive, ("input curve",)),
    (decoys.position_coupled_drive, ("input curve",)),
    (decoys.soft_saturation, ("input curve",)),
    (decoys.wobble, ("slow change",)),
    (decoys.rate_limit, ("timing",)),
    (fading_memory, ("storage",)),
)
# what the laws of a motion are called where they act on a quantity that is no speed
OF_QUANTITY = {
    "Coulomb friction": "a constant loss",
    "Coulomb friction with a rounded reversal": "a rounded constant loss",
    "viscous damping": "a loss in proportion",
    "quadratic drag": "a quadratic loss",
    "drag with an exponent of its own": "a power-law loss",
    "friction in one direction": "a one-sided constant loss",
    "friction that rises at low speed": "a loss that rises near zero",
    "a force local in time": "a source local in time",
    "a force local in time, its course open": "a source local in time, its course open"}
# what acts on a coordinate as a force, which a lever hands on to others
FORCES: frozenset[Make] = frozenset((
    friction.coulomb_friction, friction.linear_drag, friction.quadratic_drag,
    friction.power_drag, friction.amplitude_damping, friction.boundary_layer, friction.hysteresis,
    forces.cubic_stiffness, forces.free_spring, forces.static_bias, forces.wall_impact,
    decoys.even_stiffness, decoys.quintic_stiffness, decoys.linear_stiffness,
    decoys.even_drag, decoys.one_way_friction, decoys.stribeck_friction, decoys.dissipating_wall,
    decoys.rigid_stop))


def candidates(sites: Sequence[Site], effects: Iterable[Effect] = ()) -> tuple[Candidate, ...]:
    """Everything that can be missing in a model, users' own effects first, then entries; equal keys
    once.  What is an explanation of its own `beside` others only is there as well.

    Raises:
        BadModel: An effect that does not suit the model or the catalogue.

    >>> from pikanid.recording import excitation
    >>> from pikanid.model import systems
    >>> from pikanid.mismatch.catalogue.sites import sites
    >>> model, rec = systems.sloshing(), excitation.two_pulse()
    >>> found = candidates(sites(model, (rec,)))
    >>> sum(c.known and c.suits() and not c.refines for c in found), found[0].key
    (39, 'coulomb_friction')
    """
    made: dict[str, Candidate] = {}
    # two coordinates may be seen in one output, or moved by one input: each is one channel
    levered = {s.v for s in sites if s.lever}
    first = {name: s.v for s in reversed(sites) for name in (*s.inputs, s.output.name)}
    for table in (ENTRIES, DECOYS):
        for site in sites:
            for make, families in table:
                if site.lever and make not in FORCES:
                    continue
                for candidate in make(site):
                    if all(first[name] == site.v for name in _channels(candidate)):
                        candidate = _told_apart(candidate if site.mechanical else replace(
                            candidate, name=OF_QUANTITY.get(candidate.name, candidate.name)))
                        if site.suffix and make in FORCES:
                            candidate = _placed(candidate, site.v in levered)
                        made.setdefault(candidate.key, replace(
                            candidate, families=families, pushes=make in FORCES))
        for other in sites[0].sensors:
            made |= {c.key: c for c in _of_sensor(replace(other, taken=sites[0].taken), table)}
    for entry in [*made.values()]:
        made |= {c.key: c for c in neighbouring_forms(entry) if entry.known}
    effects = tuple(effects)
    stored = {state for effect in effects if effect.states for state in effect.add}
    made = {key: without_store(c) if c.ids == ("fading_memory",) and c.site.v in stored else c
            for key, c in made.items()}
    model = sites[0].model
    lost = {state for effect in effects if _is_a_loss(effect, model) for state in effect.add}
    made = {key: c for key, c in made.items()
            if c.ids != ("linear_drag",) or c.site.v not in lost}
    own = own_effects(effects, sites, made)
    measured = [*(s.unit for s in model.states), *(o.unit for o in model.outputs)]
    if any(map(units.begins_elsewhere, measured)):
        made = {key: c for key, c in made.items() if _has_meaning(c, model)}
    return tuple(with_twins([*own, *made.values()], effects))


def _is_a_loss(effect: Effect, model: Model) -> bool:
    """Whether it is a loss of one state in proportion to that: one law is offered once."""
    if len(effect.add) != 1 or len(effect.parameters) != 1:
        return False
    (state,) = effect.add
    more = model.with_effect(effect).equations[state] - model.equations[state]
    return bool(more == -symbol(effect.parameters[0].name) * symbol(state))


def _of_sensor(site: Site, table: Sequence[tuple[Make, tuple[Family, ...]]]
               ) -> Iterator[Candidate]:
    """What may be wrong with the sensor of an output that no equation's site is seen in.

    No law of an equation is a twin of it, as other outputs show that as well.
    """
    for make, families in table:
        for candidate in make(site):
            if candidate.channel == "sensor":
                yield replace(_told_apart(candidate), families=families, twin=candidate.twin and (
                    f"{candidate.twin} in {site.output.name}"))


def _placed(law: Candidate, levered: bool) -> Candidate:
    """A law of one of several coordinates: its name says of which one.  Where there is a lever the
    same law along it is its twin.
    """
    site = law.site
    name = f"{law.name} {'on' if site.mechanical else 'of'} {site.q or site.v}" + (
        f" as {site.along} acts" if site.lever else "")
    own = f"{law.ids[0]}[{law.variant}]" if levered else ""
    return replace(law, name=name, twin=law.twin or own)


def _told_apart(law: Candidate) -> Candidate:
    """What happens to one of several inputs, or outputs, with its name."""
    model, name = law.site.model, law.name
    for channel in _channels(law):
        several, word = ((model.inputs, "the input") if channel in law.site.inputs
                         else (model.outputs, "the sensor"))
        if len(several) > 1 and word in name:
            name = name.replace(word, f"{word} {'' if several is model.inputs else 'of '}{channel}")
        elif len(several) > 1 and channel not in name.split():
            name = f"{name} ({channel})"
    return replace(law, name=name)


def _channels(candidate: Candidate) -> Sequence[str]:
    """The input or output that a candidate changes, rather than an equation."""
    site = candidate.site
    if candidate.channel == "dynamics":
        return ()
    if candidate.channel == "sensor":
        return (site.output.name,)
    # of several inputs the variant tells which
    return [u for u in site.inputs if u in candidate.variant.split(",")] or site.inputs


def _has_meaning(candidate: Candidate, model: Model) -> bool:
    """Whether the model's units allow its formula: in degC no temperature has a power or a sign."""
    of_state = candidate.powers is not None or candidate.resistance is not None
    if of_state and units.begins_elsewhere(candidate.site.speed_unit):
        return False
    try:
        candidate.applied(model)
    except errors.BadUnit:
        return False
    return True
