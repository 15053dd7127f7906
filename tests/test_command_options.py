"""What options mean: quantities, changes to a model, outputs that may be written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from commandline import Run

import pikanid as pk
from pikanid.commands.design import ranges
from pikanid.commands.options import adjusted, quantity
from pikanid.commands.outputs import check_outputs, written


def test_an_output_never_overwrites_an_input(run: Run, recorded: str, tmp_path: Path) -> None:
    os.symlink(tmp_path / recorded, tmp_path / "link.json")
    content = (tmp_path / recorded).read_bytes()
    code, _, err = run("identify", recorded, "--model", "sloshing", "--json", "link.json")
    assert code == 2 and "overwrite" in err
    assert (tmp_path / recorded).read_bytes() == content


def test_outputs_are_checked_before_inputs_are_read(run: Run) -> None:
    code, _, err = run("identify", "absent.csv", "-m", "sloshing", "--plot", "absent/a.png")
    assert code == 2 and "--plot" in err


def test_devices_are_not_replaced() -> None:
    with pytest.raises(pk.errors.BadSetting, match="no regular file"):
        check_outputs({"--json": (os.devnull, [""])}, [])


def test_a_sigma_is_a_difference() -> None:
    assert quantity("1 degC", "K", "x", difference=True) == 1.0
    assert quantity("1 degC", "K", "x") == pytest.approx(274.15)


def test_free_then_fix_then_set() -> None:
    model = adjusted(pk.systems.sloshing(), ["m=200g"], ["d_theta"], ["g"])
    assert model.free_names == ("l_theta", "g")
    assert model.parameter("m").value == pytest.approx(0.2)


def test_json_goes_to_a_file_or_is_printed_and_has_no_nan(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place, beside = str(tmp_path / "a.json"), str(tmp_path / "a.txt")
    written({beside: b"x"}, place, {"std": float("nan")})
    assert (Path(place).read_text(), capsys.readouterr().out) == ('{\n  "std": null\n}\n', "")
    written({}, "-", {"std": 1.0})
    assert capsys.readouterr().out == '{\n  "std": 1.0\n}\n'
    with pytest.raises(pk.errors.BadRecording):
        written({beside: b"y"}, str(tmp_path / "absent" / "a.json"), {})
    assert Path(beside).read_bytes() == b"x"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.json", "a.txt"]


@pytest.mark.parametrize(("text", "range_"), [
    ("u=0:10V", (0.0, 10.0)), ("u=-500:500mV", (-0.5, 0.5)), ("u=-1V:200mV", (-1.0, 0.2)),
    ("u=-1.5e3: 2e3 mV", (-1.5, 2.0)), ("u=-1:2", (-1.0, 2.0))])
def test_a_range_has_the_unit_of_its_upper_end(text: str, range_: tuple[float, float]) -> None:
    assert ranges(pk.systems.dc_motor(), [text]) == {"u": pytest.approx(range_)}
