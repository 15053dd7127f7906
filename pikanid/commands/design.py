"""`pikanid design`: which experiment would tell most?"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pikanid.commands.grouped import grouped
from pikanid.commands.options import Quiet, Sigma, assignments, quantity, seconds
from pikanid.commands.outputs import check_outputs
from pikanid.commands.reading import Recorded, every_source
from pikanid.commands.simulate import sigmas
from pikanid.figures import ENDINGS, image_for
from pikanid.recording.formats import written_endings

if TYPE_CHECKING:
    from pikanid.model import Model

EXAMPLES = """Examples:

  pikanid design sloshing --sigma 0.1deg --out next.csv --limit theta=15deg

  pikanid design friction.toml drag.toml --recorded run.csv --sigma 0.1deg --out next.csv

  pikanid design dc_motor --sigma 2rad/s --range u=-6:6V --out next.csv

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
    span: Annotated[list[str], typer.Option(
        "--range", metavar="NAME=LOW:HIGH", show_default=False,
        help="least and largest value of an input that is no acceleration, as u=0:10V; by default "
             "those recorded")] = [],  # noqa: B006
    acceleration: Annotated[float | None, typer.Option(
        metavar="X", help="largest acceleration of the drive; 1 m/s^2 by default")] = None,
    velocity: Annotated[float | None, typer.Option(
        metavar="X", help="largest velocity; 0.5 m/s by default")] = None,
    stroke: Annotated[float | None, typer.Option(
        metavar="X", help="range of its position; 0.4 m by default")] = None,
    limit: Annotated[list[str], typer.Option(
        metavar="NAME=VALUE", show_default=False,
        help="largest value that an output may reach, as theta=15deg")] = [],  # noqa: B006
    duration: Annotated[float | None, typer.Option(
        metavar="TIME", parser=seconds,
        help="of the profile; by default that of --recorded, or 20 s")] = None,
    rate: Annotated[float | None, typer.Option(
        metavar="HZ", help="its sampling rate; that of --recorded, or 100 Hz, by default")] = None,
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

    if rate is not None and not rate > 0:
        raise errors.BadSetting(errors.bad_rate(rate))
    found = {name: systems.find(name) for name in models}
    first = found[models[0]]
    limits = {name: quantity(value, first.output(name).unit, f"--limit {name}")
              for name, value in assignments("--limit", limit, "theta=15deg").items()}
    past = [files.recording(text, *found.values()) for text in recorded]
    # a profile holds inputs alone: nothing to thin
    whole = replace(files, decimate=1)
    offered = [whole.recording(text, *found.values()) for text in candidate] or None
    given = {k: v for k, v in (("acceleration", acceleration), ("velocity", velocity),
                               ("stroke", stroke)) if v is not None}
    asked: dict[str, Any] = {
        "recorded": past, "sigma": sigmas(first, sigma) or None, "candidates": offered,
        "bounds": Bounds(**given) if given else None, "duration": duration,
        "dt": None if rate is None else 1 / rate, "limits": limits, "seed": seed,
        "ranges": ranges(first, span)}
    chosen = d_optimal(first, **asked) if len(found) == 1 else next_experiment(found, **asked)
    made = {out: content(chosen.profile.channels, out)}
    if plot is not None:
        made[plot] = image_for(chosen.plot(), plot)
    together(made)
    if not quiet:
        nearer = "" if limits else " --limit NAME=VALUE keeps an output nearer."
        console().print(f"{chosen}{nearer}\n{out}: {chosen.profile.stop:g} s, "
                        f"columns {', '.join(chosen.profile.names)}", markup=False, soft_wrap=True)
    return 0


def ranges(model: Model, texts: list[str]) -> dict[str, tuple[float, float]]:
    """The texts of --range, in the units of the model's inputs."""
    from pikanid import errors
    from pikanid.formula.quantity import parts

    found: dict[str, tuple[float, float]] = {}
    units = {i.name: i.unit for i in model.inputs}
    for name, text in assignments("--range", texts, "u=0:10V").items():
        low, colon, high = text.partition(":")
        if not (colon and low.strip() and high.strip()):
            raise errors.BadSetting(errors.not_a_range(text, "u=0:10V"))
        ends = parts(low), parts(high)
        if ends[0] and ends[1] and not ends[0][1]:  # 0:10V are volts both
            low += ends[1][1]
        least, most = (quantity(v, units.get(name, ""), f"--range {name}") for v in (low, high))
        found[name] = least, most
    return found
