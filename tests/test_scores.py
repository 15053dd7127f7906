"""Scores: relations that hold for all data, and what happens at their edges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pikanid as pk
from pikanid.comparison.scores import fit_percent, information_criteria, score

SERIES = st.lists(st.floats(-100, 100), min_size=3, max_size=30)


@given(SERIES, st.floats(-50, 50), st.floats(0.01, 100), st.integers(0, 2**32 - 1))
def test_fit_does_not_depend_on_units_and_goes_with_r_squared(
        values: list[float], shift: float, scale: float, seed: int) -> None:
    y = np.array(values) + np.random.default_rng(seed).normal(0, 1, len(values))
    yhat = y + np.random.default_rng(seed + 1).normal(0, 1, len(values))
    fit = fit_percent(y, yhat)
    assert fit_percent(scale * y + shift, scale * yhat + shift) == pytest.approx(fit, abs=1e-6)
    found = score("m", "r", "y", "", None, y, yhat, np.ones(len(y)), "given", 1, 0)
    assert found.r2 == pytest.approx(1 - (1 - fit / 100) ** 2, abs=1e-9)
    assert found.bic - found.aic == pytest.approx(np.log(len(y)) - 2)


def test_the_mean_fits_by_zero_and_the_truth_by_a_hundred() -> None:
    y = np.array([1.0, 2.0, 6.0])
    assert fit_percent(y, np.full(3, 3.0)) == pytest.approx(0.0)
    assert fit_percent(y, y) == 100.0
    assert np.isnan(fit_percent(np.ones(3), np.ones(3)))
    assert information_criteria(np.zeros(3), 1) == (-np.inf, -np.inf)


def test_a_prediction_that_left_the_finite_numbers_scores_worst() -> None:
    found = score("m", "r", "y", "", None, np.arange(3.0), np.array([0.0, np.nan, np.nan]),
                  np.ones(3), "given", 1, 0)
    assert (found.rmse, found.fit, found.aic, found.p_value) == (np.inf, -np.inf, np.inf, 0.0)


def test_a_residual_of_rounding_is_not_analysed() -> None:
    model = pk.systems.sloshing()
    clean = pk.simulate(model, pk.excitation.two_pulse())
    found = pk.validate(model, clean, baseline=False)
    assert found.residuals["sloshing"] == () and found.score("sloshing").fit > 99.999
