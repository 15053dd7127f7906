"""Inputs as functions of time: samples, what happens between them, and play behind them."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import numpy as np

Side = Literal["left", "right"]
PIECES = 4  # numerical: straight ones between two samples of a smooth input


@dataclass(frozen=True)
class HeldInput:
    """An input as a function of time: samples (N,) and what happens between them."""

    name: str
    time: np.ndarray
    values: np.ndarray
    hold: Literal["zero", "first"]

    def at(self, t: np.ndarray, delay: float = 0.0, side: Side = "right") -> np.ndarray:
        """Values at times t (M,), `delay` seconds late; outside the record its end values."""
        if len(self.time) == 1:
            return np.full(len(t), self.values[0])
        shifted = np.asarray(t, float) - delay
        if self.hold == "first":
            return np.interp(shifted, self.time, self.values)
        # a sample time met up to rounding belongs to the interval that starts there
        slack = 1e-9 * self._spacing
        probe = shifted + (slack if side == "right" else -slack)
        knots, values = self._levels
        index = np.searchsorted(knots, probe, side="right") - 1
        return values[np.maximum(index, 0)]  # never beyond the last one

    def slope(self, t: np.ndarray, delay: float = 0.0) -> np.ndarray:
        """du/dt inside the intervals that hold the times t."""
        if self.flat:
            return np.zeros(len(t))
        index = np.searchsorted(self.time, np.asarray(t) - delay, side="right") - 1
        inside = (index >= 0) & (index < len(self.time) - 1)
        index = np.clip(index, 0, len(self.time) - 2)
        slopes = np.diff(self.values) / np.diff(self.time)
        return np.where(inside, slopes[index], 0.0)

    @functools.cached_property
    def _levels(self) -> tuple[np.ndarray, np.ndarray]:
        """When a held value is first met (K,), and the values: often few, and found the sooner."""
        new = np.ones(len(self.time), bool)
        np.not_equal(self.values[1:], self.values[:-1], out=new[1:])
        return self.time[new], self.values[new]

    @functools.cached_property
    def switches(self) -> np.ndarray:
        """Times at which the value (zero-order hold) or the slope (first-order) changes."""
        if len(self.time) < 2:
            return np.empty(0)
        if self.hold == "zero":
            return self._levels[0][1:]
        slopes = np.concatenate([[0.0], np.diff(self.values) / np.diff(self.time), [0.0]])
        change = np.abs(np.diff(slopes)) > 1e-9 * np.max(np.abs(slopes), initial=0.0)
        return self.time[change]

    @property
    def lines(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Knots (K,), values and slopes right of each; how far before a knot counts as at it."""
        slopes = np.zeros(len(self.time))
        if self.flat:
            return self.time, self.values, slopes, 1e-9 * self._spacing
        slopes[:-1] = np.diff(self.values) / np.diff(self.time)
        return self.time, self.values, slopes, 0.0

    @property
    def flat(self) -> bool:
        """Whether it stands still between its switches."""
        return self.hold == "zero" or len(self.time) < 2

    @functools.cached_property
    def _spacing(self) -> float:
        return float((self.time[1:] - self.time[:-1]).min()) if len(self.time) > 1 else 1.0


def held_input(name: str, time: np.ndarray, values: np.ndarray,
               hold: Literal["zero", "first", "cubic"]) -> HeldInput:
    """An input from samples (N,), whatever happens between them.

    The cubic spline of a `hold` "cubic" runs in `PIECES` straight pieces between two samples: they
    are off it by at most h²/(8·PIECES²)·max|u''| (C. de Boor, A Practical Guide to Splines, 2001,
    ch. III), a sixteenth of what straight lines between the samples are.

    >>> t = np.arange(4.0)
    >>> smooth = held_input("u", t, t**2, "cubic")
    >>> smooth.at(np.array([0.5, 1.5])).round(9).tolist()
    [0.25, 2.25]
    """
    if hold != "cubic" or len(time) < 2:
        return HeldInput(name, time, values, "zero" if hold == "cubic" else hold)
    from scipy.interpolate import CubicSpline

    steps = np.diff(time)[:, None] * np.arange(PIECES) / PIECES
    fine = np.append((time[:-1, None] + steps).ravel(), time[-1])
    return HeldInput(name, fine, CubicSpline(time, values)(fine), "first")


