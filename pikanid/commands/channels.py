"""`pikanid channels`: what is in a file, before anything is made of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pikanid.commands.options import FileRate, Json, Sheet
from pikanid.commands.outputs import STDOUT, check_outputs, written
from pikanid.commands.reading import every_source
from pikanid.recording.formats import readable

if TYPE_CHECKING:
    from pikanid.recording.reading.listing import Listed, Listing

EXAMPLES = """Examples:

  pikanid channels run.mf4

  pikanid channels output.csv+input.csv

  pikanid channels rosbag2_2026_01_15/ --json -

Every name and path may stand behind --column NAME= of the other commands."""


def channels(
    recordings: Annotated[list[str], typer.Argument(
        metavar="RECORDING...", help=f"{readable()}; files joined by + are listed one by one",
        show_default=False)],
    rate: FileRate = None,
    sheet: Sheet = None,
    json_: Json = None,
) -> int:
    """List what is in a file: channels with their units, rates, spans and numbers of samples."""
    files = every_source(*recordings)
    check_outputs({"--json": (json_, [".json"])}, files)
    from pikanid.recording.reading.listing import listing

    found = [listing(path, sheet, rate) for path in files]
    written({}, json_, {"schema_version": 1, "files": [_content(one) for one in found]})
    if json_ != STDOUT:
        for one in found:
            _show(one)
    return 0


def _show(found: Listing) -> None:
    from pikanid.reporting.console import console
    from pikanid.reporting.tables import row, table

    screen = console()
    began = "" if found.began is None else f", t = 0 at {_date(found.began)}"
    screen.print(f"{found.name}: {found.format}, {len(found.channels)} channels{began}",
                 markup=False, soft_wrap=True)
    numbers = ["samples", "rate [Hz]", "from [s]", "to [s]"]
    whole = any(one.path not in ("", one.name) for one in found.channels)
    remarks = any(one.remark for one in found.channels)
    made = table("channel", *(["path"] if whole else []), "unit", *numbers,
                 *(["remark"] if remarks else []), numbers=numbers)
    for one in found.channels:
        path = one.path if one.path != one.name else ""
        row(made, one.name, *([path] if whole else []), one.unit, *_numbers(one),
            *([one.remark] if remarks else []))
    screen.print(made)
    for note in found.notes:
        screen.print(f"note: {note}", markup=False, soft_wrap=True)


def _numbers(one: Listed) -> tuple[str, str, str, str]:
    if math.isnan(one.start):
        return str(one.samples), "", "", ""
    rate = "" if math.isnan(one.rate) else f"{one.rate:.6g}"
    return (str(one.samples), rate if one.uniform else f"{rate}, uneven",
            f"{one.start:.6g}", f"{one.stop:.6g}")


def _content(found: Listing) -> dict[str, Any]:
    from dataclasses import asdict

    return {"name": found.name, "format": found.format, "notes": list(found.notes),
            "began": None if found.began is None else _date(found.began),
            "channels": [asdict(one) for one in found.channels]}


def _date(posix: float) -> str:
    """A POSIX time as ISO 8601 has it, in UTC."""
    from datetime import UTC, datetime

    return datetime.fromtimestamp(posix, UTC).isoformat(timespec="milliseconds")
