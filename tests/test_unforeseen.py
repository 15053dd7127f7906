"""The net of the command line: what nobody foresaw is one sentence and exit code 70."""

from __future__ import annotations

import multiprocessing
from pathlib import Path
from typing import Any

import pytest

import pikanid as pk
from pikanid.cli import EXIT_UNFORESEEN, main
from pikanid.mismatch.fitting.parallel import side_by_side
from pikanid.model import systems


def broken(*_: Any) -> Any:
    return {}["absent\nkey"]


def in_a_thread(*_: Any) -> Any:
    return side_by_side([0, 1, 2], lambda job: 1 / job, 2)


def in_a_process(*_: Any) -> Any:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(divmod, (1, 0))


@pytest.mark.parametrize(("failure", "told"), [
    (broken, "KeyError"), (in_a_thread, "ZeroDivisionError"), (in_a_process, "ZeroDivisionError")])
def test_what_nobody_foresaw_is_one_sentence(
        failure: Any, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    """It says what was being done, on which file, what failed, and how to report it."""
    monkeypatch.setattr(systems, "find", failure)
    code = main(["identify", str(tmp_path / "a run.csv"), "--model", "sloshing"])
    found = capsys.readouterr()
    assert (code, found.out) == (EXIT_UNFORESEEN, "") == (70, "")
    assert found.err.startswith("Error: ") and found.err.count("\n") == 1
    for part in ("pikanid identify", "a run.csv", told, "report", "--debug"):
        assert part in found.err
    assert "Traceback" not in found.err


def test_the_place_is_named(monkeypatch: pytest.MonkeyPatch,
                            capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(systems, "find", in_a_thread)
    main(["models", "sloshing"])
    assert "mismatch/fitting/parallel.py, line" in capsys.readouterr().err


@pytest.mark.parametrize("words", [
    ["--debug", "models", "sloshing"], ["models", "--debug", "sloshing"],
    ["models", "sloshing", "--debug"]])
def test_debug_shows_the_traceback_wherever_it_stands(
        words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
        ) -> None:
    assert main(words) == 0
    capsys.readouterr()
    monkeypatch.setattr(systems, "find", broken)
    assert main(words) == EXIT_UNFORESEEN
    err = capsys.readouterr().err
    assert "Traceback" in err and 'return {}["absent' in err
    assert err.splitlines()[-1].startswith("Error: ")


def test_the_net_is_the_only_one() -> None:
    """Elsewhere failures are named; only the net takes them all, and a study of thousands of fits
    keeps what became of each.
    """
    package = Path(pk.__file__).parent
    places = [f"{path.relative_to(package)}: {line.strip()}"
              for path in sorted(package.rglob("*.py"))
              for line in path.read_text().splitlines()
              if line.strip().startswith(("except Exception", "except:"))]
    assert [place.split(":")[0] for place in places] == [
        "cli.py", "validation/benchmark/spread.py", "validation/benchmark/trial.py"]
