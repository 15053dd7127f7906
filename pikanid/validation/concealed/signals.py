"""Piecewise-linear signals and what happens to them on the way, without any approximation.

A recorded input that is held between samples is piecewise linear, and limits, dead zones, slew
rates, play and delays keep it so: each operation below returns its result with exact knots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pikanid.validation.concealed.arrays import Array


@dataclass(frozen=True, eq=False)
class Signal:
    """Straight pieces: value and slope from each knot to the next, the last one for ever.

    Attributes:
        knots: (K,) rising times [s].
        values: (K,) at the knots, from the right.
        slopes: (K,) per second.
    """

    knots: Array
    values: Array
    slopes: Array

    def at(self, t: Array) -> Array:
        """Values at times (M,), from the right; before the first knot, its value."""
        k = np.maximum(np.searchsorted(self.knots, t, side="right") - 1, 0)
        return self.values[k] + self.slopes[k] * np.maximum(t - self.knots[k], 0.0)

    def scaled(self, factor: float) -> Signal:
        """factor · u(t)."""
        return Signal(self.knots, factor * self.values, factor * self.slopes)

    def delayed(self, seconds: float) -> Signal:
        """u(t - seconds), at rest before.

        >>> late = zero_order(np.array([0.0, 1.0]), np.array([2.0, 3.0])).delayed(0.25)
        >>> late.at(np.array([0.0, 0.5, 1.2, 1.3])).tolist()
        [0.0, 2.0, 2.0, 3.0]
        """
        if seconds == 0.0:
            return self
        start = self.knots[0]
        return Signal(np.r_[start, self.knots + seconds], np.r_[0.0, self.values],
                      np.r_[0.0, self.slopes])


def zero_order(t: Array, u: Array) -> Signal:
    """Each sample holds until the next."""
    return _merged(t, u, np.zeros(len(u)))


def first_order(t: Array, u: Array) -> Signal:
    """Straight lines from sample to sample."""
    return _merged(t, u, np.r_[np.diff(u) / np.diff(t), 0.0])


def clipped(u: Signal, low: float, high: float) -> Signal:
    """Limited to [low, high]."""
    cut = _cut_at(u, (low, high))
    middle = _middles(cut)
    inside = (middle > low) & (middle < high)
    return Signal(cut.knots, np.clip(cut.values, low, high), np.where(inside, cut.slopes, 0.0))


def dead_zone(u: Signal, width: float) -> Signal:
    """0 up to |u| = width, beyond it u less the width.

    >>> dead_zone(zero_order(np.array([0.0, 1.0]), np.array([0.1, -0.5])), 0.2).values.tolist()
    [0.0, -0.3]
    """
    cut, lost = _cut_at(u, (-width, width)), clipped(u, -width, width)
    return Signal(cut.knots, cut.values - lost.values, cut.slopes - lost.slopes)


def slewed(u: Signal, rate: float) -> Signal:
    """Follows u no faster than `rate` per second.

    >>> slewed(zero_order(np.array([0.0, 1.0]), np.array([0.0, 2.0])), 4.0).knots.tolist()
    [0.0, 1.0, 1.5]
    """
    y, out = float(u.values[0]), []
    for start, stop, value, slope in _pieces(u):
        t = start
        gap = value - y
        if gap != 0.0 or abs(slope) > rate:
            way = np.sign(gap) if gap != 0.0 else np.sign(slope)
            closing = rate - way * slope  # how fast |gap| shrinks
            needed = abs(gap) / closing if closing > 0.0 else np.inf
            out.append((t, y, way * rate))
            if t + needed >= stop:
                y += way * rate * (stop - t)
                continue
            t += needed
            y = value + slope * needed
        if abs(slope) > rate:
            out.append((t, y, float(np.sign(slope)) * rate))
            y += float(np.sign(slope)) * rate * (stop - t)
        else:
            out.append((t, y, slope))
            y += slope * (stop - t)
    return _signal(out)


def played(u: Signal, half: float) -> Signal:
    """Backlash: y stays until u has crossed the play, and then follows u ∓ half.

    >>> steps = zero_order(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.9]))
    >>> played(steps, 0.25).at(np.array([0.5, 1.5, 2.5])).tolist()
    [0.0, 0.75, 0.75]
    """
    y, out = 0.0, []
    for start, stop, value, slope in _pieces(u):
        y = min(max(y, value - half), value + half)
        edge = y + half if slope > 0.0 else y - half
        touch = start + (edge - value) / slope if slope != 0.0 else np.inf
        out.append((start, y, 0.0) if touch > start else (start, y, slope))
        if start < touch < stop:
            out.append((touch, y, slope))
        if touch < stop:
            y += slope * (stop - max(touch, start))
    return _signal(out)


def _merged(t: Array, values: Array, slopes: Array) -> Signal:
    """Without the knots at which nothing changes, so that long holds are one piece."""
    before = values[:-1] + slopes[:-1] * np.diff(t)
    changes = np.r_[True, (before != values[1:]) | (slopes[:-1] != slopes[1:])]
    return Signal(t[changes], values[changes], slopes[changes])


def _pieces(u: Signal) -> list[tuple[float, float, float, float]]:
    ends = np.r_[u.knots[1:], np.inf]
    # The last piece is constant in every recording, so that its end does not matter.
    ends[-1] = u.knots[-1] + 1e3
    return list(zip(u.knots.tolist(), ends.tolist(), u.values.tolist(), u.slopes.tolist(),
                    strict=True))


def _signal(pieces: list[tuple[float, float, float]]) -> Signal:
    knots, values, slopes = np.array(pieces, dtype=float).T
    return Signal(knots, values, slopes)


def _cut_at(u: Signal, levels: tuple[float, ...]) -> Signal:
    """The same signal with a knot wherever it crosses a level."""
    out = []
    for start, stop, value, slope in _pieces(u):
        out.append((start, value, slope))
        if slope == 0.0:
            continue
        crossings = sorted(start + (level - value) / slope for level in levels)
        out += [(t, value + slope * (t - start), slope) for t in crossings if start < t < stop]
    return _signal(out)


def _middles(u: Signal) -> Array:
    ends = np.r_[u.knots[1:], u.knots[-1] + 1.0]
    return u.values + u.slopes * 0.5 * (ends - u.knots)
