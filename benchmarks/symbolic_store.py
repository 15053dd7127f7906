"""Results of a long report, kept one a line in build/, so that an interrupted run goes on."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

BUILD = Path("build") / "symbolic"


def collected(part: str, function: Callable[..., dict[str, Any]],
              cases: Sequence[tuple[Any, ...]], stored: bool = False) -> list[dict[str, Any]]:
    """The result of every case, from the file of an earlier run where it is there.

    With `stored` only those are given that are there already.
    """
    BUILD.mkdir(parents=True, exist_ok=True)
    path = BUILD / f"{part}.jsonl"
    known: dict[str, dict[str, Any]] = {}
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            entry = json.loads(line)
            known[json.dumps(entry["case"])] = entry["result"]
    for case in cases:
        key = json.dumps(list(case))
        if key in known or stored:
            continue
        known[key] = function(*case)
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"case": list(case), "result": known[key]}) + "\n")
    keys = [json.dumps(list(case)) for case in cases]
    return [known[key] for key in keys if key in known]
