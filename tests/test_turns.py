"""Parts of the slow tests: every test is in one of them, and none is far longer than another."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from turns import UNKNOWN, keep_part, known_seconds, part

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("count", [1, 3, 7])
def test_every_test_comes_round_once(count: int) -> None:
    tests = [f"t{k}" for k in range(20)]
    seconds = {f"t{k}": float(k) for k in range(15)}
    parts = [part(tests, seconds, number, count) for number in range(1, count + 1)]
    assert sorted(name for one in parts for name in one) == sorted(tests)
    lengths = [sum(seconds.get(name, UNKNOWN) for name in one) for one in parts]
    assert max(lengths) - min(lengths) <= 14.0
    assert part(tests[::-1], seconds, 1, count) == parts[0]


@pytest.mark.parametrize("number", [0, 4])
def test_a_part_that_there_is_not(number: int) -> None:
    with pytest.raises(ValueError, match="no part"):
        part(["a"], {}, number, 3)


def test_stored_durations_are_of_tests_that_there_are() -> None:
    files = {name.split("::")[0] for name in known_seconds()}
    assert files and all((ROOT / file).is_file() for file in files)


def test_a_session_runs_its_part_only() -> None:
    names, ran, left = [f"tests/test_made.py::test_{k}" for k in range(5)], [], []
    hook = SimpleNamespace(pytest_deselected=lambda items: left.extend(i.nodeid for i in items))
    for chosen in (None, "1/2", "2/2"):
        config = SimpleNamespace(getoption={"--slow-part": chosen}.get, hook=hook)
        items = [SimpleNamespace(nodeid=name) for name in names]
        keep_part(config, items)  # type: ignore[arg-type]  # stand-ins
        ran.append([item.nodeid for item in items])
    assert ran[0] == names == sorted(ran[1] + ran[2]) == sorted(left)
    assert ran[1] and ran[2]
