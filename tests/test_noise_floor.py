"""Rounded signals: the floor of every σ, rest at either end, diagnoses of rigs with encoders."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.data.noise_level import first_level, refined
from pikanid.mismatch.data.preparation import prepared, set_aside
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise import level as noise
from pikanid.noise.floor import repeated, rounding_noise, rounding_step
from pikanid.noise.level import NoiseModel, difference_noise
from pikanid.objective.adequacy import judge
from pikanid.recording.channel import Channel

TIMES = np.arange(600) * 0.01
STEP = 2 * np.pi / 1000  # of the encoder [rad]


def motor() -> pk.Model:
    """φ'' = K u - a φ', seen through an encoder."""
    return pk.Model.from_dict({
        "name": "motor", "inputs": {"u": {"unit": "V"}},
        "states": {"phi": {"unit": "rad"}, "w": {"unit": "rad/s"}},
        "parameters": {"K": {"unit": "rad/(s^2*V)", "guess": 20.0, "bounds": [0.1, 1e3]},
                       "a": {"unit": "1/s", "guess": 3.0, "bounds": [0.0, 1e3]}},
        "equations": {"phi": "w", "w": "K*u - a*w"},
        "outputs": {"motor": {"unit": "rad", "expression": "phi"}}})


def run(seed: int, rest: float, moves: float, seconds: float, size: float = 2.0,
        friction: float = 0.0) -> pk.Recording:
    """K = 25, a = 4, at rest before and after its moves; by another integrator than the kit's."""
    t = np.arange(0.0, seconds, 0.01)
    rng, u, k = np.random.default_rng(seed), np.zeros(len(t)), round(100 * rest)
    first, end = k, round(100 * (rest + moves))
    while k < end:
        length = int(rng.integers(20, 60))
        u[k:min(k + length, end)] = size * rng.uniform(-1, 1)
        k += length
    x = np.zeros((len(t), 2))
    for k in range(first, len(t) - 1):
        x[k + 1] = solve_ivp(lambda _, z, u=u[k]: [
            z[1], 25 * u - 4 * z[1] - friction * np.tanh(z[1] / 1e-2)], (0.0, 0.01), x[k],
            method="LSODA", rtol=1e-8, atol=1e-10).y[:, -1]
    return pk.Recording.from_arrays(t, {"u": u, "motor": STEP * np.round(x[:, 0] / STEP)},
                                    {"u": "V", "motor": "rad"}, name=f"run {seed}")


@settings(max_examples=40)
@given(st.floats(1e-6, 1e3), st.floats(-1e3, 1e3), st.floats(0.2, 3.0))
def test_the_step_of_a_rounded_swing_is_found(step: float, zero: float, turns: float) -> None:
    y = step * (np.round(30 * np.sin(turns * TIMES)) + round(zero))
    assert rounding_step(y) == pytest.approx(step, rel=1e-6)
    with_gaps = y.copy()
    with_gaps[100:130] = np.nan
    assert rounding_step(with_gaps) == pytest.approx(step, rel=1e-6)


@pytest.mark.parametrize("y", [
    np.sin(TIMES), np.minimum(np.sin(TIMES), 0.7), np.where(TIMES > 3, np.sin(TIMES - 3), 0.0),
    np.sin(TIMES) + 0.01 * np.random.default_rng(0).standard_normal(600), np.zeros(600)],
    ids=["smooth", "clipped", "at rest", "noisy", "nothing"])
def test_what_is_not_rounded_has_no_step(y: np.ndarray) -> None:
    assert rounding_step(y) == 0 and not repeated(y).any()


def test_no_estimate_of_noise_is_below_that_of_rounding() -> None:
    y = STEP * np.round(np.where(TIMES < 4, 0.0, 0.3 * np.sin(3 * (TIMES - 4))) / STEP)
    channel, floor = Channel("motor", TIMES, y, "rad"), STEP / np.sqrt(12)
    assert rounding_noise(y) == pytest.approx(floor)
    assert difference_noise(y) >= 0.999 * floor
    assert noise.high_band_sigma(channel)[0] >= 0.999 * floor
    assert noise.estimate(channel).sigma >= 0.999 * floor
    # the user's own quiet stretch shows a constant
    still = noise.estimate(channel, (0.0, 3.5))
    assert still.sigma == pytest.approx(floor) and still.rho == 0.0
    recording = pk.Recording({"motor": channel})
    assert first_level(recording, "motor", (0.0, 3.5), DEFAULTS).sigma == pytest.approx(floor)
    left = np.where(TIMES < 4, 0.0, floor * np.random.default_rng(0).standard_normal(600))
    level = NoiseModel(floor, 0.0, 0.1, 0.01, "")
    assert refined(level, channel, TIMES, left, 3.0, None, DEFAULTS).sigma >= 0.999 * floor


