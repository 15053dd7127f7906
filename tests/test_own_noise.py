"""Held-out recordings with more noise than those that are explained."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.data.noise_level import louder
from pikanid.mismatch.data.own_noise import with_own_noise
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel
from pikanid.recording import Channel

STEP, COUNT = 0.01, 800
T = STEP * np.arange(COUNT)


def level(sigma: float, rho: float = 0.0, source: str = "a quiet stretch") -> NoiseModel:
    return NoiseModel(sigma, rho, 0.05, STEP, source)


def noise(sigma: float, rho: float, seed: int) -> np.ndarray:
    white = np.random.default_rng(seed).normal(0, sigma * np.sqrt(1 - rho**2), COUNT + 200)
    for k in range(1, len(white)):
        white[k] += rho * white[k - 1]
    return white[200:]


@pytest.mark.parametrize("rho", [0.0, 0.5])
@pytest.mark.parametrize("times", [0.7, 1.0, 2.0])
def test_the_ratio_of_powers_is_read_at_high_frequencies(times: float, rho: float) -> None:
    """A slow misfit, far larger than the noise, does not count."""
    found = [louder(level(1.0, rho), T, noise(times, rho, seed) + 30 * np.sin(2 * T), 2.0,
                    DEFAULTS.noise) for seed in range(40)]
    ratios, errors = zip(*(f for f in found if f is not None), strict=True)
    assert len(ratios) == 40
    assert np.mean(ratios) == pytest.approx(times**2, rel=0.05)
    assert np.std(np.log(ratios)) == pytest.approx(np.mean(errors), rel=0.35)


@pytest.mark.parametrize("times", [1.0, 2.0])
def test_off_an_even_grid_it_is_read_beside_neighbours(times: float) -> None:
    ratios, errors = [], []
    for seed in range(40):
        t = np.sort(np.random.default_rng(seed).uniform(0, T[-1], 500))
        found = louder(level(1.0), t, noise(times, 0.0, seed)[:500] + 30 * np.sin(2 * t), 2.0,
                       DEFAULTS.noise)
        assert found is not None
        ratios.append(found[0])
        errors.append(found[1])
    assert np.median(ratios) == pytest.approx(times**2, rel=0.15)
    assert np.std(np.log(ratios)) < 1.35 * np.mean(errors)
    few = slice(0, 500, 20)
    assert louder(level(1.0), t[few], 5 * np.sin(9 * t[few]), 2.0, DEFAULTS.noise) is None


def heard(sigma: float, seed: int, source: str = "a quiet stretch") -> float:
    recording = pk.Recording({"y": Channel("y", T, noise(sigma, 0.0, seed), "m")})
    records = Records((recording,), ({"y": level(1.0)},), DEFAULTS)
    found = with_own_noise(records, [(0, "y", T, recording["y"].values)],
                           {"y": level(1.0, source=source)}, 2.0, ())
    assert found.sigma("y") == found.levels[0]["y"].sigma
    return found.levels[0]["y"].sigma


def test_louder_noise_is_taken_as_it_is() -> None:
    assert heard(1.6, 0) == pytest.approx(1.6, rel=0.1)


def test_the_same_noise_is_hardly_ever_called_louder() -> None:
    assert sum(heard(1.0, seed) > 1.0 for seed in range(300)) <= 3  # of rate 1/1000


@pytest.mark.parametrize(("sigma", "source"), [(0.5, "a quiet stretch"), (2.0, "given")])
def test_less_noise_and_given_noise_stay(sigma: float, source: str) -> None:
    assert heard(sigma, 0, source) == 1.0


def test_a_louder_recording_is_no_mismatch() -> None:
    model = pk.systems.linear_oscillator()
    drive = [pk.excitation.planar_moves(4, 8.0, seed=seed) for seed in (1, 2)]
    name = model.input_names[0]
    drives = [pk.Recording({name: Channel(name, d["u_x"].time, 2 * d["u_x"].values,
                                          model.input(name).unit)}) for d in drive]
    quiet = pk.simulate(model, drives[0], sigma=0.002, seed=1)
    loud = pk.simulate(model, drives[1], sigma=0.004, seed=2)
    stripped = [pk.Recording({n: Channel(n, r[n].time, r[n].values, r[n].unit)
                              for n in r.names}) for r in (quiet, loud)]
    found = pk.diagnose(model, *stripped)
    assert found.verdict == "none", str(found)
    assert "In the held-out recording" in found.noise[0] and "as much" in found.noise[0]
