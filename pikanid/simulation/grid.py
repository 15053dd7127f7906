"""The stops of a simulation: every input switch and every observation is met exactly.

Between two stops each input is a straight line, so that a fixed-step method keeps its order; an
adaptive solver over the whole interval would step over short pulses without noticing them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pikanid.problem import Experiment
from pikanid.simulation.support import Seen


@dataclass(frozen=True)
class Grid:
    """Stops T (L,), inputs at the start of each interval U (L-1, m) and their slopes V (L-1, m).

    `jumps` (L-1,) marks intervals that begin with a jump of an input; `seen` lists the
    observations of each stop; `rows` is their number.
    """

    T: np.ndarray
    U: np.ndarray
    V: np.ndarray
    jumps: np.ndarray
    seen: Seen
    rows: int

    def pieces(self, longest: float) -> np.ndarray:
        """Sub-steps of each interval (L-1,) so that none is longer than `longest` [s]."""
        counts = np.ceil(np.diff(self.T) / longest - 1e-9)
        return np.maximum(counts, 1).astype(np.int64)


def build_grid(experiment: Experiment, delay_in: np.ndarray, delay_out: np.ndarray) -> Grid:
    """Lay out the stops of one experiment for given input and output delays [s].

    Observations are numbered output by output, in the order of `experiment.samples`.  A delayed
    output shows the initial state until t0 + delay.
    """
    t0 = experiment.t0
    wanted = [np.maximum(s.t - delay_out[s.output], t0) for s in experiment.samples]
    end = max([experiment.t1 if not wanted else t0, *(w[-1] for w in wanted if len(w))])
    pairs = list(zip(experiment.held, delay_in, strict=True))
    breaks = [b[(b > t0) & (b < end)] for b in (h.switches + d for h, d in pairs)]
    T = _merge(np.concatenate([[t0, end], *breaks, *wanted]), 1e-11 * max(end - t0, 1e-300))
    if len(T) < 2:
        T = np.array([t0, t0 + 1e-9])
    middle = 0.5 * (T[1:] + T[:-1])
    V = _columns([h.slope(middle, d) for h, d in pairs], len(middle))
    U = _columns([h.at(middle, d) for h, d in pairs], len(middle)) - V * (middle - T[:-1])[:, None]
    ends = U + V * np.diff(T)[:, None]
    jumps = np.ones(len(middle), bool)
    scale = np.maximum(np.abs(U).max(axis=0, initial=0.0), 1e-300)
    jumps[1:] = np.any(np.abs(U[1:] - ends[:-1]) > 1e-9 * scale, axis=1)
    return Grid(T, U, V, jumps, _seen(T, experiment, wanted), sum(map(len, wanted)))


def _columns(columns: list[np.ndarray], count: int) -> np.ndarray:
    return np.stack(columns, axis=1) if columns else np.zeros((count, 0))


def _merge(times: np.ndarray, gap: float) -> np.ndarray:
    """Sorted times; those closer than `gap`, which differ by rounding only, become one."""
    times = np.sort(times)
    return times[np.concatenate([[True], np.diff(times) > gap])]


def _seen(T: np.ndarray, experiment: Experiment, wanted: list[np.ndarray]) -> Seen:
    outputs = [np.full(len(w), s.output) for s, w in zip(experiment.samples, wanted, strict=True)]
    times = np.concatenate([np.empty(0), *wanted])
    stop = np.clip(np.searchsorted(T, times), 1, len(T) - 1)
    stop -= (times - T[stop - 1]) < (T[stop] - times)
    order = np.argsort(stop, kind="stable")
    first = np.searchsorted(stop[order], np.arange(len(T) + 1))
    output = np.concatenate([np.empty(0, np.int64), *outputs]).astype(np.int64)
    return Seen(first.astype(np.int64), output[order], order.astype(np.int64),
                times[order] > experiment.t0)
