"""`pikanid study`: the main job."""

from __future__ import annotations

from typing import Annotated

import typer

from pikanid.commands.outputs import report_folder

EXAMPLES = """Examples:

  pikanid study

  pikanid study --seeds 100 --out reports-100

The real recording is an excerpt that comes with the package: no network is needed."""


def study(
    out: Annotated[str, typer.Option(
        "--out", "-o", metavar="FOLDER", help="folder of the report")] = "build/study",
    seeds: Annotated[int, typer.Option(
        metavar="N", min=0, help="noisy recordings in each repetition; 0 for none")] = 20,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="write the report only")] = False,
) -> int:
    """Compare the strategies on simulated and real data, diagnose the real one; write a report."""
    folder = report_folder("--out", out)
    from pikanid.reporting.console import console, working
    from pikanid.reporting.study_report import show, write
    from pikanid.validation.study.run import count_steps, run

    with working("study", count_steps(), quiet) as step:
        found = run(seeds, step=step)
    written = write(found, folder)
    if not quiet:
        screen = console()
        show(screen, found)
        screen.print()
        for path in written:
            screen.print(f"written: {path}", markup=False, soft_wrap=True)
    return 0
