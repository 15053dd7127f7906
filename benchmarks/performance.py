"""Turn pytest-benchmark's JSON into reports/performance.md.

Usage: python benchmarks/performance.py BENCHMARKS.json PERFORMANCE.md [TABLE.md ...]

Ratios are against the entry that its group marks as the reference, measured in the same run; an
entry with a published time [s] also says how many times as fast as that it was.  Further tables are
appended as they are.
"""

from __future__ import annotations

import importlib.metadata
import json
import os
import platform
import sys
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

LIBRARIES = ("numpy", "scipy", "sympy", "numba", "casadi", "torch", "pykan")
PUBLISHED = ("Published: Table III of the paper, low noise, on its authors' machine, so that these "
             "ratios compare machines too. Over all its scenarios PIKAN took 1272 to 1672 s.")


def main(source: str, target: str, *tables: str) -> None:
    """Read the measurements, write the report (atomically)."""
    data = json.loads(Path(source).read_text())
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for entry in data["benchmarks"]:
        groups[entry["group"] or "other"].append(entry)
    lines = ["# Performance", "", _setting(), ""]
    for name, entries in groups.items():
        lines += _table(name, entries)
    for table in tables:
        lines += [Path(table).read_text()]
    path = Path(target)
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
    with os.fdopen(handle, "w") as file:
        file.write("\n".join(lines))
    os.replace(temporary, path)


def _setting() -> str:
    versions = []
    for name in ("pikanid", *LIBRARIES):
        try:
            versions.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return (f"Written by `make bench`. Python {platform.python_version()}, {os.cpu_count()} cores, "
            f"one thread; {', '.join(versions)}. Times are medians; machines differ, so read the "
            "ratios, which come from one run. \"In turn\" is the median of the ratios to the "
            "reference timed in the same round, which a machine that changes its speed between two "
            "benchmarks does not bend.")


def _table(name: str, entries: list[dict[str, Any]]) -> list[str]:
    base = next((e["stats"]["median"] for e in entries if e["extra_info"].get("reference")), None)
    published = any("published" in e["extra_info"] for e in entries)
    notes = sorted({k for e in entries for k in e["extra_info"]} - {"reference", "published"})
    head = ["", "median", "spread (IQR)", *(["ratio"] if base else []),
            *(["published", "published / ours"] if published else []), *notes]
    rule = "| --- |" + " ---: |" * (len(head) - 1)
    lines = [f"## {name}", "", "| " + " | ".join(head) + " |", rule]
    ordered = sorted(entries, key=lambda e: e["stats"]["median"])
    for e, label in zip(ordered, _labels([e["name"] for e in ordered]), strict=True):
        s, more = e["stats"], e["extra_info"]
        mark = " (reference)" if more.get("reference") else ""
        cells = [label + mark, _time(s["median"]), _time(s["iqr"])]
        cells += [f"{s['median'] / base:.3g}"] if base else []
        if published:
            then = more.get("published")
            cells += [f"{then:g} s", f"{then / s['median']:.0f}"] if then else ["", ""]
        lines.append("| " + " | ".join([*cells, *(str(more.get(k, "")) for k in notes)]) + " |")
    if published:
        lines += ["", PUBLISHED]
    return [*lines, ""]


def _labels(names: Sequence[str]) -> list[str]:
    """What is timed: parameters of the tests, or the tests where they share the parameter."""
    tests, parameters = zip(*(n.removeprefix("test_").rstrip("]").split("[") if "[" in n
                              else (n.removeprefix("test_"), "") for n in names), strict=True)
    told = [p or t for t, p in zip(tests, parameters, strict=True)]
    return [one.replace("_", " ") if one in tests else one
            for one in (told if len({*told}) == len(told) else tests)]


def _time(seconds: float) -> str:
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("µs", 1e6)):
        if seconds * factor >= 1:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


if __name__ == "__main__":
    main(*sys.argv[1:])
