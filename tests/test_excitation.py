"""Excitations: exact switches, bounded moves, and the spectra that they promise."""

from __future__ import annotations

import inspect
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pikanid as pk
from pikanid.cli import main
from pikanid.errors import BadSetting
from pikanid.recording import Recording, excitation, resampling
from pikanid.recording.excitation import EXCITATIONS


def motion(rec: Recording, channel: str = "u_x") -> tuple[np.ndarray, np.ndarray]:
    """Velocity and position at the samples, exactly, from a zero-order-held acceleration."""
    u, dt = rec[channel].values, rec[channel].interval
    v = np.concatenate([[0.0], np.cumsum(u[:-1]) * dt])
    x = np.concatenate([[0.0], np.cumsum(v[:-1] * dt + u[:-1] * dt**2 / 2)])
    return v, x


def test_two_pulse_is_table_ii() -> None:
    rec = excitation.two_pulse()
    u = rec["u_x"]
    assert (len(u), u.unit, u.hold, rec.names) == (501, "m/s^2", "zero", ("u_x",))
    assert (rec.start, rec.stop) == (0.0, 5.0)
    assert u.uniform
    k = np.arange(501)
    wanted = np.where((k >= 20) & (k < 60), 1.0, 0.0) - np.where((k >= 120) & (k < 160), 1.0, 0.0)
    np.testing.assert_array_equal(u.values, wanted)
    # The times are the doubles nearest to their decimals, so comparisons come out right too.
    again = np.where((u.time >= 0.2) & (u.time < 0.6), 1.0, 0.0)
    again -= np.where((u.time >= 1.2) & (u.time < 1.6), 1.0, 0.0)
    np.testing.assert_array_equal(u.values, again)
    assert resampling.switches(u).tolist() == [0.2, 0.6, 1.2, 1.6]


@pytest.mark.parametrize("dt", [0.1, 0.05, 0.02, 0.01, 0.005, 0.004, 0.001])
def test_switches_land_exactly_whatever_the_step(dt: float) -> None:
    u = excitation.two_pulse(dt=dt)["u_x"]
    np.testing.assert_allclose(resampling.switches(u), [0.2, 0.6, 1.2, 1.6], rtol=0, atol=1e-15)
    assert len(u) == round(5 / dt) + 1


def test_naive_times_would_miss_a_switch() -> None:
    # Why `grid` divides: multiplied times fall on the wrong side of their decimals.
    assert np.any(np.arange(501) * 0.01 != excitation.grid(5.0, 0.01))
    assert excitation.grid(5.0, 0.01)[57] == 0.57 != 57 * 0.01


def test_pulses_must_lie_on_the_grid() -> None:
    with pytest.raises(BadSetting, match="on the grid"):
        excitation.two_pulse(dt=0.03)
    with pytest.raises(BadSetting, match="no grid"):
        excitation.two_pulse(duration=-1.0)
    with pytest.raises(BadSetting, match="no grid"):
        excitation.grid(float("inf"), 0.1)


def test_a_short_horizon_cuts_the_pulses() -> None:
    assert excitation.two_pulse(duration=1.0)["u_x"].values.sum() == 40


def test_chirp_sweeps_its_band() -> None:
    rec = excitation.chirp(0.5, 8.0, duration=40.0, amplitude=2.0)
    u = rec["u_x"]
    crossings = np.flatnonzero(np.diff(np.sign(u.values)) > 0) * 0.01
    rates = 1 / np.diff(crossings)
    assert 0.4 < rates[:3].mean() < 0.65
    assert 7.0 < rates[-10:].mean() < 8.5
    assert np.max(np.abs(u.values)) <= 2.0
    for low, high in ((0, 1), (2, 1), (1, 60)):
        with pytest.raises(BadSetting, match="half the sampling rate"):
            excitation.chirp(low, high)


