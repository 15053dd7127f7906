"""What the recorded inputs' past explains of a signal beyond what its own past does.

A rig that is as fast as its sampling answers a step of its input between two samples.  What follows
the inputs like that is no noise, and no gross error, whatever the model says.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import fdtrc

from pikanid.noise.autoregressive import fit, innovations
from pikanid.noise.level import NORMAL
from pikanid.noise.neighbours import LONGEST, neighbour_weights
from pikanid.noise.projection import orthonormal
from pikanid.problem.held import HeldInput

CLIPPED = 3.0  # numerical: standard deviations beyond which a deviation counts as so much only
SMOOTH = 0.01  # numerical: of an input's spread: gaps below say nothing that a misfit could not
LEAST = 5  # definition: samples of a neighbourhood
ALIKE = 1.2  # numerical: times the shortest one that neighbourhoods last on an even grid
UNEVEN = 0.1  # numerical: share of them that last longer, where samples are lost now and then
ROUNDS = 10  # numerical: of a fit that gross errors must not lead
RESTS = 0.2  # numerical: share of samples at which an input that stands still at most may change
ROWS = 10  # numerical: samples a column from which on those are told from noise


def explained(t: np.ndarray, y: np.ndarray, inputs: Sequence[HeldInput], lags: int, chance: float
              ) -> np.ndarray:
    """The part (N,) of a signal y (N,) that is a weighted sum of the inputs some samples ago, less
    its mean; zeros where they tell no more of the next sample than its own past does (C. W. J.
    Granger, Econometrica 37, 1969).

    The weights are those that explain best how samples leave the cubic through their neighbours:
    slow parts of the signal, whatever they are, do not lead them away.  Inputs that hardly leave
    it themselves have none: noise would make them huge.

    Args:
        t: (N,) [s].
        y: (N,) there.
        inputs: As recorded.
        lags: Intervals up to which the past reaches.
        chance: That noise alone is explained as well.

    >>> t = np.arange(300.0)
    >>> u = np.repeat(np.random.default_rng(0).normal(size=30), 10)
    >>> y = 2 * np.concatenate([[u[0]], u[:-1]])
    >>> part = explained(t, y, [HeldInput("u", t, u, "zero")], 5, 1e-6)
    >>> bool(np.ptp(part - y) < 1e-9)
    True
    """
    nothing = np.zeros(len(y))
    if len(y) < LEAST:
        return nothing
    weights, lengths = neighbour_weights(t)
    X, moves = _past(t, inputs, lags, bool(np.mean(lengths > ALIKE * lengths.min()) > UNEVEN))
    if not X.shape[1] or len(y) < ROWS * X.shape[1]:
        return nothing
    own = fit(y - y.mean())
    seen = np.stack([innovations(x, own) for x in (X - X.mean(axis=0)).T], axis=1)
    _, p_value = _robust(innovations(y - y.mean(), own), seen)
    if not p_value < chance:
        return nothing
    weights /= np.sqrt(np.sum(weights**2, axis=1))[:, None]
    weights[lengths > LONGEST * np.median(lengths)] = 0.0  # across a gap a motion does anything
    gaps, gap = (np.einsum("nw,n...w->n...", weights, np.lib.stride_tricks.sliding_window_view(
        values, 5, axis=0)) for values in (X, y))
    sharp = gaps.std(axis=0) > SMOOTH * moves
    said, _ = _robust(gap, gaps[:, sharp])
    sizes = np.linalg.lstsq(gaps[:, sharp], said, rcond=None)[0]
    part = np.asarray((X - X.mean(axis=0))[:, sharp] @ sizes)
    # an input that a controller drives knows the noise of earlier samples, which is no motion
    if not all(rests(u) for u in inputs) and np.std(np.diff(part)) > np.std(np.diff(y)):
        return nothing
    return part


def _robust(wanted: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, float]:
    """What columns (N, k) explain of rows (N,), and how likely they do of white noise by chance;
    gross errors count little (P. J. Huber, Ann. Math. Stat. 35, 1964).
    """
    q = orthonormal(columns)
    said, most = q @ (q.T @ wanted), np.inf
    for _ in range(ROUNDS):
        rest = np.abs(wanted - said)
        most = CLIPPED * float(np.median(rest)) / NORMAL
        root = np.sqrt(most / np.maximum(rest, max(most, 1e-300)))
        said = q @ np.linalg.lstsq(root[:, None] * q, root * wanted, rcond=None)[0]
    k, freedom = q.shape[1], len(wanted) - q.shape[1] - 1
    left = max(float(np.sum(np.minimum(np.abs(wanted - said), most) ** 2)), 1e-300)
    return said, float(fdtrc(k, freedom, float(said @ said) / k * freedom / left)) if k else 1.0


def _past(t: np.ndarray, inputs: Sequence[HeldInput], lags: int, uneven: bool
          ) -> tuple[np.ndarray, np.ndarray]:
    """Columns (N, k), and how far each moves in an interval (k,): every input that moves, one
    interval ago and more; between `uneven` samples its integral as well, which has the corners of
    a slow rig where they are.  Between even ones the past has them, and the two would be alike.

    At the same instant an input may know the output's noise, where a controller drives it; one that
    stands still at most samples does not, and an output may follow it at once.
    """
    step = float(np.median(np.diff(t)))
    columns, moves = [np.empty((len(t), 0))], [np.empty(0)]
    for u in (u for u in inputs if np.all(np.isfinite(u.values)) and np.ptp(u.values) > 0):
        own = np.stack([u.at(t, k * step) for k in range(not rests(u), lags + 1)], axis=1)
        own = own[:, np.ptp(own, axis=0) > 0]
        columns.append(own)
        moves.append(own.std(axis=0))
        if uneven:
            columns.append(_integral(u, t)[:, None])
            moves.append(np.array([step * float(np.std(u.values))]))
    return np.concatenate(columns, axis=1), np.concatenate(moves)


def rests(u: HeldInput) -> bool:
    """Whether an input stands still at most samples, as one that a controller drives does not.

    >>> t = np.arange(4.0)
    >>> rests(HeldInput("u", t, np.sin(t), "zero")), rests(HeldInput("u", t, np.ones(4), "zero"))
    (False, True)
    """
    return bool(np.sum(np.diff(u.values) != 0.0) < RESTS * max(len(u.values) - 1, 1))


def _integral(u: HeldInput, t: np.ndarray) -> np.ndarray:
    """(N,) from the first of the times t (N,)."""
    every = np.union1d(t, u.time[(u.time > t[0]) & (u.time < t[-1])])
    middle = 0.5 * (every[1:] + every[:-1])
    whole = np.concatenate([[0.0], np.cumsum(u.at(middle) * np.diff(every))])
    return np.asarray(whole[np.searchsorted(every, t)])
