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

from dataclasses import dataclass, field
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
GAUGE = 1e-3  # numerical: of a sign: less is left when the free parameters can do the same


@dataclass(frozen=True, eq=False)
class Edge:
    """One edge: values (G,) and standard errors (G,) over its argument (G,), [unit of q''].

    `own` is the share of what all edges explain that no other edge can; `alone` the share that this
    one can without the others, and `curve` what the data say of it then, for laws to be compared
    with.
    """

    argument: str
    grid: np.ndarray
    values: np.ndarray
    std: np.ndarray
    own: float
    p_value: float
    alone: float
    curve: Curve = field(repr=False)


@dataclass(frozen=True, eq=False)
class ForceShape:
    """All edges, and whether a static law can be all that is missing (None: not to be told)."""

    edges: tuple[Edge, ...]
    unit: str
    static_law: Literal[True] | None

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
    names = [*site.moving, *site.inputs]
    splines = [_Spline() for _ in names]
    whitened, fit = base.whitened, base.minimum
    found = directions(whitened, fit.theta,
                       [_candidate(site, n, s) for n, s in zip(names, splines, strict=True)])
    D, owner = found.D, found.owner
    D = np.vstack([D, np.zeros((len(fit.r) - len(D), D.shape[1]))])
    size = np.linalg.norm(D, axis=0)
    size = np.where(size > 0, size, np.inf)
    rest, target = project(fit.J, D), project(fit.J, -fit.r)
    coefficients, covariance = _smoothed(rest / size, target, owner, size)
    everything = _explained(rest / size, target)
    edges = []
    for k, (name, spline) in enumerate(zip(names, splines, strict=True)):
        own = owner == k
        if not own.any():
            continue
        alone, rank = _explained((rest / size)[:, ~own], target)
        gain, freedom = everything[0] - alone, everything[1] - rank
        line = spline.sites()
        removed = np.linalg.norm(rest[:, own] @ line) < (
            whitened.settings.beyond.line * np.linalg.norm(D[:, own] @ line))
        values, std = spline.drawn(coefficients[own], covariance[np.ix_(own, own)], bool(removed))
        seen = _without_constant(rest[:, own])
        at = spline.typical()
        curve = Curve.of_likelihood(
            at, spline.matrix(at), coefficients[own], covariance[np.ix_(own, own)], seen.T @ seen,
            seen.T @ target, samples=len(target),
            free=at[:, None] if removed else np.empty((len(at), 0)), argument=name,
            unit=site.force_unit)
        lone = _explained((rest / size)[:, own], target)[0]
        edges.append(Edge(name, spline.grid, values, std,
                          float(gain / max(everything[0], 1e-300)),
                          float(chi2.sf(gain, freedom)) if freedom > 0 else 1.0,
                          float(lone / max(everything[0], 1e-300)), curve))
    left = residual_tests(whitened, fit.theta, fit.r, np.hstack([fit.J, D]), candidates, site.rate)
    static: Literal[True] | None = True if left.p_value >= whitened.settings.refusal else None
    return ForceShape(tuple(edges), site.force_unit, static)


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

    def drawn(self, coefficients: np.ndarray, covariance: np.ndarray, without_line: bool
              ) -> tuple[np.ndarray, np.ndarray]:
        """Values and standard errors (G,), without their mean over the visits (and their line)."""
        seen = self.matrix(self.visits[:: max(len(self.visits) // 2000, 1)])
        x = self.visits[:: max(len(self.visits) // 2000, 1)]
        X, at = np.ones((len(x), 1)), np.ones((GRID, 1))
        if without_line:
            X, at = np.column_stack([X, x]), np.column_stack([at, self.grid])
        basis = self.matrix(self.grid) - at @ np.linalg.lstsq(X, seen, rcond=None)[0]
        spread = np.einsum("gi,ij,gj->g", basis, covariance, basis)
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


def _smoothed(rest: np.ndarray, target: np.ndarray, owner: np.ndarray, size: np.ndarray
              ) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (n,) and their covariance, in the units of the force.

    Directions that the gauge leaves nothing of stay at zero.
    """
    u, s, vt = np.linalg.svd(rest, full_matrices=False)
    kept = s > GAUGE
    u, s, vt = u[:, kept], s[kept], vt[kept]
    rough = np.zeros((0, len(owner)))
    for k in np.unique(owner):
        own = np.flatnonzero(owner == k)
        second = np.zeros((max(len(own) - 2, 0), len(owner)))
        second[:, own] = np.diff(np.eye(len(own)), 2, axis=0)
        rough = np.vstack([rough, second / size])
    penalty = vt @ (rough.T @ rough) @ vt.T
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
    return back @ inverse @ (s * pull), back @ inverse @ back.T


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
