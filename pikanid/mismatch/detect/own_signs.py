"""How an effect that was described as text would show, about a fit without it.

What it adds to equations is a force along the motion, the derivative of the right-hand sides by the
effect's size.  Where it changes more than equations (states, inputs, outputs, initial values) the
derivative is simulated, which asks nothing of an effect but that it can be added to the model.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from pikanid import errors
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.whitened import Whitened
from pikanid.model import Model
from pikanid.simulation.input_paths import with_parts
from pikanid.simulation.vectorfield import VectorField


class Along(Protocol):
    """A motion: t (L,), states x (L, n), inputs u (L, m), and the parameters p (P,) behind it."""

    t: np.ndarray
    x: np.ndarray
    u: np.ndarray
    p: np.ndarray


def equations_alone(model: Model, candidate: Candidate) -> bool | None:
    """Whether an effect changes right-hand sides, and nothing else; None where it cannot be added
    to what the model holds.
    """
    try:
        extended = candidate.applied(model)
    except (errors.BadUnit, errors.BadModel):
        return None
    return (extended.states, extended.inputs, extended.outputs) == (
        model.states, model.inputs, model.outputs)


def added_forces(model: Model, candidate: Candidate, at: Along) -> list[np.ndarray]:
    """∂f/∂size (L, n) at no effect, at each of the candidate's probes."""
    extended = with_parts(candidate.applied(model))
    size = candidate.parameters[0]
    field = VectorField(extended)
    found = []
    for probe in candidate.probes:
        values = {**extended.values, **dict(zip(model.parameter_names, at.p, strict=True)),
                  **probe, size.name: size.value}
        p = np.array([values[n] for n in extended.parameter_names])
        found.append(field.rhs_by(size.name, at.t, at.x, at.u, p))
    return found


def simulated_signs(whitened: Whitened, theta: np.ndarray, candidate: Candidate
                    ) -> list[np.ndarray]:
    """∂y/∂size, whitened, at no effect: for each recording (rows, probes) of the candidate's
    probes; zeros where the model with the effect cannot be simulated.
    """
    size = candidate.parameters[0]
    extended = Whitened(candidate.applied(whitened.problem.model), whitened.records)
    here = dict(zip((f.label for f in whitened.problem.free), theta, strict=True))
    columns = []
    for probe in candidate.probes:
        named = {**here, **probe}
        at = np.array([named.get(f.label, named.get(f.name, f.guess))
                       for f in extended.problem.free])
        columns.append(_column(extended, at, size.name))
    stacked = np.column_stack(columns)
    counts = [sum(len(s.t) for s in e.samples) for e in whitened.problem.experiments]
    return np.split(stacked, np.cumsum(counts)[:-1])


def _column(extended: Whitened, theta: np.ndarray, size: str) -> np.ndarray:
    nothing = np.zeros(extended.rows)
    own = [k for k, f in enumerate(extended.problem.free) if f.name == size]
    try:
        found = extended.residual(theta) if extended.choose_steps(theta) else None
    except errors.SimulationFailed:
        return nothing
    return nothing if found is None else found[1][:, own].sum(axis=1)
