"""The ARX baseline: its coefficients, its order, its simulation."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.comparison.linear import ARX, Series, best_arx, even_grid, fitted
from pikanid.comparison.predictions import BASELINE

A, B = np.array([1.5, -0.7]), np.array([[0.0], [1.0], [0.5]])


def recorded(n: int, noise: float, seed: int = 0) -> Series:
    rng = np.random.default_rng(seed)
    u, y = rng.standard_normal((n, 1)), np.zeros(n)
    for t in range(2, n):
        y[t] = 3.0 + A @ y[t - 2:t][::-1] + B[:, 0] @ u[t - 2:t + 1, 0][::-1]
    return Series(y + noise * rng.standard_normal(n), u)


def test_coefficients_are_found_and_gaps_left_out() -> None:
    series = recorded(300, 0.0)
    y = series.y.copy()
    y[100:110] = np.nan
    model = fitted([Series(y[2:], series.u[2:])], 2)
    assert np.allclose(model.a, A, atol=1e-9)
    assert np.allclose(model.b[1:], B[1:], atol=1e-9)
    assert model.c == pytest.approx(3.0, abs=1e-8)


def test_simulation_from_its_own_start_is_exact_after_a_few_samples() -> None:
    series = recorded(300, 0.0)
    late = Series(series.y[40:], series.u[40:])
    model = ARX(A, B, 3.0)
    for first in (0, 20):
        # inputs before the first sample are not known: what they leave dies out
        assert np.allclose(model.simulate(late, first)[100:], late.y[100:], atol=1e-6)


@pytest.mark.parametrize("horizon", [1, 4])
def test_predictions_ahead_use_what_was_measured(horizon: int) -> None:
    series = recorded(200, 0.0)
    ahead = ARX(A, B, 3.0).ahead(series, horizon)
    assert np.isnan(ahead[:1 + horizon]).all()
    assert np.allclose(ahead[2 + horizon:], series.y[2 + horizon:], atol=1e-9)


def test_order_by_bic_is_no_more_than_it_takes() -> None:
    """Of a simulation, white noise of the output biases the true order: one more makes up for it,
    twenty more do not pay.
    """
    found = best_arx([recorded(1500, 0.01)])
    assert found is not None and 2 <= found.order <= 4
    exact = best_arx([recorded(1500, 1e-6)])
    assert exact is not None and exact.order == 2


def test_a_series_without_a_stable_linear_model_has_none() -> None:
    """Driven by what grows, undriven afterwards: every simulation of it runs away."""
    model = ARX(np.array([1.5]), np.zeros((2, 1)), 0.0)
    with np.errstate(all="raise"):
        y = model.simulate(Series(np.ones(4000), np.ones((4000, 1))))
    assert np.all(np.isinf(y))


def test_times_off_an_even_grid_have_none_and_gaps_do() -> None:
    found = even_grid(np.delete(np.arange(50) * 0.1, [7, 8, 30]))
    assert found is not None and found[1] == pytest.approx(0.1) and found[0][-1] == 49
    assert even_grid(np.sort(np.random.default_rng(0).random(50))) is None


def test_baseline_beats_nothing_on_a_linear_system() -> None:
    """Fitted to the training recording, it comes close to the truth, and no closer."""
    model = pk.systems.linear_oscillator()
    train, test = (pk.simulate(model, drive(duration=20.0, channel="u").with_unit("u", "N"),
                               sigma=1e-3, seed=1)
                   for drive in (pk.excitation.multisine, pk.excitation.chirp))
    found = pk.validate(model, test, training=train)
    assert found.ranking == (model.name, BASELINE)
    assert found.score(BASELINE).fit > 90
