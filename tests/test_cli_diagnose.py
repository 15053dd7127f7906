"""`pikanid diagnose`: files in, files out."""

from __future__ import annotations

from pathlib import Path

import pytest
from commandline import Run, strict

import pikanid as pk


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A pendulum with a cubic spring that the model lacks, moved in two ways."""
    truth = pk.systems.sloshing().with_term(
        "theta_dot", "-k3*theta**3", [pk.Parameter("k3", 400.0)])
    for k in (1, 2):
        moves = pk.excitation.planar_moves(4, 6.0, seed=k)
        pk.simulate(truth, moves, sigma=0.002, seed=k).write(tmp_path / f"run{k}.csv")
    return tmp_path


def test_the_extended_model_is_written_and_predicts(run: Run, files: Path) -> None:
    asked = ("diagnose", "run1.csv", "--held-out", "run2.csv", "--model", "sloshing", "--quiet")
    code, _, err = run(*asked, "--extended", "better.toml", "--json", "why.json")
    assert (code, err) == (0, "")
    found = strict((files / "why.json").read_text())
    assert found["verdict"] == "named"
    better, other = pk.Model.load(files / "better.toml"), pk.Recording.read(files / "run2.csv")
    left = pk.simulate(better, other)["theta"].values - other["theta"].values
    assert (left**2).mean() ** 0.5 == pytest.approx(found["held_out"]["rmse_after"], rel=0.05)
    assert found["held_out"]["rmse_before"] > 2 * found["held_out"]["rmse_after"]


@pytest.mark.parametrize("place", ["better.json", "run1.csv", "nowhere/better.toml"])
def test_a_place_that_cannot_hold_a_model_is_refused_before_any_work(run: Run, files: Path,
                                                                     place: str) -> None:
    before = (files / "run1.csv").read_bytes()
    code, _, err = run("diagnose", "run1.csv", "--model", "sloshing", "--extended", place)
    assert code == 2 and "--extended" in err and "Traceback" not in err
    assert (files / "run1.csv").read_bytes() == before
