"""`pikanid validate`: files in, tables, JSON and a page out; mistakes in one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest
from commandline import Run, strict

import pikanid as pk


@pytest.fixture
def files(tmp_path: Path) -> Path:
    model = pk.systems.sloshing()
    for k, drive in enumerate((pk.excitation.two_pulse(), pk.excitation.multisine(duration=4))):
        rec = pk.simulate(model, drive, sigma="0.1deg", seed=k)
        (tmp_path / f"run{k}.csv").write_text(_csv(rec))
    pk.NLS().fit(model, pk.Recording.read(tmp_path / "run0.csv")).save(tmp_path / "fit.json")
    model.with_values(l_theta=0.05).fix("l_theta", "d_theta").save(tmp_path / "stiff.toml")
    return tmp_path


def _csv(rec: pk.Recording) -> str:
    lines = ["t [s],u_x [m/s^2],theta [rad]"]
    lines += [f"{float(t)!r},{float(u)!r},{float(y)!r}" for t, u, y in zip(
        rec.t, rec["u_x"].values, rec["theta"].values, strict=True)]
    return "\n".join(lines) + "\n"


def test_estimate_against_a_model_with_everything_written(run: Run, files: Path) -> None:
    code, out, err = run("validate", "fit.json", "stiff.toml", "--data", "run1.csv", "--train",
                         "run0.csv", "--json", "v.json", "--plot", "v.svg", "--report", "v.html")
    assert (code, err) == (0, "")
    assert "Best is 'fit'" in out and "linear (ARX)" in out and "noise" in out
    found = strict((files / "v.json").read_text())
    assert found["ranking"][0] == "fit"
    scores = {s["model"]: s for s in found["scores"]}
    assert scores["fit"]["held_out"] is True and scores["fit"]["fit"] > 95
    assert scores["noise"]["aic"] is None
    assert (files / "v.svg").read_text().startswith("<?xml")
    page = (files / "v.html").read_text()
    assert "fit %" in page and "http" not in page.replace("http://www.w3.org", "").replace(
        "http-equiv", "")


def test_models_are_fitted_to_training_recordings(run: Run, files: Path) -> None:
    code, out, _ = run("validate", "sloshing", "--data", "run1.csv", "--train", "run0.csv",
                       "--first", "30", "--json", "-")
    assert code == 0
    found = strict(out)
    (score,) = [s for s in found["scores"] if s["model"] == "sloshing"]
    assert score["held_out"] is True and score["n"] == 401 - 30 and score["parameters"] == 4
    assert "first 30 samples" in found["protocol"]["text"]


def test_predictions_ahead(run: Run, files: Path) -> None:
    code, out, _ = run("validate", "fit.json", "--data", "run1.csv", "--horizon", "4", "--decimate",
                       "4")
    assert code == 0 and "4 samples ahead" in out


@pytest.mark.parametrize("words", [
    ("validate", "fit.json"),
    ("validate", "--data", "run1.csv"),
    ("validate", "fit.json", "--data", "absent.csv"),
    ("validate", "absent.json", "--data", "run1.csv"),
    ("validate", "run0.csv", "--data", "run1.csv"),
    ("validate", "slosing", "--data", "run1.csv"),
    ("validate", "linear_oscillator", "--data", "run1.csv"),
    ("validate", "fit.json", "linear_oscillator", "--data", "run1.csv"),
    ("validate", "fit.json", "--data", "run1.csv", "--column", "theta=angle"),
    ("validate", "fit.json", "--data", "run1.csv", "--first", "401"),
    ("validate", "fit.json", "--data", "run1.csv", "--first", "-1"),
    ("validate", "fit.json", "--data", "run1.csv", "--horizon", "0"),
    ("validate", "fit.json", "--data", "run1.csv", "--horizon", "400"),
    ("validate", "fit.json", "--data", "run1.csv", "--report", "page.pdf"),
    ("validate", "fit.json", "--data", "run1.csv", "--json", "fit.json"),
])
def test_a_mistake_is_one_sentence(run: Run, files: Path, words: tuple[str, ...]) -> None:
    before = sorted(p.name for p in files.iterdir())
    code, out, err = run(*words)
    assert code == 2 and out == ""
    assert err.startswith("Error: ") and err.count("\n") == 1
    assert sorted(p.name for p in files.iterdir()) == before
