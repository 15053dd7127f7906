"""What the inputs' past explains is neither noise nor an outlier."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from pikanid.mismatch.data.outliers import without_lone, without_outliers
from pikanid.mismatch.data.preparation import with_refined_noise
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.model import Model, systems
from pikanid.noise.level import NoiseModel
from pikanid.problem.held import HeldInput
from pikanid.problem.inputs_past import explained
from pikanid.recording import Recording
from pikanid.simulation import simulate
from pikanid.strategies.nls import NLS

STEP = 0.005
SIGMA = 2.0  # rad/s


def driven(seed: int, n: int = 800, hold: int = 25) -> Recording:
    """A voltage of random levels, as the motor below is driven by."""
    u = np.repeat(np.random.default_rng(seed).uniform(-6.0, 6.0, n // hold), hold)
    return Recording.from_arrays(STEP * np.arange(n), {"u": u}, {"u": "V"})


def motor(late: float = 0.0) -> Model:
    """As fast as it is sampled, with its sensor late."""
    model = systems.dc_motor()
    return model.map_output("omega", delay=repr(late)) if late else model


def recorded(seed: int, late: float = 0.0) -> Recording:
    """Its speed."""
    return simulate(motor(late), driven(seed), sigma=SIGMA, seed=seed)


def test_a_fast_rig_has_no_outliers() -> None:
    """What it does after a step of the voltage looks like one from the signal alone."""
    run = recorded(1)
    _, alone = without_outliers(run, "omega", DEFAULTS)
    _, known = without_outliers(run, "omega", DEFAULTS, ("u",))
    assert alone and not known


def test_a_gross_error_of_a_fast_rig_is_one() -> None:
    """Where the voltage does not explain it."""
    run = recorded(2)
    bad = [110, 360, 613]
    values = run["omega"].values.copy()
    values[bad] += np.array([60.0, -60.0, 60.0])
    clean, found = without_outliers(
        run.with_channels(replace(run["omega"], values=values)), "omega", DEFAULTS, ("u",))
    assert len(found) == 3 and np.flatnonzero(np.isnan(clean["omega"].values)).tolist() == bad


@pytest.mark.parametrize("seed", range(5))
def test_a_delay_is_no_noise(seed: int) -> None:
    """A sensor that is late by a good part of a sample was read as noise of its own colour, three
    times as loud, and its largest errors as outliers.
    """
    run = recorded(seed, 0.6 * STEP)
    fit = NLS().fit(motor(), run.with_sigma({"omega": SIGMA}))
    records = Records((run,), ({"omega": NoiseModel(SIGMA, 0.0, 0.3, STEP, "the start")},),
                      DEFAULTS)
    assert np.std(fit.fits[0].residual) > 2 * SIGMA
    refined = with_refined_noise(records, fit, 0.0, None)
    level = refined.levels[0]["omega"]
    assert len(refined.left_out) <= 2, "but where it starts: no input is known before"
    assert level.rho == 0
    # 750 ordinates: 4 standard errors
    assert level.sigma == pytest.approx(SIGMA, rel=0.11)


def test_noise_is_not_explained_by_chance() -> None:
    """Coloured or white, by inputs that move at random or in steps; a signal without an input is
    not either.
    """
    t = STEP * np.arange(600)
    for seed in range(40):
        rng = np.random.default_rng(seed)
        noise = rng.standard_normal(600)
        if seed % 2:
            for k in range(1, 600):
                noise[k] += 0.8 * noise[k - 1]
        u = driven(seed, 600)["u"]
        moves = [HeldInput("a", t, rng.standard_normal(600), "zero"),
                 HeldInput("u", u.time, u.values, "zero")]
        assert not explained(t, noise, moves, 12, 1e-4).any()
    assert not explained(t, noise, [], 12, 1e-4).any()


def test_noise_that_a_controller_feeds_back_stays_noise() -> None:
    """At the same instant its output knows the noise that the sensor gave it."""
    rng = np.random.default_rng(3)
    t, noise = STEP * np.arange(600), rng.standard_normal(600)
    assert not explained(t, noise, [HeldInput("u", t, -2.0 * noise, "zero")], 12, 1e-4).any()


def test_gross_errors_do_not_hide_what_inputs_explain() -> None:
    """They are a thousand times as large as the noise."""
    t, worst = STEP * np.arange(1000), []
    for seed in range(4, 14):
        u = driven(seed, 1000)["u"]
        answer = np.convolve(u.values, [0.0, 0.5, 0.3, 0.2])[:1000]
        y = answer + 0.01 * np.random.default_rng(seed).standard_normal(1000)
        y[[77, 391, 708]] += 10.0
        left = y - explained(t, y, [HeldInput("u", t, u.values, "zero")], 12, 1e-6)
        worst.append(np.abs(np.diff(np.delete(left, [77, 391, 708])))[5:].max())
    assert np.median(worst) < 0.15  # noise alone: 0.05


def test_an_output_that_follows_a_step_at_once_has_no_outliers() -> None:
    """The voltage of a cell over its resistance, at uneven times: a jump with the current."""
    rng = np.random.default_rng(8)
    t = np.arange(1500.0) + rng.uniform(-0.08, 0.08, 1500)
    current = np.repeat(rng.normal(0.0, 3.0, 50), 30)
    slow = lfilter([0.0, 0.06], [1.0, -0.94], current)
    u = 3.9 - 0.03 * current - 0.018 * slow + 0.0008 * rng.standard_normal(1500)
    cell = Recording.from_arrays(t, {"i": current, "u": u}, {"i": "A", "u": "V"},
                                 hold={"i": "zero"})
    assert without_outliers(cell, "u", DEFAULTS, ["i"])[1] == []
    u[700] += 0.05
    assert len(without_outliers(cell.with_channels(replace(cell["u"], values=u)), "u", DEFAULTS,
                                ["i"])[1]) == 1


def test_residuals_of_a_late_sensor_are_not_alone() -> None:
    """Each of them follows a step of the voltage."""
    run = recorded(5, 0.6 * STEP)
    left = run["omega"].values - simulate(motor(), driven(5))["omega"].values
    records = Records((run,), ({},), DEFAULTS)
    seen = [(0, "omega", run["omega"].time, left)]
    assert without_lone(records, seen).left_out
    assert not without_lone(records, seen, ("u",)).left_out


@pytest.mark.parametrize("offset", [0.0, 300.0])
def test_a_slow_input_far_from_zero_explains_nothing_by_itself(offset: float) -> None:
    """The heater's steps do; a temperature about 300 K leaves its own neighbours' cubic by rounding
    only, of which no weight of it follows.
    """
    rng, t = np.random.default_rng(4), 5.0 * np.arange(400.0)
    heat = np.repeat(rng.uniform(0, 900, 40), 10)
    room = HeldInput("T_a", t, offset + 4 * np.sin(t / 300), "zero")
    y = 0.01 * np.concatenate([heat[:1], heat[:-1]])
    part = explained(t, y + 0.1 * rng.standard_normal(400),
                     [HeldInput("P", t, heat, "zero"), room], 5, 1e-6)
    assert np.std(part - y) < 0.15 * np.std(y)


def oven(seed: int) -> Recording:
    """A heater switched every 300 s, seen at uneven times: it bends, but never jumps."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.integers(1, 9, 1200)).astype(float)
    heat = rng.uniform(0.0, 400.0, 20)[np.minimum(t // 300, 19).astype(int)]
    y = np.empty(len(t))
    y[0] = 20.0
    for k, step in enumerate(np.diff(t)):
        rest = 20.0 + 0.6 * heat[k]
        y[k + 1] = rest + (y[k] - rest) * np.exp(-step / 40.0)
    y += 0.4 * rng.standard_normal(len(t))
    return Recording.from_arrays(t, {"P": heat, "T": y}, {"P": "W", "T": "degC"},
                                 hold={"P": "zero"})


@pytest.mark.parametrize("seed", range(5))
def test_corners_of_a_slow_rig_between_uneven_samples_are_no_outliers(seed: int) -> None:
    run = oven(seed)
    assert without_outliers(run, "T", DEFAULTS, ("P",))[1] == []
    values = run["T"].values.copy()
    values[[200, 700]] += (8.0, -8.0)
    clean, found = without_outliers(
        run.with_channels(replace(run["T"], values=values)), "T", DEFAULTS, ("P",))
    assert len(found) == 2 and np.flatnonzero(np.isnan(clean["T"].values)).tolist() == [200, 700]


def test_a_mode_that_rings_as_fast_as_it_is_sampled_is_no_outlier() -> None:
    """After each step of the input, for longer than its past is asked; errors by chance are."""
    t, u = 0.004 * np.arange(3000), np.repeat(np.random.default_rng(6).uniform(-1, 1, 24), 125)
    rng, y = np.random.default_rng(7), np.zeros(3000)
    for k in range(1, 24):
        since = t[125 * k:] - t[125 * k]
        y[125 * k:] += (u[125 * k] - u[125 * k - 1]) * np.exp(-20 * since) * np.cos(
            2 * np.pi * 74 * since)
    y += 0.01 * rng.standard_normal(3000)
    run = Recording.from_arrays(t, {"u": u, "p": y}, hold={"u": "zero"})
    assert without_outliers(run, "p", DEFAULTS, ("u",))[1] == []
    plain = 0.01 * rng.standard_normal(3000)
    bad = rng.choice(3000, 60, replace=False)
    plain[bad] += rng.choice([-1, 1], 60)
    run = run.with_channels(replace(run["p"], values=plain))
    found = np.isnan(without_outliers(run, "p", DEFAULTS, ("u",))[0]["p"].values)
    assert found[bad].mean() > 0.95 and found.sum() < 70
