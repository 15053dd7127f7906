"""Short recordings in coloured noise: what nothing is missing from is not called incomplete."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import RIGS
from scipy.signal import lfilter

import pikanid as pk
from pikanid.mismatch.settings.settings import DEFAULTS, Settings
from pikanid.mismatch.steps.opening import open_case

pytestmark = pytest.mark.slow
SAMPLES, RUNS = 100, 40
BLIND = DEFAULTS.with_values({"noise.least_spectrum": 10 * SAMPLES})  # to all but a quiet stretch


def recorded(seed: int, rho: float) -> tuple[pk.Recording, ...]:
    """Two runs of a heated room: 1 % noise, of which neighbours correlate; no rest, no sigma."""
    rng, model = np.random.default_rng([seed, int(100 * rho)]), RIGS["thermal_rc"].model()
    runs = []
    for k in range(2):
        drive = RIGS["thermal_rc"].experiment(5000 + 10 * seed + k).window(
            0.0, 1800.0 * (SAMPLES - 1))
        y = pk.simulate(model, drive)[model.outputs[0].name]
        noise = lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], rng.standard_normal(SAMPLES + 50))
        channels = {n: drive[n].values for n in drive.names}
        units = {n: drive[n].unit for n in drive.names}
        runs.append(pk.Recording.from_arrays(
            y.time, channels | {y.name: y.values + 0.01 * np.ptp(y.values) * noise[50:]},
            units | {y.name: y.unit}))
    return tuple(runs)


def alarms(rho: float, settings: Settings) -> int:
    """Of `RUNS` recordings, how many seem to lack something at α = 1 %."""
    p = []
    for seed in range(RUNS):
        train, other = recorded(seed, rho)
        case = open_case(RIGS["thermal_rc"].model(), (train,), (other,), None, lambda text: None,
                         settings)
        p.append(case.detected().p_value)
    return int(np.sum(np.array(p) < 0.01))


@pytest.mark.parametrize("rho", [0.0, 0.5])
def test_noise_of_unknown_colour_raises_few_alarms(rho: float) -> None:
    """At a rate of 5 %, six of forty or more come in 1 % of all cases."""
    assert alarms(rho, DEFAULTS) <= 5


def test_noise_taken_for_white_raises_many() -> None:
    """The control: short quiet stretches, and the highest frequencies, tell no colour."""
    many = alarms(0.7, BLIND)
    assert many > 20
    assert alarms(0.7, DEFAULTS) < many / 2  # still more than five: so strong a colour misleads
