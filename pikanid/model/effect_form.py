"""Effects written for any model: placeholders stand for states, inputs, parameters and channels.

    [effects.overflow]
    name = "overflow of {x}"
    for = { x = "state" }
    parameters.k = { unit = "1/s", guess = "10/duration", bounds = [0, "1/interval"] }
    parameters.h = { unit = "{x}", guess = "0.3*x_low + 0.7*x_high", bounds = ["x_low", "x_high"] }
    add = { x = "-k*max(x - h, 0)" }
    null = { k = 0 }

Texts in braces become the unit of what a placeholder stands for, in names its name. Guesses and
bounds may be formulas of the range that a state or an output covers (``x_low``, ``x_high``), of the
largest size of an input or a channel (``u_size``), of a parameter's value (``p_value``), of
absolute zero on a state's scale of temperature (``x_zero``), of the recordings' duration [s] and of
the usual interval between samples [s]: what is gone within one is as good as gone at once. A state
that no output shows may go as far again beyond its range, which the nominal model guesses: bounds
follow that. A parameter with a ``value`` instead of a guess is not estimated. A coordinate is a
state whose rate is another state: ``"its rate"``, the place after it, is that one; an angle is a
coordinate with a unit of angles, a current or a voltage a state with one of those, and so is a
voltage output, or a current input. A parameter is one of the equation of the first place; a channel
like it, recorded and not used by the model, has a unit that converts to its own, and a signal like
it may be an input or a fixed parameter of the model as well, such as the temperature of the
surroundings.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pikanid.formula.expressions import check_name
from pikanid.storage.entries import Entry

MOST_PLACES = 4  # limit: of placeholders in one form
FIRST = ("state", "coordinate", "angle", "current", "voltage", "input", "output",
         "voltage output")
KINDS = (*FIRST, "current input", "other state", "its rate", "channel", "channel like it",
         "signal like it", "parameter")


@dataclass(frozen=True)
class EffectForm:
    """An effect for any model: its table, and what each placeholder may stand for.

    Attributes:
        key: Its id.
        places: Placeholder -> kind (one of `KINDS`).
        content: Its table in a file, without the placeholders' kinds.
        source: Of the table, for messages.
        within: States that placeholders may stand for; None: any.
    """

    key: str
    places: Mapping[str, str]
    content: Mapping[str, Any]
    source: str
    within: tuple[str, ...] | None = None


def form_of(key: str, entry: Entry, source: str) -> EffectForm:
    """The form that a table describes; what depends on a model is checked when it is bound.

    Raises:
        BadModel: It has no placeholders, or one of no kind.
    """
    check_name(key, "effect")
    table = entry.table(["for", "parameters", "null"], optional=None)
    entry.plain()  # tables, texts and numbers, not too deep
    for section in ("parameters", "states"):
        for part in table[section].table(optional=None).values() if section in table else ():
            part.table(optional=None)
    if "name" in table:
        table["name"].text()
    places = {check_name(n, "placeholder"): e.text(KINDS) for n, e in table["for"].table(
        optional=None, most=MOST_PLACES).items()}
    if next(iter(places.values()), "") not in FIRST:
        raise table["for"].fail(f"a table whose first entry is one of {', '.join(FIRST)}")
    return EffectForm(key, places, {k: v for k, v in entry.value.items() if k != "for"}, source)
