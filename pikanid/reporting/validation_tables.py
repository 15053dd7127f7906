"""A comparison of models in a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pikanid.comparison.validation import NUMBERS
from pikanid.pieces.sheet import Sheet
from pikanid.reporting.tables import shown

if TYPE_CHECKING:
    from rich.console import Console

    from pikanid.comparison import Validation


def scores(found: Validation) -> Sheet:
    """Every model on every output of every recording, best first."""
    headers, cells = found.rows()
    return Sheet(headers, cells, NUMBERS)


def pairs(found: Validation) -> Sheet:
    """Who is better than whom, and how sure that is."""
    size = "MSE difference / σ²"
    return Sheet(("better", "worse", size, "95 % interval", "p (Holm)"), tuple(
        (p.better, p.worse, f"{p.difference:.3g}", f"{p.interval[0]:.3g} … {p.interval[1]:.3g}",
         f"{p.p_value:.2g}") for p in found.pairs), (size, "p (Holm)"))


def show_validation(out: Console, found: Validation) -> None:
    """The sentence, the protocol, the tables and the notes."""
    out.print(found.sentence(), style="bold", markup=False, soft_wrap=True)
    out.print(str(found.protocol), markup=False, soft_wrap=True)
    out.print()
    out.print(shown(scores(found)))
    if found.pairs:
        out.print()
        out.print(shown(pairs(found)))
    left = found.left()
    if left:
        out.print()
    for sentence, good in left:
        out.print(sentence, style="green" if good else "yellow", markup=False, soft_wrap=True)
    for note in found.notes:
        out.print(f"Note: {note}", style="yellow", markup=False, soft_wrap=True)
