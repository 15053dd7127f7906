"""`pikanid score`: diagnose a concealed set, and say how many answers were right."""

from __future__ import annotations

from typing import Annotated

import typer

from pikanid.commands.options import Catalogues, Json, ModelName, Quiet, Values, adjusted
from pikanid.commands.outputs import STDOUT, check_outputs, written

EXAMPLES = """Examples:

  pikanid score mine --truth mine.json --model tanks.toml --catalogue hydraulics

  pikanid score recordings --truth truth.json --model sloshing --json scores.json

Every answer is kept (--answers); an interrupted run goes on where it stopped. Right: the truth is
among at most two explanations, where the recordings can tell. Wrong: an answer without the truth.

Exit codes: 0 scored; 2 bad input."""


def score(
    folder: Annotated[str, typer.Argument(
        metavar="FOLDER", show_default=False, help="recordings of a set, from `pikanid conceal`")],
    truth: Annotated[str, typer.Option(metavar="FILE", show_default=False, help="of that set")],
    model: ModelName,
    answers: Annotated[str | None, typer.Option(
        metavar="FOLDER", show_default=False,
        help="of the answers, one file a case; FOLDER.answers by default")] = None,
    json_: Json = None,
    set_: Values = [],  # noqa: B006
    catalogue: Catalogues = [],  # noqa: B006
    workers: Annotated[int | None, typer.Option(
        metavar="N", min=1, show_default=False, help="processes; by default one a core")] = None,
    quiet: Quiet = False,
) -> int:
    """Diagnose every case of a concealed set and count what was right."""
    check_outputs({"--json": (json_, [".json"])}, [truth, model, *catalogue])
    import os

    from pikanid import errors
    from pikanid.model import systems
    from pikanid.reporting.console import console, working
    from pikanid.reporting.tables import row, table
    from pikanid.validation.concealed import seal
    from pikanid.validation.concealed.score import tally
    from pikanid.validation.own_model.trial import places, trials

    chosen = adjusted(systems.find(model), set_, catalogue=catalogue)
    if not seal.matches(folder, truth):
        raise errors.BadSetting(errors.not_the_sealed(truth, folder))
    count = len(seal.cases_of(truth))
    with working("diagnosing", count, quiet) as step:
        found = trials(folder, truth, chosen, answers or f"{folder.rstrip('/')}.answers",
                       workers or os.cpu_count() or 1, step)
    shares = tally([one.score for one in found]) | {"place": places(found)}
    if not quiet and json_ != STDOUT:
        each = table("case", "hidden", "answer", "outcome", "s")
        for one in found:
            said = f"{one.score.verdict}: {one.said}" if one.said else one.score.verdict
            row(each, one.score.case, one.hidden, said, one.score.outcome, f"{one.cpu:.1f}")
        console().print(each)
        made = table("what", "share")
        for name, share in shares.items():
            if share.n:
                row(made, name.replace("_", " "), str(share))
        console().print(made)
    written({}, json_, {
        "shares": {n: {"count": s.count, "of": s.n, "interval": list(s.interval)}
                   for n, s in shares.items()},
        "cases": [{"case": one.score.case, "class": one.score.kind, "hidden": one.hidden,
                   "verdict": one.score.verdict, "said": one.said, "outcome": one.score.outcome,
                   "reason": one.score.reason, "place": one.place, "cpu": one.cpu}
                  for one in found]})
    return 0
