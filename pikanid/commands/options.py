"""Options that commands share, and what people write behind them: assignments, quantities with
units.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from pikanid import errors
from pikanid.recording.excitation import EXCITATIONS

if TYPE_CHECKING:
    from pikanid.model import Model


def seconds(text: str | float) -> float:
    """A time of the command line: a number in seconds, or with a unit.

    Raises:
        BadSetting: If it is neither.

    >>> seconds("2.5"), seconds("300 ms")
    (2.5, 0.3)
    """
    return text if isinstance(text, float) else quantity(text, "s", "a time")


def quantity(text: str, unit: str, where: str, difference: bool = False) -> float:
    """A number in `unit`, as `pikanid.formula.quantity.quantity` reads it.

    >>> quantity("45 mm", "m", "l_theta")
    0.045
    """
    from pikanid.formula import quantity as units_quantity

    return units_quantity.quantity(text, unit, where, difference)


ModelName = Annotated[str, typer.Option(
    "--model", "-m", metavar="NAME|FILE.toml", help="a ready-made model, or a model file",
    show_default=False)]
Sigma = Annotated[list[str], typer.Option(
    "--sigma", metavar="[NAME=]VALUE", show_default=False,
    help="standard deviation of the noise, as 0.1deg or theta=0.1deg")]
Values = Annotated[list[str], typer.Option(
    "--set", metavar="NAME=VALUE", show_default=False,
    help="guess of a free parameter, or value of a fixed one")]
Catalogues = Annotated[list[str], typer.Option(
    "--catalogue", metavar="NAME|FILE.toml", show_default=False,
    help="effects that the model may lack besides: hydraulics, thermal, kinetics, electrical, "
    "mechanics, populations, or a file of your own")]
Columns = Annotated[list[str], typer.Option(
    "--column", metavar="NAME=COLUMN", show_default=False,
    help="column, channel or topic of the file that holds a signal, by name, path or a pattern "
    "that fits one; t=COLUMN for time")]
Units = Annotated[list[str], typer.Option(
    "--unit", metavar="NAME=UNIT", show_default=False,
    help="unit of a signal, where the file does not say")]
FileRate = Annotated[float | None, typer.Option(
    "--rate", metavar="HZ", help="sampling rate, where the file has no times")]
Sheet = Annotated[str | None, typer.Option(
    "--sheet", metavar="NAME", help="sheet of a workbook, by name or number from 0")]
Start = Annotated[float | None, typer.Option(
    "--from", metavar="TIME", help="start, as 2 or 300ms", show_default=False, parser=seconds)]
Stop = Annotated[float | None, typer.Option(
    "--to", metavar="TIME", help="end, as 10 or 5min", show_default=False, parser=seconds)]
OwnTimes = Annotated[bool, typer.Option(
    "--own-times", help="take the times of files joined by + as they stand, whatever their dates")]
Stride = Annotated[int, typer.Option(
    "--decimate", metavar="N", min=1, help="use every N-th sample of the outputs")]
Excitation = Annotated[str, typer.Option(
    "--excitation", "-e", metavar="NAME|FILE",
    help=f"what drives the model: {', '.join(EXCITATIONS)}, or a recording of its inputs (files "
    "joined by + are one)")]
Duration = Annotated[float, typer.Option(
    "--duration", metavar="TIME", help="of a built-in excitation", parser=seconds)]
Rate = Annotated[float | None, typer.Option(
    "--rate", metavar="HZ", show_default=False,
    help="sampling rate of a built-in excitation, 100 by default, or of a file without times")]
Json = Annotated[str | None, typer.Option(
    "--json", metavar="FILE", show_default=False,
    help="write the result as JSON (- for standard output)")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="print nothing but errors")]


def assignments(option: str, texts: Sequence[str], example: str) -> dict[str, str]:
    """NAME=VALUE texts as a dictionary.

    Raises:
        BadSetting: If a text is no assignment, or a name comes twice.

    >>> assignments("--set", ["l_theta=0.05"], "l_theta=0.05")
    {'l_theta': '0.05'}
    """
    found: dict[str, str] = {}
    for text in texts:
        name, sign, value = text.partition("=")
        if not (sign and name.strip() and value.strip()):
            raise errors.BadSetting(errors.not_an_assignment(option, text, example))
        if name.strip() in found:
            raise errors.BadSetting(errors.named_twice(option, name.strip()))
        found[name.strip()] = value.strip()
    return found


def by_output(model: Model, texts: Sequence[str]) -> dict[str, str]:
    """The texts of --sigma by output: one for all, or "theta=0.1deg" for one.

    Raises:
        BadSetting: If two are for all outputs, or for one of them.
    """
    common = [text for text in texts if "=" not in text]
    named = assignments("--sigma", [text for text in texts if "=" in text], "theta=0.1deg")
    if len(common) > 1:
        raise errors.BadSetting(errors.named_twice("--sigma", "all outputs"))
    return {**{o: common[0] for o in model.output_names if common}, **named}


def adjusted(model: Model, set_: Sequence[str], fix: Sequence[str] = (),
             free: Sequence[str] = (), catalogue: Sequence[str] = ()) -> Model:
    """The model with values set, parameters fixed or freed, initial states freed, and the effects
    of the files in `catalogue` listed as what it may lack.

    Raises:
        BadModel: If the model has no such parameter or state, or a value leaves its bounds.
        BadSetting: If a text cannot be read, or a parameter is to be both free and fixed.

    >>> from pikanid.model.systems import sloshing
    >>> adjusted(sloshing(), ["l_theta=50mm"], fix=["d_theta=0.1"], free=["theta"]).free_names
    ('l_theta', 'theta_0')
    """
    from pikanid.model.effects_file import read_effects

    for name in free:
        if name in model.state_names:
            model = model.with_initial(**{name: "free"})
        else:
            model = model.free(name)
    fixed = {}
    for text in fix:
        name, sign, value = text.partition("=")
        if not name.strip() or (sign and not value.strip()) or name.strip() in fixed:
            raise errors.BadSetting(errors.not_an_assignment("--fix", text, "d_theta=0.15"))
        if name.strip() in free:
            raise errors.BadSetting(errors.free_and_fixed(name.strip()))
        fixed[name.strip()] = value.strip()
    for name, value in fixed.items():
        p = model.parameter(name)
        number = quantity(value, p.unit, f"--fix {name}") if value else p.value
        model = model.fix(**{name: number})
    for path in catalogue:
        model = model.with_candidates(*read_effects(path))
    values = assignments("--set", set_, "l_theta=0.05")
    return model.with_values({
        name: quantity(value, model.parameter(name).unit, f"--set {name}")
        for name, value in values.items()})
