"""JSON that every reader takes: no NaN, no infinity, arrays and paths as what they hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from commandline import strict

from pikanid.reporting import strict_json


def test_strict_json_has_no_nan() -> None:
    content = {"a": float("nan"), "b": [np.inf, np.float32(1)], "c": np.arange(2), "d": Path("x")}
    assert strict(strict_json.text(content)) == {"a": None, "b": [None, 1.0], "c": [0, 1], "d": "x"}
