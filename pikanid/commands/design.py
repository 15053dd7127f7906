"""`pikanid design`: which experiment would tell most?"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer

from pikanid.commands.grouped import grouped
from pikanid.commands.options import Quiet, Sigma, assignments, quantity
from pikanid.commands.outputs import check_outputs
from pikanid.commands.reading import Recorded, every_source
from pikanid.commands.simulate import sigmas
from pikanid.figures import ENDINGS, image_for
from pikanid.recording.formats import written_endings

EXAMPLES = """Examples:

  pikanid design sloshing --sigma 0.1deg --out next.csv --limit theta=15deg

  pikanid design friction.toml drag.toml --recorded run.csv --sigma 0.1deg --out next.csv

One model: the profile from which its free parameters are learnt best (D-optimal). Several: the one
that tells them apart best. A model stands for its values; refit it before."""


@grouped
def design(
    models: Annotated[list[str], typer.Argument(
        metavar="NAME|FILE.toml...", help="a model, or hypotheses to be told apart",
        show_default=False)],
    out: Annotated[str, typer.Option(
        "--out", "-o", metavar="FILE", show_default=False,
        help=f"profile to run ({', '.join(written_endings())})")],
    sigma: Sigma = [],  # noqa: B006
    recorded: Annotated[list[str], typer.Option(
        metavar="FILE", show_default=False,
        help="what was recorded before; files joined by + are one")] = [],  # noqa: B006
    candidate: Annotated[list[str], typer.Option(
        metavar="FILE", show_default=False,
        help="profile to choose from; many feasible ones by default")] = [],  # noqa: B006
    acceleration: Annotated[float, typer.Option(
        metavar="X", help="largest value of the input, in its unit")] = 1.0,
    velocity: Annotated[float, typer.Option(
        metavar="X", help="largest integral of the input; inf if it is no acceleration")] = 0.5,
    stroke: Annotated[float, typer.Option(
        metavar="X", help="largest range of the second integral; inf likewise")] = 0.4,
    limit: Annotated[list[str], typer.Option(
        metavar="NAME=VALUE", show_default=False,
        help="largest value that an output may reach, as theta=15deg")] = [],  # noqa: B006
    duration: Annotated[float, typer.Option(metavar="S", help="of the profile [s]")] = 20.0,
    rate: Annotated[float, typer.Option(metavar="HZ", help="its sampling rate")] = 100.0,
    *,
    files: Recorded,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="of random profiles")] = 0,
    plot: Annotated[str | None, typer.Option(
        metavar="FILE", help="figure to write (.png, .svg, .pdf)")] = None,
    quiet: Quiet = False,
) -> int:
    """Choose the next experiment among feasible ones, and write it ready to run."""
    check_outputs({"--out": (out, written_endings()),
                   "--plot": (plot, ENDINGS)},
                  every_source(*models, *recorded, *candidate))
    from pikanid import errors
    from pikanid.mismatch.design.next_experiment import d_optimal, next_experiment
    from pikanid.mismatch.design.profiles import Bounds
    from pikanid.model import systems
    from pikanid.recording.writing import content
    from pikanid.reporting.console import console
    from pikanid.storage.outputs import together

    if not rate > 0:
        raise errors.BadSetting(errors.bad_rate(rate))
    found = {name: systems.find(name) for name in models}
    first = found[models[0]]
    limits = {name: quantity(value, first.output(name).unit, f"--limit {name}")
              for name, value in assignments("--limit", limit, "theta=15deg").items()}
    past = [files.recording(text, *found.values()) for text in recorded]
    # a profile holds inputs alone: nothing to thin
    whole = replace(files, decimate=1)
    offered = [whole.recording(text, *found.values()) for text in candidate] or None
    noise, drive = sigmas(first, sigma) or None, Bounds(acceleration, velocity, stroke)
    if len(found) == 1:
        chosen = d_optimal(first, past, noise, offered, drive, duration, 1 / rate, limits, seed)
    else:
        chosen = next_experiment(found, past, noise, offered, drive, duration, 1 / rate, limits,
                                 seed)
    made = {out: content(chosen.profile.channels, out)}
    if plot is not None:
        made[plot] = image_for(chosen.plot(), plot)
    together(made)
    if not quiet:
        console().print(f"{chosen}\n{out}: {chosen.profile.stop:g} s, "
                        f"columns {', '.join(chosen.profile.names)}", markup=False, soft_wrap=True)
    return 0
