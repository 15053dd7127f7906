"""`pikanid simulate`: a model and an excitation in, a recording out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from pikanid import errors
from pikanid.commands.grouped import grouped
from pikanid.commands.options import (
    Duration,
    Excitation,
    ModelName,
    Quiet,
    Sigma,
    Values,
    adjusted,
    by_output,
    quantity,
)
from pikanid.commands.outputs import check_outputs, tell_notes
from pikanid.commands.reading import Driven, every_source
from pikanid.recording.formats import written_endings

if TYPE_CHECKING:
    from pikanid.model import Model
    from pikanid.recording import Recording

BUILT_IN_RATE = 100.0  # definition: [Hz] of a built-in excitation, unless it is told
EXAMPLES = """Examples:

  pikanid simulate --model sloshing --sigma 0.1deg --out run.csv

  pikanid simulate --model sloshing --set d_theta=0.3 --excitation move --out move.csv

  pikanid simulate --model my.toml --excitation motion.csv --seed 7 --out run.parquet

A file given as --excitation holds the inputs; the outputs are sampled at its times."""


@grouped
def simulate(
    model: ModelName,
    out: Annotated[str, typer.Option(
        "--out", "-o", metavar="FILE", show_default=False,
        help=f"recording to write ({', '.join(written_endings())})")],
    excitation: Excitation = "two_pulse",
    sigma: Sigma = [],  # noqa: B006
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="of the noise")] = 0,
    set_: Values = [],  # noqa: B006
    duration: Duration = 5.0,
    *,
    files: Driven,
    quiet: Quiet = False,
) -> int:
    """Simulate a model and write what would be recorded."""
    check_outputs({"--out": (out, written_endings())},
                  every_source(excitation, model))
    from pikanid.model import systems
    from pikanid.simulation import simulate as run

    chosen = adjusted(systems.find(model), set_)
    drive = excited(chosen, excitation, duration, files)
    tell_notes(drive.notes, quiet)
    made = run(chosen, drive, sigma=sigmas(chosen, sigma), seed=seed)
    if not chosen.inputs:
        made = made.without(*drive.names)
    made.write(out)
    if not quiet:
        from pikanid.reporting.console import console

        screen = console()
        screen.print(f"{out}: {chosen.name}, {made.start:g} s to {made.stop:g} s, "
                     f"columns {', '.join(made.names)}", markup=False, soft_wrap=True)
    return 0


def excited(model: Model, name: str, duration: float, files: Driven) -> Recording:
    """The inputs to simulate under: the built-in excitation `name`, or the recording it names,
    read as `files` says; its rate is that of a built-in one too.
    """
    from pathlib import Path

    from pikanid.recording.excitation import EXCITATIONS, built_in

    if name not in EXCITATIONS:
        import difflib

        if "." not in name and not Path(name).exists():
            known = list(EXCITATIONS)
            close = difflib.get_close_matches(name, known, 1)
            raise errors.BadSetting(errors.unknown_excitation(name, known, close))
        rec = files.recording(name, model)
        if model.inputs and not any(i in rec for i in model.input_names):
            raise errors.BadRecording(errors.nothing_to_simulate(name))
        return rec
    rate = BUILT_IN_RATE if files.rate is None else files.rate
    if not rate > 0:
        raise errors.BadSetting(errors.bad_rate(rate))
    # The profile drives the model's own inputs, in their own units.
    required = [i for i in model.inputs if i.default is None] or list(model.inputs)
    rec = built_in(name, duration, 1 / rate, [i.name for i in required] or ["u"])
    for item in required:
        if item.name in rec and item.unit:
            rec = rec.with_unit(item.name, item.unit)
    still = [i.name for i in required if not rec[i.name].values.any()]
    return replace(rec, notes=(
        *too_short(model, rec),
        *([errors.note_input_at_rest(name, still)] if 0 < len(still) < len(required) else ())))


def too_short(model: Model, rec: Recording) -> tuple[str, ...]:
    """A sentence where a built-in excitation ends before the model has moved."""
    from pikanid.mismatch.design.response import decay_rate, natural_frequency

    rate, lasts = natural_frequency(model) or decay_rate(model), rec.stop - rec.start
    return (errors.note_excitation_short(lasts, 1 / rate),) if rate and lasts * rate < 1 else ()


def sigmas(model: Model, texts: list[str]) -> dict[str, float]:
    """Standard deviation of the noise per output from texts like "0.1deg" or "theta=0.1deg"."""
    wanted = by_output(model, texts)
    made = {name: quantity(text, model.output(name).unit, f"--sigma {name}", difference=True)
            for name, text in wanted.items()}
    for name, value in made.items():
        if value < 0:
            raise errors.BadSetting(errors.sigma_not_positive(wanted[name]))
    return made
