"""The best linear model of the same data: ARX, its order by BIC, simulated freely.

    y_t = c + Σ_{i=1..p} a_i y_{t-i} + Σ_u Σ_{i=0..p} b_{u,i} u_{t-i}

Each output has its own, with all inputs; coefficients by least squares of the equation error
(L. Ljung, System Identification, 2nd ed. 1999, sec. 4.2).  What is compared is a simulation, so
the order is the one whose *simulation* of the training recordings has the least
N ln(RSS/N) + k ln N: the equation error of densely sampled data says little about that.  Where
predictions K samples ahead are compared, it is these.  A simulation starts from the p outputs
before its first sample that suit its first samples best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

HIGHEST = 20  # limit: orders that are tried
UNEVEN = 0.01  # numerical: of an interval, by which samples may be off an even grid
WILD = 1e3  # numerical: times the largest sample, beyond which a simulation counts as unstable
STARTING = 10  # numerical: samples a coefficient from which a start is fitted, where none are set


@dataclass(frozen=True, eq=False)
class Series:
    """One output and all inputs on an even grid: y (N,), NaN where missing, and u (N, m)."""

    y: np.ndarray
    u: np.ndarray


@dataclass(frozen=True, eq=False)
class ARX:
    """y_t = c + Σ a_i y_{t-i} + Σ b_{i,u} u_{t-i}: a (p,), b (p + 1, m), c.

    `parameters` is the number of coefficients that were estimated.
    """

    a: np.ndarray
    b: np.ndarray
    c: float

    @property
    def order(self) -> int:
        """p."""
        return len(self.a)

    @property
    def parameters(self) -> int:
        """Number of estimated coefficients."""
        return self.a.size + self.b.size + 1

    def simulate(self, series: Series, first: int = 0) -> np.ndarray:
        """Free simulation (N,); the start suits the first samples (`first` of them, or some times
        as many as there are coefficients) by least squares.

        >>> one = ARX(np.array([0.5]), np.array([[1.0], [0.0]]), 0.0)
        >>> u = np.array([[0.0], [1.0], [0.0], [0.0]])
        >>> one.simulate(Series(np.array([0.0, 1.0, 0.5, 0.25]), u)).round(6).tolist()
        [0.0, 1.0, 0.5, 0.25]
        """
        from scipy.signal import lfilter

        p, N = self.order, len(series.y)
        lags = _lagged(series.u, p)
        drive = self.c + np.einsum("nkm,km->n", lags, self.b)
        poly = np.concatenate([[1.0], -self.a])
        forced = lfilter([1.0], poly, drive)
        if not p:
            return forced
        # the response to each of the p outputs before the first sample
        starts = np.zeros((p, N))
        for j in range(p):
            start = np.zeros(N)
            start[:p - j] = self.a[j:][:N]
            starts[j] = lfilter([1.0], poly, start)
        if not (np.all(np.isfinite(forced)) and np.all(np.isfinite(starts))):
            return np.full(N, np.inf)  # unstable
        there = np.flatnonzero(np.isfinite(series.y))
        there = there[:first or max(STARTING * self.parameters, 1)]
        chosen, *_ = np.linalg.lstsq(starts[:, there].T, (series.y - forced)[there], rcond=1e-9)
        return np.asarray(forced + chosen @ starts)

    def ahead(self, series: Series, horizon: int) -> np.ndarray:
        """k-step-ahead predictions (N,) from measured outputs; NaN where these are missing."""
        p, N = self.order, len(series.y)
        drive = self.c + np.einsum("nkm,km->n", _lagged(series.u, p), self.b)
        found = np.full(N, np.nan)
        if p + horizon > N:
            return found
        # row i: the p latest outputs, newest first, at origin i = p - 1 ... N - 1 - horizon
        origins = np.arange(max(p - 1, 0), N - horizon)
        past = np.stack([series.y[origins - j] for j in range(p)], axis=1) if p else np.empty(
            (len(origins), 0))
        new = np.empty(len(origins))
        for step in range(1, horizon + 1):
            new = drive[origins + step] + past @ self.a
            past = np.concatenate([new[:, None], past[:, :-1]], axis=1) if p else past
        found[origins + horizon] = new
        return found


def _lagged(u: np.ndarray, order: int) -> np.ndarray:
    """(N, order + 1, m): inputs at lags 0 ... order; before the first sample, its value."""
    N = len(u)
    at = np.maximum(np.arange(N)[:, None] - np.arange(order + 1)[None, :], 0)
    return u[at]


def fitted(training: Sequence[Series], order: int) -> ARX:
    """The ARX model of that order, by least squares over all rows whose samples are there."""
    rows, targets = [], []
    for s in training:
        lags = _lagged(s.u, order)
        past = np.stack([np.concatenate([np.full(j, np.nan), s.y[:len(s.y) - j]])
                         for j in range(1, order + 1)], axis=1) if order else np.empty(
                             (len(s.y), 0))
        X = np.concatenate([past, lags.reshape(len(s.y), -1), np.ones((len(s.y), 1))], axis=1)
        good = np.isfinite(X).all(axis=1) & np.isfinite(s.y)
        rows.append(X[good])
        targets.append(s.y[good])
    X, y = np.concatenate(rows), np.concatenate(targets)
    size = np.linalg.norm(X, axis=0)
    size[size == 0] = 1.0
    theta = np.linalg.lstsq(X / size, y, rcond=1e-12)[0] / size
    m = training[0].u.shape[1]
    return ARX(theta[:order], theta[order:-1].reshape(order + 1, m), float(theta[-1]))


def best_arx(training: Sequence[Series], first: int = 0, horizon: int | None = None,
             highest: int = HIGHEST) -> ARX | None:
    """The ARX model with the least BIC of its simulation, or of its predictions so far ahead,
    among orders 0 to `highest`; None where no simulation is stable.

    >>> rng = np.random.default_rng(0)
    >>> u, y = rng.standard_normal((400, 1)), np.zeros(400)
    >>> for t in range(2, 400): y[t] = 1.2*y[t-1] - 0.5*y[t-2] + u[t-1, 0]
    >>> best_arx([Series(y + 0.01 * rng.standard_normal(400), u)]).order
    2
    """
    n = sum(int(np.isfinite(s.y).sum()) for s in training)
    best: tuple[float, ARX] | None = None
    for order in range(min(highest, (first or highest)) + 1):
        if n <= 2 * (order + (order + 1) * training[0].u.shape[1] + 1):
            break
        model = fitted(training, order)
        errors = np.concatenate([_errors(model, s, first, horizon, highest) for s in training])
        if len(errors) and np.all(np.isfinite(errors)):
            with np.errstate(divide="ignore"):
                bic = (len(errors) * float(np.log(np.mean(errors**2)))
                       + model.parameters * float(np.log(len(errors))))
            if best is None or bic < best[0]:
                best = bic, model
    return None if best is None else best[1]


def _errors(model: ARX, s: Series, first: int, horizon: int | None, highest: int) -> np.ndarray:
    """Errors of all samples that every order predicts; infinite where the model runs away."""
    if horizon is None:
        y, there = model.simulate(s, first), np.isfinite(s.y)
    else:
        y = model.ahead(s, horizon)
        there = np.isfinite(s.y) & np.isfinite(y)
        there[:highest + horizon] = False
    limit = WILD * np.max(np.abs(s.y[there]), initial=1e-300)
    error = s.y[there] - y[there]
    return np.where(np.abs(y[there]) < limit, error, np.inf)


def even_grid(t: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Places (N,) of times on an even grid, and its interval [s]; None where they are on none.

    >>> even_grid(np.array([0.0, 0.1, 0.3]))[0].tolist()
    [0, 1, 3]
    """
    if len(t) < 3:
        return None
    interval = float(np.quantile(np.diff(t), 0.5, method="lower"))
    places = np.rint((t - t[0]) / interval).astype(int)
    # of a long recording the median is off by more than its rounding: the whole span says it better
    interval = float((t[-1] - t[0]) / places[-1])
    places = np.rint((t - t[0]) / interval).astype(int)
    off = np.max(np.abs((t - t[0]) / interval - places))
    return (places, interval) if off < UNEVEN and np.all(np.diff(places) > 0) else None
