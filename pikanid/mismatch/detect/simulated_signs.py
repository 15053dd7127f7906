"""How an effect of any form would show: its derivative by simulation, about a fit without it.

The analytic signs of the catalogue are faster; this one asks nothing of an effect but that it can
be added to the model.
"""

from __future__ import annotations

import numpy as np

from pikanid import errors
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.whitened import Whitened


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
