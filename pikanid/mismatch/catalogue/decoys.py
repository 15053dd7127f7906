"""Laws that are in no catalogue but look like entries of it.

They are never named alone.  Where one of them explains a recording about as well as an entry does,
it is given beside the entry; where it does far better, the entry is not named: |θ'|^1.5 must not be
called quadratic drag, nor a soft limit a hard one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pikanid.formula import units
from pikanid.mismatch.catalogue.candidate import Candidate, Parts, TangentDirection, View
from pikanid.mismatch.catalogue.forces import BOTH, INF, spring, term, wall_force, wall_impact
from pikanid.mismatch.catalogue.friction import STICKING, sense
from pikanid.mismatch.catalogue.site import Site
from pikanid.model import Model
from pikanid.model.parts import Parameter
from pikanid.problem.held import HeldInput, acting

RISING = (0.025, 0.075, 0.25)  # numerical: of the usual speed, below which friction rises
BRIEFER = 25.0  # numerical: times as stiff as what is touched for one sample
TURNING = 0.1  # numerical: share of the largest v², that a motion both ways has either way
PARTS = 8  # numerical: of a step, at which a ramp within it is looked at
Shape = Callable[[View], np.ndarray]


def _product(u: str, v: str) -> Shape:
    return lambda w: w.u[u] * w.x[v]


def _half_sign(v: str, sign: int) -> Shape:
    # at rest friction holds whatever pushes, as dry friction does: half of it would push by itself
    def shape(w: View) -> np.ndarray:
        rests = (w.x[v] == 0) & (w.rates[v] == 0)
        return np.where(rests, 0.0, -(sense(w, v) + sign) / 2)

    return shape


def _lever(v: str, p: str) -> Shape:
    return lambda w: w.by_parameter[v, p]


def _through(u: str, text: str) -> Callable[[Model], Model]:
    return lambda m: m.map_input(u, function=text)


def even_stiffness(site: Site) -> list[Candidate]:
    """-k q²: not the same on both sides."""
    if not site.placed:
        return []
    k = Parameter(site.name("k_even"), 0.0, f"1/(s^2*{site.unit})")
    return [term(site, "even_stiffness", "a stiffness that differs between the sides",
                 f"-{k.name}*{site.q}**2", k, lambda w: -w.x[site.q] ** 2, one_sided=False,
                 known=False)]


def quintic_stiffness(site: Site) -> list[Candidate]:
    """-k q⁵."""
    if not site.placed:
        return []
    k = Parameter(site.name("k5"), 0.0, f"1/(s^2*({site.unit})^4)")
    return [term(site, "quintic_stiffness", "quintic stiffness", f"-{k.name}*{site.q}**5", k,
                 lambda w: -w.x[site.q] ** 5, one_sided=False, known=False)]


def linear_stiffness(site: Site) -> list[Candidate]:
    """-k q beside another restoring force: alone it is the model's own stiffness and a gain."""
    if not site.rate:
        return []
    law = spring(site, "a stiffness beside the model's own")
    return [replace(law, known=False, instead_of=("input_gain", "sensor_gain"), beside=(
        "wall_impact", "dissipating_wall", "cubic_stiffness", "quintic_stiffness",
        "even_stiffness"))]


def even_drag(site: Site) -> list[Candidate]:
    """-c v²: to one side whichever way it moves, as the turning of another coordinate pulls."""
    if not site.mechanical:
        return []
    c = Parameter(site.name("c_even"), 0.0, units.product(
        (site.force_unit, 1), (site.speed_unit, -2)))
    text = f"-{c.name}*{site.v}**2"

    def directions(view: View) -> list[TangentDirection]:
        v = view.x[site.v]
        # of a motion that does not turn it is what quadratic drag is
        either = [float((v[side] ** 2).max(initial=0.0)) for side in (v < 0, v > 0)]
        return [TangentDirection({c.name: 1.0}, force=-v**2)] if (
            min(either) > TURNING * max(either)) else []

    return [Candidate(("even_drag",), "drag that pulls to one side", text, "dynamics", site, (c,),
                      lambda m: site.pushed(m, text), directions, known=False)]


def one_way_friction(site: Site) -> list[Candidate]:
    """Dry friction in one direction only."""
    found = []
    for sign in (1, -1):
        c = Parameter(site.name("c_one"), 0.0, site.force_unit, (0.0, INF))
        law = term(
            site, "one_way_friction", "friction in one direction",
            f"-{c.name}*(sign({site.v}) + {sign})/2", c,
            _half_sign(site.v, sign), one_sided=True,
            variant="forth" if sign > 0 else "back", known=False, other_minima=STICKING)
        found.append(replace(law, parts=_half_and_half(site.suffix, sign)))
    return found


