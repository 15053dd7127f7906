"""The stops of a simulation: every input switch and every observation is met exactly.

Between two stops each input is a straight line, so that a fixed-step method keeps its order; an
adaptive solver over the whole interval would step over short pulses without noticing them.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pikanid.problem.held import HeldInput, PiecewiseInput
from pikanid.problem.problem import Experiment
from pikanid.simulation.layout import Seen


@dataclass(frozen=True)
class Grid:
    """Stops T (L,), inputs right of each stop U (L, m) and their slopes V (L, m).

    `jumps` (L,) marks stops at which an input jumps or kinks; `seen` lists the observations of
    each stop; `rows` is their number.
    """

    T: np.ndarray
    U: np.ndarray
    V: np.ndarray
    jumps: np.ndarray
    seen: Seen
    rows: int

    @functools.cached_property
    def _gaps(self) -> np.ndarray:
        return self.T[1:] - self.T[:-1]

    @functools.cached_property
    def _even(self) -> float | None:
        """The interval between stops [s] where all are alike up to rounding, else None."""
        shortest, longest = float(self._gaps.min()), float(self._gaps.max())
        return longest if longest - shortest <= 1e-9 * longest else None

    @functools.cached_property
    def spacings(self) -> tuple[float, float]:
        """Median interval between stops [s], and the length of intervals at half of the time.

        Steps as long as a lone gap cannot be judged by halving them: all other intervals would
        be crossed in one step either way.
        """
        if self._even is not None:
            return self._even, self._even
        gaps = np.sort(self._gaps)
        half = np.searchsorted(np.cumsum(gaps), 0.5 * gaps.sum())
        middle = len(gaps) // 2  # they are sorted: np.median would sort them again
        return 0.5 * float(gaps[middle] + gaps[~middle]), float(gaps[min(half, len(gaps) - 1)])

    def pieces(self, longest: float) -> np.ndarray:
        """Sub-steps of each interval (L-1,) so that none is longer than `longest` [s]."""
        if self._even is not None:
            return np.full(len(self._gaps), max(math.ceil(self._even / longest - 1e-9), 1))
        counts = np.ceil(self._gaps / longest - 1e-9)
        return np.maximum(counts, 1).astype(np.int64)


def build_grid(experiment: Experiment, held: Sequence[HeldInput | PiecewiseInput],
               delay_in: np.ndarray, delay_out: Sequence[np.ndarray | float]) -> Grid:
    """Lay out the stops of one experiment for given inputs (m), their delays [s], and those of the
    samples of each output.

    Observations are numbered output by output, in the order of `experiment.samples`.  A delayed
    output shows the initial state until t0 + delay.
    """
    from pikanid.simulation.stops import draw

    t0 = experiment.t0
    wanted = [np.maximum(s.t - late, t0)
              for s, late in zip(experiment.samples, delay_out, strict=True)]
    end = max([experiment.t1 if not wanted else t0, *(w.max() for w in wanted if len(w))])
    pairs = list(zip(held, delay_in, strict=True))
    breaks = [b[(b > t0) & (b < end)]
              for b in (h.switches + d for h, d in pairs if len(h.switches))]
    T, seen = _stops(np.concatenate([[t0, end], *breaks, *wanted]), experiment, wanted)
    # nothing is integrated beyond the last stop, but an output may show the inputs there
    U, V = np.empty((len(T), len(pairs))), np.zeros((len(T), len(pairs)))
    jumps = np.zeros(len(T), bool)
    jumps[0] = True
    for j, (h, d) in enumerate(pairs):
        if h.flat and not len(h.switches):  # one value for ever
            U[:, j] = h.values[0]
        else:
            draw(T, *h.lines, d, j, U, V, jumps)
    return Grid(T, U, V, jumps, seen, len(seen.row))


def _stops(times: np.ndarray, experiment: Experiment, wanted: Sequence[np.ndarray]
           ) -> tuple[np.ndarray, Seen]:
    """The stops for all times (K,) that are to be met, and the observations at each."""
    from pikanid.simulation.stops import lay_out

    times.sort(kind="stable")  # it merges what is sorted
    seen = np.concatenate([np.empty(0), *wanted])
    shown, at = np.empty(len(seen), np.int64), 0
    for s, w in zip(experiment.samples, wanted, strict=True):
        shown[at:at + len(w)] = s.output
        at += len(w)
    T, first = np.empty(len(times)), np.empty(len(times) + 1, np.int64)
    stop, output, row = np.empty((3, len(seen)), np.int64)
    inside = np.empty(len(seen), bool)
    count = lay_out(times, 1e-11 * max(times[-1] - times[0], 1e-300), seen,
                    shown, T, first, stop, output, row, inside)
    return T[:count], Seen(first[:count + 1], output, row, inside)
