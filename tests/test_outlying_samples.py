"""Samples that lie far off a fit by themselves are told, and nothing else is taken for one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pikanid as pk
from pikanid.estimate.data import Fit
from pikanid.estimate.outlying import loose_warning, outlying
from pikanid.problem.held import HeldInput

SIGMA = 0.1 * np.pi / 180
SEEN = pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=SIGMA, seed=4)


def spoilt(*samples: int, by: float = 40 * SIGMA) -> pk.Recording:
    theta = SEEN["theta"].values.copy()
    theta[list(samples)] += by
    return pk.Recording.from_arrays(SEEN["theta"].time, {
        "theta": theta, "u_x": np.interp(SEEN["theta"].time, SEEN["u_x"].time, SEEN["u_x"].values),
    }, {"theta": "rad", "u_x": "m/s^2"}, hold={"u_x": "first"})


def of(residual: np.ndarray) -> Fit:
    n = len(residual)
    return Fit("run", "y", "", np.arange(n) / 10, residual, np.zeros(n))


def test_one_wrong_sample_moves_an_estimate_and_is_told() -> None:
    model = pk.systems.sloshing()
    right, wrong = (pk.NLS().fit(model, rec) for rec in (spoilt(), spoilt(130, by=4.0)))
    assert not any("far off" in w for w in right.warnings)
    (said,) = (w for w in wrong.warnings if "far off" in w)
    assert f"t = {SEEN['theta'].time[130]:.6g} s" in said and "1 sample lies" in said
    off = abs(wrong.value("d_theta") - right.value("d_theta"))
    assert off > 3 * right.std("d_theta")


def test_several_are_counted() -> None:
    found = pk.NLS().fit(pk.systems.sloshing(), spoilt(40, 130, 260, 400))
    (said,) = (w for w in found.warnings if "far off" in w)
    assert "4 samples lie" in said and ", ..." in said


@pytest.mark.parametrize("n", [20, 60, 300])
@pytest.mark.parametrize("noise", ["normal", "uniform", "steps", "correlated"])
def test_ordinary_noise_has_none(noise: str, n: int) -> None:
    """In at most one of a thousand recordings; of 2000, more than 8 have a probability of 1e-3."""
    rng = np.random.default_rng(21)
    count = 0
    for _ in range(2000):
        e = rng.standard_normal(n)
        if noise == "uniform":
            e = rng.uniform(-1, 1, n)
        if noise == "steps":
            e = np.round(2 * e + 0.37 * np.arange(n)) - 0.37 * np.arange(n)
        if noise == "correlated":
            e = np.convolve(rng.standard_normal(n + 9), np.ones(10) / 10, "valid")
        count += len(outlying(of(e))) > 0
    assert count <= 8


def test_a_sample_that_is_said_to_be_uncertain_is_none() -> None:
    rng = np.random.default_rng(8)
    e, sigma = rng.standard_normal(300), np.ones(300)
    e[40], sigma[40] = 50.0, 50.0
    assert outlying(of(e)).tolist() == [40]
    assert len(outlying(replace(of(e), sigma=sigma))) == 0


def test_what_lasts_or_is_frequent_is_none() -> None:
    rng = np.random.default_rng(5)
    e = rng.standard_normal(300)
    assert outlying(of(e + 30.0 * (np.arange(300) == 77))).tolist() == [77]
    assert len(outlying(of(e + 30.0 * np.isin(np.arange(300), range(77, 83))))) == 0
    assert len(outlying(of(e + 30.0 * (rng.random(300) < 0.05)))) == 0
    assert len(outlying(of(np.zeros(300)))) == 0
    assert len(outlying(of(e[:19] + 99 * (np.arange(19) == 7)))) == 0
    # two beside each other are no more alone than what an input's step leaves
    assert len(outlying(of(e + 30.0 * (np.arange(300) == 77) - 30.0 * (np.arange(300) == 78)))) == 0


@pytest.mark.parametrize("end", [0, 299])
def test_the_first_and_the_last_sample_count(end: int) -> None:
    e = np.random.default_rng(6).standard_normal(300)
    e[end] = -25.0
    assert outlying(of(e)).tolist() == [end]


def test_what_follows_the_steps_of_an_input_is_none() -> None:
    """A sensor that is late by part of a sample leaves one large residual after each step."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(-1.0, 1.0, 16), 50)
    u[300:] = np.where(np.arange(500) < 250, 30.0, u[300:])  # two steps much larger than the others
    late = np.diff(u, prepend=u[0])
    fit = of(rng.standard_normal(800) + 2.0 * np.concatenate([[0.0], late[:-1]]))
    inputs = [HeldInput("u", fit.t, u, "zero")]
    assert len(outlying(fit)) == 2
    assert len(outlying(fit, inputs)) == 0
    wrong = replace(fit, measured=fit.measured + 60.0 * (np.arange(800) == 77))
    assert outlying(wrong, inputs).tolist() == [77]


def test_a_stated_sigma_that_is_far_too_large_is_told() -> None:
    """Beside another output it would do no harm to the verdict, and all to the weights."""
    rng = np.random.default_rng(2)
    for n, sigma, said in ((200, 1.0, False), (200, 3.0, False), (200, 50.0, True),
                           (19, 50.0, False)):
        fit = replace(of(rng.standard_normal(n)), sigma=np.full(n, sigma), unit="A")
        assert bool(loose_warning(fit)) == said, (n, sigma)
    assert "0.02 times the stated noise (50 A)" in loose_warning(
        replace(of(np.ones(30)), sigma=np.full(30, 50.0), unit="A"))
    assert not loose_warning(replace(of(np.zeros(30)), sigma=np.ones(30)))  # clean data


@pytest.mark.parametrize("lag", [1, 3, 11, 20])
def test_one_step_of_an_input_explains_no_wrong_reading_after_it(lag: int) -> None:
    rng = np.random.default_rng(lag)
    t = np.arange(400) / 10
    u = np.where(np.arange(400) < 200, 0.0, 1.0)
    residual = 0.1 * rng.standard_normal(400)
    residual[200 + lag] += 3.0
    assert outlying(of(residual), [HeldInput("u", t, u, "zero")]).tolist() == [200 + lag]