def _half_and_half(suffix: str, sign: int) -> Parts:
    """Friction in one direction is half of it in both, and a constant force."""
    return lambda values: [{
        f"coulomb_friction{suffix}": [values[0] / 2],
        f"static_bias{variant}{suffix}": [-sign * values[0] / 2]} for variant in ("", "[held]")]


def stribeck_friction(site: Site) -> list[Candidate]:
    """Dry friction that is greater at low speed."""
    c = Parameter(site.name("c_s"), 0.0, site.force_unit, (0.0, INF))
    rise = Parameter(site.name("rise"), 0.5, "", (0.0, 20.0))
    slow = site.slow_speed("v_s", RISING[1])
    text = f"-{c.name}*(1 + {rise.name}*exp(-({site.v}/{slow.name})**2))*sign({site.v})"

    def directions(view: View) -> list[TangentDirection]:
        v = view.x[site.v]
        speeds = float(np.abs(v).max(initial=0.0)) * np.array(RISING)
        return [TangentDirection({c.name: 1.0, rise.name: 1.0, slow.name: float(s)},
                                 force=-sense(view, site.v) * (1 + np.exp(-(v / s) ** 2)),
                                 one_sided=True)
                for s in speeds if s > 0]

    def resistance(speed: np.ndarray, rise: float, slow: float) -> np.ndarray:
        return np.asarray(1 + rise * np.exp(-(speed / slow) ** 2))

    return [Candidate(("stribeck_friction",), "friction that rises at low speed", text, "dynamics",
                      site, (c, rise, slow), lambda m: site.pushed(m, text), directions,
                      known=False, covers={"coulomb_friction" + site.suffix: {}},
                      resistance=resistance)]


def dissipating_wall(site: Site) -> list[Candidate]:
    """A stop that takes energy out: k δ (1 + α δ'), δ how deep the wall gives way.

    K. H. Hunt and F. R. E. Crossley, J. Appl. Mech. 42, 1975.
    """
    found = []
    # with more, it would hold fast what leaves it at full speed
    most = 1.0 / max(site.half_range * site.rate, 1e-3)
    for wall in (w for w in wall_impact(site) if w.variant != BOTH):
        a = Parameter(site.name("a_wall"), 0.3 * most, f"s/({site.unit})", (0.0, most))
        text = f"({wall.expression})*(1 {'-' if wall.variant else '+'} {a.name}*{site.v})"
        found.append(Candidate(
            ("dissipating_wall",), "impact on a wall that takes energy out", text, "dynamics",
            site, (*wall.parameters, a), _pushing(site, text), lambda view: [], wall.variant,
            known=False, other_minima=wall.other_minima, levels=wall.levels, covers={wall.key: {}},
            stops_like=wall.stops_like))
    return found


def rigid_stop(site: Site) -> list[Candidate]:
    """A stop of constant restitution: of a wall that touches for a sample at most, whatever its
    stiffness.  It pushes less on the way back, by the share of the energy that it takes.
    """
    found = []
    for wall in (w for w in wall_impact(site) if w.variant != BOTH):
        w, k = wall.parameters
        stiff = Parameter(site.name("k_stop"), BRIEFER * k.bounds[1], k.unit, free=False)
        lost = Parameter(site.name("lost"), 0.3, "", (0.0, 1.0))
        text = (f"({wall_force(site, w.name, stiff.name, wall.variant)})*(1 - {lost.name}"
                f"*(1 {'+' if wall.variant else '-'} sign({site.v}))/2)")
        found.append(Candidate(
            ("rigid_stop",), "impact on a rigid stop", text, "dynamics", site, (w, lost),
            _pushing(site, text, stiff), lambda view: [], wall.variant, known=False,
            other_minima=wall.other_minima, covers={wall.key: {}}))
    return found


def _pushing(site: Site, text: str, *fixed: Parameter) -> Callable[[Model], Model]:
    return lambda m: site.pushed(m.with_parameters(*fixed), text)


def velocity_coupled_drive(site: Site) -> list[Candidate]:
    """κ u v: the drive acts according to the speed, or to the state; that of another equation, too.
    """
    found = []
    for u in site.model.input_names:
        name = (f"a drive that depends on {'speed' if site.q else site.v}" if u in site.inputs else
                f"{u} acting in proportion to {site.v}")
        found.append(_in_proportion(site, u, site.v, "velocity_coupled_drive", name, "k_uv"))
    return found


