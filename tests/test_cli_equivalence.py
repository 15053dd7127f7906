"""`pikanid equivalence`: exit codes, files, tables and progress, on a few real comparisons."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from pikanid.cli import main
from pikanid.commands.equivalence import count_parts

pytestmark = pytest.mark.kan
Progress = Callable[[str], None] | None


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, object]]:
    """Two settings and one negative control in place of all; what the command asked for."""
    pytest.importorskip("torch", reason="needs the `kan` extra")
    from pikanid.validation import equivalence
    from pikanid.validation.equivalence.controls import quadratic_at_the_end

    calls: list[dict[str, object]] = []

    def few(*, quick: bool, seed: int, progress: Progress) -> equivalence.EquivalenceReport:
        calls.append({"quick": quick, "seed": seed})
        rows = list(quadratic_at_the_end(seed))
        for system in ("sloshing", "duffing"):
            setting = equivalence.Setting(system, "second-order", grid=5, seed=seed)
            if progress is not None:
                progress(setting.describe())
            rows += equivalence.compare(setting)
        return equivalence.EquivalenceReport(tuple(rows))

    monkeypatch.setattr(equivalence, "run_checks", few)
    return calls


def test_tables_and_verdict(asked: list[dict[str, object]], capsys: pytest.CaptureFixture[str]
                            ) -> None:
    assert main(["equivalence", "--quick", "--seed", "3"]) == 0
    assert asked == [{"quick": True, "seed": 3}]
    out, err = capsys.readouterr()
    assert "Gauss-Newton matrix" in out and "negative control" in out
    assert out.rstrip().endswith("All 16 comparisons passed.")
    assert err == "" and "\x1b" not in out


def test_json_holds_every_comparison(asked: list[dict[str, object]], tmp_path: Path,
                                     capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["equivalence", "--json", str(tmp_path / "out.json"), "-q"]) == 0
    assert capsys.readouterr().out == ""
    found = json.loads((tmp_path / "out.json").read_text())
    assert found["schema_version"] == 1 and found["passed"] is True and len(found["rows"]) == 16
    assert {"check", "setting", "quantity", "difference", "tolerance", "must_differ",
            "passed"} <= set(found["rows"][0])
    assert main(["equivalence", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out) == found


def test_report_and_figure(asked: list[dict[str, object]], tmp_path: Path,
                           capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["equivalence", "--report", str(tmp_path / "new")]) == 0
    assert sorted(os.listdir(tmp_path / "new")) == ["equivalence.md", "equivalence.png"]
    assert "written: " in capsys.readouterr().out


def test_a_difference_is_exit_code_3(asked: list[dict[str, object]],
                                     monkeypatch: pytest.MonkeyPatch,
                                     capsys: pytest.CaptureFixture[str]) -> None:
    from pikanid.validation import equivalence

    few = equivalence.run_checks

    def spoilt(**options: object) -> equivalence.EquivalenceReport:
        first, *rest = few(**options).rows  # type: ignore[arg-type]  # by name
        return equivalence.EquivalenceReport(
            (replace(first, difference=float("nan")), *rest))

    monkeypatch.setattr(equivalence, "run_checks", spoilt)
    assert main(["equivalence"]) == 3
    out = capsys.readouterr().out
    assert "not passed: degree 2 at T" in out and "1 of 16 comparisons did not pass." in out


@pytest.mark.parametrize("arguments", [
    ["--json", "out.txt"], ["--json", "absent/out.json"], ["--report", "file.md/x"],
    ["--seed", "-1"], ["surplus"]])
def test_bad_input_is_one_sentence(arguments: list[str], tmp_path: Path,
                                   monkeypatch: pytest.MonkeyPatch,
                                   capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file.md").write_text("not a folder")
    assert main(["equivalence", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("Error: ") and err.count("\n") == 1


@pytest.mark.parametrize("quick", [True, False])
def test_progress_counts_every_part(quick: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("torch", reason="needs the `kan` extra")
    from pikanid.validation.equivalence import checks, controls, deep, delivery

    monkeypatch.setattr(checks, "compare", lambda setting: ())
    monkeypatch.setattr(checks, "compare_paths", lambda setting, quick: ())
    for module, name in ((controls, "uniqueness"), (controls, "controls"),
                         (controls, "quadratic_at_the_end"), (deep, "tangent_step"),
                         (delivery, "delivered_curve")):
        monkeypatch.setattr(module, name, lambda seed, **options: ())
    parts: list[str] = []
    checks.run_checks(quick=quick, progress=parts.append)
    assert len(parts) == count_parts(quick)