@pytest.mark.parametrize("seed", [None, 0, 1])
def test_multisine_has_its_lines_only(seed: int | None) -> None:
    lines = [0.5, 1.25, 2.0, 3.75]
    u = excitation.multisine(lines, duration=20.0, amplitude=0.7, seed=seed)["u_x"].values
    assert np.max(np.abs(u)) == pytest.approx(0.7)
    power = np.abs(np.fft.rfft(u[:-1])) ** 2
    strong = np.fft.rfftfreq(2000, 0.01)[power > 1e-12 * power.max()]
    np.testing.assert_allclose(strong, lines)
    with pytest.raises(BadSetting):
        excitation.multisine([])


def test_schroeder_phases_keep_the_crest_low() -> None:
    lines = np.arange(1, 21) * 0.25
    u = excitation.multisine(lines, duration=20.0)["u_x"].values
    assert np.max(np.abs(u)) / np.std(u) < 2.0


@given(
    st.floats(-0.5, 0.5).filter(lambda d: abs(d) > 1e-3),
    st.floats(0.2, 5.0),
    st.floats(0.05, 2.0),
    st.sampled_from([0.01, 0.005, 0.02]),
)
def test_a_move_arrives_within_its_bounds(
    distance: float, acceleration: float, velocity: float, dt: float
) -> None:
    rec = excitation.move(distance, 30.0, dt, acceleration=acceleration, velocity=velocity)
    v, x = motion(rec)
    assert np.max(np.abs(rec["u_x"].values)) <= acceleration * (1 + 1e-9)
    assert np.max(np.abs(v)) <= velocity * (1 + 1e-9)
    assert v[-1] == pytest.approx(0, abs=1e-12)
    assert x[-1] == pytest.approx(distance, abs=1e-9)


@given(st.integers(0, 10_000))
def test_planar_moves_keep_to_their_bounds(seed: int) -> None:
    rec = excitation.planar_moves(
        count=5, stroke=0.4, acceleration=1.5, velocity=0.6, seed=seed, channels=("u_x", "u_y")
    )
    for channel in rec.names:
        v, x = motion(rec, channel)
        assert np.max(np.abs(rec[channel].values)) <= 1.5 * (1 + 1e-9)
        assert np.max(np.abs(v)) <= 0.6 * (1 + 1e-9)
        assert np.max(np.abs(x)) <= 0.2 * (1 + 1e-6)
        assert v[-1] == pytest.approx(0, abs=1e-12)
    assert not np.array_equal(rec["u_x"].values, rec["u_y"].values)


def test_moves_that_do_not_fit() -> None:
    with pytest.raises(BadSetting, match="does not fit"):
        excitation.move(5.0, duration=2.0)
    with pytest.raises(BadSetting, match="does not fit"):
        excitation.planar_moves(count=100, duration=5.0)
    with pytest.raises(BadSetting, match="positive bounds"):
        excitation.move(0.1, acceleration=0.0)


def test_the_same_seed_gives_the_same_moves() -> None:
    assert excitation.planar_moves(seed=4) == excitation.planar_moves(seed=4)
    assert excitation.planar_moves(seed=4) != excitation.planar_moves(seed=5)


@pytest.mark.parametrize("name", EXCITATIONS)
def test_python_and_the_command_line_read_one_list(name: str, tmp_path: Path) -> None:
    function = getattr(pk.excitation, name)
    assert name in pk.excitation.__all__ and inspect.getdoc(function)
    out = tmp_path / "run.csv"
    words = ["simulate", "--model", "sloshing", "--duration", "8", "--rate", "50", "--quiet"]
    assert main([*words, "--excitation", name, "--out", str(out)]) == 0
    made = function(duration=8.0, dt=0.02)
    read = Recording.read(out)["u_x"]
    assert read.unit == "m/s^2"
    np.testing.assert_array_equal(read.values, made["u_x"].values)
    np.testing.assert_array_equal(read.time, made.t)


def test_help_and_the_sentence_about_an_unknown_name_list_all(
        capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("simulate", "confusable"):
        assert main([command, "--help"]) == 0
        told = "".join(capsys.readouterr().out.split())
        assert all(name in told.replace("│", "") for name in EXCITATIONS), command
    assert main(["simulate", "--model", "sloshing", "--out", "a.csv", "-e", "chrip"]) == 2
    sentence = capsys.readouterr().err
    assert all(name in sentence for name in EXCITATIONS) and "chirp'?" in sentence
