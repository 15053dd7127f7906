"""`pikanid benchmark`: scenarios × strategies × protocols × seeds."""

from __future__ import annotations

from contextlib import suppress
from typing import Annotated, Literal

import typer

from pikanid import errors
from pikanid.commands.interrupts import interrupted_by_kill
from pikanid.commands.options import Quiet
from pikanid.commands.outputs import report_folder

EXAMPLES = """Examples:

  pikanid benchmark --seeds 100

  pikanid benchmark --scenario sparse_high --strategy nls --strategy pikan --protocol both

  pikanid benchmark --scenario beyond --scenario mine.toml --out mine

  pikanid benchmark --seeds 100 --resume --scheduler tcp://10.0.0.1:8786

Scenarios: paper (Tables III and IV), beyond (process noise, physics not modelled, coloured noise,
outliers), one of either by its name, or a TOML file of your own. Each finished trial is stored at
once in trials.sqlite; --resume goes on there, with the same result as without an interruption.

Exit codes: 0 done; 2 bad input; 130 interrupted."""


def benchmark(
    scenario: Annotated[list[str], typer.Option(
        metavar="NAME|FILE.toml", show_default=False,
        help="scenario, group (paper, beyond), or file; paper by default")] = [],  # noqa: B006
    strategy: Annotated[list[str], typer.Option(
        metavar="NAME", show_default=False,
        help="strategy; by default all that take less than some seconds")] = [],  # noqa: B006
    protocol: Annotated[Literal["paper", "default", "both"], typer.Option(
        help="settings of each strategy: those of Table II, its own, or both")] = "default",
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="seeds 0 to N - 1")] = 20,
    resume: Annotated[bool, typer.Option(
        "--resume", help="go on with the store that is in the folder")] = False,
    scheduler: Annotated[str | None, typer.Option(
        metavar="ADDRESS", show_default=False,
        help="of a Dask scheduler whose workers do the work (extra: cluster)")] = None,
    workers: Annotated[int | None, typer.Option(
        metavar="N", min=1, show_default=False,
        help="processes on this machine; by default one a core")] = None,
    out: Annotated[str, typer.Option(
        "--out", "-o", metavar="FOLDER", help="of the store and the tables")] = "build/benchmark",
    quiet: Quiet = False,
) -> int:
    """Fit many noisy recordings by many strategies; say how far each can be trusted."""
    from joblib import cpu_count

    from pikanid.reporting import benchmark_report as report
    from pikanid.reporting.benchmark_live import Sofar, watching
    from pikanid.reporting.console import console
    from pikanid.validation.benchmark import files, runner
    from pikanid.validation.benchmark.trial import PROTOCOLS, slow, strategies

    known = strategies()
    for name in strategy:
        if name not in known:
            raise errors.BadSetting(errors.unknown_strategy(name, known))
    names = list(dict.fromkeys(strategy)) or [n for n in strategies(variants=False) if not slow(n)]
    chosen = files.chosen(scenario or ["paper"])
    folder = report_folder("--out", out)
    order = runner.Order(tuple(chosen), tuple(names),
                         PROTOCOLS if protocol == "both" else (protocol,), seeds,
                         workers or cpu_count(), scheduler or "")
    sofar = Sofar({s.name: s.true for s in chosen})
    try:
        with interrupted_by_kill(), watching(sofar, quiet) as (begin, tell):
            runner.run(order, folder, resume, begin, tell)
    except KeyboardInterrupt:
        with suppress(errors.PikanidError):  # it may have come before there was a store
            report.write(folder)  # of what is finished
        raise
    written, found = report.write(folder)
    if not quiet:
        screen = console()
        report.show(screen, found)
        for path in written:
            screen.print(f"written: {path}", markup=False, soft_wrap=True)
    return 0
