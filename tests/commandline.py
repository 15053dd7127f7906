"""Helpers of the tests of the command line; `conftest.py` has the fixtures."""

from __future__ import annotations

import json
from collections.abc import Callable
from math import pi
from typing import Any

Run = Callable[..., tuple[int, str, str]]  # words -> exit code, stdout, stderr
SIGMA = 0.1 * pi / 180


def strict(text: str) -> dict[str, Any]:
    """JSON without NaN and infinity."""

    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is no JSON")

    return json.loads(text, parse_constant=refuse)