def test_a_right_model_of_a_rig_at_rest_explains_it() -> None:
    y = STEP * np.round(np.where(TIMES < 4, 0.0, 0.3 * np.sin(3 * (TIMES - 4)) ** 3) / STEP)
    left = y - np.where(TIMES < 4, 0.0, 0.3 * np.sin(3 * (TIMES - 4)) ** 3)
    assert judge([left], [None], [y], 2).verdict == "fits"
    assert judge([left + 0.02 * (TIMES > 4)], [None], [y], 2).verdict == "misfit"


def test_beginnings_hold_motion_and_so_many_rows() -> None:
    y = np.where(TIMES < 4, 0.0, 0.3 * np.sin(3 * (TIMES - 4)))
    level = {"motor": NoiseModel(0.001, 0.0, 0.0, 0.01, "")}

    def beginning(values: np.ndarray, rows: int) -> Channel:
        recording = pk.Recording.from_arrays(TIMES, {"motor": values})
        return Records((recording,), (level,), DEFAULTS).beginning(rows).recordings[0]["motor"]

    assert np.ptp(beginning(y, 60).values) > 0
    assert len(beginning(y, 500)) == 500
    thin = np.where(np.arange(600) % 4 > 0, np.nan, y)
    assert np.isfinite(beginning(thin, 120).values).sum() == 120


def test_an_end_at_rest_is_not_set_aside_as_proof() -> None:
    model, notes = motor(), list[str]()
    at_rest, moving = run(0, 0.5, 1.0, 6.0, 0.05), run(0, 1.0, 5.0, 6.0, 0.05)
    assert set_aside((at_rest,), model, notes, DEFAULTS.noise) == ((at_rest,), None)
    kept, end = set_aside((moving,), model, notes, DEFAULTS.noise)
    assert end is not None and kept[0].stop < moving.stop


def test_equal_samples_in_a_row_are_one_observation() -> None:
    notes: list[str] = []
    recording = run(0, 2.0, 1.0, 6.0)
    records = prepared(motor(), (recording,), None, notes, DEFAULTS)
    kept = np.isfinite(records.recordings[0]["motor"].values)
    assert kept[200:300].sum() > 70 and kept[:195].sum() == 2 and kept[500:].sum() <= 2
    assert any("repeat their neighbours" in note for note in notes)


@pytest.mark.parametrize(("rest", "moves", "seconds", "size"), [
    (1.0, 4.0, 6.0, 2.0), (3.0, 2.0, 6.0, 1.0), (1.0, 3.0, 16.0, 2.0)])
def test_the_right_model_of_a_rig_with_an_encoder_lacks_nothing(
        rest: float, moves: float, seconds: float, size: float) -> None:
    train, later = (run(seed, rest, moves, seconds, size) for seed in (0, 1))
    found = pk.NLS().fit(motor(), train)
    assert found.adequacy.verdict == "fits"
    assert found.value("K") == pytest.approx(25, rel=0.01)
    assert pk.diagnose(motor(), train, held_out=later).verdict == "none"
    assert pk.diagnose(motor(), train, quiet=(0.0, 0.9 * rest)).verdict == "none"


@pytest.mark.slow
def test_dry_friction_of_a_rig_that_rests_at_first_is_found() -> None:
    """Impacts and sticking are followed over longer and longer beginnings, first of all at rest."""
    train, later = (run(seed, 2.0, 4.0, 6.0, friction=3.0) for seed in (0, 1))
    found = pk.diagnose(motor(), train, held_out=later)
    assert found.mismatch
    assert "coulomb_friction" in {i for h in found.hypotheses for e in h.effects for i in e.ids}


def test_noise_is_no_louder_than_what_a_fit_leaves() -> None:
    """High frequencies tell little of its colour: what all frequencies hold bounds it, but for a
    line, which is none of it; a colour that is there leaves it open.
    """
    rng = np.random.default_rng(4)
    white = 0.01 * rng.standard_normal(2000)
    slow = white + 0.02 * np.sin(0.3 * np.arange(2000) * 0.01 * 2 * np.pi)
    dull = np.convolve(0.01 * rng.standard_normal(2010), 0.7 ** np.arange(11), "valid")
    t = 0.01 * np.arange(2000)
    level = NoiseModel(0.01, 0.0, 0.1, 0.01, "the highest frequencies")
    found = {name: refined(level, Channel("y", t, values, "rad"), t, values, 30.0, None, DEFAULTS)
             for name, values in (("white", white), ("slow", slow), ("dull", dull))}
    assert max(found["white"].excess, found["slow"].excess) < 0.15 < 0.5 < found["dull"].excess


def test_a_quiet_stretch_as_long_as_the_recording_is_refused() -> None:
    train = pk.simulate(motor(), pk.Recording.from_arrays(
        0.01 * np.arange(300), {"u": np.ones(300)}, units={"u": "V"}), sigma=0.1)
    with pytest.raises(pk.errors.BadSetting, match="until 5 s, and a recording ends at 2"):
        pk.diagnose(motor(), train, quiet=(0.0, 5.0))
