"""`Records`: recordings as they are judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from pikanid.mismatch.data.left_out import LeftOut
from pikanid.mismatch.settings.settings import Settings
from pikanid.noise.level import NoiseModel
from pikanid.recording import Recording


@dataclass(frozen=True)
class Records:
    """Recordings as they are judged: without outliers, each output with its noise level, by which
    settings, and what the nominal model's parameters were given as, which tells their sizes.
    Of segments of longer recordings `cut_from` says which; empty, each is a recording of its own.
    `left_out` holds the outliers.
    """

    recordings: tuple[Recording, ...]
    levels: tuple[dict[str, NoiseModel], ...]
    settings: Settings
    guess: Mapping[str, float] = field(default_factory=dict)
    cut_from: tuple[int, ...] = ()
    left_out: tuple[LeftOut, ...] = ()

    @property
    def owners(self) -> tuple[int, ...]:
        """The longer recording that each one is a segment of."""
        return self.cut_from or tuple(range(len(self.recordings)))

    @property
    def stretches(self) -> list[list[int]]:
        """Numbers of the recordings that are segments of the same one; most are alone."""
        return [[r for r, own in enumerate(self.owners) if own == owner]
                for owner in dict.fromkeys(self.owners)]

    @property
    def spread(self) -> float:
        """Relative standard error of the noise's power, where it is known least."""
        return max(level.spread for found in self.levels for level in found.values())

    @property
    def allowed(self) -> float:
        """The same as tests of a residual allow for it: no more than what a fit has left."""
        return max(min(level.spread, level.excess)
                   for found in self.levels for level in found.values())

    def sigma(self, output: str) -> float:
        """σ of an output's noise; of several recordings the root mean square of their samples."""
        counts = [np.isfinite(r[output].values).sum() for r in self.recordings]
        squares = [found[output].sigma ** 2 for found in self.levels]
        return float(np.sqrt(np.average(squares, weights=counts)))

    def beginning(self, rows: int) -> Records:
        """The same with about so many rows in all, each recording cut alike, from its start; not
        before each output has changed: a rig may rest at first.
        """
        times = [np.sort(np.concatenate([r[o].time[np.isfinite(r[o].values)] for o in found]))
                 for r, found in zip(self.recordings, self.levels, strict=True)]
        share = rows / max(sum(map(len, times)), 1)
        if share >= 1:
            return self
        cut = []
        for r, found, t in zip(self.recordings, self.levels, times, strict=True):
            moved = (min(r[o].changes_at, r.stop) for o in found)
            cut.append(_cut(r, max(float(t[int(share * (len(t) - 1))]), *moved)))
        return replace(self, recordings=tuple(cut))

    def beside(self, later: Records) -> Records:
        """With other recordings after these."""
        first = max(self.owners) + 1
        return replace(self, recordings=self.recordings + later.recordings,
                       levels=self.levels + later.levels,
                       cut_from=(*self.owners, *(first + own for own in later.owners)))

    def with_levels(self, levels: dict[str, NoiseModel]) -> Records:
        """The same with one noise level of each output for all recordings."""
        return replace(self, levels=tuple(levels for _ in self.recordings))


def _cut(recording: Recording, stop: float) -> Recording:
    short = []
    for name in recording.names:
        c = recording[name]
        n = max(int(np.searchsorted(c.time, stop, "right")), 2)
        sigma = c.sigma if c.sigma is None or np.ndim(c.sigma) == 0 else np.asarray(c.sigma)[:n]
        short.append(replace(c, time=c.time[:n], values=c.values[:n], sigma=sigma))
    return recording.with_channels(*short)
