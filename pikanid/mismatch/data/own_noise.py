"""The noise of held-out recordings, which may be more than that of the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import NormalDist

import numpy as np

from pikanid.mismatch.data.noise_level import louder
from pikanid.mismatch.data.outliers import from_inputs
from pikanid.mismatch.data.records import Records
from pikanid.noise.level import NoiseModel

Residual = tuple[int, str, np.ndarray, np.ndarray]  # recording, output, times, values


def with_own_noise(records: Records, residuals: Sequence[Residual],
                   known: Mapping[str, NoiseModel], rate: float, inputs: Sequence[str]) -> Records:
    """Recordings with the `known` noise of each output, or with more of it where what a prediction
    leaves is clearly louder at its highest frequencies, where hardly any motion reaches.

    Less noise than is known only blunts a test; more would be taken for a mismatch.

    Args:
        records: That were predicted.
        residuals: What is left of every output of each.
        known: By output, from the recordings that were fitted.
        rate: Natural frequency [rad/s].
        inputs: Names of the inputs: what follows their past is no noise, however fast.
    """
    certain = NormalDist().inv_cdf(1 - records.settings.noise.louder)
    levels = [dict(known) for _ in records.recordings]
    for r, name, t, values in residuals:
        level = known[name]
        if level.source == "given":
            continue
        left = values - from_inputs(records.recordings[r], t, values, inputs, records.settings)
        here = float(np.median(np.diff(t))) if len(t) > 1 else level.interval
        at_that_rate = replace(level, interval=here, rho=level.rho ** (here / level.interval))
        found = louder(at_that_rate, t, left, rate, records.settings.noise)
        if found and found[0] > np.exp(certain * np.hypot(found[1], level.spread)):
            levels[r][name] = replace(level, sigma=level.sigma * np.sqrt(found[0]),
                                      spread=float(np.hypot(found[1], level.spread)),
                                      excess=np.inf)
    return replace(records, levels=tuple(levels))
