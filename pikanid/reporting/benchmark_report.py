"""What a benchmark found: on a screen, and as files beside its store."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from pikanid.reporting import benchmark_sheets as sheets
from pikanid.reporting.tables import shown
from pikanid.storage.outputs import together
from pikanid.validation.benchmark import export
from pikanid.validation.benchmark.cells import Group, groups

if TYPE_CHECKING:
    from rich.console import Console

EXPLAINED = (
    "Median and spread (half of what the middle 68 % cover) of the estimates; bias and root mean "
    "square error in per cent of the true value, with 95 % bootstrap intervals over the seeds; "
    "RMSE/CRB: over the Cramér-Rao standard deviation, where there is one; coverage: of the 95 % "
    "intervals that the strategy states; broke down: some parameter off by more than half of its "
    "value and by more than six Cramér-Rao standard deviations, or no estimate; CPU: processor "
    "time of a fit, median. Shares have Wilson intervals.")


def write(folder: Path) -> tuple[list[Path], list[Group]]:
    """Write `summary.md`, `trials.csv` and, with pyarrow, `trials.parquet`; the paths, and what was
    found.

    Raises:
        BadRecording: There is no store, it is damaged, or the folder cannot be written to.
    """
    about, frame = export.table(folder)
    found = list(groups(frame)) if len(frame) else []
    files = {folder / "summary.md": text(found, json.loads(about["versions"])).encode(),
             **export.files(folder, about, frame)}
    together(files)
    return list(files), found


def show(screen: Console, found: list[Group]) -> None:
    """All tables on a screen."""
    for parameter in parameters(found):
        screen.print()
        screen.print(parameter, style="bold", markup=False)
        screen.print(shown(sheets.summary(found, parameter)))
    for why in sheets.reasons(found):
        screen.print(f"No estimate: {why}", markup=False, soft_wrap=True)


def parameters(found: list[Group]) -> list[str]:
    """Of all cells, each once."""
    return list(dict.fromkeys(p for g in found for p in g.cells))


def text(found: list[Group], versions: dict[str, str]) -> str:
    """The summary in Markdown."""
    parts = ["# Benchmark", EXPLAINED]
    for parameter in parameters(found):
        parts += [f"## {parameter}", sheets.summary(found, parameter).to_markdown()]
    if why := sheets.reasons(found):
        parts += ["## No estimate", "\n".join(f"- {one}" for one in why)]
    said = ", ".join(f"{k} {v}" for k, v in versions.items())
    return "\n\n".join([*parts, "## Settings", f"Written by `pikanid benchmark`. {said}."]) + "\n"
