"""Starting points of a multi-start fit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

from pikanid.problem.problem import FreeParameter, Problem


def starting_points(problem: Problem, starts: int | Literal["auto"],
                    protocol: Literal["default", "paper"], seed: int, extra: int = 8
                    ) -> Iterator[np.ndarray]:
    """Yield starting points (n_free,); the first is the guess.

    "paper": five points within ±20 % of the guess (Table II, best of five).  Otherwise a
    Latin hypercube (McKay, Beckman & Conover, Technometrics 21, 1979) over each parameter's range:
    its bounds where they are finite, logarithmic where both are positive and a decade apart, else
    a decade around the guess.
    """
    guess = problem.guess
    yield guess
    count = (extra + 1 if starts == "auto" else starts) - 1
    if protocol != "paper" and (count < 1 or len(guess) == 0):
        return
    rng = np.random.default_rng(seed)
    if protocol == "paper":
        draws = rng.uniform(0.8, 1.2, (4, len(guess))) * guess
        yield from np.clip(draws, problem.lower, problem.upper)
        return
    from scipy.stats import qmc

    unit = qmc.LatinHypercube(len(guess), rng=rng).random(count)
    columns = [_spread(f, unit[:, k]) for k, f in enumerate(problem.free)]
    yield from np.stack(columns, axis=1)


def _spread(f: FreeParameter, unit: np.ndarray) -> np.ndarray:
    low, high = f.bounds
    around = max(abs(f.guess), 1e-3)
    if f.guess > 0:
        # a decade about the guess, within the bounds: wide enough to leave a wrong basin
        low, high = max(low, around / 10), min(high, around * 10)
    else:
        low, high = max(low, f.guess - 5 * around), min(high, f.guess + 5 * around)
    if low > 0 and high / low > 10:
        return low * (high / low) ** unit
    return low + (high - low) * unit
