"""When a fit is a misfit, and what is worth a fit."""

from __future__ import annotations

from dataclasses import dataclass

from pikanid.settings import Amount, Count, Factor, Share


@dataclass(frozen=True)
class FitSettings:
    """From which misfit on a fit is judged by it alone, or not carried through.

    χ² of a right model is its number of rows, within a few times √(2 rows): all of these lie far
    above.  They cost or save time; the closer a fit comes, the less they say.

    Attributes:
        certain: [χ² per row] that needs no test to be called a misfit.
        gross: [χ² per row] from which on nobody needs a misfit's last digits.
        lost: [χ² per row] from which on a beginning counts as unexplained.
        hopeless: [χ² per row] above which no hill about a fit leads anywhere.
        rough: Standard deviations of χ², √(2 rows), beyond its mean from which on impacts may have
            been missed.
        glance: [χ² per row] that is good enough to see whether a start is worth more.
        wild: Times the closest χ², and that of the noise: starts above both are given up.
        far: Times the closest χ², and that of the noise: fits above both together are given up.
        closer: Share of the closest χ² below which a gross fit is worth finer steps all the same.
        slow: Share of χ² left by one iteration from which on a fit far away is given up.
        other_order: [χ²] that another way to put the same effects together has to matter.
        lower_hill: [χ²] by which a minimum beyond a hill has to be lower.
        hop_again: Share of what is left beyond the noise that a minimum beyond a hill has to
            explain before more hills are looked for.
        rows_a_parameter: Rows a parameter that make a beginning worth a fit.
    """

    certain: Amount = 4.0
    gross: Amount = 25.0
    lost: Amount = 3.0
    hopeless: Amount = 300.0
    rough: Amount = 3.0
    glance: Amount = 1e4
    wild: Factor = 1000.0
    far: Factor = 2.0
    closer: Share = 0.25
    slow: Share = 0.7
    other_order: Amount = 1.0
    lower_hill: Amount = 1.0
    hop_again: Share = 0.02
    rows_a_parameter: Count = 10


@dataclass(frozen=True)
class SearchSettings:
    """What one more effect must promise, to first order, to be fitted.

    Attributes:
        faint: [χ²] for each effect that is added: chance alone gives one sign 3 in one of twelve
            cases, and the criterion asks for more than ln N.
        promising: Share of what an effect gained that another in its place must promise.
        kept: Share of what an effect promises that a fit of it must gain, or it has lost its way.
        much: Share of χ² that one more effect must promise where much is left anyway.
        equal: [χ²]: another fit of the same that is no better than by this, or by what fits stop
            at where much is left, is not kept, and what was tested stands.
    """

    faint: Amount = 3.0
    promising: Share = 0.5
    kept: Share = 0.5
    much: Share = 0.1
    equal: Amount = 0.05
