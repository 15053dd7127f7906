"""The keys of a model file, and what is meant by those that are none."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any

from pikanid import errors
from pikanid.model.channel_maps import INPUT_MAPS, OUTPUT_MAPS

SECTIONS = ("name", "domain", "states", "inputs", "parameters", "equations", "outputs", "splines",
            "effects")
OWN = SECTIONS[:2]  # layout: of the model itself, no tables
KEYS = {
    "states": ("unit", "initial", "guess", "bounds", "scope", "description"),
    "inputs": ("unit", "hold", "default", *INPUT_MAPS),
    "parameters": ("unit", "guess", "value", "bounds", "scope", "description"),
    "outputs": ("unit", "expression", "sigma", *OUTPUT_MAPS),
    "splines": ("degree", "knots"),
}
# Words of other tools -> keys here: that which the section has is meant.
_MEANT: Mapping[str, Sequence[str]] = {
    **dict.fromkeys(("equation", "formula", "expr", "rhs", "ode"), ("expression",)),
    **dict.fromkeys(("start", "begin", "x0", "ic", "initial_value"), ("initial", "guess")),
    **dict.fromkeys(("initial", "estimate", "free"), ("guess", "default")),
    **dict.fromkeys(("value", "constant", "fixed"), ("value", "default", "initial", "expression")),
    **dict.fromkeys(("min", "max", "lower", "upper", "range", "limit", "limits"),
                    ("bounds", "clip")),
    **dict.fromkeys(("std", "sd", "stdev", "noise", "error"), ("sigma",)),
    **dict.fromkeys(("comment", "note", "label", "doc"), ("description",)),
    **dict.fromkeys(("interpolation", "order"), ("hold", "degree")),
}
_OF_EQUATIONS = ("equation", "equations", "expression", "formula", "expr", "rhs", "ode",
                 "derivative", "rate", "dot")  # layout: a state's is no key of its table


def check_keys(table: Mapping[str, Any], known: Sequence[str], source: str, where: str) -> None:
    """Refuse a key that is none, with the one that seems to be meant.

    Args:
        table: Of the file.
        known: Its keys.
        source: The file.
        where: The table's place: ``"the file"``, or section and name, as ``"states.x"``.

    Raises:
        BadModel: A key is unknown.

    >>> try:
    ...     check_keys({"start": 1.0}, KEYS["states"], "m.toml", "states.x")
    ... except errors.BadModel as error:
    ...     print(str(error).split(". ")[-1])
    Did you mean 'initial'?
    """
    section, _, name = where.partition(".")
    for key in map(str, table):
        if key in known:
            continue
        if section == "states" and key.lower() in _OF_EQUATIONS:
            raise errors.BadModel(errors.equation_of_state(source, where, key, name))
        raise errors.BadModel(errors.model_file_key(source, where, key, known, _close(key, known)))


def _close(key: str, known: Sequence[str]) -> list[str]:
    word = key.lower()
    meant = [one for one in (word, *_MEANT.get(word, ())) if one in known]
    return meant[:1] or difflib.get_close_matches(word, known, 1)
