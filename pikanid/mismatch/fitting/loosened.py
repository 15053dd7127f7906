"""What a model would explain if the bounds of its parameters did not hold them."""

from __future__ import annotations

import numpy as np

from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.descent import place
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.lowest import lowest


def loosened(h: Hypothesis, near: Hypothesis) -> float | None:
    """χ² where the model's parameters that a bound holds may pass it; None where it holds none.

    What effects bring with them keeps its bounds: past them, an exponent or a width means nothing.

    Args:
        h: A fit.
        near: Another one, with more effects: the values that it has for the rest are a second
            place to begin.
    """
    whitened = Whitened(h.model, h.whitened.records)
    problem, rows, fit = whitened.problem, max(whitened.rows, 1), h.minimum
    held = fit.pinned(problem.lower, problem.upper) & np.array(
        [f.name in whitened.records.guess for f in problem.free])
    if not held.any():
        return None
    upwards = fit.J.T @ fit.r < 0
    lower = np.where(held & ~upwards, -np.inf, problem.lower)
    upper = np.where(held & upwards, np.inf, problem.upper)
    found = [fit.chi2]
    for start in (h, near):
        theta, misfit = place(whitened, start.point), start.minimum.chi2 / rows
        for _ in range(2):  # the second time with steps for what the first one leaves
            if not whitened.choose_steps(theta, misfit=max(misfit, 1.0)):
                break
            one = lowest(whitened, theta, whitened.settings.budget.iterations,
                         lower=lower, upper=upper)
            if one is None:
                break
            theta, misfit = one.theta, one.chi2 / rows
            found.append(one.chi2)
    return min(found)