def position_coupled_drive(site: Site) -> list[Candidate]:
    """κ u q: the drive acts according to the place, as a coil does, or a rotor near the ground."""
    return [_in_proportion(site, u, site.q, "position_coupled_drive",
                           "a drive that depends on the place", "k_uq")
            for u in (site.inputs if site.q else ())]


def _in_proportion(site: Site, u: str, x: str, entry: str, name: str, size: str) -> Candidate:
    """κ u x."""
    own = site.variant(u) if u in site.inputs else u
    drive = site.model.input(u).unit
    k = Parameter(site.name(size, own), 0.0, units.product(
        (site.force_unit, 1), (drive, -1), (site.unit if x == site.q else site.speed_unit, -1)
    ) if drive else "")
    return term(site, entry, name, f"{k.name}*{u}*{x}", k, _product(u, x), one_sided=False,
                variant=own, known=False)


def soft_saturation(site: Site) -> list[Candidate]:
    """An input limited softly: u/(1 + (u/L)²)^½ to first order u - u³/2L²."""
    found = []
    for u in site.inputs:
        unit = f"1/({site.model.input(u).unit or '1'})"
        k = Parameter(site.name("k_soft", site.variant(u)), 0.0, unit, (0.0, INF))
        text = f"tanh({k.name}*{u} + 1e-9*{u})/({k.name} + 1e-9)"

        def directions(view: View, u: str = u, k: Parameter = k) -> list[TangentDirection]:
            top = float(np.abs(view.u[u]).max())
            return [TangentDirection(
                {k.name: s / top}, push={u: np.tanh(s * view.u[u] / top) * top / s - view.u[u]},
                one_sided=True, scales=False) for s in (0.1, 0.3, 0.8)] if top else []

        found.append(Candidate(("soft_saturation",), "an input limited softly",
                               f"tanh({k.name}*{u})/{k.name}", "input", site,
                               (k,), _through(u, text), directions, site.variant(u), known=False))
    return found


def wobble(site: Site) -> list[Candidate]:
    """A parameter that swings, and a force that does, at frequencies of their own."""
    if not site.rate:
        return []
    found: list[Candidate] = []
    rates = site.rate * np.array([0.1, 0.15, 0.22, 0.32, 0.45, 0.63, 0.8])

    def swinging(shape: Shape, rates: np.ndarray
                 ) -> Callable[[View], list[TangentDirection]]:
        return lambda w: [TangentDirection({}, force=shape(w) * wave(r * w.t)) for r in rates
                          for wave in (np.sin, np.cos)]

    for p in site.free_in_force[:1]:
        found.append(Candidate(("wobble",), f"a {p} that swings", f"{p}*(1 + e*sin(w*t))",
                               "dynamics", site, (), lambda m: m,
                               swinging(_lever(site.v, p), rates), known=False,
                               fits=False))
    return found


def rate_limit(site: Site) -> list[Candidate]:
    """An input that cannot change at once: jumps become ramps."""
    found = []
    for u in site.inputs:
        unit = units.product((site.model.input(u).unit, 1), ("s", -1))
        most = Parameter(site.name("rate", site.variant(u)), 1e9, unit, (1e-9, INF))

        def directions(view: View, u: str = u, most: Parameter = most) -> list[TangentDirection]:
            steps = np.diff(view.t)
            top = float(np.max(np.abs(np.diff(view.u[u])) / steps, initial=0.0))
            recorded = HeldInput(u, view.t, view.u[u], "zero")
            # ramps may be shorter than a step: what counts is their mean over it
            inside = view.t[:-1, None] + steps[:, None] * (np.arange(PARTS) + 0.5) / PARTS
            found = []
            for size in top * np.array([2.0, 0.5, 0.15, 0.05, 0.015]) if top else ():
                carrier, *_, ramp, _ = acting(recorded, rate=size)
                at = inside.ravel()
                mean = (carrier.at(at) + size * ramp.at(at)).reshape(inside.shape).mean(axis=1)
                found.append(TangentDirection(
                    {most.name: float(size)}, one_sided=True, scales=False,
                    push={u: np.append(mean, view.u[u][-1]) - view.u[u]}))
            return found

        found.append(Candidate(
            ("rate_limited_input",), "an input of limited rate",
            f"{u} changing by at most {most.name}", "input", site, (most,),
            _limited(u, most.name), directions, site.variant(u), known=False))
    return found


def _limited(u: str, name: str) -> Callable[[Model], Model]:
    return lambda m: m.map_input(u, rate_limit=name)
