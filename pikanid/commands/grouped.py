"""Options that commands share, as one parameter: a dataclass whose fields are the options."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Any, get_type_hints


def grouped(command: Callable[..., int]) -> Callable[..., int]:
    """The command with every parameter that is a dataclass taken apart into that one's fields.

    Typer makes an option of a parameter and knows no groups of them.  Fields that are no arguments
    of the dataclass are no options either.

    >>> from dataclasses import dataclass
    >>> @dataclass
    ... class Window:
    ...     start: float = 0.0
    ...     stop: float = 1.0
    >>> def length(*, window: Window, factor: float = 1.0) -> int:
    ...     return int(factor * (window.stop - window.start))
    >>> list(inspect.signature(grouped(length)).parameters), grouped(length)(start=2, stop=5)
    (['start', 'stop', 'factor'], 3)
    """
    hints = get_type_hints(command, include_extras=True)
    groups = {name: options for name, kind in hints.items() if (options := _options(kind))}
    parameters = []
    for name, own in inspect.signature(command).parameters.items():
        parameters += groups.get(name) or [own.replace(
            kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[name])]

    @functools.wraps(command)
    def flat(**given: Any) -> int:
        made = {name: hints[name](**{o.name: given.pop(o.name) for o in options if o.name in given})
                for name, options in groups.items()}
        return command(**given, **made)

    flat.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]  # for Typer
    flat.__annotations__ = {p.name: p.annotation for p in parameters}
    return flat


def _options(kind: Any) -> list[inspect.Parameter]:
    """The fields of a dataclass as parameters; none of any other type."""
    if not is_dataclass(kind):
        return []
    hints = get_type_hints(kind, include_extras=True)
    return [inspect.Parameter(f.name, inspect.Parameter.KEYWORD_ONLY, default=_default(f),
                              annotation=hints[f.name]) for f in fields(kind) if f.init]


def _default(field: Field[Any]) -> Any:
    return field.default if field.default_factory is MISSING else field.default_factory()
