"""`pikanid effects`: what a model may lack, in the words of its file, checked and shown."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from pikanid import errors
from pikanid.commands.grouped import grouped
from pikanid.commands.options import (
    Catalogues,
    Duration,
    Excitation,
    ModelName,
    Quiet,
    Values,
    adjusted,
)
from pikanid.commands.outputs import check_outputs, tell_notes
from pikanid.commands.reading import Driven, every_source
from pikanid.commands.simulate import excited
from pikanid.figures import ENDINGS, save_figure

AGREES = 0.1  # layout: difference of derivatives from which on "agrees" would be the wrong word

EXAMPLES = """Examples:

  pikanid effects --model tanks.toml

  pikanid effects --model tanks.toml --catalogue hydraulics.toml --excitation run.csv --plot e.png

Exit codes: 0 all is well; 2 bad input."""


@grouped
def effects(
    model: ModelName,
    catalogue: Catalogues = [],  # noqa: B006
    excitation: Excitation = "two_pulse",
    set_: Values = [],  # noqa: B006
    duration: Duration = 5.0,
    *,
    files: Driven,
    plot: Annotated[str | None, typer.Option(
        metavar="FILE", show_default=False,
        help="draw what each effect does at its guess (.png, .svg, .pdf)")] = None,
    quiet: Quiet = False,
) -> int:
    """Check the effects that a model may lack: symbols, units, derivatives; show what they do."""
    check_outputs({"--plot": (plot, ENDINGS)},
                  [*every_source(excitation), model, *catalogue])
    from pikanid.mismatch.design.effects_shown import effects_figure, effects_shown
    from pikanid.model import systems
    from pikanid.reporting.console import console
    from pikanid.reporting.tables import row, table

    chosen = adjusted(systems.find(model), set_, catalogue=catalogue)
    drive = excited(chosen, excitation, duration, files)
    tell_notes(drive.notes, quiet)
    shown = effects_shown(chosen, drive)
    if not shown:
        raise errors.BadModel(errors.no_effects(chosen.name))
    if plot is not None and not all(one.failure for one in shown):
        save_figure(effects_figure(shown, chosen), plot)
    if quiet:
        return 0
    made = table("effect", "what it adds", "shown at", "changes outputs by", "derivative")
    for one in shown:
        size = one.effect.size
        largest = ", ".join(f"{o}: {v:.3g} {chosen.output(o).unit}".strip()
                            for o, v in one.largest.items())
        key = f"{one.effect.key} ({one.effect.variant})" if one.effect.variant else one.effect.key
        row(made, key, one.effect.expression,
            f"{size.name} = {one.size:.3g} {size.unit}".strip(),
            "cannot be simulated there" if one.failure else largest,
            "" if one.failure else "reaches no output" if math.isnan(one.derivative) else
            f"agrees to {100 * one.derivative:.2g} %" if one.derivative < AGREES else
            f"differs by {100 * one.derivative:.0f} %")
    console().print(made)
    return 0
