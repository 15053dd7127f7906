"""A force without a name that acts in one region of a state only: its place by a refit.

    δ(s) = a₁ max(s - h, 0) + a₂ max(s - h, 0)² + b₁ max(l - s, 0) + b₂ max(l - s, 0)²

with thresholds l and h that are estimated like everything else (segmented regression: V. M. R.
Muggeo, Stat. Med. 22, 2003), on one side or both, alike on both, with one power or both.  Between
them the nominal model has to do alone, so that its parameters come from clean motion, the idea of
Y. Wang, "Where Is My Physics Wrong?", arXiv 2606.23215.  A region is reported if such a force
explains the recording better than a smooth free curve of the same state over the whole range does,
and than chance, no worse than anything else that is given, and leaves little beside noise.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid.formula import units
from pikanid.mismatch.beyond.force_shape import ForceShape
from pikanid.mismatch.beyond.patch import Difference, FreeCurve
from pikanid.mismatch.beyond.region import Course, Interval, course
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.search.overdispersion import overdispersion
from pikanid.model import Model
from pikanid.model.parts import Parameter
from pikanid.symbolic.curve import Curve

PLACES = tuple(k / 10 for k in range(-9, 10))  # numerical: of thresholds, in a range of at most ±1
ABOVE, BELOW, ALIKE = "above", "below", "alike"


@dataclass(frozen=True, eq=False)
class Local:
    """A force in a region.

    Attributes:
        intervals: Of the state in which it acts.
        hypothesis: The fit: parameters of the nominal model beside it come from clean motion.
        course: When it acts.
        overdispersion: By which variances are multiplied.
    """

    intervals: tuple[Interval, ...]
    hypothesis: Hypothesis
    course: Course
    overdispersion: float


def local_force(base: Hypothesis, nominal: Model, shape: ForceShape, site: Site,
                given: Hypothesis | None = None) -> Local | None:
    """Where the missing force acts, if it does in a region of one state only.

    Args:
        base: Fit of the nominal model.
        nominal: That model.
        shape: What is missing, to first order: whose edge explains most, and where fits begin.
        site: Coordinate.
        given: What is given as the best explanation, though it leaves something.

    Returns:
        The force; None where it may act anywhere.
    """
    settings = base.whitened.settings
    edge = max(shape.edges, key=lambda e: e.alone, default=None)
    if edge is None or edge.alone < settings.beyond.read or edge.argument in site.inputs:
        return None
    low, high = edge.curve.low, edge.curve.high
    curve = FreeCurve(edge.argument, low, high, nominal)
    smooth = fitted(nominal, [curve.candidate(site)], base.whitened.records, [base.point], 1)
    if smooth is None:
        return None
    x = edge.curve.x
    drawn = curve.matrix(x) @ [smooth.values[n] for n in curve.names]
    # what a line does is the free parameters' own
    seen_as = replace(Curve.of_points(x, drawn, 1.0), free=np.column_stack([np.ones(len(x)), x]))
    rivals = [base, smooth]
    found: list[tuple[Hypothesis, LocalForce]] = []

    def fit(force: LocalForce) -> None:
        # to first order a strong force seems to begin elsewhere, and no smooth curve follows a wall
        starts = [{**base.point, **force.start(c)} for c in (seen_as, edge.curve)]
        h = fitted(nominal, [force.candidate(site)], base.whitened.records, starts, 1)
        if h is not None:
            found.append((h, force))

    within = settings.verdict.indistinct

    def noise() -> float:
        return overdispersion([*rivals, *(h for h, _ in found), *([given] if given else [])])

    def better() -> tuple[Hypothesis, LocalForce] | None:
        scale = noise()
        best = min(found, key=lambda pair: pair[0].score(scale), default=None)
        return best if best and best[0].score(scale) + within < min(
            h.score(scale) for h in rivals) else None

    for sides in ((ABOVE,), (BELOW,), (BELOW, ABOVE), (ALIKE,)):
        fit(LocalForce(edge.argument, low, high, sides, nominal))
    if pair := better():
        for k in pair[1].powers:
            fit(pair[1].with_powers(k))
    if (pair := better()) is None:
        return None
    best, force = pair
    scale = noise()
    # what is given may be a law of that very region
    if given and best.score(scale) > given.score(scale) + within:
        return None
    if best.noise**2 > settings.beyond.unexplained:
        return None
    ends = force.ends(best.values)
    visited = edge.curve.x
    clean = (visited > ends[0]) & (visited < ends[1])
    if min(clean.mean(), (ends[1] - ends[0]) / (high - low)) < settings.beyond.clean:
        return None
    seen = course(best, base.model, best.effects[0])
    if seen is None:
        return None
    unit = site.model.state(edge.argument).unit
    return Local(tuple(Interval(edge.argument, a, b, unit)
                       for a, b in ((low, ends[0]), (ends[1], high)) if b > a),
                 best, seen, overdispersion([best]))


class LocalForce:
    """The force above, of the argument scaled to at most ±1, on given sides with given powers."""

    def __init__(self, argument: str, low: float, high: float, sides: tuple[str, ...],
                 model: Model, powers: tuple[int, ...] = (1, 2)):
        self.argument = argument
        self.low, self.high, self.half = low, high, max(abs(low), abs(high))
        self.sides, self.powers, self.model = sides, powers, model
        name = "local"
        while any(taken.startswith(name) for taken in model.symbols):
            name += "_x"
        self.places = {side: f"{name}_{side}" for side in sides}
        self.names = {side: {k: f"{name}_{side}_{k}" for k in powers} for side in sides}
        self.difference = Difference.of(argument, model.state(argument).unit, f"{name}_zero")

    def with_powers(self, *powers: int) -> LocalForce:
        """The same with other powers."""
        return LocalForce(self.argument, self.low, self.high, self.sides, self.model, powers)

    def matrix(self, z: np.ndarray, places: Mapping[str, float]) -> np.ndarray:
        """(N, sides times powers) of scaled arguments (N,), for a threshold on each side."""
        columns = []
        for side in self.sides:
            up, down = (np.maximum(s * z - places[side], 0.0) for s in (1, -1))
            if side == BELOW:
                up, down = np.maximum(places[side] - z, 0.0), 0 * z
            columns += [up**k - (down**k if side == ALIKE else 0) for k in self.powers]
        return np.column_stack(columns)

    def start(self, curve: Curve, places: Sequence[float] = PLACES) -> dict[str, float]:
        """Of some places the thresholds, with coefficients, that suit a curve best."""
        z = curve.x / self.half
        best: tuple[float, dict[str, float]] = (np.inf, {})
        for chosen in itertools.product(places, repeat=len(self.sides)):
            at = dict(zip(self.sides, chosen, strict=True))
            if at.get(BELOW, -1.0) >= at.get(ABOVE, 1.0) or at.get(ALIKE, 1.0) <= 0:
                continue
            columns = np.vstack([self.matrix(z, at).T, curve.free.T])
            seen = curve.whiten(columns).T
            c = np.linalg.lstsq(seen, curve.target, rcond=1e-9)[0]
            left = float(np.sum((curve.target - seen @ c) ** 2))
            if left < best[0]:
                names = [n for side in self.sides for n in self.names[side].values()]
                best = left, {**{self.places[side]: value for side, value in at.items()},
                              **dict(zip(names, map(float, c[:len(names)]), strict=True))}
        return best[1]

    def candidate(self, site: Site) -> Candidate:
        """The force as an effect whose thresholds and coefficients are estimated."""
        z, unit = f"({self.difference.text}/{self.half!r})", self.difference.unit
        terms, parameters = [], []
        for side in self.sides:
            at = self.places[side]
            up = f"max({at} - {z}, 0)" if side == BELOW else f"max({z} - {at}, 0)"
            parameters.append(Parameter(
                at, -0.5 if side == BELOW else 0.5, self.difference.distance,
                (0.0 if side == ALIKE else -1.0, 1.0)))
            for k, name in self.names[side].items():
                down = f" - max(-{z} - {at}, 0)**{k}" if side == ALIKE else ""
                terms.append(f"{name}*({up}**{k}{down})")
                # z is a number, but carries the unit of what it is made from
                parameters.append(Parameter(name, 0.0, units.product(
                    (site.force_unit, 1), (unit or "1", -k))))
        text = " + ".join(terms)
        return Candidate(("local",), "a force in a region", text, "dynamics", site,
                         tuple(parameters), lambda m: site.pushed(
                             m.with_parameters(*self.difference.zeros), text), lambda view: (),
                         known=False)

    def ends(self, values: Mapping[str, float]) -> tuple[float, float]:
        """From where up to where the force is zero, in the argument's unit."""
        low, high = self.low, self.high
        for side in self.sides:
            place = self.half * values[self.places[side]]
            low = {BELOW: place, ALIKE: -place}.get(side, low)
            high = {ABOVE: place, ALIKE: place}.get(side, high)
        return max(low, self.low), min(high, self.high)
