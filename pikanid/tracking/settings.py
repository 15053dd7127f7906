"""What decides which pictures show a surface, and what its standard error is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pikanid.settings import Amount, Checked, Count, Range, Share


@dataclass(frozen=True)
class TrackingSettings(Checked):
    """Settings of the tracker.

    Attributes:
        contrast: Standard deviations by which air and liquid have to differ.
        margin: Share of the width that is left out at either wall, where liquid climbs.
        columns: Least share of the columns that must show an edge.
        unlike: How far from air above, and liquid below, a column may be; share of their contrast.
        shape: Degree of the polynomial that the surface may follow.
        independent: How many of the next higher degrees tell the error.
        outlier: Robust standard deviations beyond which a column is left out.
        rough: Residual [share of the width] beyond which it is no surface.
        first: How many pictures the colours and the region are learned from.
    """

    contrast: Amount = 4.0
    margin: Share = 0.04
    columns: Share = 0.5
    unlike: Share = 0.35
    shape: Annotated[int, Range(4, 12, whole=True)] = 6
    independent: Annotated[int, Range(3, 20, whole=True)] = 8
    outlier: Amount = 4.0
    rough: Share = 0.03
    first: Count = 12


USUAL = TrackingSettings()
