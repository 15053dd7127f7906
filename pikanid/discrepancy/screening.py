"""How the outputs would answer to a force that depends on an edge's argument.

Answers to w(t) = w(a(t)) through the variational equation along the fitted trajectory,

    S' = f_x S + e w(t),   δy = h_x S,

with f_x and w constant over each interval between stops (their means over it, so second order in
its length).  It says whether a step or a finer grid is worth a fit of its own, before anything is
compiled or simulated for it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.linalg import expm

from pikanid.discrepancy.edges import EdgePlan, argument_model
from pikanid.objective.shooting import Shooting
from pikanid.problem.problem import Problem
from pikanid.simulation.vectorfield import VectorField

# from arguments (L, edges) at the begin and end of every interval to mean forces (L, forces)
Force = Callable[[np.ndarray, np.ndarray], np.ndarray]


def step_responses(shooting: Shooting, theta: np.ndarray, equation: str,
                   plans: Sequence[EdgePlan]) -> np.ndarray:
    """Standardised answers (rows, edges) of all samples to a unit step at zero of every edge."""
    return _responses(shooting, theta, equation, plans, _mean_sign)


def spline_responses(shooting: Shooting, theta: np.ndarray, equation: str,
                     plans: Sequence[EdgePlan]) -> np.ndarray:
    """Standardised answers (rows, ΣK) to the spline basis functions of all edges."""
    def force(before: np.ndarray, after: np.ndarray) -> np.ndarray:
        return np.hstack([0.5 * (p.basis(a) + p.basis(b))[:, : p.intervals + 3]
                          for p, a, b in zip(plans, before.T, after.T, strict=True)])

    return _responses(shooting, theta, equation, plans, force)


def _responses(shooting: Shooting, theta: np.ndarray, equation: str, plans: Sequence[EdgePlan],
               force: Force) -> np.ndarray:
    problem = shooting.problem
    parts = []
    for r, response in enumerate(shooting.responses(theta)):
        p = problem.parameters(theta, r)
        parts.append(_one(problem, r, p, response.t, response.states, equation, plans, force))
    return np.concatenate(parts) * shooting.weights[:, None]


def _one(problem: Problem, r: int, p: np.ndarray, t: np.ndarray, x: np.ndarray, equation: str,
         plans: Sequence[EdgePlan], force: Force) -> np.ndarray:
    model, experiment = problem.model, problem.experiments[r]
    field = VectorField(model)
    right, left = experiment.inputs(t), experiment.inputs(t, side="left")
    slopes = 0.5 * (field.rhs_jacobians(t[:-1], x[:-1], right[:-1], p)[0]
                    + field.rhs_jacobians(t[1:], x[1:], left[1:], p)[0])
    seen = VectorField(argument_model(model, plans))
    pushes = force(seen.outputs(t[:-1], x[:-1], right[:-1], p),
                   seen.outputs(t[1:], x[1:], left[1:], p))
    n = x.shape[1]
    joint = np.zeros((len(slopes), n + 1, n + 1))
    joint[:, :n, :n] = slopes
    joint[:, model.state_names.index(equation), n] = 1.0
    joint = expm(joint * np.diff(t)[:, None, None])
    S = np.zeros((len(t), n, pushes.shape[1]))
    for i, (step, push) in enumerate(zip(joint, pushes, strict=True)):
        S[i + 1] = step[:n, :n] @ S[i] + step[:n, n:] * push
    rows = []
    for samples in experiment.samples:
        hx = field.output_jacobians(t, x, right, p)[0][:, samples.output]
        answer = np.einsum("ln,lne->le", hx, S)
        rows.append(np.column_stack([np.interp(samples.t, t, a) for a in answer.T]))
    return np.concatenate(rows)


def _mean_sign(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Mean of sign(a) over an interval in which a goes straight from `before` to `after`."""
    span = np.abs(before) + np.abs(after)
    crossed = (np.sign(before) * np.sign(after) < 0) & (span > 0)
    share = (np.abs(before) - np.abs(after)) / np.where(span > 0, span, 1.0)
    return np.where(crossed, np.sign(before) * share, np.sign(before + after))
