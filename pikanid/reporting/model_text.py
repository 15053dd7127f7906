"""A model as a model file that reads well: one line an entry, as people write it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from pikanid.model import Model


def toml(model: Model) -> str:
    """The model file's text; reading it gives the model back.

    >>> import tomllib
    >>> from pikanid.model.systems import pendulum
    >>> Model.from_dict(tomllib.loads(toml(pendulum()))) == pendulum()
    True
    """
    content = model.to_dict()
    tables = {key: entry for key, entry in content.items() if isinstance(entry, Mapping)}
    lines = [f"{key} = {_value(entry)}" for key, entry in content.items() if key not in tables]
    for section, entries in tables.items():
        lines += ["", f"[{section}]"]
        width = max((len(key) for key in entries), default=0)
        lines += [f"{key:<{width}} = {_value(entry)}" for key, entry in entries.items()]
    return "\n".join(lines) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
    if isinstance(value, str):
        # A basic string of TOML is one of JSON, but for DEL.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)
