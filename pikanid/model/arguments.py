"""What the operations of a `Model` are given: parameters, values with or without a unit, bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pikanid import errors
from pikanid.formula.quantity import quantity
from pikanid.model.lookup import Lookup
from pikanid.model.parts import Parameter


def parameters_of(given: Any) -> Sequence[Parameter]:
    """The parameters, where it is nothing else; BadModel otherwise."""
    if not isinstance(given, list | tuple):
        raise errors.BadModel(errors.not_of_kind(
            "'parameters'", type(given).__name__, "a list of Parameter"))
    for part in given:
        if not isinstance(part, Parameter):
            raise errors.BadModel(errors.not_of_kind(
                "What is added", type(part).__name__, "a Parameter"))
    return given


def table(given: Any) -> Mapping[str, Any]:
    """Parameter -> value; None stands for none of them, and all else is a BadModel."""
    if given is not None and not isinstance(given, Mapping):
        raise errors.BadModel(errors.not_of_kind(
            "'values'", type(given).__name__, "a dictionary: parameter -> value"))
    return given or {}


def number(model: Lookup, name: str, given: Any) -> float:
    """The value of a parameter in its unit; a text may carry another one: "50 mm".

    Raises:
        BadModel: If it is no number; BadSetting or BadUnit if the text is not one with a unit.
    """
    if isinstance(given, str):
        return quantity(given, model.parameter(name).unit, f"'{name}'")
    try:
        return float(given)
    except (TypeError, ValueError, OverflowError):
        raise errors.BadModel(errors.not_of_kind(
            f"The value of '{name}'", type(given).__name__, "a number")) from None


def limits(model: Lookup, name: str, given: Any) -> tuple[float, float]:
    """The bounds of a parameter, each as `number` takes it."""
    if not isinstance(given, list | tuple) or len(given) != 2:
        raise errors.BadModel(errors.not_of_kind(
            f"The bounds of parameter '{name}'", type(given).__name__, "(lower, upper)"))
    return number(model, name, given[0]), number(model, name, given[1])
