"""Slow tests in parts of about the same length, which take turns."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

SECONDS = Path(__file__).with_name("slow_seconds.json")  # of a core, by test
UNKNOWN = 10.0  # seconds of a test that is not in the list yet


def known_seconds() -> dict[str, float]:
    """The stored durations; they balance the parts and decide nothing else."""
    return json.loads(SECONDS.read_text())


def part(tests: Sequence[str], seconds: Mapping[str, float], number: int, count: int) -> set[str]:
    """The tests of one part: the longest first, each to the part that is shortest so far.

    Args:
        tests: Names, in any order.
        seconds: Name -> how long it takes, where that is known.
        number: Of the part, from 1.
        count: Of all parts.

    Raises:
        ValueError: If there is no such part.
    """
    if not 1 <= number <= count:
        raise ValueError(f"There is no part {number} of {count}.")
    parts: list[set[str]] = [set() for _ in range(count)]
    filled = [0.0] * count
    for test in sorted(tests, key=lambda name: (-seconds.get(name, UNKNOWN), name)):
        shortest = filled.index(min(filled))
        parts[shortest].add(test)
        filled[shortest] += seconds.get(test, UNKNOWN)
    return parts[number - 1]


def keep_part(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave only one part of the tests of a session, if the option --slow-part=K/N asks for it."""
    chosen = config.getoption("--slow-part")
    if chosen is None:
        return
    number, count = (int(text) for text in chosen.split("/"))
    kept = part([item.nodeid for item in items], known_seconds(), number, count)
    config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in kept])
    items[:] = [item for item in items if item.nodeid in kept]
