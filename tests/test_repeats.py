"""Noise from repeated experiments: how often it raises an alarm, and that physics is still seen."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

import pikanid as pk
from pikanid.mismatch.fitting.repeats import Spectra, modes_beside
from pikanid.mismatch.fitting.same_experiment import same_experiment
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.noise.level import NoiseModel

T = np.arange(60) / 15
START = np.vander(T, 2)  # what a start that is estimated takes up
DRAG = 0.006  # 1/m
FALL = {"name": "free fall",
        "states": {"h": {"unit": "m", "initial": "free"}, "v": {"unit": "m/s", "initial": "free"}},
        "parameters": {"g": {"unit": "m/s^2", "value": 9.81}},
        "equations": {"h": "v", "v": "-g"},
        "outputs": {"h": {"unit": "m", "expression": "h"}}}


def slow(seed: int, count: int, kind: str, n: int = len(T)) -> np.ndarray:
    """Noise (count, n) whose highest frequencies say nothing of the others."""
    rng = np.random.default_rng(seed)
    e = rng.standard_normal((count, n + 300))
    if kind == "white":
        return e[:, 300:]
    if kind == "walk":
        return np.cumsum(e[:, 300:], axis=1)
    wander = lfilter([1.0], [1.0, -0.95], e, axis=1)[:, 300:]
    return wander + (2 * rng.standard_normal((count, n)) if kind == "two" else 0.0)


def spectra(residuals: np.ndarray) -> Spectra:
    rest = residuals - (START @ np.linalg.lstsq(START, residuals.T)[0]).T
    return Spectra.of([T] * len(rest), list(rest), [START] * len(rest), float(T[1]), DEFAULTS)


@pytest.mark.parametrize("repeated", [2, 3])
@pytest.mark.parametrize("kind", ["white", "wander", "two", "walk"])
def test_noise_of_any_colour_is_not_said_to_repeat(kind: str, repeated: int) -> None:
    trials = 150
    noise = slow(1, trials * repeated, kind).reshape(trials, repeated, -1)
    p = np.array([spectra(each).p_value for each in noise])
    for alpha in (0.01, 0.05):
        assert np.sum(p < alpha) <= binom.ppf(0.999, trials, alpha)


def test_a_law_that_repeats_is_seen_in_the_same_noise() -> None:
    law = -DRAG * (9.81 * T**2) ** 2 / 12  # of the height, to first order
    noise = 0.03 * slow(2, 200, "wander").reshape(100, 2, -1)
    assert np.mean([spectra(each + law).p_value < 0.01 for each in noise]) > 0.95
    assert np.mean([spectra(each).p_value < 0.01 for each in noise]) <= 0.05


def test_what_differs_is_the_noise() -> None:
    noise = 0.2 * slow(3, 200, "white").reshape(100, 2, -1)
    white = [spectra(each) for each in noise]
    assert np.mean([s.apart for s in white]) == pytest.approx(0.2, rel=0.05)
    right, wrong = (NoiseModel(sigma, 0.0, 0.1, 1 / 15, "") for sigma in (0.2, 0.1))
    assert np.mean([s.beyond(right) < 0.05 for s in white]) <= 0.12
    assert all(s.beyond(wrong) < 0.05 for s in white)
    wandering = [spectra(each).level(right) for each in 0.2 * slow(
        4, 60, "wander").reshape(30, 2, -1)]
    assert np.median([level.rho for level in wandering]) > 0.7


def test_modes_are_beside_what_fits_take_up() -> None:
    modes, omega = modes_beside(START)
    assert modes.shape == (60, 58)
    assert np.allclose(modes.T @ modes, np.eye(58))
    assert np.allclose(START.T @ modes, 0.0, atol=1e-9)
    assert np.all(np.diff(omega) > 0)


def test_another_motion_is_no_repeat() -> None:
    model = pk.systems.pendulum()

    def swing(start: float, seed: int, stop: float = 10.0) -> pk.Recording:
        t = np.arange(0, stop, 0.02)
        noise = 0.001 * np.random.default_rng(seed).standard_normal(len(t))
        return pk.Recording.from_arrays(t, {"theta": start * np.exp(-0.05 * t) * np.cos(6 * t)
                                            + noise}, {"theta": "rad"})

    assert same_experiment(model, [swing(0.5, 0), swing(0.52, 1)], DEFAULTS.noise)
    assert not same_experiment(model, [swing(0.5, 0), swing(0.2, 1)], DEFAULTS.noise)
    assert not same_experiment(model, [swing(0.5, 0), swing(0.5, 1, 5.0)], DEFAULTS.noise)


def test_another_temperature_is_no_repeat() -> None:
    model = pk.systems.pendulum()

    def swing(warm: float, seed: int, drift: float = 0.0) -> pk.Recording:
        t = np.arange(0, 10.0, 0.02)
        draw = np.random.default_rng(seed)
        return pk.Recording.from_arrays(
            t, {"theta": 0.5 * np.exp(-0.05 * t) * np.cos(6 * t)
                + 0.001 * draw.standard_normal(len(t)),
                "T_air": warm + drift * t + 0.1 * draw.standard_normal(len(t)),
                "shake": draw.standard_normal(len(t))},
            {"theta": "rad", "T_air": "degC", "shake": "m/s^2"})

    assert same_experiment(model, [swing(20.0, 0), swing(20.1, 1)], DEFAULTS.noise)
    assert same_experiment(model, [swing(20.0, 0, 0.1), swing(20.0, 1, 0.1)], DEFAULTS.noise)
    assert not same_experiment(model, [swing(20.0, 0), swing(24.0, 1)], DEFAULTS.noise)
    assert not same_experiment(model, [swing(20.0, 0), swing(20.0, 1, 0.1)], DEFAULTS.noise)
    # a column without values tells nothing
    assert same_experiment(model, [swing(20.0, 0), swing(np.nan, 1)], DEFAULTS.noise)
    assert same_experiment(model, [swing(np.nan, 0), swing(20.0, 1)], DEFAULTS.noise)


def drop(drag: float, seed: int, level: float = 0.03) -> pk.Recording:
    """A ball that falls for 3 s, its height read with an error that is slow."""
    fallen = np.log(np.cosh(np.sqrt(9.81 * drag) * T[:45])) / drag if drag else 0.5 * 9.81 * (
        T[:45] ** 2)
    h = 47.0 - fallen + level * slow(seed, 1, "wander", 45)[0]
    return pk.Recording.from_arrays(T[:45], {"h": h}, {"h": "m"}, name=f"drop {seed}")


@pytest.mark.parametrize("proves", [True, False])
def test_a_case_takes_its_noise_from_what_differs_between_repeats(proves: bool) -> None:
    """In the recordings to explain, and in the held-out one where that is another drop."""
    drops = tuple(drop(0.0, seed) for seed in (1, 2))
    train, later = (drops[:1], drops[1:]) if proves else (drops, None)
    case = open_case(pk.Model.from_dict(FALL), train, later, None, lambda text: None, DEFAULTS)
    assert case.repeats is not None and "repeats" in case.repeats.levels["h"].source
    assert all(level == case.repeats.levels for level in case.records.levels)
    held = () if case.later is None else case.later.levels
    assert held == ((case.repeats.levels,) if proves else ())
    assert any("differ from one to the next" in note for note in case.notes)


def test_slow_errors_of_two_drops_are_noise() -> None:
    dx = pk.diagnose(pk.Model.from_dict(FALL), drop(0.0, 1), drop(0.0, 2), workers=1)
    assert dx.verdict == "none"
    assert dx.p_value > 0.01
    assert any("differ from one to the next" in note for note in dx.notes)
    assert "repeats" in dx.noise[0]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_drag_on_two_drops_is_found_in_the_same_noise() -> None:
    # of six pairs of seeds one (1 and 2) leaves six more explanations, and is not confirmed
    dx = pk.diagnose(pk.Model.from_dict(FALL), drop(0.015, 3), drop(0.015, 4), workers=1)
    assert dx.verdict in ("named", "set")
    assert any({"quadratic_drag", "power_drag"} & set(h.effects[0].ids) for h in dx.hypotheses)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_rates_of_whole_diagnoses() -> None:
    model, seeds = pk.Model.from_dict(FALL), range(0, 80, 2)

    def verdicts(drag: float) -> list[str]:
        return [pk.diagnose(model, drop(drag, s), drop(drag, s + 1), workers=1).verdict
                for s in seeds]

    alarms = sum(v != "none" for v in verdicts(0.0))
    assert alarms <= binom.ppf(0.999, len(seeds), 0.01)
    assert sum(v != "none" for v in verdicts(0.015)) >= 0.95 * len(seeds)
