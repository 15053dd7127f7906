"""`pikanid diagnose`: which physics does a model leave out?"""

from __future__ import annotations

from typing import Annotated

import typer

from pikanid.commands.grouped import grouped
from pikanid.commands.options import (
    Catalogues,
    Json,
    ModelName,
    Quiet,
    Sigma,
    Values,
    adjusted,
    seconds,
)
from pikanid.commands.outputs import STDOUT, check_outputs, tell_notes, written
from pikanid.commands.reading import Reading, every_source, files_read
from pikanid.recording.formats import readable

EXAMPLES = """Examples:

  pikanid diagnose run1.csv --held-out run2.csv --model sloshing

  pikanid diagnose run1.csv --held-out run2.csv --model my.toml --report why.html --json why.json

  pikanid diagnose run1.csv --held-out run2.csv --model my.toml --extended better.toml

  pikanid diagnose run1.csv --model pendulum --quiet-until 2s

  pikanid diagnose run1.csv --held-out run2.csv --model tanks.toml --catalogue hydraulics.toml

Exit codes: 0 diagnosed, whatever was found; 2 bad input."""


@grouped
def diagnose(
    train: Annotated[list[str], typer.Argument(
        metavar="TRAIN...", help=f"recordings to explain: {readable()}; files joined by + "
        "are one",
        show_default=False)],
    model: ModelName,
    held_out: Annotated[list[str], typer.Option(
        metavar="OTHER", show_default=False,
        help="recording of another experiment, to prove it on")] = [],  # noqa: B006
    json_: Json = None,
    report: Annotated[str | None, typer.Option(
        metavar="FILE.html", help="write a page for people")] = None,
    extended: Annotated[str | None, typer.Option(
        metavar="FILE.toml", help="write the model with what was found, at its estimates")] = None,
    sigma: Sigma = [],  # noqa: B006
    quiet_until: Annotated[float | None, typer.Option(
        metavar="TIME", parser=seconds, help="nothing moves before, as 2s")] = None,
    settings: Annotated[str | None, typer.Option(
        metavar="FILE.toml", show_default=False,
        help="error rates, thresholds, budgets: fields of pikanid.Settings")] = None,
    alpha: Annotated[float | None, typer.Option(
        help="rate of false alarms, 0.01 by default", show_default=False)] = None,
    set_: Values = [],  # noqa: B006
    catalogue: Catalogues = [],  # noqa: B006
    *,
    files: Reading,
    workers: Annotated[int | None, typer.Option(
        metavar="N", min=1, show_default=False,
        help="threads; by default two where there are as many cores")] = None,
    quiet: Quiet = False,
) -> int:
    """Find out which physics a model leaves out, and prove it on another recording."""
    named = [*train, *held_out, model, *catalogue, *([settings] if settings else [])]
    check_outputs({"--json": (json_, [".json"]),
                   "--report": (report, [".html"]),
                   "--extended": (extended, [".toml"])},
                  every_source(*named))
    from pikanid.mismatch.diagnose import diagnose as run
    from pikanid.mismatch.settings.settings import Settings
    from pikanid.mismatch.steps.unlike import unlike
    from pikanid.model import systems
    from pikanid.reporting.console import working

    taken = Settings() if settings is None else Settings.read(settings)
    taken = taken if alpha is None else taken.with_values({"alpha": alpha})
    chosen = adjusted(systems.find(model), set_, catalogue=catalogue)
    records, others = ([files.recording(text, chosen, sigma=sigma) for text in texts]
                       for texts in (train, held_out))
    stretch = None
    if quiet_until is not None:
        begin = min(r.start for r in records)
        stretch = (begin, begin + quiet_until)
    tell_notes(unlike(chosen, records, others), quiet)
    with working("diagnosing", 8, quiet) as step:
        dx = run(chosen, records, others or None,
                 settings=taken, quiet=stretch, tell=step, workers=workers)
    made = {}
    if report is not None:
        from pikanid.reporting.diagnosis_page import page

        made[report] = page(dx, records[0].name, files_read(*named)).encode()
    if extended is not None:
        made[extended] = dx.model.to_toml().encode()
    written(made, json_, dx.to_dict())
    if not quiet and json_ != STDOUT:
        print(dx)
    return 0
