"""Recordings: construction, checks on use, and what they print."""

from __future__ import annotations

import copy
import pickle
import re

import numpy as np
import pytest
from swinging import swing

from pikanid.errors import BadRecording, BadSetting, BadUnit
from pikanid.recording import Recording
from pikanid.recording.channel import Channel

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
