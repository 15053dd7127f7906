"""Recordings: construction, checks on use, cutting and thinning, and files written."""

from __future__ import annotations

import copy
import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pikanid.errors import BadRecording, BadSetting, BadUnit
from pikanid.recording import Recording, excitation, resampling
from pikanid.recording.channel import Channel


def swing(n: int = 101, dt: float = 0.01) -> Recording:
    t = np.arange(n) * dt
    return Recording.from_arrays(
        t,
        {"u_x": np.where(t < 0.5, 1.0, 0.0), "theta": np.sin(5 * t)},
        {"u_x": "m/s^2", "theta": "rad"},
        {"theta": 0.002},
        {"u_x": "zero"},
        "swing",
    )


# --- construction --------------------------------------------------------------------------------


def test_arrays_are_copied_and_frozen() -> None:
    values = np.array([0.0, 1.0])
    rec = Recording.from_arrays([0, 1], {"y": values})
    values[0] = 5.0
    assert rec["y"].values[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        rec["y"].values[0] = 1.0
    with pytest.raises(TypeError):
        rec.channels["z"] = rec["y"]  # type: ignore[index]
    with pytest.raises(AttributeError):
        rec.name = "other"  # type: ignore[misc]


def test_equality_is_by_content() -> None:
    assert swing() == swing()
    assert swing() != swing().with_sigma(theta=0.1)
    gap = Recording.from_arrays([0, 1, 2], {"y": [0, np.nan, 1]})
    assert gap == Recording.from_arrays([0, 1, 2], {"y": [0, np.nan, 1]})
    assert gap != "recording"


def test_other_processes_and_copies_get_the_same() -> None:
    for again in (pickle.loads(pickle.dumps(swing())), copy.deepcopy(swing())):
        assert again == swing()
        assert not again["theta"].values.flags.writeable


@pytest.mark.parametrize(
    ("t", "y", "said"),
    [
        ([0, 1, 2], [0, 1], "as many"),
        ([0, 1], ["a", "b"], "not all numbers"),
        ([[0, 1]], [[0, 1]], "one-dimensional"),
        ([0, 1], [1j, 2], "not all numbers"),
        ([0, 1], [[1], [2, 3]], "not all numbers"),
    ],
)
def test_what_is_no_signal(t: list[float], y: list[float], said: str) -> None:
    with pytest.raises(BadRecording, match=said):
        Channel("y", t, y)  # type: ignore[arg-type]


@pytest.mark.parametrize("sigma", [0.0, -1.0, np.nan, [0.1, 0.0], [0.1, 0.2, 0.3]])
def test_sigma_must_make_sense(sigma: float) -> None:
    with pytest.raises(BadRecording):
        Recording.from_arrays([0, 1], {"y": [0, 1]}, sigma={"y": sigma})


def test_sigma_may_be_missing_with_its_sample() -> None:
    rec = Recording.from_arrays([0, 1, 2], {"y": [0, np.nan, 1]}, sigma={"y": [1, np.nan, 1]})
    assert isinstance(rec["y"].sigma, np.ndarray)


def test_settings_for_unknown_channels() -> None:
    with pytest.raises(BadSetting, match="'z'"):
        Recording.from_arrays([0, 1], {"y": [0, 1]}, {"z": "m"})
    with pytest.raises(BadSetting, match="hold"):
        Recording.from_arrays([0, 1], {"y": [0, 1]}, hold={"y": "second"})  # type: ignore[dict-item]


def test_no_channels() -> None:
    with pytest.raises(BadRecording, match="nothing to identify"):
        Recording({})


# --- use -----------------------------------------------------------------------------------------


def test_missing_channel_suggests_a_name() -> None:
    with pytest.raises(BadRecording, match=r"it has: u_x, theta\. Did you mean 'theta'\?"):
        swing()["thetta"]


@pytest.mark.parametrize(
    ("t", "y", "said"),
    [
        ([0.0], [1.0], "at least 2"),
        ([0, 1, 2], [1, np.nan, np.nan], "at least 2"),
        ([0, 2, 1], [1, 2, 3], "sample 3: the time 1 s goes back from 2 s"),
        ([0, 1, 1], [1, 2, 3], "sample 3: the time 1 s repeats"),
        ([0, np.nan, 1], [1, 2, 3], "sample 2: the time is nan"),
        ([0, 1, np.inf], [1, 2, 3], "sample 3: the time is inf"),
        ([0, 1, 2], [1, np.inf, 3], r"sample 2 \(t = 1 s\): 'y' is inf"),
        ([0, 1, 2], [1, 1e308, 3], "beyond 1e300"),
        ([0, 1, 2], [3, 3, 3], "throughout"),
        ([0, 1, 2], [3, np.nan, 3], "throughout"),
    ],
)
def test_unusable_outputs(t: list[float], y: list[float], said: str) -> None:
    with pytest.raises(BadRecording, match=said):
        Recording.from_arrays(t, {"y": y}).as_output("y")


def test_gaps_are_for_outputs_only() -> None:
    rec = Recording.from_arrays([0, 1, 2], {"y": [1, np.nan, 3]})
    assert np.isnan(rec.as_output("y").values[1])
    with pytest.raises(BadRecording, match=r"sample 2 \(t = 1 s\): input 'y' is missing"):
        rec.as_input("y")


def test_a_constant_input_is_fine() -> None:
    assert Recording.from_arrays([0, 1], {"u": [0, 0]}).as_input("u").values.tolist() == [0, 0]


def test_units_on_use() -> None:
    rec = Recording.from_arrays([0, 1], {"y": [0, 180]}, {"y": "deg"}, {"y": [18.0, 36.0]})
    y = rec.as_output("y", "rad")
    assert y.values[1] == pytest.approx(np.pi)
    np.testing.assert_allclose(y.sigma, [np.pi / 10, np.pi / 5])
    assert y.unit == "rad"
    with pytest.raises(BadUnit, match=r"channel 'y'.*different things"):
        rec.as_output("y", "m")


@pytest.mark.parametrize("unit", ["Vlt", "widgets", "m//s", "2*m"])
def test_an_unknown_unit_is_an_error_at_once(unit: str) -> None:
    with pytest.raises(BadUnit, match=f"'{re.escape(unit)}' of channel 'y' is unknown"):
        Channel("y", [0, 1], [0, 1], unit)
    with pytest.raises(BadUnit, match="is unknown"):
        Recording.from_arrays([0, 1], {"y": [0, 1]}, {"y": unit})
    with pytest.raises(BadUnit, match="is unknown"):
        Recording.from_arrays([0, 1], {"y": [0, 1]}).with_unit("y", unit)


def test_no_unit_means_the_models() -> None:
    y = Recording.from_arrays([0, 1], {"y": [0, 2]}).as_output("y", "deg")
    assert (y.unit, y.values[1]) == ("deg", 2.0)


# --- preparing -----------------------------------------------------------------------------------


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


# --- holds ---------------------------------------------------------------------------------------

TIMES = hnp.arrays(float, st.integers(2, 30), elements=st.floats(0.01, 1.0)).map(np.cumsum)


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


# --- showing and writing -------------------------------------------------------------------------


def test_it_prints_what_it_holds() -> None:
    text = repr(swing())
    assert "Recording 'swing': 0 s to 1 s" in text
    assert "theta  [rad]    101 samples, every 0.01 s" in text
    assert "sigma 0.002" in text
    empty = Recording({"y": Channel("y", [], [])})  # type: ignore[arg-type]
    assert "0 samples" in repr(empty)
    odd = Recording({"<b>": Channel("<b>", np.arange(2), np.arange(2))})
    assert "&lt;b&gt;" in odd._repr_html_()


def test_frame_of_several_time_bases() -> None:
    a = Recording.from_arrays([0.0, 1.0], {"u": [1, 2]})
    b = Recording.from_arrays([0.0, 0.5], {"y": [3, 4]})
    frame = Recording.merge(a, b).to_frame()
    assert frame.index.tolist() == [0.0, 0.5, 1.0]
    assert frame["y"].isna().tolist() == [False, False, True]


FLOATS = st.one_of(st.floats(-1e200, 1e200), st.just(float("nan")))


@given(st.data(), st.sampled_from([".csv", ".csv.gz", ".tsv", ".parquet"]))
@settings(deadline=None, max_examples=60)
def test_files_give_the_recording_back(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject, ending: str
) -> None:
    path = tmp_path_factory.mktemp("rec") / f"run{ending}"
    first, second = data.draw(TIMES), data.draw(TIMES)
    y = data.draw(hnp.arrays(float, len(first), elements=FLOATS))
    z = data.draw(hnp.arrays(float, len(second), elements=st.floats(-1e200, 1e200)))
    spread = data.draw(hnp.arrays(float, len(second), elements=st.floats(1e-6, 1e6)))
    channels = [Channel("y", first, y, "deg"), Channel("z", second, z, "m/s^2", spread)]
    rec = Recording({ch.name: ch for ch in channels}, "run")
    rec.write(path)
    assert Recording.read(path) == rec


def test_parquet_carries_sigma_and_hold(tmp_path: Path) -> None:
    swing().write(tmp_path / "swing.parquet")
    assert Recording.read(tmp_path / "swing.parquet") == swing()


def test_writing_is_whole_or_not_at_all(tmp_path: Path) -> None:
    swing().write(tmp_path / "a.csv")
    assert [file.name for file in tmp_path.iterdir()] == ["a.csv"]
    with pytest.raises(BadRecording, match="no known format"):
        swing().write(tmp_path / "a.xyz")
    with pytest.raises(BadRecording, match="cannot be written"):
        swing().write(tmp_path / "missing" / "a.csv")
    first = (tmp_path / "a.csv").read_bytes()
    swing().write(tmp_path / "a.csv.gz")
    again = (tmp_path / "a.csv.gz").read_bytes()
    swing().write(tmp_path / "a.csv.gz")
    assert (tmp_path / "a.csv.gz").read_bytes() == again
    assert first.startswith(b"t [s],u_x [m/s^2],theta [rad]\n0.0,1.0,0.0\n")
