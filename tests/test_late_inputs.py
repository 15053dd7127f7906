"""An input whose recorder lags behind that of the output acts before it is recorded."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

import pikanid as pk
from pikanid.mismatch.catalogue.delays import input_delay, input_lead
from pikanid.mismatch.catalogue.sites import sites

STEP, FINE, SIGMA = 0.02, 10, 0.003  # s, steps of the truth between two samples, V
POLE, GAIN = 3.0, 2.5  # 1/s
MODEL = pk.Model.from_dict({
    "name": "amplifier", "states": {"x": {"unit": "V"}},
    "inputs": {"u": {"unit": "V", "hold": "zero"}},
    "parameters": {"a": {"unit": "1/s", "guess": 2.0, "bounds": [0.1, 50.0]},
                   "b": {"unit": "1/s", "guess": 2.0, "bounds": [0.1, 50.0]}},
    "equations": {"x": "b*u - a*x"}, "outputs": {"x": {"unit": "V", "expression": "x"}}})


def recorded(seed: int, late: float) -> pk.Recording:
    """The exact answer of the amplifier to a staircase that is written down `late` [s]."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-2.0, 2.0, 40), 15 * FINE)
    (num, den, *_) = cont2discrete(([GAIN], [1.0, POLE]), STEP / FINE)
    x = lfilter(num.ravel(), den, u)[::FINE]
    written = np.roll(u, round(late / STEP * FINE))
    written[: round(late / STEP * FINE)] = 0.0
    y = x + SIGMA * rng.normal(size=len(x))
    return pk.Recording.from_arrays(STEP * np.arange(len(x)), {"u": written[::FINE], "x": y},
                                    {"u": "V", "x": "V"}, hold={"u": "zero"})


def test_it_is_a_delay_the_other_way() -> None:
    recording = recorded(1, 0.0)
    (late,) = input_lead(sites(MODEL, [recording])[0])
    assert late.ids == ("input_lead",) and "before it is recorded" in late.name
    delays = input_delay(sites(MODEL, [recording])[0])
    assert not any(late.suits([d]) or d.suits([late]) for d in delays)
    tau = late.parameters[0].name
    led = late.extend(MODEL.replace(parameters=(*MODEL.parameters, *late.parameters)))
    ahead = pk.simulate(led.with_values(**{tau: 4 * STEP}), recording)["x"].values
    plain = pk.simulate(MODEL, recording)["x"].values
    # from rest: what comes 4 samples later without a lead
    assert np.abs(ahead[60:-4] - plain[64:]).max() < 0.01 * np.ptp(plain)


@pytest.mark.slow
@pytest.mark.parametrize("late", [0.06, 0.1])
def test_it_is_found(late: float) -> None:
    found = pk.diagnose(MODEL, recorded(1, late), recorded(2, late))
    assert found.verdict == "named", str(found)
    (effect,) = found.hypotheses[0].effects
    assert effect.ids == ("input_lead",)
    (value,) = effect.parameters.values()
    assert value.value == pytest.approx(late, abs=max(4 * value.std, 0.1 * STEP))


@pytest.mark.slow
def test_nothing_is_recorded_late_where_nothing_is() -> None:
    assert pk.diagnose(MODEL, recorded(3, 0.0), recorded(4, 0.0)).verdict == "none"
