"""What a residual is tested for, beside the signs of the catalogue."""

from __future__ import annotations

from dataclasses import dataclass

from pikanid.settings import Amount, Count


@dataclass(frozen=True)
class DetectionSettings:
    """Directions in which something unforeseen would show.

    More of them find more kinds of physics, and each of them less: power spreads over all.

    Attributes:
        bands: Of frequency.  They widen with it, so that a line and a broad hump are both seen.
        reach: Natural frequencies up to which bands reach, as missing physics does: hardly beyond
            the fifth harmonic.
        lines: Frequencies in all bands together, at most: the lowest that a record resolves.
        lags: Of each input, over a natural period.
        spans: Parts of a record, over one of which lags reach where nothing oscillates.
    """

    bands: Count = 9
    reach: Amount = 6.0
    lines: Count = 150
    lags: Count = 12
    spans: Count = 20
