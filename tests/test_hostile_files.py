"""Saved estimates, truths, seals and diagnoses from strangers: valid content, or one sentence."""

from __future__ import annotations

import gzip
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hostile import CODE, JSON_VALUES, MARK, cut, nothing_evaluated, walk

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.estimate import file as estimate_file
from pikanid.estimate.data import Fit, Trajectory
from pikanid.model import Model
from pikanid.objective.adequacy import Adequacy
from pikanid.problem.problem import FreeParameter
from pikanid.storage import limits as stored
from pikanid.validation.concealed import seal
from pikanid.validation.concealed.score import judge

__all__ = ["nothing_evaluated"]


def estimate() -> Estimate:
    model = Model.from_dict({
        "name": "decay", "states": {"x": {"initial": "free"}}, "inputs": {"u": {"delay": "k"}},
        "parameters": {"k": {"guess": 1.0, "bounds": [0.0, 5.0]}}, "equations": {"x": "u - k*x"},
        "outputs": {"x": {"expression": "x", "unit": "m"}}})
    t = np.array([0.0, 0.1, 0.2, 0.3])
    x = np.exp(-t)
    return Estimate(
        model, "nls", (FreeParameter("k", None, 1.0, (0.0, 5.0), "1/s"),
                       FreeParameter("x_0", 0, 0.0, (-np.inf, np.inf))),
        np.array([1.1, 1.0]), np.array([[0.01, 0.0], [0.0, np.nan]]),
        (Fit("run", "x", "m", t, x + 0.01, x, np.full(4, 0.01)), Fit("b", "x", "m", t, x, x)),
        (Trajectory(t, x[:, None]),), 0.5, Adequacy(4.0, 2, 0.1, "fits", "given"), True,
        {"grid": 5, "starts": [1.0, None], "deep": {"a": "b"}}, ({"cost": 1.0},), ("note",), 0.1,
        7, "0.1")


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    path = tmp_path_factory.mktemp("estimate") / "fit.json"
    estimate().save(path)
    return dict(json.loads(path.read_text()))


def one_sentence(problem: errors.PikanidError) -> None:
    text = str(problem)
    assert 10 < len(text) < 4000, text[:300]
    assert text.isprintable(), text[:300]


def estimate_used(content: Any) -> bool:
    """Whether it is an estimate; then everything that shows or keeps it works."""
    def wrong(detail: str) -> errors.BadSetting:
        return errors.BadSetting(errors.unreadable("estimate file", "fit.json", detail))

    try:
        found = estimate_file.from_content(content, wrong, Estimate)
    except errors.PikanidError as problem:
        one_sentence(problem)
        return False
    with np.errstate(all="ignore"):  # numbers near the largest float
        assert str(found) and found._repr_html_() and found.sentence()
        json.dumps(found.to_dict())
        assert found.correlation.shape == found.covariance.shape
        assert len([found.std(f.name, f.recording) for f in found.free]) == len(found.theta)
        for use in (lambda: found.fitted_model, lambda: found.interval("k")):
            try:
                use()
            except errors.PikanidError as problem:
                one_sentence(problem)
    return True


def test_a_saved_estimate_is_one(saved: dict[str, Any]) -> None:
    assert estimate_used(saved)


