"""A hypothesis' fit as an estimate: the recordings' own samples beside what the model says."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.fitting.as_estimate import as_estimate
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel
from pikanid.strategies.nls import NLS

SIGMA = 0.002


def test_it_says_what_least_squares_of_the_model_say() -> None:
    model = pk.systems.sloshing()
    recording = pk.simulate(model, pk.excitation.two_pulse(), sigma=SIGMA, seed=0)
    records = Records((recording,), ({"theta": NoiseModel(SIGMA, 0.0, 0.0, 0.01, "")},),
                      DEFAULTS)
    like = NLS().fit(model, recording)
    h = fitted(model, (), records, [{}], 1)
    assert h is not None
    found = as_estimate(h, like)
    assert found.settings == {**like.settings, "effects": []}
    np.testing.assert_allclose(found.theta, like.theta, rtol=1e-4)
    np.testing.assert_allclose(found.covariance, like.covariance, rtol=0.01)
    assert found.cost == pytest.approx(like.cost, rel=1e-6)
    (ours,), (theirs,) = found.fits, like.fits
    assert (ours.recording, ours.output, ours.unit) == (
        theirs.recording, theirs.output, theirs.unit)
    np.testing.assert_array_equal(ours.t, theirs.t)
    np.testing.assert_array_equal(ours.measured, theirs.measured)
    np.testing.assert_allclose(ours.fitted, theirs.fitted, atol=0.01 * SIGMA)
    np.testing.assert_array_equal(ours.sigma, np.full(len(theirs.t), SIGMA))
