"""How much errors grow along a recording: whether a simulation from one start can follow it.

Along an unstable motion, as of a ball in a magnetic field that a controller holds there, errors
grow until no simulation follows the recording, however right the parameters are.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from pikanid.model import Model
from pikanid.problem.problem import Experiment, Problem
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.nodes import state_near

HOPELESS = 25.0  # limit: logarithm of how much errors grow over what is followed in one go
PLACES = 60  # numerical: of a recording at which its rates are looked at first
FINER = 4.0  # numerical: places for each time that errors grow by e
LONGEST = 8.0  # limit: logarithm of how much they grow in a segment
LEAST = 4  # limit: samples of an output in a segment, for each state


def growth(problem: Problem, theta: np.ndarray) -> tuple[float, ...]:
    """Logarithm of how much errors grow along each recording's motion: of the largest singular
    value of the product of its transition matrices, which parameters θ (n_free,) give.

    The motion is read off the samples, so that no simulation need follow it.  Zero where errors
    grow by less than e^25, where outputs show neither a state nor what it is the rate of, and where
    recordings cannot be cut into segments.
    """
    if not _can_be_cut(problem.model):
        return (0.0,) * len(problem.experiments)
    field = VectorField(problem.model)
    return tuple(_growth(field, e, problem.parameters(theta, r))
                 for r, e in enumerate(problem.experiments))


def _can_be_cut(model: Model) -> bool:
    """Whether a segment needs no past of its inputs, and no parameter of a recording's own but an
    initial state: each would be estimated for every segment.
    """
    first = {q.name for s in model.states for q in s.initial.free_symbols} & {*model.free_names}
    own = {p.name for p in model.parameters if p.free and p.scope != "shared"}
    return (not any(i.shaped or i.delay != 0 or i.hold == "cubic" for i in model.inputs)
            and not any(o.delay != 0 for o in model.outputs)
            and not used_after_start(model) & (own | first))


def used_after_start(model: Model) -> set[str]:
    """Names in equations and outputs, not those that only initial states need."""
    formulas = [*model.equations.values(), *(o.expression for o in model.outputs)]
    return {q.name for f in formulas for q in f.free_symbols}


def _growth(field: VectorField, e: Experiment, p: np.ndarray) -> float:
    span, samples = e.t1 - e.t0, max(len(s.t) for s in e.samples)
    x, A = _along(field, e, p, PLACES)
    most = span * _frozen(A)
    if most <= HOPELESS:
        return 0.0
    if (places := int(min(np.ceil(FINER * most), samples))) > PLACES:
        x, A = _along(field, e, p, places)
    sizes = np.maximum(np.abs(x).max(axis=0), 1e-300)
    total, product = 0.0, np.eye(len(sizes))
    with np.errstate(all="ignore"):
        for a in A * sizes[None, None, :] / sizes[None, :, None]:
            product = expm(a * span / len(A)) @ product
            if not np.all(np.isfinite(product)):
                return 0.0  # no segment would be short enough
            size = float(np.linalg.norm(product, 2))
            total, product = total + float(np.log(size)), product / size
    enough = most_segments(e, len(sizes)) >= total / LONGEST
    return total if total > HOPELESS and enough else 0.0


def most_segments(e: Experiment, states: int) -> int:
    """Into how many a recording can be cut at most, for a model of so many states."""
    return max(max(len(s.t) for s in e.samples) // (LEAST * states), 1)


def _along(field: VectorField, e: Experiment, p: np.ndarray, count: int
           ) -> tuple[np.ndarray, np.ndarray]:
    """States (K, n) at so many places, and ∂f/∂x (K, n, n) there; none where some are not known."""
    t = e.t0 + (e.t1 - e.t0) * (np.arange(count) + 0.5) / count
    nodes = [state_near(field.model, e, at, p) for at in t]
    if not all(told.all() for _, told in nodes):
        return np.zeros((0, len(p))), np.zeros((0, 1, 1))
    x = np.stack([found for found, _ in nodes])
    with np.errstate(all="ignore"):
        A = field.rhs_jacobians(t, x, e.inputs(t), p)[0]
    good = np.all(np.isfinite(A), axis=(1, 2))
    return x[good], A[good]


def _frozen(A: np.ndarray) -> float:
    """Mean of the largest rate [1/s] at which errors would grow in systems (K, n, n) that stay."""
    return float(np.mean(np.maximum(np.linalg.eigvals(A).real.max(axis=1), 0.0))) if len(A) else 0.0
