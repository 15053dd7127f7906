"""Misuse from Python: what a user would expect is taken, the rest is refused in a sentence."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import pikanid as pk
from pikanid import Channel, Model, Recording
from pikanid.errors import BadRecording, BadSetting, BadUnit, PikanidError

MODEL = Model.from_dict({
    "name": "decay", "states": {"x": {"unit": "rad", "initial": 1.0}},
    "inputs": {"u": {"default": 0}},
    "parameters": {"k": {"unit": "1/s", "guess": 0.5}, "l": {"unit": "m", "value": 0.3}},
    "equations": {"x": "u - k*x"}, "outputs": {"x": {"unit": "rad", "expression": "x"}}})
T = np.linspace(0.0, 4.0, 41)
REC = Recording.from_arrays(T, {"x": np.exp(-0.7 * T), "u": 0 * T}, {"x": "rad"}, name="run")
DATES = pd.to_datetime(["2026-01-01T00:00", "2026-01-01T00:01"])
FRAME = pd.DataFrame({"t": T, "x [rad]": np.exp(-0.7 * T)})

# Never what is asked for; models and recordings stand where the other is meant.
WRONG = {"None": None, "int": 3, "float": 1.5, "list": [1, 2], "array": np.ones(3), "dict": {1: 2},
         "bool": True, "object": object(), "list of None": [None], "frame": FRAME, "set": {1},
         "swapped": (MODEL, REC)}
FITS = [getattr(pk, name) for name in ("NLS", "PDA", "IPDA", "PIKAN")]
DOORS: dict[str, Callable[[Any], Any]] = {
    **{f"{s.__name__}.fit, model": lambda x, s=s: s().fit(x, REC) for s in FITS},
    **{f"{s.__name__}.fit, recording": lambda x, s=s: s().fit(MODEL, x) for s in FITS},
    "simulate, model": lambda x: pk.simulate(x, REC),
    "simulate, recording": lambda x: pk.simulate(MODEL, x),
    "simulate, parameters": lambda x: pk.simulate(MODEL, REC, parameters={"k": x}),
    "diagnose, model": lambda x: pk.diagnose(x, REC),
    "diagnose, recording": lambda x: pk.diagnose(MODEL, x),
    "diagnose, held out": lambda x: pk.diagnose(MODEL, REC, held_out=x),
    "confusable, model": lambda x: pk.confusable(x, REC, 0.1),
    "confusable, recording": lambda x: pk.confusable(MODEL, x, 0.1),
    "next_experiment": lambda x: pk.next_experiment({"a": x, "b": MODEL}, REC, 0.1),
    "next_experiment, hypotheses": lambda x: pk.next_experiment(x, REC, 0.1),
    "next_experiment, recorded": lambda x: pk.next_experiment({"a": MODEL, "b": MODEL}, [x], 0.1),
    "d_optimal, recorded": lambda x: pk.d_optimal(MODEL, [x], 0.1),
    "d_optimal": lambda x: pk.d_optimal(x, REC, 0.1),
    "kan_discrepancy, model": lambda x: pk.kan_discrepancy(x, REC, "x", ["x"]),
    "kan_discrepancy, recording": lambda x: pk.kan_discrepancy(MODEL, x, "x", ["x"]),
    "Recording": Recording, "Recording.read": Recording.read,
    "from_arrays": lambda x: Recording.from_arrays([0, 1], x),
    "from_arrays, samples": lambda x: Recording.from_arrays([0, 1], {"y": x}),
    "from_frame": lambda x: Recording.from_frame(x), "merge": lambda x: Recording.merge(REC, x),
    "window": lambda x: REC.window(x, "1 s"), "split": REC.split,
    "rename": REC.rename, "with_channels": lambda x: REC.with_channels(x), "without": REC.without,
    "with_sigma": REC.with_sigma, "with_unit": lambda x: REC.with_unit(x, "m"),
    "with_unit, unit": lambda x: REC.with_unit("x", x), "shift": lambda x: REC.shift(x, 1.0),
    "shift, seconds": lambda x: REC.shift("x", [x]), "as_input": REC.as_input,
    "as_output": REC.as_output, "[]": lambda x: REC[x], "write": REC.write,
    "Channel, times": lambda x: Channel("y", x, [0.0, 1.0, 2.0, 3.0]),
    "Channel, unit": lambda x: Channel("y", [0, 1], [0, 1], x),
    "Model.load": Model.load, "from_dict": Model.from_dict, "Estimate.load": pk.Estimate.load,
    "with_parameters": lambda x: MODEL.with_parameters(x), "parameter": MODEL.parameter,
    "fix": lambda x: MODEL.fix(x), "fix, value": lambda x: MODEL.fix(k=[x]),
    "free": lambda x: MODEL.free(x), "with_values": MODEL.with_values,
    "with_bounds": lambda x: MODEL.with_bounds(k=x), "per_recording": MODEL.per_recording,
    "substitute": lambda x: MODEL.substitute([x]), "save": MODEL.save,
    "map_input": lambda x: MODEL.map_input(x, gain=2.0),
    "map_output": lambda x: MODEL.map_output(x, gain=2.0),
}
# Where what is wrong elsewhere is right.
RIGHT = {
    *((f"{s.__name__}.fit, recording", "frame") for s in FITS), ("from_frame", "frame"),
    ("simulate, parameters", "int"), ("simulate, parameters", "float"),
    ("simulate, parameters", "bool"), ("diagnose, held out", "None"), ("merge", "frame"),
    ("simulate, recording", "frame"), ("from_arrays, samples", "list"),
    ("Channel, unit", "None"), ("with_unit, unit", "None"), ("split", "int"),
    ("split", "float"), ("with_sigma", "None"),
    ("with_values", "None"), ("with_bounds", "list"), ("kan_discrepancy, recording", "frame"),
    ("diagnose, recording", "frame"), ("diagnose, held out", "frame"),
    ("confusable, recording", "frame"), ("next_experiment, recorded", "frame"),
    ("d_optimal, recorded", "frame")}


@pytest.mark.parametrize("door", DOORS)
def test_wrong_things_are_refused_in_a_sentence(door: str, tmp_path: Path,
                                                monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for kind, thing in WRONG.items():
        if (door, kind) in RIGHT:
            continue
        things = thing if kind == "swapped" else (thing,)
        for wrong in things:
            if kind == "swapped" and isinstance(wrong, Model) == ("model" in door or door in (
                    "next_experiment", "d_optimal")):
                continue
            if kind == "swapped" and door == "merge":
                continue
            with pytest.raises(PikanidError) as found:
                DOORS[door](wrong)
            text = str(found.value)
            assert text.endswith(".") and "\n" not in text and len(text) < 900, (kind, text)
    assert list(tmp_path.iterdir()) == []


def test_a_table_and_a_path_stand_for_a_recording(tmp_path: Path) -> None:
    REC.write(tmp_path / "run.csv")
    wanted = pk.PDA().fit(MODEL, REC).value("k")
    for given in (FRAME, str(tmp_path / "run.csv"), tmp_path / "run.csv", [FRAME],
                  REC.to_frame()):
        assert pk.PDA().fit(MODEL, given).value("k") == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("frame", [
    pd.DataFrame({"t": [0, 60], "y [deg]": [1, 2]}),
    pd.DataFrame({"Time [min]": [0, 1], "y [deg]": [1, 2]}),
    pd.DataFrame({"y [deg]": [1, 2]}, index=pd.Index([0, 60], name="t")),
    pd.DataFrame({"y [deg]": [1, 2]}, index=pd.Index([0.0, 1 / 60], name="time [h]")),
    pd.DataFrame({"y [deg]": [1, 2]}, index=[0.0, 60.0]),
    pd.DataFrame({"y [deg]": [1, 2]}, index=DATES),
    pd.DataFrame({"y [deg]": [1, 2]}, index=pd.to_timedelta([0, 60], unit="s")),
    pd.DataFrame({"t": DATES, "y [deg]": [1, 2]}),
    pd.DataFrame({"t": ["0", "60"], "y [deg]": ["1", "2"]}),
])
def test_tables_of_pandas(frame: pd.DataFrame) -> None:
    rec = Recording.from_frame(frame, sigma={"y": "30 arcmin"})
    assert rec.names == ("y",)
    np.testing.assert_allclose(rec["y"].time, [0.0, 60.0])
    assert rec["y"].values.tolist() == [1.0, 2.0]
    assert (rec["y"].unit, rec["y"].sigma) == ("deg", pytest.approx(0.5))


@pytest.mark.parametrize(("frame", "message"), [
    (pd.DataFrame({"y": [1.0, 2.0]}), "time"), (pd.DataFrame({"t": []}), "no rows|no data"),
    (pd.DataFrame({"t": [1.0, 0.0], "y": [1.0, 2.0]}), "does not|not later|rise"),
    (pd.DataFrame({"t": [0.0, 1.0], "y": ["1", "2x"]}), "2x"),
])
def test_tables_that_are_no_recordings(frame: pd.DataFrame, message: str) -> None:
    with pytest.raises(BadRecording, match=message):
        Recording.from_frame(frame)


def test_a_table_goes_there_and_back() -> None:
    again = Recording.from_frame(REC.to_frame(), units={"x": "rad"}, name="run")
    assert again == REC


def test_texts_with_a_unit_are_taken_where_the_command_line_takes_them() -> None:
    assert REC.with_sigma(x="0.1deg")["x"].sigma == pytest.approx(0.1 * np.pi / 180)
    assert REC.with_sigma({"x": "2 mrad"})["x"].sigma == pytest.approx(0.002)
    assert Channel("y", [0, 1], [0, 1], "degC", "1 K").sigma == pytest.approx(1.0)
    assert MODEL.with_values(l="50mm").values["l"] == pytest.approx(0.05)
    assert MODEL.fix(k="6/min").values["k"] == pytest.approx(0.1)
    assert MODEL.free(l="5 cm").values["l"] == pytest.approx(0.05)
    assert MODEL.with_bounds(l=("1 mm", "2 m")).parameter("l").bounds == pytest.approx((0.001, 2))
    assert pk.simulate(MODEL, REC, sigma="1deg", seed=1)["x"].sigma == pytest.approx(np.pi / 180)
    with pytest.raises(BadUnit, match="different things"):
        REC.with_sigma(x="0.1 kg")
    with pytest.raises(BadUnit, match="'Vlt' of sigma of 'x' is unknown"):
        REC.with_sigma(x="0.1 Vlt")
    with pytest.raises(BadSetting, match="'much'"):
        REC.with_sigma(x="much")


@pytest.mark.parametrize(("a", "b"), [(20, 30), (-5, -1), (3.0, 2.0), (0.01, 0.09)])
def test_a_window_in_which_nothing_was_recorded(a: float, b: float) -> None:
    with pytest.raises(BadRecording, match=r"'run' has nothing from .* it runs from 0 s to 4 s"):
        REC.window(a, b)


@pytest.mark.parametrize("at", [-1.0, 0.0, 4.5])
def test_a_split_that_leaves_nothing(at: float) -> None:
    with pytest.raises(BadRecording, match="leaves nothing on one side"):
        REC.split(at)
