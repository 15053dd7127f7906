"""`pikanid confusable`: what could an experiment reveal, before it is run?"""

from __future__ import annotations

from typing import Annotated

import typer

from pikanid.commands.grouped import grouped
from pikanid.commands.options import (
    Catalogues,
    Duration,
    Excitation,
    Json,
    ModelName,
    Quiet,
    Sigma,
    Values,
    adjusted,
)
from pikanid.commands.outputs import STDOUT, check_outputs, tell_notes, written
from pikanid.commands.reading import Driven, every_source
from pikanid.commands.simulate import excited, sigmas

EXAMPLES = """Examples:

  pikanid confusable --model sloshing --sigma 0.1deg

  pikanid confusable --model my.toml --excitation motion.csv --sigma 0.1deg --json told.json"""


@grouped
def confusable(
    model: ModelName,
    excitation: Excitation = "two_pulse",
    sigma: Sigma = [],  # noqa: B006
    set_: Values = [],  # noqa: B006
    catalogue: Catalogues = [],  # noqa: B006
    duration: Duration = 5.0,
    *,
    files: Driven,
    strength: Annotated[float, typer.Option(
        metavar="N", help="how many σ strong effects are made before they are compared")] = 30.0,
    quick: Annotated[bool, typer.Option(
        "--quick", help="first order only: nothing is refitted")] = False,
    json_: Json = None,
    quiet: Quiet = False,
) -> int:
    """Say which effects an experiment could detect, from which size, and which it confuses."""
    check_outputs({"--json": (json_, [".json"])}, [*every_source(excitation), model, *catalogue])
    from pikanid.mismatch.design.confusable import confusable as run
    from pikanid.model import systems
    from pikanid.reporting.console import console, working

    chosen = adjusted(systems.find(model), set_, catalogue=catalogue)
    drive = excited(chosen, excitation, duration, files)
    tell_notes(drive.notes, quiet)
    with working("looking", 28, quiet) as step:
        found = run(chosen, drive, sigmas(chosen, sigma) or None, strength=strength,
                    refit=not quick, tell=step)
    written({}, json_, found.to_dict())
    if not quiet and json_ != STDOUT:
        console().print(str(found), markup=False, soft_wrap=True)
    return 0
