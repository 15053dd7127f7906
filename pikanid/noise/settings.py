"""What counts as a quiet stretch of a recording, and what as a rounded signal."""

from __future__ import annotations

from dataclasses import dataclass

from pikanid.settings import Amount, Checked, Count, Factor, Rate, Share


@dataclass(frozen=True)
class QuietSettings(Checked):
    """When a stretch of a signal shows noise only, and what its noise is known by.

    Attributes:
        chance: Rate at which white noise is refused by each of the tests for a line (Fisher), for
            an uneven spectrum (Bartlett) and for halves that spread alike (F).
        shortest: Samples in a quiet stretch.
        memories: Correlation times that must fit into one: σ of fewer is not known.
        order: Of the autoregressive models that are tried: a short memory needs no higher one.
        calmest: Times the variance of the calmest stretch that another one may have.
        quieter: Share of the recording's variance that coloured noise may have at most: a busy
            signal can look like it.
        still: Share of an input's range that it may leave its resting value by.
        still_noise: The same [standard deviations of the input's own noise].
        low: Samples of a quiet stretch that say something about low frequencies: fewer cannot tell
            coloured noise from a motion.
        steepest: Correlation of neighbours that a quiet stretch can show: beyond it, it drifts.
    """

    chance: Rate = 0.01
    shortest: Count = 20
    memories: Amount = 10.0
    order: Count = 4
    calmest: Factor = 2.0
    quieter: Share = 0.25
    still: Share = 0.01
    still_noise: Amount = 4.0
    low: Count = 100
    steepest: Share = 0.98


@dataclass(frozen=True)
class RoundingSettings(Checked):
    """When a signal counts as rounded to the steps of its sensor.

    Attributes:
        changes: Of the signal, at least, that are compared: one is a multiple of itself.
        dwell: Equal samples in a row that are as many observations: more are one, as the error of
            rounding is the same in all of them.
    """

    changes: Count = 2
    dwell: Count = 5


USUAL = QuietSettings()
ROUNDING = RoundingSettings()
