"""Is one model's squared error smaller than another's by more than chance?

Errors of neighbouring samples are alike, so blocks of the difference of squared errors are drawn
with replacement, each series wrapped into a circle (D. N. Politis and J. P. Romano, A circular
block-resampling procedure for stationary data, 1992).  The length of the blocks follows from the
series' own correlation (D. N. Politis and H. White, Econometric Reviews 23, 2004, corrected by
A. Patton, D. N. Politis and H. White, Econometric Reviews 28, 2009).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

DRAWS = 2000  # numerical: resampled series
SIGNIFICANT = 2.0  # numerical: √(log10 N/N) that a correlation exceeds to count (Politis and White)
QUIET = 5  # numerical: correlations in a row that do not count; √(log10 N) is never more
ALIKE = 1e-6  # numerical: of noise and error: squared errors that differ less are one model's
LONGEST = 0.25  # numerical: share of a series that a block may have


@dataclass(frozen=True)
class Pair:
    """Two models on the same samples.

    Attributes:
        better, worse: Their names, by mean squared error.
        difference: Mean of worse² - better², each output by the variance of its noise.
        interval: 95 % bootstrap interval of it.
        p_value: That a difference as large arises where there is none; adjusted for the number of
            pairs (S. Holm, Scand. J. Stat. 6, 1979).
    """

    better: str
    worse: str
    difference: float
    interval: tuple[float, float]
    p_value: float


def block_length(series: np.ndarray) -> int:
    """Length of the blocks (samples) for the mean of a series (N,).

    >>> rng = np.random.default_rng(0)
    >>> block_length(rng.standard_normal(1000)) < 5
    True
    """
    n = len(series)
    x = series - np.mean(series)
    power = float(x @ x)
    if n < 8 or power <= 0:
        return 1
    longest = max(int(LONGEST * n), 1)
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(x, size)) ** 2
    R = np.fft.irfft(spectrum, size)[:longest + 1] / n
    small = np.abs(R[1:] / R[0]) < SIGNIFICANT * np.sqrt(np.log10(n) / n)
    runs = np.convolve(small, np.ones(QUIET, int), "valid") == QUIET if len(small) >= QUIET else (
        np.zeros(1, bool))
    m = int(np.argmax(runs)) if runs.any() else longest
    M = min(2 * max(m, 1), longest)
    k = np.arange(-M, M + 1)
    flat = np.clip(2 * (1 - np.abs(k) / M), 0.0, 1.0)
    Rk = R[np.abs(k)]
    G = float(np.sum(flat * np.abs(k) * Rk))
    g = float(np.sum(flat * Rk))
    if g <= 0:
        return longest
    return int(np.clip(np.ceil((2 * G**2 / (4 / 3 * g**2)) ** (1 / 3) * n ** (1 / 3)), 1, longest))


def resampled_means(series: Sequence[np.ndarray], draws: int, seed: int) -> np.ndarray:
    """Means (draws,) of all samples of several series, each resampled in blocks of its own length.

    >>> means = resampled_means([np.random.default_rng(0).standard_normal(400)], 500, seed=0)
    >>> bool(0.04 < means.std() < 0.06)
    True
    """
    rng = np.random.default_rng(seed)
    total = np.zeros(draws)
    for x in series:
        n, b = len(x), block_length(x)
        blocks, rest = divmod(n, b)
        ends = np.cumsum(np.concatenate([[0.0], x, x]))
        starts = rng.integers(0, n, (draws, blocks + 1))
        total += np.sum(ends[starts[:, :blocks] + b] - ends[starts[:, :blocks]], axis=1)
        total += ends[starts[:, blocks] + rest] - ends[starts[:, blocks]]
    return total / sum(map(len, series))


def same(one: Sequence[np.ndarray], other: Sequence[np.ndarray]) -> bool:
    """Whether squared errors (N,) of several series, in variances of the noise, are one model's.

    >>> same([np.array([1.0, 2.0])], [np.array([1.0, 2.0 + 1e-9])])
    True
    """
    return all(bool(np.all(np.abs(x - y) <= ALIKE * (1.0 + x)))
               for x, y in zip(one, other, strict=True))


def twins(errors: dict[str, list[np.ndarray]]) -> tuple[tuple[str, ...], ...]:
    """The names of models that err alike in every sample, in groups of two or more.

    >>> a, b = [np.ones(9)], [np.zeros(9)]
    >>> twins({"one": a, "other": b, "again": a})
    (('one', 'again'),)
    """
    groups: list[list[str]] = []
    for name, own in errors.items():
        group = next((g for g in groups if same(errors[g[0]], own)), None)
        if group is None:
            groups.append([name])
        else:
            group.append(name)
    return tuple(tuple(g) for g in groups if len(g) > 1)


def pairs(errors: dict[str, list[np.ndarray]], seed: int = 0, draws: int = DRAWS
          ) -> tuple[Pair, ...]:
    """All pairs of models that differ, compared on the same samples.

    Args:
        errors: Name -> squared errors (N,) of each series, in the same order for every name.
        seed: Of the draws.
        draws: Their number.
    """
    names = list(errors)
    found = []
    for i, a in enumerate(names):
        for b in names[i + 1:]:
            if same(errors[a], errors[b]):
                continue
            series = [y - x for x, y in zip(errors[a], errors[b], strict=True)]
            mean = float(np.mean(np.concatenate(series)))
            better, worse, sign = (a, b, 1.0) if mean >= 0 else (b, a, -1.0)
            means = sign * resampled_means(series, draws, seed)
            size = abs(mean)
            p = (1 + int(np.sum(np.abs(means - size) >= size))) / (draws + 1)
            low, high = np.quantile(means, [0.025, 0.975])
            found.append((p, Pair(better, worse, size, (float(low), float(high)), p)))
    order = sorted(range(len(found)), key=lambda k: found[k][0])
    adjusted, least = [0.0] * len(found), 0.0
    for rank, k in enumerate(order):
        least = max(least, min(1.0, (len(found) - rank) * found[k][0]))
        adjusted[k] = least
    return tuple(Pair(pair.better, pair.worse, pair.difference, pair.interval, p)
                 for (_, pair), p in zip(found, adjusted, strict=True))
