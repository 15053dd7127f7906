"""`pikanid extract`: files in, formula out, one sentence for whatever is wrong."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from pikanid.cli import main
from pikanid.recording import Recording

pytestmark = pytest.mark.kan


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A KAN [1, 1] of a cubic with the points behind it."""
    from pikanid.approximators.kan import build_kan, save
    from pikanid.approximators.kan.train import fit_points

    folder = tmp_path_factory.mktemp("extract")
    x = np.random.default_rng(0).uniform(-1, 1, 300)
    y = x**3 + 0.02 * np.random.default_rng(1).normal(size=300)
    save(fit_points(build_kan([1, 1], grid=6), x[:, None], y).kan, folder / "net.npz")
    Recording.from_arrays(np.arange(300.0), {"x": x, "y": y}).write(folder / "points.csv")
    return folder


def test_kan_and_points(files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plot = tmp_path / "net.svg"
    assert main(["extract", str(files / "net.npz"), "--data", str(files / "points.csv"),
                 "--input", "x", "--output", "y", "--json", "-", "--plot", str(plot)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["formula"] == "a_x*x**3"
    assert told["constants"]["a_x"]["value"] == pytest.approx(1.0, abs=0.02)
    assert told["ok"] and plot.stat().st_size > 1000


@pytest.mark.parametrize("words, sentence", [
    (["absent.npz"], "absent.npz"),
    (["{net}", "--data", "{points}", "--input", "z", "--output", "y"], "no columns z"),
    (["{net}", "--data", "{points}", "--output", "y"], "--input"),
    (["{points}"], "neither a saved KAN"),
    (["{net}", "--plot", "net.txt"], "--plot"),
    (["{net}", "--data", "{points}", "--input", "x", "--output", "y", "--alpha", "2"], "alpha")])
def test_bad_input_is_one_sentence(files: Path, words: list[str], sentence: str,
                                   capsys: pytest.CaptureFixture[str]) -> None:
    places = {"net": files / "net.npz", "points": files / "points.csv"}
    assert main(["extract", *(w.format(**places) for w in words)]) == 2
    told = capsys.readouterr().err
    assert sentence in told and "Traceback" not in told


def test_estimate_without_edges_is_refused(tmp_path: Path,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    import pikanid as pk

    model = pk.Model.from_dict({
        "name": "decay", "states": {"x": {"initial": 1.0}}, "equations": {"x": "-k*x"},
        "parameters": {"k": {"guess": 0.5}}, "outputs": {"x": {"expression": "x"}}})
    t = np.arange(0.0, 5.0, 0.05)
    noise = np.random.default_rng(0).normal(0.0, 0.01, t.size)
    recording = Recording.from_arrays(t, {"x": np.exp(-0.4 * t) + noise})
    pk.NLS().fit(model, recording).save(tmp_path / "fit.json")
    assert main(["extract", str(tmp_path / "fit.json")]) == 2
    assert "holds no edges" in capsys.readouterr().err
