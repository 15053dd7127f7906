"""Laws of the forms next to an entry's: other powers of the states, and a wall that stiffens.

A name claims a form.  Where the form next to it explains a recording about as well, the recording
has not shown which of them acts; where it explains far more, the entry is not what acts.  So
compared are: every power law of the catalogue with those of one power more and one less in each
state, that of a free exponent with a loss that saturates; an elastic wall with one whose force
rises with the square, as that of a cable that tightens; a boundary layer, whose memory has a
power's tail, with a fluid whose memory fades exponentially; a steady drift with a parameter that
settles; a loop of hysteresis with a spring that gives way without a memory; another initial state
with a force that goes on swinging; a constant force with one in a region of a state; a linear
coupling with one in the product of both states; a scale error of input or sensor with curves that
bend as well, and a cubic one with other powers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pikanid.formula import units
from pikanid.mismatch.catalogue.candidate import Begin, Candidate, Family, Powers
from pikanid.mismatch.catalogue.forces import INF, changing, wall_force
from pikanid.mismatch.catalogue.regional_force import regional_forces
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.catalogue.swinging_force import swinging_force
from pikanid.model import Model
from pikanid.model.parts import Parameter, State

EASED = (0.75, 0.88, 1.0)  # numerical: of a wall's distance, where fits of one that stiffens begin
MEMORIES = (0.3, 1.0, 3.0)  # numerical: of the time to swing, where fits of a memory begin
SETTLED = (0.1, 0.3, 1.0)  # numerical: of the recording, where fits of what settles begin
ROUNDED = (1.0, 1.5)  # numerical: of a sensor's limit, where fits of a rounded one begin
KNEES = (0.03, 0.2)  # numerical: of the half range, how wide these begin where one side is limited
STEEPEST = 0.05  # numerical: what a loss that saturates lacks of being in proportion, at least
BENT = (2, 3)  # definition: powers of a curve beside its straight part
Starts = list[dict[str, float]]


def neighbouring_forms(entry: Candidate) -> list[Candidate]:
    """The decoys next to an entry in form; none where no form is next to it."""
    if entry.ids == ("wall_impact",):
        return [_stiffening(entry)]
    if entry.ids == ("power_drag",):
        return [_saturating(entry)]
    if entry.ids == ("boundary_layer",):
        return [_fading(entry)]
    if entry.ids == ("parameter_drift",):
        return [_settling(entry)]
    if entry.ids == ("hysteresis",) and entry.channel == "dynamics" and entry.site.rate:
        return [_yielding(entry)]
    if entry.ids == ("initial_state",):
        return [swinging_force(entry.site, entry.key)]
    if entry.ids == ("static_bias",) and not entry.variant:
        return regional_forces(entry)
    if entry.ids == ("coupled_state",):
        return [_in_product(entry)]
    if entry.ids == ("input_gain",):
        return [_bent(entry, entry.variant or entry.site.inputs[0], n) for n in BENT]
    if entry.ids == ("sensor_gain",) and entry.site.rate:
        return [_bent(entry, entry.site.output.name, n) for n in BENT]
    if entry.ids == ("sensor_nonlinearity",):
        return [_bent_otherwise(entry, n) for n in (2, 4)]
    if entry.ids == ("sensor_saturation",):
        return [_rounded(entry)]
    if entry.powers is None or not entry.site.placed:
        return []
    return [_power_law(entry, near) for near in _next(entry.powers)]


def _next(own: Powers) -> list[Powers]:
    """One power more, and one less, in each state; without the linear laws that a model has."""
    if own.restores:
        return [Powers(n, 0, True) for n in (own.q - 1, own.q + 1) if n > 1]
    near = [(own.q + 1, own.v), (own.q - 1, own.v), (own.q, own.v + 1), (own.q, own.v - 1)]
    return [Powers(q, v) for q, v in near if min(q, v) >= 0 and (q, v) != (0, 1)]


def _power_law(entry: Candidate, near: Powers) -> Candidate:
    """-c |q|ᵃ |v|ᵇ against the motion, or -k |q|ᵃ towards the rest."""
    site, own = entry.site, entry.powers
    assert own is not None
    mark = f"{entry.ids[0]}_q{near.q}_v{near.v}"
    unit = units.product((site.unit, 1 - near.q - near.v), ("s", near.v - 2))
    letter = "k" if near.restores else "c"
    size = Parameter(site.name(f"{letter}_{near.q}{near.v}"), 0.0, unit, entry.parameters[0].bounds)
    factors = [_signed(site.q, near.q)] if near.restores else [
        *_magnitude(site.q, near.q), _signed(site.v, near.v)]
    text = "*".join([f"-{size.name}", *factors])

    def starts(values: Mapping[str, float], states: Mapping[str, np.ndarray]) -> Starts:
        q, v = (np.abs(states[n]) for n in (site.q, site.v))
        as_loud = _loud(own, q, v) / max(_loud(near, q, v), 1e-300)
        return [{size.name: values[entry.parameters[0].name] * as_loud}]

    # what does not rise with speed is dry friction; one whose load grows with the deflection takes
    # energy out as drag does, faster than with the square of the amplitude
    kinds: tuple[Family, ...] = ("drag",) if near.v else (
        "dry friction", "drag") if near.q else ("dry friction",)
    return _decoy(entry, mark, text, (size,), starts, entry.families if near.restores else kinds)


def _magnitude(x: str, n: int) -> list[str]:
    return [] if n == 0 else [f"{x}**{n}" if n % 2 == 0 else f"abs({x})" if n == 1 else
                              f"abs({x})**{n}"]


def _signed(x: str, n: int) -> str:
    if n == 0:
        return f"sign({x})"
    power = x if n <= 2 else f"{x}**{n if n % 2 else n - 1}"
    return power if n % 2 else f"abs({x})*{power}"


def _loud(form: Powers, q: np.ndarray, v: np.ndarray) -> float:
    """The root mean square of a power law of size 1 over the motion |q|, |v| (L,)."""
    return float(np.sqrt(np.mean((q**form.q * v**form.v) ** 2)))


def _stiffening(wall: Candidate) -> Candidate:
    """The wall's force k δ², δ how deep it gives way."""
    site, distance = wall.site, wall.parameters[0]
    k = Parameter(site.name("k_cable"), 0.0, units.product((site.unit, -1), ("s", -2)), (0.0, INF))

    def starts(values: Mapping[str, float], states: Mapping[str, np.ndarray]) -> Starts:
        stiffness, at = values[wall.parameters[1].name], values[distance.name]
        top = float(np.abs(states[site.q]).max(initial=0.0))
        return [{distance.name: share * at,
                 k.name: stiffness * max(top - at, 0.0) / max(top - share * at, 1e-9) ** 2}
                for share in EASED]

    text = wall_force(site, distance.name, k.name, wall.variant, power=2)
    made = _decoy(wall, "stiffening_wall", text, (distance, k), starts, wall.families)
    return replace(made, shape_of=wall.ids)


