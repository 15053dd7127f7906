"""What an edge may say for itself: everything that the free parameters cannot do already.

Along the visited data, a change of the parameters changes the equation by G Δp, G = ∂f_e/∂p.
Where all edges together can follow such a change, edges and parameters cannot be told apart: that
direction is a gauge.  Each edge is reported without its own part of every gauge direction and
without its mean: what is left is orthogonal, over the data, to the nominal terms as that edge sees
them.  The same projection, put to a law that one has in mind, makes the two comparable.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from pikanid.discrepancy.edges import EdgePlan, argument_model
from pikanid.discrepancy.settings import USUAL, DiscrepancySettings
from pikanid.estimate.data import Trajectory
from pikanid.problem.problem import Problem
from pikanid.simulation.vectorfield import VectorField

BEND = 1e-3  # numerical: cost of ∫ (d²δ/dz²)² against the mean square: of least norm


@dataclass(frozen=True, eq=False)
class Visited:
    """What the fitted trajectories went through.

    `arguments` (M, edges), `weights` (M,) summing to 1, `terms` (M, n_free) = ∂f_e/∂θ of the
    nominal model, `size` root mean square of the equation's right-hand side.
    """

    arguments: np.ndarray
    weights: np.ndarray
    terms: np.ndarray
    size: float


def visit(problem: Problem, equation: str, plans: Sequence[EdgePlan], theta: np.ndarray,
          trajectories: Sequence[Trajectory]) -> Visited:
    """Collect arguments and nominal terms along the trajectories of a fit of the nominal model."""
    model = problem.model
    field, seen = VectorField(model), VectorField(argument_model(model, plans))
    row = model.state_names.index(equation)
    arguments, weights, terms, rates = [], [], [], []
    for r, path in enumerate(trajectories):
        p = problem.parameters(theta, r)
        t, x = path.t[:-1], path.x[:-1]
        u = problem.experiments[r].inputs(t)
        arguments.append(seen.outputs(t, x, u, p))
        weights.append(np.diff(path.t))
        own = np.zeros((len(t), len(theta)))
        inside, outside = problem.columns(r)
        own[:, outside] = field.rhs_jacobians(t, x, u, p)[1][:, row, inside]
        terms.append(own)
        rates.append(field.rhs(t, x, u, p)[:, row])
    w = np.concatenate(weights)
    w = w / w.sum()
    size = float(np.sqrt(w @ np.concatenate(rates) ** 2))
    return Visited(np.vstack(arguments), w, np.vstack(terms), max(size, 1e-300))


@dataclass(frozen=True, eq=False)
class Gauge:
    """The gauge of one edge.

    `projection` (K, K) takes coefficients to gauge-fixed ones; `removed` (K, m) spans what it takes
    out; `a`, `weights` (M,) are the visited arguments.
    """

    plan: EdgePlan
    a: np.ndarray
    weights: np.ndarray
    removed: np.ndarray
    projection: np.ndarray

    def fix(self, law: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> np.ndarray:
        """A law of the argument, without its gauge part, at arguments `at` (M,)."""
        shadows = self.plan.basis(self.a) @ self.removed
        root = np.sqrt(self.weights)
        share = np.linalg.lstsq(root[:, None] * shadows, root * law(self.a), rcond=None)[0]
        return law(at) - self.plan.basis(at) @ (self.removed @ share)


def fix_gauges(plans: Sequence[EdgePlan], visited: Visited,
               settings: DiscrepancySettings = USUAL) -> tuple[Gauge, ...]:
    """The gauge of every edge over the visited data."""
    root = np.sqrt(visited.weights)
    columns = [root[:, None] * p.basis(a) for p, a in zip(plans, visited.arguments.T, strict=True)]
    ends = np.cumsum([p.size for p in plans])[:-1]
    shared = _shared(plans, columns, root[:, None] * visited.terms, settings.followed)
    gauges = []
    for plan, a, B, parts in zip(plans, visited.arguments.T, columns, np.split(shared, ends),
                                 strict=True):
        kept = [plan.constant]
        total = np.linalg.norm(np.hstack(columns) @ shared, axis=0)
        mean = root @ B
        for k in range(parts.shape[1]):
            own = parts[:, k] - (mean @ parts[:, k]) * plan.constant
            if np.linalg.norm(B @ own) > settings.carried * total[k]:
                kept.append(own)
        removed = _orthonormal(np.column_stack(kept), B)
        # over the data the removed functions are orthonormal: (B M)ᵀ(B M) = I
        projection = np.eye(plan.size) - removed @ (removed.T @ (B.T @ B))
        gauges.append(Gauge(plan, a, visited.weights, removed, projection))
    return tuple(gauges)


def _shared(plans: Sequence[EdgePlan], columns: Sequence[np.ndarray], terms: np.ndarray,
            followed: float) -> np.ndarray:
    """Coefficients (ΣK, m) of the nominal directions that all edges together can follow."""
    alive = np.linalg.norm(terms, axis=0) > 0
    if not alive.any():
        return np.zeros((sum(c.shape[1] for c in columns), 0))
    terms = terms[:, alive] / np.linalg.norm(terms[:, alive], axis=0)
    # a step takes no part: what the nominal terms do is smooth
    B = np.hstack([c * np.append(np.ones(c.shape[1] - p.step), np.zeros(int(p.step)))
                   for p, c in zip(plans, columns, strict=True)])
    # smooth, and of least norm where edges overlap (their constants do)
    padded = np.vstack([B, np.sqrt(BEND) * block_diag(*(p.bends() for p in plans))])
    below = np.zeros((len(padded) - len(B), terms.shape[1]))
    follow = np.linalg.lstsq(padded, np.vstack([terms, below]), rcond=1e-8)[0]
    r: np.ndarray = np.asarray(np.linalg.qr(terms, mode="r"))
    turned = follow @ np.linalg.pinv(r, rcond=1e-8)
    # principal angles between the edges' span and the nominal one
    _, cosine, vt = np.linalg.svd(B @ turned, full_matrices=False)
    return turned @ vt.T[:, cosine**2 > followed]


def _orthonormal(coefficients: np.ndarray, B: np.ndarray) -> np.ndarray:
    """The same span, orthonormal as functions over the data."""
    values = B @ coefficients
    _, s, vt = np.linalg.svd(values, full_matrices=False)
    good = s > 1e-8 * s[0]
    return np.asarray(coefficients @ (vt[good].T / s[good]))
