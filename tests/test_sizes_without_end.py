"""Effects of a size that the recording does not hold, as a play that is wider than the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from opened import hypothesis

import pikanid as pk
from pikanid.mismatch.judge.doubt import why_not
from pikanid.mismatch.judge.explanations import lasting
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.recording import Recording

PLAY = "hysteresis[backlash,T_a]"
NOISE = 0.02  # K


def heated(seed: int, insulated: bool) -> Recording:
    """A room (R C = 2 h) in a week that is warm at noon, heated now and then.

    Insulated, it feels the ambient's mean; else the ambient with a play of 2 K.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 7 * 24 * 3600.0, 1800.0)
    ambient = 5.0 + 4.0 * np.sin(2 * np.pi * t / 86400.0) + 1.5 * np.sin(2 * np.pi * t / 260000.0)
    power = 500.0 * np.repeat(rng.uniform(0.0, 1.0, len(t) // 8 + 1), 8)[:len(t)]
    felt = np.full(len(t), 5.0) if insulated else behind(ambient, 2.0)
    temperature = np.empty(len(t))
    temperature[0] = 18.0
    decay = np.exp(-1800.0 / 7200.0)  # the inputs are held: each step has a closed form
    for k in range(len(t) - 1):
        steady = felt[k] + 0.02 * power[k]
        temperature[k + 1] = steady + (temperature[k] - steady) * decay
    return Recording.from_arrays(
        t, {"T": temperature + NOISE * rng.standard_normal(len(t)), "T_a": ambient, "P": power},
        {"T": "degC", "T_a": "degC", "P": "W"}, hold={"T_a": "zero", "P": "zero"})


def behind(values: np.ndarray, half: float) -> np.ndarray:
    out = np.empty(len(values))
    out[0] = values[0]
    for k in range(1, len(values)):
        out[k] = np.clip(out[k - 1], values[k] - half, values[k] + half)
    return out


@pytest.mark.parametrize("insulated", [False, True])
def test_a_play_wider_than_the_motion_could_have_any_size(insulated: bool) -> None:
    room = pk.systems.thermal_rc().with_values(R=0.02, C=3.6e5)
    case = open_case(room, (heated(1, insulated),), (heated(2, insulated),), None,
                     lambda text: None, DEFAULTS)
    found = hypothesis(case, PLAY, half_play_T_a=30.0 if insulated else 1.5, play_start_T_a=0.0,
                       R=0.02, C=3.6e5, T_0=18.0)
    assert case.base is not None and found.minimum.chi2 < 0.1 * case.base.minimum.chi2
    assert found.determines(found.effects[0]) is not insulated
    assert lasting([found, case.base]) == ([case.base] if insulated else [found, case.base])
    said = why_not(found, replace(case.evidence([found, case.base]), scale=1.0))
    assert ("any is as good" in said) is insulated
    if not insulated:
        off = found.values["half_play_T_a"] - 2.0
        assert abs(off) < 4 * found.std["half_play_T_a"] < 0.5


def test_what_a_bound_holds_has_an_end() -> None:
    """The way to one side is barred: that is no valley without an end."""
    room = pk.systems.thermal_rc().with_values(R=0.02, C=3.6e5)
    case = open_case(room, (heated(1, False),), (heated(2, False),), None, lambda text: None,
                     DEFAULTS)
    limited = hypothesis(case, "rate_limited_input[P]", rate_P=1e3, R=0.02, C=3.6e5, T_0=18.0)
    held = replace(limited, minimum=replace(limited.minimum, J=np.zeros_like(limited.minimum.J)))
    assert limited.determines(limited.effects[0]) and held.determines(held.effects[0])