@dataclass(frozen=True)
class PiecewiseInput:
    """Straight pieces: from each knot (K,) on, a value and a slope; before the first, its value."""

    knots: np.ndarray
    values: np.ndarray
    slopes: np.ndarray
    flat: ClassVar[bool] = False

    def at(self, t: np.ndarray, delay: float = 0.0, side: Side = "right") -> np.ndarray:
        """Values at times t (M,), `delay` seconds late."""
        shifted = np.asarray(t, float) - delay
        k = self._piece(shifted, side)
        return self.values[k] + self.slopes[k] * np.maximum(shifted - self.knots[k], 0.0)

    def slope(self, t: np.ndarray, delay: float = 0.0) -> np.ndarray:
        """Slopes inside the pieces that hold the times t (M,)."""
        shifted = np.asarray(t, float) - delay
        return np.where(shifted < self.knots[0], 0.0, self.slopes[self._piece(shifted, "right")])

    @property
    def lines(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Knots (K,), values and slopes right of each; how far before a knot counts as at it."""
        slack = 1e-9 * (float(self.knots[-1] - self.knots[0]) / max(len(self.knots), 1))
        return self.knots, self.values, self.slopes, slack

    def _piece(self, t: np.ndarray, side: Side) -> np.ndarray:
        slack = self.lines[3]
        probe = t + (slack if side == "right" else -slack)
        return np.maximum(np.searchsorted(self.knots, probe, side="right") - 1, 0)

    @functools.cached_property
    def switches(self) -> np.ndarray:
        """Knots (K-1,) behind the first at which the value jumps or the slope changes."""
        ends = self.values[:-1] + self.slopes[:-1] * np.diff(self.knots)
        return self.knots[1:][(ends != self.values[1:]) | (self.slopes[:-1] != self.slopes[1:])]


class Acting(NamedTuple):
    """Of v = carrier + side·half + start·open·half + ramp·rate + past·before the signals; they are
    its derivatives as well: ∂v/∂half = side + start·open, ∂v/∂start = half·open, ∂v/∂rate = ramp,
    ∂v/∂before = past.
    """

    carrier: PiecewiseInput
    side: PiecewiseInput
    open: PiecewiseInput
    ramp: PiecewiseInput
    past: PiecewiseInput

    def parts(self, half: float, rate: float = np.inf, start: float = np.nan,
              before: float = np.nan) -> list[tuple[PiecewiseInput, float]]:
        """The signals, each with what it is multiplied by in v."""
        return [(self.carrier, 1.0), (self.side, half),
                (self.open, half * start if np.isfinite(start) else 0.0),
                (self.ramp, rate if np.isfinite(rate) else 0.0),
                (self.past, before if np.isfinite(before) else 0.0)]


def acting(held: HeldInput, half: float | None = None, rate: float = np.inf,
           start: float = np.nan, remembers: bool = False) -> Acting:
    """What follows an input u through a play of ±half, and no faster than `rate` per second.

    Behind the play v stays until u has crossed it and then follows u ∓ half (M. A. Krasnosel'skii
    and A. V. Pokrovskii, Systems with Hysteresis, 1989, sec. 2).  It begins at u + start·half, or,
    without a start, is 0 before the record begins.  The limit on the rate comes after the play and
    begins at its first value; without it `side` is -1 where u pushes upwards or did so last, +1
    downwards, 0 before the first contact, until which `open` is 1 where there is a start.  Before
    the record begins, its first value acts, or, where it `remembers` another one, `past` is 1 and
    everything else 0.

    >>> u = HeldInput("u", np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.9]), "zero")
    >>> carrier, side, *_ = acting(u, 0.25)
    >>> (carrier.values + 0.25 * side.values).tolist(), side.values.tolist()
    ([0.0, 0.75, 0.75], [0.0, -1.0, -1.0])
    >>> acting(u, 0.25, start=-0.5).open.values.tolist()
    [1.0, 0.0, 0.0]
    >>> carrier, _, _, ramp, _ = acting(u, rate=2.0)
    >>> t = np.array([1.0, 1.25, 1.75])
    >>> (carrier.at(t) + 2.0 * ramp.at(t)).tolist()
    [0.0, 0.5, 1.0]
    >>> carrier, *_, past = acting(u, remembers=True)
    >>> [part.at(np.array([-0.5, 1.5])).tolist() for part in (carrier, past)]
    [[0.0, 1.0], [1.0, 0.0]]
    """
    from pikanid.problem.backlash import limited, play

    u = np.asarray(held.values, float)
    slopes = np.zeros(len(u))
    if held.hold == "first" and len(u) > 1:
        slopes[:-1] = np.diff(u) / np.diff(held.time)
    knots, carrier, rates, side = np.asarray(held.time, float), u, slopes, np.zeros(len(u))
    ramp = ramp_rates = untouched = moves = shifts = np.zeros(len(u))
    begins = float(np.clip(start, -1.0, 1.0))
    if half is not None:
        knots, carrier, rates, side, untouched, moves, shifts = play(
            knots, carrier, rates, float(half), begins)
        ramp = ramp_rates = np.zeros(len(knots))
    if np.isfinite(rate):
        knots, carrier, rates, side, ramp, ramp_rates, untouched = limited(
            knots, carrier, rates, side, untouched, moves, shifts, float(half or 0.0), float(rate))
    if np.isfinite(begins):
        side = side - begins * untouched
    still = np.zeros(len(knots))
    found = [(carrier, rates), (side, still), (untouched, still), (ramp, ramp_rates),
             (still, still)]
    if remembers:
        knots = np.append(knots[0] - 1.0, knots)
        found = [(np.append(float(k == len(found) - 1), values), np.append(0.0, slopes))
                 for k, (values, slopes) in enumerate(found)]
    return Acting._make(PiecewiseInput(knots, *part) for part in found)
