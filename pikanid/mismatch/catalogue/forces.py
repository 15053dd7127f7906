"""Catalogue: forces on a coordinate that a model can leave out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from pikanid.formula.expressions import TIME, symbol
from pikanid.mismatch.catalogue.candidate import Candidate, Powers, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site, out_of_reach
from pikanid.model import Model
from pikanid.model.parts import Parameter

INF = float("inf")
SKEWEST = 0.95  # numerical: of the width, that one side of what acts once may take
NEXT_TO_NONE = 1e-9  # numerical: square of a distance from a peak, in quarters of its width
USUAL_PEAK = 2.5  # numerical: exponent of a hump, from about which fits of a course begin
BRIEF, LASTING = 0.03, 0.25  # numerical: of a recording, how long what acts once is, and at most
NEAREST = 0.1  # definition: of the half range, at which a wall may stand
STIFF = 3  # definition: contacts that take as long as half a swing does, of a stiff stop
SIDE, BOTH = "negative side", "both sides"
SIDES = {"": (1,), SIDE: (-1,), BOTH: (1, -1)}  # definition: of the walls of each variant


def term(site: Site, identifier: str, name: str, expression: str, size: Parameter,
         shape: Callable[[View], np.ndarray], *, one_sided: bool, twin: str = "",
         variant: str = "", known: bool = True, other_minima: tuple[float, ...] = ()) -> Candidate:
    """A force with one parameter: `shape` (L,) is what it adds to q'' at size 1."""
    def directions(view: View) -> list[TangentDirection]:
        return [TangentDirection({size.name: 1.0}, force=shape(view), one_sided=one_sided)]

    return Candidate((identifier,), name, expression, "dynamics", site, (size,),
                     lambda m: site.pushed(m, expression), directions, variant, twin,
                     known=known,
                     other_minima=other_minima)


def cubic_stiffness(site: Site) -> list[Candidate]:
    """A restoring force that bends: hardening or softening."""
    if not site.placed:
        return []
    k = Parameter(site.name("k3"), 0.0, f"1/(s^2*({site.unit})^2)")
    law = term(site, "cubic_stiffness", "cubic stiffness", f"-{k.name}*{site.q}**3", k,
               lambda w: -w.x[site.q] ** 3, one_sided=False)
    return [replace(law, static=True, form="cubic", argument=site.q,
                    powers=Powers(3, 0, restores=True))]


def free_spring(site: Site) -> list[Candidate]:
    """A spring at a coordinate that nothing brings back to a place.  Of a motion that nothing
    drives through one again and again, place and speed tell the same.
    """
    return [spring(site, "a spring")] if not site.rate and (
        site.placed or (site.q and site.inputs)) else []


def spring(site: Site, name: str) -> Candidate:
    """-k q."""
    k = Parameter(site.name("k1"), 0.0, "1/s^2")
    return term(site, "linear_stiffness", name, f"-{k.name}*{site.q}", k,
                lambda w: -w.x[site.q], one_sided=False)


def static_bias(site: Site) -> list[Candidate]:
    """A constant force, or a tilt; a system that starts at rest starts where it holds balance, or
    where dry friction holds it.
    """
    b = Parameter(site.name("bias"), 0.0, site.force_unit)
    k = site.stiffness
    # without a restoring force there is no balance to start in, beside others not in q alone
    balanced = site.rest and site.rate > 0 and site.alone

    def extend(model: Model) -> Model:
        model = site.pushed(model, b.name)
        if not balanced:
            return model
        still = {symbol(n): sp.Integer(0) for n in (*model.state_names, *model.input_names)
                 if n != site.q}
        still[TIME] = sp.Float(site.span[0])  # where other effects have parameters change
        force = model.equations[site.v].xreplace(still)
        near = symbol(b.name) / k
        at = {symbol(site.q): near}
        newton = near - force.xreplace(at) / force.diff(symbol(site.q)).xreplace(at)
        start = model.state(site.q).initial + newton
        return model.with_initial(**{site.q: start})

    def directions(view: View) -> list[TangentDirection]:
        initial = {site.q: 1.0 / site.rate**2} if balanced else {}
        return [TangentDirection({b.name: 1.0}, force=np.ones(len(view.t)), initial=initial)]

    name = "a constant force or tilt" if site.q else "a constant source"
    free = Candidate(("static_bias",), name, b.name, "dynamics", site, (b,), extend, directions,
                     twin="offset", static=True, form="constant")
    held = replace(
        free, variant="held", extend=lambda m: site.pushed(m, b.name),
        directions=lambda view: [TangentDirection({b.name: 1.0}, force=np.ones(len(view.t)))],
        beside=("coulomb_friction", "hysteresis"))
    return [free, held] if balanced else [free]


def parameter_drift(site: Site) -> list[Candidate]:
    """A parameter that changes steadily with time, in every equation that it stands in."""
    def one(p: str) -> Candidate:
        within = [n for n in site.model.state_names if site.model.equations[n].has(symbol(p))]
        # one and the same seen from each of several equations
        place = site if within == [site.v] else replace(site, suffix="")
        r = Parameter(place.name(f"r_{p}"), 0.0, "1/s", (slowest(site, p), INF))
        text = f"{p}*(1 + {r.name}*t)"

        def directions(view: View) -> list[TangentDirection]:
            forces = np.column_stack([view.by_parameter[n, p] * view.t if n in within
                                      else np.zeros(len(view.t)) for n in view.x])
            return [TangentDirection({r.name: 1.0}, forces=forces)]

        return Candidate(("parameter_drift",), f"drift of {p}", f"{p} -> {text}", "dynamics",
                         place, (r,), lambda m: changing(m, p, text), directions, variant=p)

    return [one(p) for p in site.free_in_force]


def slowest(site: Site, parameter: str) -> float:
    """Rate [1/s], as a share, at which a parameter that cannot be negative is nothing at the end of
    the first recording; none bounds another one.
    """
    end = site.span[1]
    return -1 / end if site.model.parameter(parameter).bounds[0] >= 0 and end > 0 else -INF


def changing(model: Model, parameter: str, text: str) -> Model:
    """The model with a formula in the place of a parameter in all its equations."""
    new = {symbol(parameter): model.formula(text, "change of a parameter")}
    return model.replace(equations={n: e.xreplace(new) for n, e in model.equations.items()})


def wall_impact(site: Site) -> list[Candidate]:
    """A stiff stop on one side, or two at the same distance, that give way elastically."""
    if not site.q:
        return []
    # a contact shorter than from one sample to the next looks the same, however short
    stiffest = max((np.pi / site.interval) ** 2, 1e4)
    stiffnesses, near = np.array([0.03, 0.1, 0.3]), NEAREST * site.half_range
    k = Parameter(site.name("k_wall"), 0.0, "1/s^2", (0.0, stiffest))
    # what nothing drives is at each place once
    about = site.visited[0] < 0 < site.visited[1] or not site.inputs

    def one(variant: str, name: str = "impact on a wall") -> Candidate:
        sides = SIDES[variant]
        # what is touched about the rest is no wall but a spring that differs between the sides, and
        # what is never left one that does not
        least = min(side * end for side in sides for end in site.visited)
        lowest, centre = (near, 0.0) if about else (least + near, least + site.half_range)
        w = Parameter(site.name("wall"), out_of_reach(site.half_range), site.unit, (lowest, INF))
        walls = centre + np.geomspace(1.1, 0.2, 14) * site.half_range
        text = wall_force(site, w.name, k.name, variant)

        def directions(view: View) -> list[TangentDirection]:
            top = min(float((side * view.x[site.q]).max()) for side in sides) - centre
            return [TangentDirection(
                {k.name: 1e4, w.name: centre + share * top}, one_sided=True, scales=False,
                force=np.sum([-side * np.maximum(side * view.x[site.q] - centre - share * top, 0.0)
                              for side in sides], axis=0))
                for share in (1.03, 0.97, 0.9, 0.8, 0.65, 0.5)] if top > 0 else []

        return Candidate(("wall_impact",), name, text, "dynamics", site, (w, k),
                         lambda m: site.pushed(m, text), directions, variant, static=True,
                         stops_like=("sensor_saturation",),
                         brief=lambda values: values[k.name] > (STIFF * site.rate) ** 2,
                         other_minima=(0.9, 0.985, 0.993, 0.997, 1.003, 1.007, 1.015, 1.05),
                         levels=tuple({w.name: float(at), k.name: float(share * stiffest)}
                                      for at in walls for share in stiffnesses))

    return [one(""), one(SIDE), *([one(BOTH, "impact on walls on both sides")] if about else [])]


def wall_force(site: Site, distance: str, stiffness: str, variant: str, power: int = 1) -> str:
    """The formula of walls that push back with a power of how deep they give way."""
    raised = f"**{power}" if power > 1 else ""
    return " + ".join(
        f"{'-' if side > 0 else ''}{stiffness}*max({'-' if side < 0 else ''}{site.q}"
        f" - {distance}, 0){raised}" for side in SIDES[variant])


def disturbance(site: Site) -> list[Candidate]:
    """A force that acts once, for a short time: a hump, or one whose course is left open,

    a exp(-ln 2 (4 |t - t₀| / w (1 ± s))ⁿ), with w/2 wide at half its height: with n from a cusp to
    a stretch of constant force, and with s it rises as much faster than it falls.
    """
    a = Parameter(site.name("peak"), 0.0, site.force_unit)
    first, last = site.span
    # what nothing follows that it set in motion cannot be told from a few bad samples
    last -= min(0.5 * np.pi / site.rate, 0.5 * (last - first)) if site.rate else 0.0
    at = Parameter(site.name("t_peak"), (first + last) / 2, "s", (first, last))
    whole = site.span[1] - site.span[0]
    w = Parameter(site.name("width"), BRIEF * whole, "s", (0.5 * site.interval, LASTING * whole))
    text = f"{a.name}/2*(1 + cos(2*pi*clip((t - {at.name})/{w.name}, -0.5, 0.5)))"

    def directions(view: View) -> list[TangentDirection]:
        span = view.t[-1] - view.t[0]
        found = []
        step = float(np.median(np.diff(view.t)))
        for width in (0.01 * span, 0.025 * span):
            if width < 4 * step:
                # what is no longer than a few samples could be anything
                continue
            centres = np.arange(view.t[0] + width, view.t[-1] - width, width)
            if site.rate:
                # forces half a period apart ring alike: those in quadrature must be there too
                centres = np.sort(np.concatenate([centres, centres + 0.5 * np.pi / site.rate]))
            centres = centres[centres < last]
            humps = _humps(view.t, centres, 2 * width)
            found += [TangentDirection(
                {a.name: 1.0, at.name: float(centre), w.name: 2 * width}, force=hump)
                      for centre, hump in zip(centres, humps, strict=True)]
        return found

    hump = Candidate(("disturbance",), "a force local in time", text, "dynamics", site, (a, at, w),
                     lambda m: site.pushed(m, text), directions, per_recording=True,
                     absent=True)
    s = Parameter(site.name("skew"), 0.0, "", (-SKEWEST, SKEWEST))
    n = Parameter(site.name("n_peak"), USUAL_PEAK, "", (1.0, 20.0))
    sides = (f"max(t - {at.name}, 0)/(1 + {s.name}) + max({at.name} - t, 0)/(1 - {s.name})")
    # the logarithm of no distance at all has no value, which a derivative by n asks for
    course = f"{a.name}*exp(-log(2)*((4/{w.name}*({sides}))**2 + {NEXT_TO_NONE})**({n.name}/2))"
    return [hump, replace(
        hump, name="a force local in time, its course open", expression=course, variant="open",
        parameters=(a, at, w, s, n), extend=lambda m: site.pushed(m, course),
        directions=lambda view: [], covers={hump.key: {}})]


def _humps(t: np.ndarray, centres: np.ndarray, width: float) -> np.ndarray:
    """(centres, L) of raised cosines of unit height over times (L,)."""
    found = np.zeros((len(centres), len(t)))
    for row, centre in zip(found, centres, strict=True):
        own = slice(*np.searchsorted(t, [centre - 0.5 * width, centre + 0.5 * width]))
        row[own] = 0.5 * (1 + np.cos(2 * np.pi * (t[own] - centre) / width))
    return found


def initial_state(site: Site) -> list[Candidate]:
    """A start other than assumed."""
    starts = [site.model.state(n).initial for n in site.moving]
    free = {p.name for p in site.model.parameters if p.free}
    if any(s.name in free for e in starts for s in e.free_symbols):
        return []
    own = dict(zip((site.q, site.v), (site.unit, site.speed_unit), strict=True))
    sizes = {n: Parameter(site.name(f"d_{n}"), 0.0, own[n], scope="recording")
             for n in site.moving}

    def extend(model: Model) -> Model:
        return model.with_initial(**{
            n: model.state(n).initial + symbol(p.name) for n, p in sizes.items()})

    def directions(view: View) -> Sequence[TangentDirection]:
        still = np.zeros(len(view.t))
        return [TangentDirection({p.name: 1.0}, force=still, initial={n: 1.0})
                for n, p in sizes.items()]

    return [Candidate(("initial_state",), "another initial state",
                      ", ".join(f"{n}(0) + {p.name}" for n, p in sizes.items()), "dynamics", site,
                      tuple(sizes.values()), extend, directions, per_recording=True)]
