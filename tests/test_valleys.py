"""Recordings that do not tell all of a model's parameters: a motor of which only the speed is seen.

Voltage to speed, it has a gain and one slow time constant, for which it has three parameters: any
damping does, beside a torque constant and an inertia that go along with it.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.fitting.descent import Start
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.search.screen import Screen
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.optimise.levenberg_marquardt import Minimum

STEP, HOLD, COUNT, SIGMA = 0.005, 25, 1000, 20.0
K, J, B, R, L = 0.0274, 1.0e-5, 7.9e-6, 1.0, 0.001


def speeds(volts: np.ndarray, late: float = 0.0, lag: float = 0.0) -> np.ndarray:
    """(N,) of a motor, read `late` [s], behind an actuator's lag [s]; exact between samples."""
    dynamics = np.zeros((4, 4))  # current, speed, voltage that acts, voltage that is set
    dynamics[0, :3] = [-R / L, -K / L, 1.0 / L]
    dynamics[1, :2] = [K / J, -B / J]
    dynamics[2, 2:] = [-1.0 / lag, 1.0 / lag] if lag else [0.0, 0.0]
    whole, part = expm(dynamics * STEP), expm(dynamics * (STEP - late % STEP))
    state = np.array([0.0, 0.0, volts[0], volts[0]])
    read = np.zeros(len(volts))
    for k, u in enumerate(volts[:-1]):
        state[3] = u
        state[2] = state[2] if lag else u
        at = k + 1 + int(late // STEP)
        if at < len(read):
            read[at] = (part @ state)[1] if late % STEP else (whole @ state)[1]
        state = whole @ state
    return read


def recorded(seed: int, late: float = 0.0, lag: float = 0.0) -> pk.Recording:
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-6.0, 6.0, COUNT // HOLD), HOLD)
    return pk.Recording.from_arrays(
        STEP * np.arange(COUNT),
        {"u": volts, "omega": speeds(volts, late, lag) + SIGMA * rng.standard_normal(COUNT)},
        {"u": "V", "omega": "rad/s"})


def opened(late: float = 0.0, lag: float = 0.0, seed: int = 1) -> Case:
    return open_case(pk.systems.dc_motor(), (recorded(seed, late, lag),),
                     (recorded(seed + 1, late, lag),), None, lambda text: None, DEFAULTS)


def entry(case: Case, identifier: str) -> Candidate:
    return next(c for c in case.candidates if identifier in c.ids)


@pytest.fixture(scope="module")
def delayed() -> tuple[Case, Hypothesis]:
    case = opened(late=0.0058)
    found = fitted(case.model, [entry(case, "sensor_delay")], case.records, [{}], 30)
    assert found is not None
    return case, found


def test_the_motor_is_simulated_by_what_it_says() -> None:
    given = recorded(3)
    model = pk.systems.dc_motor().with_values({"k": K, "J": J, "b": B})
    ours = pk.simulate(model, given.without("omega"))["omega"].values
    assert np.max(np.abs(ours - speeds(given["u"].values))) < 1e-3 * np.ptp(ours)


def test_a_standard_error_says_what_the_fit_without_the_effect_says(
        delayed: tuple[Case, Hypothesis]) -> None:
    """Along the valley it was fifteen times as large, as if there might be no delay."""
    case, found = delayed
    size = found.values["tau_omega"]
    by_ratio = size / (case.base.minimum.chi2 - found.minimum.chi2) ** 0.5
    assert 0.5 < found.std["tau_omega"] / by_ratio < 2.0
    norms = np.linalg.norm(J := found.minimum.J, axis=0)
    along = np.sqrt(np.diag(np.linalg.pinv((J.T @ J) / np.outer(norms, norms), 1e-12))) / norms
    assert along.max() > 3 * max(found.std.values())  # the valley is there


def test_a_delay_of_a_sample_is_seen_beside_a_valley(delayed: tuple[Case, Hypothesis]) -> None:
    case, found = delayed
    assert case.base.minimum.chi2 > 1.2 * found.minimum.chi2
    assert case.test(case.base).p_value < 1e-6
    right = opened()
    assert right.test(right.base).p_value > 0.01


@pytest.mark.parametrize("off", [0.0, 1e-9])
def test_what_is_hardly_off_its_bound_is_held_there(off: float) -> None:
    columns = np.array([[1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])
    for push, held in ((1.0, True), (-1.0, False)):
        found = Minimum(np.array([3.0, off]), np.array([0.0, push, 0.0]), columns, True)
        seen = found.movable(np.array([0.0, 0.0]), np.array([10.0, 10.0]))
        assert bool(np.all(seen[:, 1] == 0)) is held and np.all(seen[:, 0] == columns[:, 0])


def test_fits_begin_within_the_order_of_magnitude_of_parameters() -> None:
    """A lag of 15 samples in front of a motor of 2.5: to first order it moves the torque constant
    three hundred times.
    """
    case = opened(lag=0.073, seed=5)
    ((_, (start, *_)),) = Screen(case.base, [entry(case, "actuator_lag")]).singles(1)
    begun = start.values if isinstance(start, Start) else start
    for name, value in case.base.values.items():
        assert abs(begun[name]) <= 10 * max(abs(value), abs(case.model.values[name]))


def test_the_slower_of_two_lags_is_found() -> None:
    model, given, later = pk.systems.dc_motor(), recorded(5, lag=0.073), recorded(6, lag=0.073)
    answer = pk.diagnose(model, given, later, workers=1)
    (effect,) = answer.hypotheses[0].effects
    lag = effect.parameters["tau_a_i"]
    assert answer.verdict == "named" and effect.ids == ("actuator_lag",)
    assert abs(lag.value - 0.073) < 4 * lag.std
