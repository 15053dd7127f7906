"""When a parameter counts as not determined."""

from __future__ import annotations

from dataclasses import dataclass

from pikanid.settings import Amount, Checked, Factor


@dataclass(frozen=True)
class UncertaintySettings(Checked):
    """From which standard errors on a parameter is told of.

    Attributes:
        far: Times the size of a parameter with a guess that its standard error may have.
        far_from_zero: Times the estimate of one without: near zero that is no size of its own.
        condition: Ratio of the largest to the least singular value of the scaled Jacobian from
            which on a combination of parameters is not determined: half of double precision's
            digits are lost there.
    """

    far: Amount = 10.0
    far_from_zero: Amount = 100.0
    condition: Factor = 1e6


USUAL = UncertaintySettings()
