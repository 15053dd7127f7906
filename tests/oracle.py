"""An independent, event-exact reference simulator: segments, DOP853 at 1e-11, no shared code.

A reference system is written by hand, next to the model that it checks: a right-hand side
``rhs(t, x, u, s)`` that is smooth while the signs ``s`` stay as they are, and one guard
``g(t, x, u)`` a sign.  The integrator is restarted at every input sample and at every zero of a
guard; where both sides push towards a guard's surface the sign takes the value in (-1, 1) that
keeps the state on it (Filippov's convention, which for dry friction is stiction).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

ON_SURFACE = 1e-9  # distance of a guard below which its sign follows from the flow, not its value
REST = 1e-14  # a guard that rests on its surface has not crossed it
Rhs = Callable[[float, np.ndarray, np.ndarray, np.ndarray], Sequence[float]]
Guard = Callable[[float, np.ndarray, np.ndarray], float]


@dataclass(frozen=True)
class Signal:
    """A sampled input, held ("zero") or joined by lines ("first"), `delay` seconds late."""

    times: np.ndarray
    values: np.ndarray
    hold: str = "zero"
    delay: float = 0.0

    def knots(self) -> np.ndarray:
        return self.times + self.delay

    def line(self, a: float, b: float) -> tuple[float, float]:
        """Value at a and slope on the interval (a, b), which holds no sample inside."""
        middle = 0.5 * (a + b) - self.delay
        k = int(np.searchsorted(self.times, middle, side="right")) - 1
        if k < 0:
            return float(self.values[0]), 0.0
        if self.hold == "zero" or k >= len(self.times) - 1:
            return float(self.values[k]), 0.0
        slope = (self.values[k + 1] - self.values[k]) / (self.times[k + 1] - self.times[k])
        return float(self.values[k] + slope * (a - self.delay - self.times[k])), float(slope)

    def at(self, t: float) -> float:
        """Right-continuous value."""
        if self.hold == "first":
            return float(np.interp(t - self.delay, self.times, self.values))
        k = int(np.searchsorted(self.times, t - self.delay + 1e-12, side="right")) - 1
        return float(self.values[max(k, 0)])


@dataclass(frozen=True)
class Path:
    """States (N, n), inputs (N, m) and signs (N, k) at the asked times."""

    x: np.ndarray
    u: np.ndarray
    s: np.ndarray


@dataclass
class _Segment:
    """The flow between two breaks, where every input is a line."""

    rhs: Rhs
    guards: Sequence[Guard]
    start: float
    value: np.ndarray
    slope: np.ndarray

    def u(self, t: float) -> np.ndarray:
        return self.value + self.slope * (t - self.start)

    def rate(self, k: int, t: float, x: np.ndarray, s: np.ndarray) -> float:
        """dg_k/dt along the flow, by a central difference (exact for guards linear in x)."""
        f, h = np.asarray(self.rhs(t, x, self.u(t), s), float), 1e-6
        ahead = self.guards[k](t + h, x + h * f, self.u(t + h))
        return (ahead - self.guards[k](t - h, x - h * f, self.u(t - h))) / (2 * h)

    def signs(self, mode: np.ndarray, t: float, x: np.ndarray) -> np.ndarray:
        """The signs of a mode; those of sliding guards solve dg/dt = 0, which is linear in them."""
        held = np.flatnonzero(mode == 0)
        s = mode.astype(float)
        if not len(held):
            return s
        base = np.array([self.rate(k, t, x, s) for k in held])
        gain = np.empty((len(held), len(held)))
        for j, k in enumerate(held):
            pushed = s.copy()
            pushed[k] = 1.0
            gain[:, j] = [self.rate(i, t, x, pushed) for i in held] - base
        s[held] = np.linalg.lstsq(gain, -base, rcond=None)[0]
        return s

    def side(self, k: int, mode: np.ndarray, t: float, x: np.ndarray, before: float) -> float:
        """The mode of a guard whose surface the state is on."""
        rates = []
        for trial in (-1.0, 1.0):
            other = mode.copy()
            other[k] = trial
            rates.append(self.rate(k, t, x, self.signs(other, t, x)))
        below, above = rates
        if above < 0 < below:
            return 0.0
        if abs(above) < 1e-10 and abs(below) < 1e-10:
            return before
        return 1.0 if above + below > 0 else -1.0


def simulate(rhs: Rhs, x0: Sequence[float], times: np.ndarray, signals: Sequence[Signal] = (),
             guards: Sequence[Guard] = (), t0: float | None = None,
             breaks: Sequence[float] = (), max_step: float = 0.02) -> Path:
    """Integrate from t0 (default: the first of `times`) and return what is seen at `times` (N,).

    Times before t0 show the start.  `breaks` are further instants at which to restart; `max_step`
    bounds the steps between which guards are looked at.
    """
    times = np.asarray(times, float)
    t0 = float(times[0]) if t0 is None else t0
    end = float(max(times.max(), t0))
    x, mode = np.array(x0, float), np.ones(len(guards))
    knots = np.concatenate([[t0, end], np.asarray(breaks, float), *(q.knots() for q in signals)])
    knots = np.unique(knots[(knots >= t0) & (knots <= end)])
    knots = knots[np.concatenate([[True], np.diff(knots) > 1e-12])]
    shape = len(times)
    out = Path(np.empty((shape, len(x))), np.empty((shape, len(signals))),
               np.empty((shape, len(guards))))

    def show(rows: np.ndarray, segment: _Segment, states: np.ndarray, mode: np.ndarray) -> None:
        for i, state in zip(rows, states, strict=True):
            t = max(times[i], t0)
            out.x[i], out.s[i] = state, segment.signs(mode, t, state)
            out.u[i] = [q.at(t) for q in signals]

    for a, b in itertools.pairwise(knots):
        lines = np.array([q.line(a, b) for q in signals]).reshape(-1, 2)
        segment = _Segment(rhs, guards, a, lines[:, 0], lines[:, 1])
        for _ in range(2):  # twice: surfaces may lean on each other
            for k, g in enumerate(guards):
                distance = g(a, x, segment.u(a))
                mode[k] = (np.sign(distance) if abs(distance) > ON_SURFACE
                           else segment.side(k, mode, a, x, mode[k]))
        if a == t0:
            show(np.flatnonzero(times <= t0), segment, [x] * int((times <= t0).sum()), mode)
        t = a
        while t < b:
            present = mode.copy()
            rows = np.flatnonzero((times > t) & (times <= b))
            solution = solve_ivp(
                lambda t, y, f=segment, m=present: f.rhs(t, y, f.u(t), f.signs(m, t, y)),
                (t, b), x, "DOP853", events=_ends(segment, present), dense_output=len(rows) > 0,
                rtol=1e-11, atol=1e-13, max_step=max_step)
            assert solution.success, solution.message
            t, x = solution.t[-1], solution.y[:, -1]
            rows = rows[times[rows] <= t]
            if len(rows):
                show(rows, segment, solution.sol(times[rows]).T, present)
            if solution.status == 1:
                k = next(i for i, found in enumerate(solution.t_events) if len(found))
                if present[k] == 0:
                    mode[k] = np.sign(segment.signs(present, t, x)[k])
                else:
                    mode[k] = segment.side(k, present, t, x, -present[k])
    return out


def _ends(segment: _Segment, mode: np.ndarray) -> list[Callable[[float, np.ndarray], float]]:
    """One terminal event a guard: it changes sign, or can no longer hold the state."""
    ends = []
    for k, side in enumerate(mode):
        if side == 0:
            def end(t: float, y: np.ndarray, k: int = k) -> float:
                return 1 - abs(segment.signs(mode, t, y)[k])
        else:
            def end(t: float, y: np.ndarray, k: int = k, side: float = side) -> float:
                return side * segment.guards[k](t, y, segment.u(t)) + REST
        end.terminal, end.direction = True, -1.0
        ends.append(end)
    return ends


def derivative(function: Callable[[float], np.ndarray], at: float, step: float) -> np.ndarray:
    """df/dp by the four-point central difference: error of order step**4."""
    near = function(at + step) - function(at - step)
    far = function(at + 2 * step) - function(at - 2 * step)
    return (8 * near - far) / (12 * step)