def _saturating(drag: Candidate) -> Candidate:
    """-c v/(s + |v|): in proportion at first, and bounded, as a reaction's rate is (L. Michaelis
    and M. L. Menten, Biochem. Z. 49, 1913).
    """
    site, (size, exponent) = drag.site, drag.parameters
    c = Parameter(site.name("c_most"), 0.0, site.force_unit, (0.0, INF))
    half = site.slow_speed("v_half")

    def starts(values: Mapping[str, float], states: Mapping[str, np.ndarray]) -> Starts:
        v, n = np.abs(states[site.v]), values[exponent.name]
        usual = float(np.sqrt(np.mean(v**2)))
        # where both rise alike
        at = usual * n / max(1 - n, STEEPEST)
        as_loud = np.sqrt(np.mean(v ** (2 * n)) / max(np.mean((v / (at + v)) ** 2), 1e-300))
        return [{c.name: values[size.name] * float(as_loud), half.name: at}]

    text = f"-{c.name}*{site.v}/({half.name} + abs({site.v}))"
    return _decoy(drag, "saturating_loss", text, (c, half), starts, drag.families)


def _fading(layer: Candidate) -> Candidate:
    """-κ (v - w), τ w' = v - w: W. E. Cummins, Schiffstechnik 9 (1962), with a kernel of one time.
    """
    site, usual = layer.site, 1 / layer.site.rate
    kappa = Parameter(site.name("kappa_m"), 0.0, "1/s", (0.0, INF))
    tau = Parameter(site.name("tau_m"), usual, "s", (1e-3 * usual, INF))
    wake = site.name("wake")

    def extend(model: Model) -> Model:
        state = State(wake, unit=site.speed_unit)
        model = model.with_state(state, f"({site.v} - {wake})/{tau.name}")
        return site.pushed(model, f"-{kappa.name}*({site.v} - {wake})")

    def starts(values: Mapping[str, float], states: Mapping[str, np.ndarray]) -> Starts:
        strength = values[layer.parameters[0].name] * site.rate**0.5
        return [{kappa.name: strength, tau.name: share * usual} for share in MEMORIES]

    made = _decoy(layer, "fading_memory", f"-{kappa.name}*({site.v} - {wake})", (kappa, tau),
                  starts, layer.families)
    return replace(made, extend=extend, static=False)


def _yielding(loop: Candidate) -> Candidate:
    """-b q/(z² + q²)^½: a spring that gives way as the loop does, without its memory."""
    site, (b, z) = loop.site, loop.parameters
    text = f"-{b.name}*({site.q}/{z.name})/(1 + ({site.q}/{z.name})**2)"
    return _decoy(loop, "yielding_spring", text, (b, z), lambda values, states: [
        {b.name: values[b.name], z.name: values[z.name]}], ("restoring force",))


