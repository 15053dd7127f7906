"""Outliers beside a fit, and noise under bridged gaps, against simulated noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import pikanid as pk
from pikanid import Model, Recording
from pikanid.mismatch.catalogue.friction import coulomb_friction
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.noise_level import bridged, refined
from pikanid.mismatch.data.outliers import (
    gaps_asked,
    lone,
    not_lone,
    without_lone,
    without_outliers,
)
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel

SIGMA = 0.002


def noise(n: int, rho: float = 0.0, seed: int = 0) -> np.ndarray:
    e = np.random.default_rng(seed).standard_normal(n)
    return np.asarray(lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], e))


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8])
def test_hardly_any_noise_is_alone(rho: float) -> None:
    assert lone(noise(100_000, rho), DEFAULTS.noise).mean() < 1e-3


def test_gross_errors_are_found_where_the_residual_bends() -> None:
    """Misfits bend where an input switches or a sensor clips; errors of 6 σ are no such thing."""
    n = np.arange(2000)
    bent = 40 * np.abs((n % 100) / 50 - 1) + noise(2000)
    assert lone(bent, DEFAULTS.noise).mean() < 2e-3
    hit = np.arange(37, 2000, 111)
    bent[hit] += 8.0 * np.where(hit % 2, 1, -1)
    found = lone(bent, DEFAULTS.noise)
    assert found[hit].mean() > 0.9
    assert found.sum() <= len(hit) + 2


def test_what_is_everywhere_is_no_outlier() -> None:
    r = noise(500)
    r[::5] += 30.0
    assert not lone(r, DEFAULTS.noise).any()
    assert not lone(np.zeros(10), DEFAULTS.noise).any()


def test_small_errors_that_hide_in_a_motion_show_in_the_residual() -> None:
    t = np.arange(1000) / 100.0
    motion = 0.2 * np.sin(14 * t)
    y = motion + SIGMA * noise(1000, seed=1)
    hit = np.arange(20, 1000, 50)
    y[hit] += 6 * SIGMA
    whole = Recording.from_arrays(t, {"y": y}, {"y": "rad"})
    before, _ = without_outliers(whole, "y", DEFAULTS)
    seen = np.isfinite(before["y"].values)
    residual = (0, "y", t[seen], (y - motion)[seen])
    records = without_lone(Records((before,), ({},), DEFAULTS), [residual])
    left = np.flatnonzero(~np.isfinite(records.recordings[0]["y"].values))
    assert len(records.left_out) == (~np.isin(hit, np.flatnonzero(~seen))).sum() - np.isfinite(
        records.recordings[0]["y"].values[hit]).sum()
    assert np.isin(hit, left).mean() > 0.85
    assert len(left) < len(hit) + 3


def left_of(*residuals: np.ndarray) -> list[int]:
    """Samples of each that are alone."""
    gaps = gaps_asked(residuals, DEFAULTS.noise)
    return [len(r) - len(not_lone(r, DEFAULTS.noise, gaps)) for r in residuals]


def test_white_noise_has_no_outliers() -> None:
    """Of 300 recordings of 1500 samples one holds a sample that is 5 sigma off, 1 in 400,000."""
    left = sum(left_of(noise(1500, seed=s)) != [0] for s in range(300))
    assert left <= 6  # 3 by chance at RARE, of which P(> 6) is 3 %, and one
    few = noise(1500, seed=1)
    few[[300, 900]] += 12.0
    gaps = gaps_asked([few], DEFAULTS.noise)
    assert set(range(1500)) - set(not_lone(few, DEFAULTS.noise, gaps)) == {300, 900}


def test_outliers_of_many_short_pieces_count_together() -> None:
    pieces = [noise(100, seed=s) for s in range(30)]
    for piece in pieces[::3]:
        piece[50] += 5.0
    assert sum(left_of(*pieces)) > 2 * sum(left_of(p)[0] for p in pieces)


@pytest.mark.parametrize("turn", [10, 12, 16, 30])
def test_peaks_of_a_misfit_that_swings_are_none(turn: int) -> None:
    k = np.arange(1200)
    swing = np.sin(2 * np.pi * k / 97) * np.sin(2 * np.pi * k / turn) + np.sin(2 * np.pi * k / 211)
    residual = swing + 0.02 * noise(1200, seed=3)
    assert lone(residual, DEFAULTS.noise).sum() <= 1  # one in 5000 by chance
    hit = np.arange(40, 1200, 80)
    residual[hit] += 2.0
    assert lone(residual, DEFAULTS.noise)[hit].mean() > 0.8


def test_straight_lines_over_gaps_take_power_away() -> None:
    rng = np.random.default_rng(3)
    n = 400
    grid = np.sort(rng.choice(np.arange(1, n - 1), int(0.9 * n), replace=False))
    grid = np.concatenate([[0], grid, [n - 1]])
    power = np.zeros(n // 2 + 1)
    for _ in range(4000):
        even = np.interp(np.arange(n), grid, rng.standard_normal(len(grid)))
        power += np.abs(np.fft.rfft(even)) ** 2 / n / 4000
    ratio = power / bridged(grid)
    # 4000 periodograms scatter by 1.6 %
    assert np.abs(ratio - 1).max() < 0.08
    assert ratio[150:].mean() == pytest.approx(1.0, abs=0.005)
    assert bridged(grid)[150:].mean() < 0.9


def test_dropouts_do_not_lower_the_noise() -> None:
    rng = np.random.default_rng(4)
    found = []
    for seed in range(8):
        t = np.arange(2000) / 100.0
        e = SIGMA * noise(2000, seed=seed)
        kept = rng.random(2000) > 0.08
        channel = Recording.from_arrays(t, {"y": np.where(kept, 0.2 * np.sin(14 * t) + e, np.nan)},
                                        {"y": "rad"})["y"]
        level = refined(NoiseModel(SIGMA, 0.0, 0.1, 0.01, "the start"), channel, t[kept],
                        e[kept], 14.0, None, DEFAULTS)
        found.append(level.sigma)
    assert np.mean(found) == pytest.approx(SIGMA, rel=0.02)


def test_friction_is_found_beyond_the_hills_between() -> None:
    """A motion that comes to rest makes χ² rugged along the size of dry friction."""
    model = Model.from_dict({
        "name": "swing", "states": {"q": {"initial": 0.3}, "v": {"initial": 0.0}},
        "parameters": {"w2": {"guess": 200.0}}, "equations": {"q": "v", "v": "-w2*q"},
        "outputs": {"q": {"expression": "q"}}})
    t = np.arange(300) / 100.0
    # half swings of dry friction about ±c/w² (S. Timoshenko, Vibration Problems, 1937, § 10)
    c, w = 8.0, np.sqrt(200.0)
    rest, amplitude, y = c / 200.0, 0.3, np.empty(300)
    for k, time in enumerate(t):
        half = int(time * w / np.pi)
        a = max(amplitude - (2 * half + 1) * rest, 0.0)
        sign = 1 if half % 2 == 0 else -1
        y[k] = sign * rest + a * np.cos(w * time) if a > 0 else y[k - 1]
    records = Records((Recording.from_arrays(t, {"q": y + SIGMA * noise(300)}),),
                      ({"q": NoiseModel(SIGMA, 0.0, 0.0, 0.01, "given")},), DEFAULTS)
    entry = coulomb_friction(sites(model, records.recordings)[0])[0]
    size = entry.parameters[0].name
    for start in (2.0, 4.5, 14.0):
        found = fitted(model, [entry], records, [{size: start}], 30)
        assert found is not None
        assert found.values[size] == pytest.approx(c, rel=0.01)
        assert found.minimum.chi2 < 1.3 * 300


def test_two_neighbours_do_not_hide_each_other() -> None:
    t = np.arange(500) / 100.0
    residual = SIGMA * noise(500, seed=2)
    residual[[219, 220]] += np.array([12.0, 15.0]) * SIGMA
    whole = Recording.from_arrays(t, {"y": residual})
    records = without_lone(Records((whole,), ({},), DEFAULTS), [(0, "y", t, residual)])
    gone = np.flatnonzero(np.isnan(records.recordings[0]["y"].values))
    assert {219, 220} <= set(gone.tolist()) and len(records.left_out) == len(gone) <= 3


def test_a_clipped_peak_is_no_run_of_outliers() -> None:
    """Five neighbours on one side, as where a sensor has met its limit once."""
    t = np.arange(2001) * 0.01
    r = SIGMA * noise(2001, 0.4, seed=2)
    hump = np.arange(1314, 1319)
    r[hump] += SIGMA * np.array([7.0, 13.0, 16.0, 13.0, 7.0])
    alone = np.array([200, 700, 701, 1500])
    r[alone] += SIGMA * np.array([30.0, 30.0, -40.0, 25.0])
    recording = Recording.from_arrays(t, {"y": r}, {"y": "rad"})
    records = Records((recording,), ({"y": NoiseModel(SIGMA, 0.4, 0.0, 0.01, "")},), DEFAULTS)
    kept = without_lone(records, [(0, "y", t, r)])
    gone = np.flatnonzero(np.isnan(kept.recordings[0]["y"].values))
    assert set(alone) <= set(gone) and not set(hump) & set(gone)
    assert len(kept.left_out) == len(gone) <= 6


def test_a_setting_says_from_how_many_samples_on_one_can_be_alone() -> None:
    few = np.cos(1.9 * np.arange(19.0))
    few[9] += 50.0
    assert not lone(few, DEFAULTS.noise).any()
    assert lone(few, replace(DEFAULTS.noise, least_alone=19))[9]


def test_outliers_of_the_held_out_recording_are_no_mismatch() -> None:
    """Pairs of them during the motion show only beside a fit."""
    model = pk.systems.sloshing()
    train, later = (pk.simulate(model, pk.excitation.two_pulse(), sigma=0.00175, seed=seed)
                    for seed in (11, 12))
    rng, bad = np.random.default_rng(1), later["theta"].values.copy()
    at = rng.choice(np.arange(30, 300, 6), 7, replace=False)
    bad[np.concatenate([at, at + 1])] += 0.00175 * np.tile(
        rng.choice([-1, 1], 7), 2) * rng.uniform(5, 8, 14)
    found = pk.diagnose(
        model, *(rec.with_channels(replace(rec["theta"], values=values, sigma=None))
                 for rec, values in ((train, train["theta"].values), (later, bad))), workers=1)
    assert found.verdict == "none"
    assert any(note.startswith("Held-out recording '") and "outliers of" in note
               for note in found.notes)


@pytest.mark.parametrize("seed", range(6))
def test_beside_a_missing_sample_none_is_an_outlier(seed: int) -> None:
    """Neighbours by number are no neighbours in time: good ones beside gaps had been left out."""
    rng, t = np.random.default_rng(seed), 0.01 * np.arange(1500)
    y = np.sin(2 * np.pi * 1.5 * t) + 0.002 * rng.standard_normal(1500)
    y[rng.random(1500) < 0.03] = np.nan
    y[400:440] = np.nan
    y[900] += 0.5
    run = Recording.from_arrays(t, {"y": y})
    clean, found = without_outliers(run, "y", DEFAULTS)
    assert len(found) == 1 and np.isnan(clean["y"].values[900])


@pytest.mark.parametrize("draw", ["uniform", "exponential"])
def test_at_any_times_the_wrong_sample_is_blamed_and_no_other(draw: str) -> None:
    """In uneven neighbourhoods another sample can weigh more than the middle one."""
    kept = lost = 0
    for seed in range(30):
        rng = np.random.default_rng(seed)
        steps = rng.uniform(0.3, 1.7, 300) if draw == "uniform" else rng.exponential(1.0, 300)
        y = 0.01 * rng.standard_normal(300)
        y[150] += 1.0
        clean, _ = without_outliers(Recording.from_arrays(np.cumsum(steps + 1e-6), {"y": y}), "y",
                                    DEFAULTS)
        gone = np.isnan(clean["y"].values)
        kept += not gone[150]
        lost += int(gone.sum()) - gone[150]
    assert kept <= 1 and lost == 0


def test_glitches_of_two_samples_do_not_keep_the_others() -> None:
    """Neighbours of a pair look bad as well; none of that is a motion."""
    rng = np.random.default_rng(9)
    t, y = np.arange(3000) * 0.01, 0.01 * rng.standard_normal(3000)
    alone = rng.choice(np.arange(100, 2900, 40), 15, replace=False)
    pairs = np.array([520, 521, 1320, 1321, 2120, 2121])
    y[alone] += 1.0
    y[pairs] += 1.0
    found = np.isnan(without_outliers(
        Recording.from_arrays(t, {"y": y}), "y", DEFAULTS)[0]["y"].values)
    assert found[alone].all() and found[pairs].all()
