"""`pikanid benchmark` from the command line to its tables."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from pikanid import errors
from pikanid.cli import main
from pikanid.reporting.benchmark_live import Sofar, watching
from pikanid.validation.benchmark import cells, export, runner
from pikanid.validation.benchmark.trial import (
    Outcome,
    Trial,
    plan,
    protocols_of,
    slow,
    strategies,
)

COMMAND = ["benchmark", "--scenario", "sparse_high", "--strategy", "nls", "--strategy", "ipda",
           "--workers", "1"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a small benchmark left."""
    made = tmp_path_factory.mktemp("benchmark")
    assert main([*COMMAND, "--protocol", "both", "--seeds", "3", "--out", str(made), "-q"]) == 0
    return made


def test_tables_and_trials_are_written(folder: Path) -> None:
    text = (folder / "summary.md").read_text("utf-8")
    assert "## l_theta" in text and "## d_theta" in text
    assert text.count("| sparse, 1° |") == 2 * 2 * 2  # strategies, protocols, parameters
    frame = pd.read_csv(folder / "trials.csv")
    assert len(frame) == 2 * 2 * 3 * 2


def test_parquet_holds_the_same_and_what_made_it(folder: Path) -> None:
    pytest.importorskip("pyarrow", reason="needs the `parquet` extra")
    about, frame = export.from_parquet(folder / "trials.parquet")
    _, stored = export.table(folder)
    pd.testing.assert_frame_equal(frame, stored)
    assert json.loads(about["versions"]) == runner.versions()
    assert json.loads(about["scenarios"])["sparse_high"]["stride"] == 10
    assert json.loads(about["runs"])[0]["seeds"] == 3
    (folder / "broken.parquet").write_bytes(b"PAR1 and no more")
    with pytest.raises(errors.BadRecording, match="table of trials"):
        export.from_parquet(folder / "broken.parquet")


def test_cells_are_the_trials(folder: Path) -> None:
    _, frame = export.table(folder)
    found = list(cells.groups(frame))
    assert [(g.strategy, g.protocol) for g in found] == [
        ("nls", "default"), ("nls", "paper"), ("ipda", "default"), ("ipda", "paper")]
    nls = found[0]
    assert list(nls.cells) == ["l_theta", "d_theta"]
    rows = frame[(frame.strategy == "nls") & (frame.protocol == "default")
                 & (frame.parameter == "d_theta")]
    assert nls.cells["d_theta"].estimates.tolist() == rows.estimate.tolist()
    assert nls.cells["d_theta"].bound == pytest.approx(0.0302, rel=0.01)
    assert found[3].breakdowns.value == 1.0 and nls.breakdowns.value == 0.0
    assert all(g.cpu > 0.0 and g.seeds == 3 and g.failed == 0 for g in found)


def test_a_second_run_needs_resume(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*COMMAND, "--out", str(folder), "--seeds", "3"]) == 2
    assert "--resume" in capsys.readouterr().err
    assert main([*COMMAND, "--out", str(folder), "--seeds", "3", "--resume"]) == 0
    said = capsys.readouterr().out
    assert "RMSE/CRB" in said and "written: " in said


@pytest.mark.parametrize(("more", "said"), [
    (["--strategy", "nsl"], "'nsl' is no strategy"),
    (["--scenario", "dens"], "is no scenario"),
    (["--scenario", "absent.toml"], "absent.toml"),
    (["--protocol", "mine"], "--protocol"),
    (["--seeds", "0"], "--seeds"),
])
def test_mistakes_are_told_in_one_sentence(
        more: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["benchmark", "--out", str(tmp_path / "out"), *more]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and said in lines[0]
    assert not (tmp_path / "out" / "trials.sqlite").exists()


def test_an_interrupt_keeps_tables_of_what_is_finished(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "TOGETHER", 1)
    real, seen = Sofar.add, []

    def add(self: Sofar, outcomes: Any) -> None:
        real(self, outcomes)
        seen.extend(outcomes)
        if len(seen) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(Sofar, "add", add)
    assert main([*COMMAND, "--out", str(tmp_path), "-q"]) == 130
    assert len(pd.read_csv(tmp_path / "trials.csv")) == 4


def test_every_strategy_and_variant_is_planned_quick_ones_first() -> None:
    names = list(strategies())
    found = list(plan(["a", "b"], names, ("default", "paper"), 2))
    assert len(set(found)) == len(found) == 2 * 2 * sum(len(protocols_of(n)) for n in names)
    late = [slow(t.strategy) for t in found]
    assert late == sorted(late)
    quick = [t.seed for t, is_slow in zip(found, late, strict=True) if not is_slow]
    assert quick == sorted(quick)


def test_progress_shows_errors_and_failures_so_far() -> None:
    sofar = Sofar({"a": {"k": 2.0}})
    trial = Trial("a", "nls", "default", 0)
    sofar.add([Outcome(trial, {"k": (2.2, 0.1)}), Outcome(trial, {"k": (2.4, math.nan)}),
               Outcome(trial, {}, "It failed.")])
    screen = Console(width=120, record=True, file=open(os.devnull, "w"))  # noqa: SIM115
    screen.print(sofar.table())
    screen.file.close()
    row = next(line for line in screen.export_text().splitlines() if "nls" in line)
    assert row.split() == ["nls", "default", "3", "1", "15"]


def test_nothing_is_drawn_where_nobody_watches(capsys: pytest.CaptureFixture[str]) -> None:
    sofar = Sofar({"a": {"k": 2.0}})
    with watching(sofar, quiet=False) as (begin, tell):
        begin(0, 1)
        tell([Outcome(Trial("a", "nls", "default", 0), {"k": (2.0, 0.1)})])
    assert capsys.readouterr().err == "" and sofar.done["nls", "default"] == 1


def test_a_terminal_sees_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    import io

    from pikanid.reporting import benchmark_live

    text = io.StringIO()
    monkeypatch.setattr(benchmark_live, "console", lambda stream: Console(
        file=text, force_terminal=True, width=160, color_system=None))
    sofar = Sofar({"a": {"k": 2.0}})
    with watching(sofar, quiet=False) as (begin, tell):
        begin(5, 10)
        tell([Outcome(Trial("a", "nls", "paper", 0), {"k": (2.0, np.nan)})])
    shown = text.getvalue()
    assert "5 trials kept" in shown and "1/5" in shown and "a, nls, paper" in shown
