"""What decides which pictures show a surface, and what its standard error is."""

from __future__ import annotations

from dataclasses import dataclass

from pikanid.settings import Amount, Checked, Count, Share

MODES = 3  # definition: shapes that are reported beside level and angle, of degrees 2, 3 and 4


@dataclass(frozen=True)
class TrackingSettings(Checked):
    """Settings of the tracker.

    Attributes:
        contrast: Standard deviations by which air and liquid have to differ.
        margin: Share of the width that is left out at either wall, where liquid climbs.
        columns: Least share of the columns that must show an edge.
        unlike: How far from air above, and liquid below, a column may be; share of their contrast.
        beyond: How many degrees beyond those that are reported (4) the surface may follow.
        independent: How many of the next higher degrees tell the error.
        outlier: Robust standard deviations beyond which a column is left out.
        unsure: How many times less sure the angle may be than a line through every column, by where
            the points lie.
        rough: Residual [share of the width] beyond which it is no surface.
        volume: Change of the surface's mean height [share of the width] that counts as one, and
        jump: robust standard deviations of that height which it must have, too.
        alike: Least correlation of a marker with its first picture.
        cover: Times the squared difference from that picture that a part of a marker may have.
        vague: Standard error [px] beyond which a marker has no place.
        texture: Grey levels per pixel by which a marker must change in every direction.
        first: How many pictures the colours and the region are learned from.
    """

    contrast: Amount = 4.0
    margin: Share = 0.04
    columns: Share = 0.5
    unlike: Share = 0.35
    beyond: Count = 2
    independent: Count = 8
    outlier: Amount = 4.0
    unsure: Amount = 12.0
    rough: Share = 0.03
    volume: Share = 0.003
    jump: Amount = 6.0
    alike: Share = 0.8
    cover: Amount = 5.0
    vague: Amount = 0.2
    texture: Amount = 2.0
    first: Count = 12

    @property
    def degree(self) -> int:
        """Of the polynomial that the surface may follow."""
        return 1 + MODES + self.beyond


USUAL = TrackingSettings()
