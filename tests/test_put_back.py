"""Samples that looked alone and were motion are data again, once a model predicts them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.data.left_out import LeftOut
from pikanid.mismatch.data.put_back import put_back
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel

SIGMA = 0.002


def records(gross: float) -> tuple[pk.Model, Records]:
    """Samples 100 and 200 are left out; that one is as it was, this one `gross` σ off."""
    model = pk.systems.sloshing()
    run = pk.simulate(model, pk.excitation.two_pulse(), sigma=SIGMA, seed=3)
    channel = run["theta"]
    values = channel.values.copy()
    values[200] += gross * SIGMA
    left = tuple(LeftOut("theta", run.name, float(channel.time[k]), float(values[k]))
                 for k in (100, 200))
    values[[100, 200]] = np.nan
    run = run.with_channels(replace(channel, values=values))
    return model, Records((run,), ({"theta": NoiseModel(SIGMA, 0.0, 0.0, 0.01, "")},), DEFAULTS,
                          left_out=left)


def test_what_a_model_predicts_is_back_and_a_gross_error_is_not() -> None:
    model, before = records(20.0)
    after = put_back(before, model, np.array([0.045, 0.15]))
    assert after.left_out == before.left_out[1:]
    values = after.recordings[0]["theta"].values
    assert values[100] == before.left_out[0].value and np.isnan(values[200])
    assert np.isnan(before.recordings[0]["theta"].values[100])


@pytest.mark.parametrize(("theta", "back"), [([0.045, 0.15], 0), ([0.06, 0.15], 1)])
def test_another_model_predicts_less(theta: list[float], back: int) -> None:
    model, before = records(0.0)
    assert bool(put_back(before, model, np.array(theta)).left_out) == bool(back)


def test_nothing_left_out_stays_as_it_is() -> None:
    model, some = records(0.0)
    before = replace(some, left_out=())
    assert put_back(before, model, np.array([0.045, 0.15])) is before


@pytest.mark.slow
def test_impacts_are_no_outliers_of_the_wall_that_explains_them() -> None:
    truth = pk.systems.sloshing().with_term("theta_dot", "-k_w*max(theta - 0.08, 0)", [
        pk.Parameter("k_w", 9000.0, "1/s^2")])
    train, other = (pk.simulate(truth, pk.excitation.planar_moves(6, 12.0, seed=seed),
                                sigma=SIGMA, seed=seed) for seed in (2, 52))
    dx = pk.diagnose(pk.systems.sloshing(), train, other)
    assert [e.ids for e in dx.hypotheses[0].effects] == [("wall_impact",)]
    assert not [note for note in dx.notes if note.startswith("Recording") and "outlier" in note]
