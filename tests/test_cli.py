"""The command line as a user meets it: what is made and said, help, and the version."""

from __future__ import annotations

import gzip
import tomllib
from pathlib import Path

import numpy as np
import pytest
from commandline import SIGMA, Run

import pikanid as pk
from pikanid.recording.excitation import EXCITATIONS


def test_simulate_is_repeatable_and_exact_about_units(run: Run, tmp_path: Path) -> None:
    for name in ("a.csv", "b.csv.gz"):
        assert run("simulate", "-m", "sloshing", "--sigma", "0.1deg", "--seed", "3",
                   "--out", name)[0] == 0
    unpacked = gzip.decompress((tmp_path / "b.csv.gz").read_bytes())
    assert unpacked == (tmp_path / "a.csv").read_bytes()
    expected = pk.simulate(
        pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=SIGMA, seed=3)
    assert np.array_equal(
        pk.Recording.read("a.csv")["theta"].values, expected["theta"].values)


@pytest.mark.parametrize("model", ["linear_oscillator", "pendulum", "sloshing_2d"])
@pytest.mark.parametrize("excitation", EXCITATIONS)
def test_every_excitation_drives_every_model(run: Run, model: str, excitation: str) -> None:
    code, _, err = run("simulate", "-m", model, "-e", excitation, "--duration", "20", "-o", "a.csv")
    assert (code, err) == (0, "")
    names = set(pk.systems.SYSTEMS[model]().input_names)
    assert (set(pk.Recording.read("a.csv").names) - {"theta", "phi", "x"}) <= names


@pytest.mark.parametrize(("model", "short"), [("thermal_rc", True), ("dc_motor", False)])
def test_an_excitation_that_ends_before_the_model_moves_is_told(run: Run, model: str,
                                                                short: bool) -> None:
    code, _, err = run("simulate", "-m", model, "-o", "a.csv")
    assert code == 0 and ("The built-in excitation lasts 5 s" in err) == short
    assert ("P stays at 0" in err) == (model == "thermal_rc")


def test_simulate_with_recorded_inputs(run: Run, recorded: str) -> None:
    assert run("simulate", "-m", "sloshing", "-e", recorded, "-o", "again.csv")[0] == 0
    again, exact = pk.Recording.read("again.csv"), pk.simulate(
        pk.systems.sloshing(), pk.excitation.two_pulse())
    assert np.allclose(again["theta"].values, exact["theta"].values, atol=1e-9)


def test_models_lists_and_prints(run: Run) -> None:
    _, out, _ = run("models")
    assert all(name in out for name in pk.systems.SYSTEMS)
    _, out, _ = run("models", "sloshing")
    assert "l_theta" in out and "[equations]" in out


@pytest.mark.parametrize("name", list(pk.systems.SYSTEMS))
def test_printed_model_file_is_the_model(run: Run, name: str) -> None:
    code, out, _ = run("models", name, "--toml")
    assert code == 0
    assert pk.Model.from_dict(tomllib.loads(out)) == pk.systems.SYSTEMS[name]()


@pytest.mark.parametrize("words", [[], ["--help"], *([c, "--help"] for c in (
    "identify", "simulate", "models", "study"))], ids=" ".join)
def test_help_has_examples(run: Run, words: list[str]) -> None:
    code, out, _ = run(*words)
    assert code == 0
    assert "pikanid " in out and "Examples" in out


def test_version(run: Run) -> None:
    assert run("--version") == (0, f"pikanid {pk.__version__}\n", "")
