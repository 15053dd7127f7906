"""What a cell of the tables holds: a parameter in a scenario, by a strategy in a protocol."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

Array = NDArray[np.float64]
QUANTILE = 1.959963984540054  # definition: of a 95 % interval
# A fit broke down if a parameter is off by more than both.
GROSS, FAR = 0.5, 6.0  # definition: shares of the true value, Cramér-Rao standard deviations
RESAMPLES = 2000  # numerical: of the bootstrap
SEED = 1  # numerical: of its generator, so that a table is the same each time


@dataclass(frozen=True)
class Interval:
    """A figure with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Cell:
    """Estimates (n,) of one parameter over seeds, NaN where there is none.

    Attributes:
        std: (n,) standard errors that the strategy states.
        true: Value.
        bound: Cramér-Rao standard deviation, NaN where there is none.
    """

    estimates: Array
    std: Array
    true: float
    bound: float = np.nan

    @property
    def errors(self) -> Array:
        """(n,) estimated minus true value of the fits that gave one."""
        return (self.estimates - self.true)[np.isfinite(self.estimates)]

    @property
    def median(self) -> float:
        """Of the estimates."""
        return float(np.median(self.errors) + self.true) if self.errors.size else np.nan

    @property
    def spread(self) -> float:
        """Half of what the middle 68 % cover: a standard deviation that gross errors leave alone.
        """
        if not self.errors.size:
            return np.nan
        low, high = np.percentile(self.errors, [15.87, 84.13])
        return float(high - low) / 2

    @property
    def bias(self) -> Interval:
        """Mean error."""
        return bootstrapped(self.errors, lambda e: np.mean(e, axis=-1))

    @property
    def rmse(self) -> Interval:
        """Root mean square error."""
        return bootstrapped(self.errors, lambda e: np.sqrt(np.mean(e**2, axis=-1)))

    @property
    def ratio(self) -> Interval:
        """Root mean square error over the Cramér-Rao standard deviation."""
        r = self.rmse
        return Interval(r.value / self.bound, r.low / self.bound, r.high / self.bound)

    @property
    def coverage(self) -> Interval:
        """Share of 95 % intervals that hold the truth; an interval that is not given does not."""
        known = np.isfinite(self.estimates)
        inside = np.abs(self.estimates - self.true)[known] <= QUANTILE * self.std[known]
        return share(int(inside.sum()), inside.size)

    @property
    def broken(self) -> NDArray[np.bool_]:
        """(n,) whether the fit is off by more than `GROSS` and `FAR`, or gave nothing."""
        limit = max(GROSS * abs(self.true), FAR * np.nan_to_num(self.bound))
        return ~(np.abs(self.estimates - self.true) <= limit)


def breakdowns(cells: Sequence[Cell]) -> Interval:
    """Share of trials that broke down in any of the parameters of one fit."""
    broken = np.any([cell.broken for cell in cells], axis=0)
    return share(int(broken.sum()), broken.size)


def share(count: int, n: int) -> Interval:
    """A share with Wilson's interval.

    >>> round(share(0, 100).high, 4)
    0.037
    """
    if n == 0:
        return Interval(np.nan, np.nan, np.nan)
    found = binomtest(count, n).proportion_ci(method="wilson")
    return Interval(count / n, float(found.low), float(found.high))


def bootstrapped(errors: Array, statistic: object) -> Interval:
    """A statistic of errors (n,) with its bootstrap percentile interval."""
    assert callable(statistic)
    if not errors.size:
        return Interval(np.nan, np.nan, np.nan)
    rng = np.random.default_rng(SEED)
    drawn = statistic(errors[rng.integers(0, errors.size, (RESAMPLES, errors.size))])
    low, high = np.percentile(drawn, [2.5, 97.5])
    return Interval(float(statistic(errors)), float(low), float(high))
