"""The missing force as a shallow KAN inside the equation: δ(q) + δ(q') + δ(u), to first order.

Every edge is a cubic spline over the range that the motion visited.  What a coefficient would show
is integrated along the fitted motion, and what the free parameters can do in its place is taken
out, so that nothing of a nominal term is found a second time (the gauge).  Second differences of
the coefficients are held down by as much as generalised cross-validation asks (Eilers and Marx,
Stat. Sci. 11, 1996).

The edges show where in state space something is missing.  Where nothing is left beside them, a
force that depends on state and input of the moment can be all of it.  What is left may be a lag, a
hidden mode, memory, something that happens once, or of second order: then nothing is said.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.interpolate import BSpline
from scipy.stats import chi2

from pikanid.approximators.bspline import uniform_knots
from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.detect.remainder import residual_tests
from pikanid.mismatch.detect.tangent import directions
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.settings.settings import Settings
from pikanid.noise.projection import project
from pikanid.symbolic.curve import Curve

INTERVALS, DEGREE = 8, 3  # numerical: knots to spare, which the penalty holds down; cubic
GRID = 101  # numerical: points at which an edge is drawn
TYPICAL = 120  # numerical: and visited ones at which laws are compared with it
RIDGES = 10.0 ** np.arange(-9.0, 4.0, 0.5)  # numerical: weights of roughness that are compared
LARGEST = 1e100  # numerical: length of a sign, of which squares can still be summed
GAUGE = 1e-3  # numerical: of a sign: less is left when the free parameters can do the same


@dataclass(frozen=True, eq=False)
class Edge:
    """One edge: values (G,) and standard errors (G,) over its argument (G,), [unit of q''].

    `own` is the share of what all edges explain that no other edge can; `alone` the share that this
    one can without the others, and `curve` what the data say of it then, for laws to be compared
    with.  `law` (G,) is what the law that was found would look like here, where there is one.
    """

    argument: str
    grid: np.ndarray
    values: np.ndarray
    std: np.ndarray
    own: float
    p_value: float
    alone: float
    curve: Curve = field(repr=False)
    law: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class ForceShape:
    """All edges, whether a static law can be all that is missing (None: not to be told), and χ² per
    degree of freedom that the edges leave: what they cannot follow makes them as unsure.
    """

    edges: tuple[Edge, ...]
    unit: str
    static_law: Literal[True] | None
    left: float = 1.0

    def depends_on(self, settings: Settings) -> tuple[str, ...]:
        """Arguments whose edge the others cannot replace."""
        return tuple(e.argument for e in self.edges if e.own > settings.beyond.own
                     and e.p_value < settings.alpha / len(self.edges))


def force_shape(base: Hypothesis, site: Site, candidates: tuple[Candidate, ...]) -> ForceShape:
    """The force that is missing in the equation of one coordinate of a fitted nominal model.

    Args:
        base: The nominal model's fit.
        site: Coordinate.
        candidates: That the rest is tested against.
    """
    edges = _Edges(base, site)
    whitened, fit, found = base.whitened, base.minimum, edges.found
    scaled, owner = edges.rest / edges.size, found.owner
    target = project(base.movable, -fit.r)
    smooth = _Smoother(scaled, target, owner, edges.size)
    coefficients, covariance = smooth.coefficients(target), smooth.covariance
    everything = _explained(scaled, target)
    drawn = []
    for k, name, spline in edges.shown():
        own = owner == k
        alone, rank = _explained(scaled[:, ~own], target)
        gain, freedom = everything[0] - alone, everything[1] - rank
        removed = edges.without_line(k)
        values, std = spline.drawn(coefficients[own], covariance[np.ix_(own, own)], removed)
        seen = _without_constant(edges.rest[:, own])
        at = spline.typical()
        curve = Curve.of_likelihood(
            at, spline.matrix(at), coefficients[own], covariance[np.ix_(own, own)], seen.T @ seen,
            seen.T @ target, samples=len(target),
            free=at[:, None] if removed else np.empty((len(at), 0)), argument=name,
            unit=site.force_unit)
        lone = _explained(scaled[:, own], target)[0]
        drawn.append(Edge(name, spline.grid, values, std,
                          float(gain / max(everything[0], 1e-300)),
                          float(chi2.sf(gain, freedom)) if freedom > 0 else 1.0,
                          float(lone / max(everything[0], 1e-300)), curve))
    taken = np.hstack([base.movable, edges.D])
    left = residual_tests(whitened, fit.theta, fit.r, taken, candidates, site.rate)
    static: Literal[True] | None = True if left.p_value >= whitened.settings.refusal else None
    spare = max(whitened.rows - everything[1] - fit.J.shape[1], 1)
    return ForceShape(tuple(drawn), site.force_unit, static,
                      float((target @ target - everything[0]) / spare))


def with_law(shape: ForceShape, base: Hypothesis, site: Site, law: Hypothesis) -> ForceShape:
    """The shape with what a fitted law would look like in it: its change of the outputs, refit
    included, projected and smoothed as the recordings were; as it was where that cannot be.
    """
    whitened, fit = base.whitened, base.minimum
    change = [other.y - own.y if other.y.shape == own.y.shape else None for own, other in zip(
        whitened.responses(fit.theta), law.whitened.responses(law.minimum.theta), strict=True)]
    parts = [whitened.whiten(r, c) for r, c in enumerate(change) if c is not None]
    seen = np.concatenate([*parts, np.zeros(len(fit.r) - sum(map(len, parts)))])
    if len(parts) < len(change) or not np.isfinite(seen).all():
        return shape
    edges = _Edges(base, site)
    smooth = _Smoother(edges.rest / edges.size, project(base.movable, -fit.r), edges.found.owner,
                       edges.size)
    coefficients = smooth.coefficients(project(base.movable, seen))
    laws = {name: spline.drawn(coefficients[edges.found.owner == k], None, edges.without_line(k))[0]
            for k, name, spline in edges.shown()}
    return replace(shape, edges=tuple(replace(e, law=laws[e.argument]) for e in shape.edges))


class _Edges:
    """What every coefficient of every edge would show, as it is (rows, n) and without what the free
    parameters can do in its place.
    """

    def __init__(self, base: Hypothesis, site: Site) -> None:
        self.names = [*site.moving, *site.inputs]
        self.splines = [_Spline() for _ in self.names]
        fit = base.minimum
        self.found = directions(
            base.whitened, fit.theta,
            [_candidate(site, n, s) for n, s in zip(self.names, self.splines, strict=True)])
        D = self.found.D
        with np.errstate(over="ignore", invalid="ignore"):
            size = np.linalg.norm(D, axis=0)
        # of what grows without bounds along an unstable motion a force shows nothing
        within = np.isfinite(size) & (size < LARGEST)
        D, size = np.where(within, D, 0.0), np.where(within, size, 0.0)
        self.D = np.vstack([D, np.zeros((len(fit.r) - len(D), D.shape[1]))])
        self.size = np.where(size > 0, size, np.inf)
        self.rest = project(base.movable, self.D)
        self._line = base.whitened.settings.beyond.line

    def shown(self) -> list[tuple[int, str, _Spline]]:
        """Number, argument and basis of the edges that show."""
        return [(k, name, spline) for k, (name, spline) in enumerate(
            zip(self.names, self.splines, strict=True)) if (self.found.owner == k).any()]

    def without_line(self, k: int) -> bool:
        """Whether the free parameters can do a straight line along that argument."""
        own, line = self.found.owner == k, self.splines[k].sites()
        return bool(np.linalg.norm(self.rest[:, own] @ line) < (
            self._line * np.linalg.norm(self.D[:, own] @ line)))


class _Spline:
    """The spline basis of one argument, over the range that the first recording visits."""

    def __init__(self) -> None:
        self.visits = np.zeros(0)

    def matrix(self, values: np.ndarray) -> np.ndarray:
        """Basis (N, coefficients); constant beyond the ends."""
        low, high = self.visits.min(), self.visits.max()
        return BSpline.design_matrix(
            np.clip(values, low, high), self._knots(), DEGREE).toarray()

    def _knots(self) -> np.ndarray:
        low, high = float(self.visits.min()), float(self.visits.max())
        return uniform_knots(low, high, intervals=INTERVALS, degree=DEGREE)

    def sites(self) -> np.ndarray:
        """Coefficients (n,) of the identity (Greville's abscissae)."""
        t = self._knots()
        return np.array([t[i + 1:i + DEGREE + 1].mean() for i in range(len(t) - DEGREE - 1)])

    def typical(self) -> np.ndarray:
        """Some of the visited values, each once."""
        visited = np.sort(self.visits)
        return np.unique(visited[np.linspace(0, len(visited) - 1, TYPICAL).round().astype(int)])

    @property
    def grid(self) -> np.ndarray:
        """Where the edge is drawn (G,)."""
        return np.linspace(self.visits.min(), self.visits.max(), GRID)

    def drawn(self, coefficients: np.ndarray, covariance: np.ndarray | None, without_line: bool
              ) -> tuple[np.ndarray, np.ndarray]:
        """Values and standard errors (G,), without their mean over the visits (and their line)."""
        seen = self.matrix(self.visits[:: max(len(self.visits) // 2000, 1)])
        x = self.visits[:: max(len(self.visits) // 2000, 1)]
        X, at = np.ones((len(x), 1)), np.ones((GRID, 1))
        if without_line:
            X, at = np.column_stack([X, x]), np.column_stack([at, self.grid])
        basis = self.matrix(self.grid) - at @ np.linalg.lstsq(X, seen, rcond=None)[0]
        spread = np.zeros(GRID) if covariance is None else np.einsum(
            "gi,ij,gj->g", basis, covariance, basis)
        return basis @ coefficients, np.sqrt(np.maximum(spread, 0.0))


def _candidate(site: Site, name: str, spline: _Spline) -> Candidate:
    def directions(view: View) -> list[TangentDirection]:
        values = view.x[name] if name in view.x else view.u[name]
        if not len(spline.visits):
            spline.visits = values
        if np.ptp(spline.visits) == 0:
            return []
        return [TangentDirection({}, force=column) for column in spline.matrix(values).T]

    return Candidate(("edge",), name, name, "dynamics", site, (), lambda m: m, directions,
                     variant=name)


class _Smoother:
    """Coefficients (n,) and their covariance, in the units of the force, of any target (rows,); how
    smooth they are is chosen by one.

    Directions that the gauge leaves nothing of stay at zero.
    """

    def __init__(self, rest: np.ndarray, target: np.ndarray, owner: np.ndarray, size: np.ndarray):
        u, s, vt = np.linalg.svd(rest, full_matrices=False)
        kept = s > GAUGE
        u, s, vt = u[:, kept], s[kept], vt[kept]
        penalty = vt @ _rough(owner, size) @ vt.T
        pull = u.T @ target
        count = len(target)
        best, chosen = np.inf, np.diag(s**2)
        scale = np.trace(np.diag(s**2)) / max(np.trace(penalty), 1e-300)
        for rho in scale * RIDGES:
            normal = np.diag(s**2) + rho * penalty
            hat = s[:, None] * np.linalg.solve(normal, np.diag(s))
            left = float(target @ target - pull @ (2 * hat - hat.T @ hat) @ pull)
            score = count * left / (count - np.trace(hat)) ** 2
            if score < best:
                best, chosen = score, normal
        inverse = np.linalg.inv(chosen) if len(s) else np.zeros((0, 0))
        back = vt.T / size[:, None]
        self._u, self._s, self._solve = u, s, back @ inverse
        self.covariance = back @ inverse @ back.T

    def coefficients(self, target: np.ndarray) -> np.ndarray:
        """Of a target without what the free parameters can do."""
        return np.asarray(self._solve @ (self._s * (self._u.T @ target)))


def _rough(owner: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Sum of squared second differences of the coefficients of each edge (n, n)."""
    rough = np.zeros((0, len(owner)))
    for k in np.unique(owner):
        own = np.flatnonzero(owner == k)
        second = np.zeros((max(len(own) - 2, 0), len(owner)))
        second[:, own] = np.diff(np.eye(len(own)), 2, axis=0)
        rough = np.vstack([rough, second / size])
    return np.asarray(rough.T @ rough)


def _without_constant(columns: np.ndarray) -> np.ndarray:
    """Columns (rows, n) of an edge without what a constant force, the sum of them, can do."""
    constant = columns.sum(axis=1)
    constant = constant / max(float(np.linalg.norm(constant)), 1e-300)
    return np.asarray(columns - np.outer(constant, constant @ columns))


def _explained(columns: np.ndarray, target: np.ndarray) -> tuple[float, int]:
    """χ² of a target that columns of unit length explain, and how many directions they have."""
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    u = u[:, s > GAUGE]
    return float(np.sum((u.T @ target) ** 2)), u.shape[1]
