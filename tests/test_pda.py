"""PDA: smoothing, then regression; what it can do and what it cannot."""

from __future__ import annotations

import numpy as np
import pytest
from relaxing import TRUTH, guessed, slosh

import pikanid as pk
from pikanid import errors
from pikanid.problem.problem import Problem
from pikanid.strategies.pda import PDA, fit_decoupled


def test_clean_data_with_exact_switches() -> None:
    est = PDA().fit(guessed(), slosh())
    assert np.all(np.abs(est.theta / TRUTH - 1) < 1e-4)
    assert est.ok


def test_paper_protocol_is_biased_and_says_so() -> None:
    est = PDA(protocol="paper").fit(guessed(), slosh())
    assert 0.046 < est.value("l_theta") < 0.055
    assert est.settings["intervals"] == 80 and est.settings["degree"] == 3
    assert est.adequacy.verdict == "misfit"
    sparse = PDA(protocol="paper").fit(guessed(), slosh(0.1, stride=10))
    assert sparse.value("d_theta") > 0.5  # Table IV: 0.874


def test_noise_attenuates_but_does_not_break() -> None:
    est = PDA().fit(guessed(), slosh(0.1))
    assert est.value("l_theta") == pytest.approx(TRUTH[0], rel=0.05)
    assert est.value("d_theta") == pytest.approx(TRUTH[1], rel=0.15)


def test_standard_errors_match_the_scatter() -> None:
    fits = [fit_decoupled(Problem(guessed(), slosh(0.1, seed)), PDA(smoothing=3.0))
            for seed in range(30)]
    scatter = np.std([f.theta for f in fits], axis=0)
    reported = np.mean([f.std for f in fits], axis=0)
    assert np.all((0.6 * scatter < reported) & (reported < 1.6 * scatter))


def test_exact_for_a_parameter_that_enters_nonlinearly() -> None:
    """p = 1/l enters as a ratio; a start four times too large is no obstacle."""
    est = PDA().fit(guessed(l_theta=0.18), slosh())
    assert est.value("l_theta") == pytest.approx(TRUTH[0], rel=1e-3)


def test_several_outputs_and_recordings() -> None:
    model = pk.systems.sloshing_2d()
    t = np.arange(0, 5, 0.01)
    push = np.where((t >= 0.2) & (t < 0.6), 1.0, 0.0)
    drive = pk.Recording.from_arrays(
        t, {"u_x": push, "u_y": np.roll(push, 50)}, units={"u_x": "m/s^2", "u_y": "m/s^2"},
        hold={"u_x": "zero", "u_y": "zero"})
    recs = [pk.simulate(model, drive, sigma=1e-4, seed=s) for s in range(2)]
    est = PDA().fit(model.with_values(l_theta=0.06, d_theta=0.05), recs)
    assert np.all(np.abs(est.theta / TRUTH - 1) < 0.03)


def test_inputs_that_change_at_every_sample() -> None:
    t = np.arange(0, 10, 0.01)
    drive = pk.Recording.from_arrays(
        t, {"u_x": np.sin(9 * t)}, units={"u_x": "m/s^2"}, hold={"u_x": "zero"})
    rec = pk.simulate(pk.systems.sloshing(), drive, sigma=1e-3, seed=0)
    est = PDA().fit(guessed(), rec)
    assert est.settings["knots"] == "adaptive"
    assert est.value("l_theta") == pytest.approx(TRUTH[0], rel=0.05)


def test_unseen_state_is_named() -> None:
    with pytest.raises(errors.BadSetting, match=r"theta_dot.*iPDA"):
        PDA(form="state").fit(guessed(), slosh(0.1))


def test_parameter_of_the_output_is_named() -> None:
    model = guessed().map_output("theta", parameters=[pk.Parameter("gain", 1.1)], gain="gain")
    with pytest.raises(errors.BadSetting, match=r"gain.*NLS"):
        PDA().fit(model, slosh(0.1))


def test_bounds_hold() -> None:
    est = PDA().fit(guessed().with_bounds(l_theta=(0.05, 0.5)), slosh(0.1))
    assert est.value("l_theta") == pytest.approx(0.05)
    assert np.isnan(est.std("l_theta"))
