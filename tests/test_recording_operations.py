"""Recordings cut, thinned, renamed, merged and held: the original stays, inputs stay known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from swinging import TIMES, swing

from pikanid.errors import BadRecording, BadSetting, BadUnit
from pikanid.recording import Recording, excitation, resampling
from pikanid.recording.channel import Channel


def test_window_is_closed_and_forgives_rounding() -> None:
    t = np.arange(101) * 0.01  # 0.01*57 > 0.57
    cut = Recording.from_arrays(t, {"y": t}).window(0.29, 0.57)
    assert len(cut.t) == 29


def test_split_loses_nothing() -> None:
    a, b = swing().split(0.57)
    assert len(a.t) + len(b.t) == 101
    assert b.t[0] == pytest.approx(0.57)
    assert a.t[-1] == pytest.approx(0.56)


def test_window_keeps_a_held_input_known() -> None:
    motion = Recording.from_arrays(
        [0.0, 1.0, 2.0, 3.0], {"u": [5.0, 6.0, 7.0, 8.0]}, hold={"u": "zero"}
    )
    camera = Recording.from_arrays(np.arange(31) * 0.1, {"y": np.arange(31)})
    cut = Recording.merge(motion, camera).window(1.35, 2.6)
    assert cut["u"].time.tolist() == [1.35, 2.0]
    assert cut["u"].values.tolist() == [6.0, 7.0]
    assert cut["y"].time[0] == pytest.approx(1.4)
    lines = motion.with_hold(u="first").window(1.5, 2.25)["u"]
    assert lines.time.tolist() == [1.5, 2.0, 2.25]
    assert lines.values.tolist() == [6.5, 7.0, 7.25]


def test_decimate_by_stride_as_the_papers_sparse_set() -> None:
    rec = excitation.two_pulse()
    thin = rec.with_channels(Channel("theta", rec.t, np.sin(rec.t), "rad")).decimate(10)
    assert len(thin["theta"]) == len(thin["u_x"]) == 51
    np.testing.assert_array_equal(thin["theta"].values, np.sin(rec.t[::10]))
    assert thin.notes == ()


def test_decimate_never_changes_an_input() -> None:
    rec = excitation.chirp(0.5, 5.0, duration=2.0)
    thin = rec.with_channels(Channel("y", rec.t, rec.t)).decimate(7)
    assert thin["u_x"] == rec["u_x"]
    assert len(thin["y"]) == 29
    assert "full rate" in thin.notes[0]


def test_decimate_some() -> None:
    assert len(swing().decimate(5, channels=["theta"])["u_x"]) == 101
    for bad in (0, -1, 1.5):
        with pytest.raises(BadSetting, match="whole number"):
            swing().decimate(bad)  # type: ignore[arg-type]
    with pytest.raises(BadRecording, match="no column 'phi'"):
        swing().decimate(2, channels=["phi"])


def test_anti_alias_filter() -> None:
    t = np.arange(4000) * 0.001
    slow, fast = np.sin(2 * np.pi * 3 * t), np.sin(2 * np.pi * 140 * t)
    thin = Recording.from_arrays(t, {"y": slow + fast}).decimate(10, filter=True)["y"]
    # 140 Hz would alias to 40 Hz at full size; away from the ends hardly anything is left.
    np.testing.assert_allclose(thin.values[20:-20], slow[::10][20:-20], atol=0.01)
    plain = Recording.from_arrays(t, {"y": slow + fast}).decimate(10)["y"]
    assert np.max(np.abs(plain.values - slow[::10])) > 0.8


def test_the_filter_shrinks_sigma_as_it_shrinks_noise() -> None:
    rng = np.random.default_rng(0)
    t = np.arange(100_000) * 0.001
    rec = Recording.from_arrays(t, {"y": rng.standard_normal(len(t))}, sigma={"y": 1.0})
    thin = rec.decimate(8, filter=True)["y"]
    assert np.std(thin.values) == pytest.approx(float(np.asarray(thin.sigma)), rel=0.03)


def test_the_filter_needs_even_samples() -> None:
    gap = Recording.from_arrays(np.arange(99), {"y": [*range(50), np.nan, *range(48)]})
    with pytest.raises(BadRecording, match="evenly sampled"):
        gap.decimate(2, filter=True)


def test_rename_merge_shift_without() -> None:
    rec = swing().rename({"theta": "phi"})
    assert rec.names == ("u_x", "phi")
    assert rec["phi"].name == "phi"
    with pytest.raises(BadRecording, match="two channels"):
        swing().rename({"theta": "u_x"})
    with pytest.raises(BadRecording, match="two channels"):
        Recording.merge(swing(), swing())
    assert rec.shift("phi", 0.5)["phi"].time[0] == 0.5
    assert rec.shift("phi", 0.5).stop == pytest.approx(1.5)
    assert rec.without("phi").names == ("u_x",)
    assert rec.with_unit("phi", "degree")["phi"].unit == "deg"
    with pytest.raises(BadUnit):
        rec.with_unit("phi", "widgets")


def test_operations_keep_the_original() -> None:
    rec = swing()
    rec.window(0.1, 0.2), rec.decimate(2), rec.with_sigma(theta=1.0), rec.shift("theta", 1)
    assert rec == swing()


@given(TIMES, st.data())
@settings(deadline=None)
def test_holds_pass_through_their_samples(t: np.ndarray, data: st.DataObject) -> None:
    y = data.draw(hnp.arrays(float, len(t), elements=st.floats(-1e3, 1e3)))
    np.testing.assert_array_equal(resampling.held(t, y, t), y)
    np.testing.assert_allclose(resampling.held(t, y, t, "first"), y)
    np.testing.assert_array_equal(resampling.held(t, y, t[1:], side="left"), y[:-1])
    middle = (t[1:] + t[:-1]) / 2
    np.testing.assert_array_equal(resampling.held(t, y, middle), y[:-1])
    np.testing.assert_allclose(
        resampling.held(t, y, middle, "first"), (y[1:] + y[:-1]) / 2, atol=1e-9
    )
    assert resampling.held(t, y, [t[0] - 1, t[-1] + 1]).tolist() == [y[0], y[-1]]


@given(TIMES, st.integers(1, 7), st.data())
@settings(deadline=None)
def test_thinning_a_held_input_never_changes_it(t: np.ndarray, n: int, data: st.DataObject) -> None:
    y = data.draw(hnp.arrays(float, len(t), elements=st.sampled_from([0.0, 1.0, -1.0])))
    rec = Recording.from_arrays(t, {"u": y}, hold={"u": "zero"})
    thin = rec.decimate(n)["u"]
    at = np.linspace(t[0], t[-1], 200)
    np.testing.assert_array_equal(
        resampling.held(thin.time, thin.values, at), resampling.held(t, y, at)
    )