@pytest.mark.usefixtures("nothing_evaluated")
@pytest.mark.parametrize("value", JSON_VALUES)
def test_every_place_of_an_estimate(value: str, saved: dict[str, Any], tmp_path: Path,
                                    monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for _, content in walk(saved, JSON_VALUES[value]):
        estimate_used(content)
    assert list(tmp_path.iterdir()) == []


def test_every_entry_of_an_estimate_may_lack(saved: dict[str, Any]) -> None:
    accepted = [path for path, content in cut(saved) if estimate_used(content)]
    # what the model or the options may do without; everything else is missed
    assert all(path[0] in ("model", "settings", "history", "warnings", "fits", "trajectories")
               for path in accepted), accepted


@pytest.mark.parametrize("place", ["delay", "hold"])
def test_an_estimate_runs_no_code(place: str, saved: dict[str, Any], tmp_path: Path,
                                  monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    content = json.loads(json.dumps(saved))
    content["model"]["inputs"]["u"][place] = [CODE]
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(content))
    with pytest.raises(errors.BadModel, match="must be"):
        Estimate.load(path)
    assert not (tmp_path / MARK).exists()


# --- bounds of memory ----------------------------------------------------------------------------


def test_a_gzip_file_unpacks_to_no_more_than_is_read(tmp_path: Path,
                                                     monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stored, "MOST_JSON", 2**20)
    path = tmp_path / "fit.json.gz"
    path.write_bytes(gzip.compress(b" " * 2**21))
    with pytest.raises(errors.BadSetting, match="more than 1 MiB"):
        Estimate.load(path)
    path.write_bytes(gzip.compress(b"{}") + gzip.compress(b" " * 2**21))  # a second member
    with pytest.raises(errors.BadSetting, match="more than 1 MiB"):
        Estimate.load(path)


def test_members_of_a_gzip_file_are_joined() -> None:
    content = gzip.compress(b"[1,") + gzip.compress(b"2]") + b"\0" * 10
    assert stored.gunzipped(content, errors.BadSetting) == b"[1,2]"


@pytest.mark.parametrize("text", [b"[[],", b"[{},", b'[{"a":1},', b'["ab",', b"[1.5,", b"[257,"])
def test_the_memory_of_parsed_json_is_known_beforehand(text: bytes,
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    """What Python takes is at most what was foreseen."""
    import tracemalloc

    content = b"[" + text[1:] * 20_000 + b"0]"
    tracemalloc.start()
    try:
        found = json.loads(content)
        taken, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(found) == 20_001
    monkeypatch.setattr(stored, "MOST_PARSED", taken - len(content))
    with pytest.raises(errors.BadSetting, match="MiB of memory"):
        stored.parsed(content, errors.BadSetting)


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "fit.json"
    os.mkfifo(path)
    with pytest.raises(errors.BadSetting, match="no regular file"):
        Estimate.load(path)
    path.rename(tmp_path / "model.toml")
    with pytest.raises(errors.BadModel, match="no regular file"):
        Model.load(tmp_path / "model.toml")


# --- truths, seals, diagnoses --------------------------------------------------------------------

CASE: dict[str, Any] = {
    "id": "001", "class": "pair", "nameable": True,
    "effects": [{"id": "input_delay", "twins": ["sensor_delay"], "near": ""},
                {"id": "coulomb_friction", "twins": [], "near": "viscous"}],
    "base": {"l_theta": {"value": 0.045}},
    "visibility": {"nominal": 40.0, "effects": [40.0, 5.0], "best_rival": ["a"],
                   "best_rival_distance": 2.0}}
ANSWER: dict[str, Any] = {
    "verdict": "set", "mismatch": True,
    "hypotheses": [{"effects": [{"ids": ["sensor_delay"]}, {"ids": ["symbolic:sign(theta_dot)"]}],
                    "probability": 0.6},
                   {"effects": [{"ids": ["input_delay"]}], "probability": 0.3}],
    "parameters": {"before": {}, "after": {"l_theta": {"value": 0.044, "std": 0.001}}},
    "held_out": {"rmse_after": 0.1, "noise": 0.1}}


def judged(case: Any, answer: Any) -> bool:
    try:
        score = judge(case, answer)
    except errors.BadSetting as problem:
        one_sentence(problem)
        return False
    assert repr(score)
    json.dumps(score.__dict__)
    return True


@pytest.mark.usefixtures("nothing_evaluated")
@pytest.mark.parametrize("value", JSON_VALUES)
def test_every_place_of_a_diagnosis_and_of_its_case(value: str) -> None:
    assert judged(CASE, ANSWER)
    for _, content in walk(ANSWER, JSON_VALUES[value]):
        judged(CASE, content)
    for _, content in walk(CASE, JSON_VALUES[value]):
        judged(content, ANSWER)


def test_entries_of_a_diagnosis_may_lack() -> None:
    for _, content in cut(ANSWER):
        judged(CASE, content)
    assert [p for p, content in cut(CASE) if judged(content, ANSWER) and len(p) == 1] == []


def test_many_effects_are_compared_at_once() -> None:
    """Trying all orders of twenty effects would take longer than there is time."""
    effects = [{"id": f"e{k}", "twins": [], "near": ""} for k in range(20)]
    case = {**CASE, "effects": effects, "visibility": {**CASE["visibility"], "effects": [9.0] * 20}}
    ids = [{"ids": [f"e{k}", f"e{k + 1}"]} for k in range(19)] + [{"ids": ["other"]}]
    answer = {**ANSWER, "hypotheses": [{"effects": ids, "probability": 0.5}]}
    assert judge(case, answer).outcome == "wrong"
    ids[-1] = {"ids": ["e19"]}
    assert judge(case, answer).outcome == "right"


@pytest.mark.parametrize("key", ["cases", "sha256", "schema_version"])
@pytest.mark.parametrize("value", JSON_VALUES)
def test_a_truth_and_a_seal_that_hold_anything(key: str, value: str, tmp_path: Path) -> None:
    (tmp_path / "001.csv").write_text("t\n")
    truth = {"schema_version": 1, "cases": [{"sha256": {"001.csv": "0"}}]}
    seal_ = {"schema_version": 1, "sha256": "0"}
    for changed, kept, name in ((truth, seal_, "truth.json"), (seal_, truth, "seal.json")):
        other = "seal.json" if name == "truth.json" else "truth.json"
        (tmp_path / other).write_text(json.dumps(kept))
        for _, content in walk(changed, JSON_VALUES[value]):
            if isinstance(content, dict):
                content = {**content, key: content.get(key, JSON_VALUES[value])}
            try:
                text = json.dumps(content)
            except (RecursionError, ValueError):
                continue  # an integer that has no text: no file can hold it
            (tmp_path / name).write_text(text)
            try:
                assert seal.matches(tmp_path, tmp_path / "truth.json") in (True, False)
            except errors.BadSetting as problem:
                one_sentence(problem)


@pytest.mark.parametrize("name", ["../outside.csv", "/etc/hostname", "a" * 5000, "a\0b", ""])
def test_a_truth_reads_no_file_outside_its_folder(name: str, tmp_path: Path,
                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "outside.csv").write_text("x")
    folder = tmp_path / "set"
    folder.mkdir()
    read = []
    monkeypatch.setattr(Path, "read_bytes", lambda self: read.append(self) or b"")
    assert not seal.intact(folder, {"sha256": {name: "0"}})
    assert read == []
