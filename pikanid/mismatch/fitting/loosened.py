"""What a model would explain if its parameters' bounds did not hold it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.closest import Closest
from pikanid.mismatch.fitting.descent import descended
from pikanid.mismatch.fitting.hypothesis import Hypothesis


def loosened(h: Hypothesis) -> float:
    """χ² where parameters that a bound holds may pass it by their order of magnitude.

    Only parameters of known size may: how far past its bounds another one would have to go, nothing
    tells.
    """
    problem, theta = h.whitened.problem, h.minimum.theta
    sizes = np.maximum(h.whitened.sizes, np.abs(theta))
    held = h.minimum.pinned(problem.lower, problem.upper) & np.isfinite(sizes)
    room = {f.name: float(size)
            for f, size, is_held in zip(problem.free, sizes, held, strict=True) if is_held}
    if not room:
        return h.minimum.chi2
    whitened = Whitened(h.model.with_parameters(*(
        replace(p, bounds=(p.bounds[0] - room[p.name], p.bounds[1] + room[p.name]))
        for p in h.model.parameters if p.name in room)), h.whitened.records)
    found = descended(whitened, [h.point], Closest(), whitened.settings.budget.iterations,
                      beyond=lambda size: False)
    return h.minimum.chi2 if found is None else found.chi2
