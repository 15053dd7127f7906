"""Predictions ahead: of exact data they are exact, whatever the model, its delays and its rates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ready_made import EXPERIMENTS

import pikanid as pk


def exact_ahead(model: pk.Model, clean: pk.Recording) -> None:
    """Seven samples ahead of exact data, from states that were estimated of them."""
    found = pk.validate(model, clean, horizon=7, baseline=False, origins=40)
    for p in found.predictions[model.name]:
        there = np.isfinite(p.predicted)
        assert there.sum() == 40
        assert np.max(np.abs(p.residual[there])) < 1e-6 * np.ptp(p.measured)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_exact_data_are_predicted_exactly(name: str) -> None:
    experiment = EXPERIMENTS[name]
    model = experiment.model(name)
    exact_ahead(model, pk.simulate(model, experiment.drive(model)))


def test_delays_of_input_and_output_are_kept() -> None:
    model = pk.systems.sloshing()
    model = model.map_input("u_x", delay=0.03).map_output("theta", delay=0.05)
    exact_ahead(model, pk.simulate(model, pk.excitation.multisine(duration=4.0)))


def test_dry_friction_is_followed() -> None:
    model = pk.systems.sloshing().with_term("theta_dot", "-0.3*sign(theta_dot)")
    clean = pk.simulate(model, pk.excitation.multisine(duration=4.0))
    found = pk.validate(model, clean, horizon=7, baseline=False)
    score = found.score(model.name)
    assert score.rmse < 1e-3 * np.ptp(clean["theta"].values)


def test_a_wrong_model_errs_less_over_short_horizons() -> None:
    model = pk.systems.sloshing()
    rec = pk.simulate(model, pk.excitation.multisine(duration=5.0), sigma=1e-3, seed=0)
    wrong = model.with_values(l_theta=0.05)
    errors = [pk.validate(wrong, rec, horizon=k, window=20, baseline=False, origins=150).score(
        wrong.name).rmse for k in (1, 10, 40)]
    assert errors[0] < errors[1] < errors[2]
    assert errors[2] < pk.validate(wrong, rec, baseline=False).score(wrong.name).rmse * 2


def test_outputs_at_their_own_rates_and_gaps() -> None:
    """One output every tenth sample, the other with a gap: predicted where they were measured."""
    model = pk.systems.double_pendulum()
    experiment = EXPERIMENTS["double_pendulum"]
    model = experiment.model("double_pendulum")
    clean = pk.simulate(model, experiment.drive(model), sigma=1e-6, seed=0)
    a, b = (clean[name] for name in model.output_names)
    values = a.values.copy()
    values[100:110] = np.nan
    rec = clean.with_channels(replace(a, values=values),
                              replace(b, time=b.time[::10], values=b.values[::10], sigma=1e-6))
    found = pk.validate(model, rec, horizon=3, baseline=False)
    for p in found.predictions[model.name]:
        there = np.isfinite(p.predicted)
        assert there.any() and np.sqrt(np.mean(p.residual[there] ** 2)) < 1e-5
    assert len(found.predictions[model.name][0].t) == len(a.time) - 10
