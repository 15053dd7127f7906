"""When a fitted model explains its recordings."""

from __future__ import annotations

from dataclasses import dataclass

from pikanid.settings import Amount, Checked, Count, Factor, Rate


@dataclass(frozen=True)
class AdequacySettings(Checked):
    """What a χ² test of the residuals takes as given.

    Attributes:
        alpha: Rate at which a right model is called a misfit.
        times: Times the noise that a residual may be, which a test must be able to see.
        power: Probability with which it must see that, or it confirms nothing: more often than not.
        samples: Of an output from which on they show its noise: eight fourth differences.
        far: [χ² per sample] from which on a residual is a misfit where its noise is read off the
            samples: coloured noise fools differences.
    """

    alpha: Rate = 1e-3
    times: Factor = 2.0
    power: Rate = 0.5
    samples: Count = 12
    far: Amount = 4.0


USUAL = AdequacySettings()
