"""States in the midst of a recording, read off the samples around: where a segment may begin."""

from __future__ import annotations

import numpy as np

from pikanid.model import Model
from pikanid.problem.problem import Experiment

_AROUND = 11  # numerical: samples that a cubic is laid through
_LEAST = 5  # numerical: of which a cubic leaves one over


def state_near(model: Model, e: Experiment, t: float, p: np.ndarray | None = None
               ) -> tuple[np.ndarray, np.ndarray]:
    """A first guess of the state (n,) at time t, and which entries (n,) the samples tell.

    A measured state comes from a local cubic through the samples, its derivative where that is a
    state too; all others have the model's initial values, at parameters p (P,), or its own.
    """
    found = e.initial(np.array(list(model.values.values())) if p is None else p).copy()
    told = np.zeros(len(found), bool)
    names = model.state_names
    for s in e.samples:
        expr = model.outputs[s.output].expression
        first = max(min(int(np.searchsorted(s.t, t)) - _AROUND // 2, len(s.t) - _AROUND), 0)
        near = slice(first, first + _AROUND)
        if not expr.is_Symbol or expr.name not in names or len(s.t[near]) < _LEAST:
            continue
        cubic = np.polynomial.Polynomial.fit(s.t[near] - t, s.y[near], 3)
        k = names.index(expr.name)
        found[k], told[k] = cubic(0.0), True
        slope = model.equations[expr.name]
        if slope.is_Symbol and slope.name in names:
            k = names.index(slope.name)
            found[k], told[k] = cubic.deriv()(0.0), True
    return found, told