def _settling(drift: Candidate) -> Candidate:
    """p (1 + a exp(-t/τ)): a parameter that settles, as that of oil that warms up."""
    site, p, (first, last) = drift.site, drift.variant, drift.site.span
    a = Parameter(site.name(f"a_{p}"), 0.0, "")
    tau = Parameter(site.name(f"tau_{p}"), 0.25 * (last - first), "s",
                    (1e-3 * (last - first), INF))
    text = f"{p}*(1 + {a.name}*exp(-t/{tau.name}))"

    def starts(values: Mapping[str, float], states: Mapping[str, np.ndarray]) -> Starts:
        change = values[drift.parameters[0].name] * (last - first)
        return [{a.name: -change, tau.name: share * (last - first)} for share in SETTLED]

    made = _decoy(drift, "settling_parameter", f"{p} -> {text}", (a, tau), starts, drift.families)
    return replace(made, static=False, extend=lambda m: changing(m, p, text))


def _in_product(linear: Candidate) -> Candidate:
    """k y v, in place of k y: what comes of one state acts on what is there of the other, as in
    kinetics (C. M. Guldberg and P. Waage, Les Mondes 12, 1864).
    """
    site, y, size = linear.site, linear.variant, linear.parameters[0]
    k = Parameter(site.name("k_with", y), 0.0, units.product(
        (size.unit or "1", 1), (site.speed_unit, -1)))

    def starts(values: Mapping[str, float], states: Mapping[str, np.ndarray]) -> Starts:
        both = states[y] * states[site.v]
        return [{k.name: values[size.name] * float(both @ states[y]) / max(float(both @ both),
                                                                          1e-300)}]

    return _decoy(linear, "coupling_in_product", f"{k.name}*{y}*{site.v}", (k,), starts,
                  linear.families)


def _bent(scale: Candidate, channel: str, n: int) -> Candidate:
    """(k + b yⁿ⁻¹) y of an input or an output y, in place of its scale alone."""
    site, k = scale.site, scale.parameters[0]
    of = site.variant(channel) if channel in site.inputs else ""
    b = Parameter(site.name(f"b_{n}", of), 0.0, units.product((_unit(scale, channel), 1 - n)))
    text = f"{k.name}*{channel} + {b.name}*{channel}**{n}"
    return _curve(scale, channel, f"{scale.ids[0]}_bent_{n}", text, (k, b), lambda values, states: [
        {k.name: values[k.name], b.name: 0.0}])


def _bent_otherwise(cubic: Candidate, n: int) -> Candidate:
    """y + b |y|ⁿ⁻¹ y, in place of y + b y³."""
    site, o = cubic.site, cubic.site.output.name
    b = Parameter(site.name(f"b_{n}"), 0.0, units.product((_unit(cubic, o), 1 - n)))
    power = o if n == 2 else f"{o}**{n - 1}"

    def starts(values: Mapping[str, float], states: Mapping[str, np.ndarray]) -> Starts:
        top = float(np.abs(states[site.q]).max(initial=0.0))
        return [{b.name: values[cubic.parameters[0].name] * top ** (3 - n)}]

    return _curve(cubic, o, f"sensor_power_{n}", f"{o} + {b.name}*abs({o})*{power}", (b,), starts)


def _rounded(clipped: Candidate) -> Candidate:
    """L tanh(y/L), in place of a limit that y keeps to and is not bent by below; of one on one side
    (y + L - ((y - L)² + w²)^½)/2, which is that limit where w is nothing.
    """
    site, o, old = clipped.site, clipped.site.output.name, clipped.parameters[0]
    unit = _unit(clipped, o)
    limit = Parameter(site.name("limit_soft"), old.value, unit, old.bounds)
    if not clipped.variant:
        return _curve(clipped, o, "sensor_rounded", f"{limit.name}*tanh({o}/{limit.name})",
                      (limit,), lambda values, states: [
                          {limit.name: share * values[old.name]} for share in ROUNDED])
    most = site.half_range or 1.0
    knee = Parameter(site.name("knee"), 0.1 * most, unit, (0.0, INF))
    sign = "" if clipped.variant == "above" else "-"
    text = (f"{sign}({sign}{o} + {limit.name} - sqrt(({sign}{o} - {limit.name})**2 "
            f"+ {knee.name}**2))/2")
    made = _curve(clipped, o, "sensor_rounded", text, (limit, knee), lambda values, states: [
        {limit.name: values[old.name], knee.name: share * most} for share in KNEES])
    return replace(made, covers={clipped.key: {}})


def _unit(entry: Candidate, channel: str) -> str:
    return (entry.site.model.input(channel) if entry.channel == "input" else
            entry.site.output).unit or "1"


def _curve(entry: Candidate, channel: str, name: str, text: str,
           parameters: tuple[Parameter, ...], starts: Begin) -> Candidate:
    made = _decoy(entry, name, text, parameters, starts, entry.families)
    mapped = Model.map_input if entry.channel == "input" else Model.map_output
    return replace(made, channel=entry.channel, static=entry.static,
                   extend=lambda m: mapped(m, channel, function=text))


def _decoy(entry: Candidate, name: str, text: str, parameters: tuple[Parameter, ...],
           starts: Begin, families: tuple[Family, ...]) -> Candidate:
    site: Site = entry.site
    return Candidate((name,), f"a form next to {entry.name}", text, "dynamics", site, parameters,
                     lambda m: site.pushed(m, text), lambda view: [], entry.variant,
                     families=families, known=False, pushes=entry.pushes, static=True,
                     other_minima=entry.other_minima, next_to=entry.key, starts=starts)
