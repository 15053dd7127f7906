"""What counts as noise, as an outlier, as a repeat."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pikanid.settings import ASCENDING, Amount, Count, Factor, Range, Rate, Share


@dataclass(frozen=True)
class NoiseSettings:
    """How the noise of an output is told from its motion, and gross errors from noise.

    Attributes:
        above: Natural frequencies from which on a residual is noise: missing physics reaches to
            harmonics, hardly beyond the fifth.
        begins: Shares of the band between which that lies in any case: impacts and steps reach far
            up even where the oscillator is slow, and a third of the band is left to read from.
        line: Means of the noise's spectrum from which on an ordinate counts as a line: of
            exponentially distributed ordinates one in a thousand is larger (e^-7).
        order_only: Relative standard error of a power, at most: then it is known by its order only.
        least_spectrum: Samples of a residual from which on its spectrum shows its noise.
        less: Standard errors of a power by which a fit has to leave less to refute it.
        louder: Rate at which noise no louder than another recording's is taken to be.
        same: Relative change of σ below which a level read again is the same.
        same_correlation: Change of the correlation of neighbours below which it is.
        spike: [σ] by which a sample must leave its neighbours before there is a fit.
        lone: Median gaps by which it must once a fit is taken away, if there are more than chance
            has made in a hundred recordings.
        lone_rate: Share of white noise that does and is also off the cubic, counted.
        lone_few: Median gaps by which it must if there are no more: 5 sigma, of white noise one
            sample in 400,000.
        off_cubic: Median gaps by which it must leave a cubic through those around it as well: the
            peaks of a smooth misfit do not.
        together: Neighbours that are alone together are none: a sensor may have been at its end.
        by_chance: Rate at which noise counts as what the inputs' past explains: it is asked of
            every output of every recording, several times.
        least_alone: Samples of which some can be alone: neighbours say nothing in fewer.
        most_outliers: Share of the samples: where more are alone, nothing is.
        clustered: Rate at which errors that happen by chance lie so closely that they are taken for
            a fast motion, and stay.
        freedom: Samples beyond the free parameters: σ² read off n of them has a relative standard
            error of √(2/n), so that σ is 16 % uncertain at 20.
        aside: Share of a recording that is set aside where there is no held-out one.
        least_aside: Samples of an output that must be there for that.
        driven_alike: Share of an input's r.m.s.: larger differences drive another experiment.
        moved_alike: Share of an output's half range: beyond it the same missing law leaves
            something else.
        covered: Share of the longest repeat that the shortest has to last.
        flat: Ratio of the frequencies between which a spectrum counts as flat.
        caution: Share of the number of independent modes that is believed: so much allows for the
            error of that number.
    """

    above: Amount = 6.0
    begins: Annotated[tuple[Share, Share], ASCENDING] = (0.25, 0.6)
    line: Amount = 7.0
    order_only: Amount = 0.6
    least_spectrum: Count = 60
    less: Amount = 2.0
    louder: Rate = 1e-3
    same: Amount = 0.05
    same_correlation: Share = 0.06
    spike: Amount = 5.0
    lone: Amount = 9.0
    lone_rate: Rate = 2e-4
    lone_few: Amount = 12.0
    off_cubic: Amount = 2.5
    together: Count = 3
    by_chance: Rate = 1e-6
    least_alone: Annotated[int, Range(7, whole=True)] = 20
    most_outliers: Share = 0.1
    clustered: Rate = 1e-3
    freedom: Count = 20
    aside: Rate = 0.3
    least_aside: Count = 300
    driven_alike: Share = 0.01
    moved_alike: Share = 0.2
    covered: Share = 0.8
    flat: Factor = 1.25
    caution: Share = 0.25
