"""How far the inputs of an experiment may go, where they are no accelerations of a drive."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from pikanid import errors
from pikanid.formula.units import convertible
from pikanid.model.parts import Input
from pikanid.recording import Recording
from pikanid.recording.channel import Array

Range = tuple[float, float]


def ranges_of(inputs: Iterable[Input], given: Mapping[str, Range] | None,
              recorded: Sequence[Recording], bounded: bool) -> dict[str, Range]:
    """Least and largest value of each input, in its unit: as given, else as recorded.

    Args:
        inputs: That are driven.
        given: Ranges by the inputs' names.
        recorded: Where each input moved before.
        bounded: Whether the bounds of a drive were given: they hold where no range is known.

    Raises:
        BadSetting: A range is none, of no input, or not known; an acceleration needs none.

    >>> ranges_of([Input("u", "V")], {"u": (0.0, 10.0)}, [], False)
    {'u': (0.0, 10.0)}
    """
    driven, given = {i.name: i for i in inputs}, given or {}
    for name, (low, high) in given.items():
        if name not in driven:
            raise errors.BadSetting(errors.range_of_nothing(name, list(driven)))
        if not (np.isfinite([low, high]).all() and low < high):
            raise errors.BadSetting(errors.no_range(name, low, high))
    found = dict(given)
    for name, i in driven.items():
        if name in found or bounded or _is_acceleration(i):
            continue
        values = [r.as_input(name, i.unit or None).values for r in recorded if name in r]
        if not values or not np.ptp(together := np.concatenate(values)) > 0:
            raise errors.BadSetting(errors.range_not_known(name, i.unit))
        found[name] = float(together.min()), float(together.max())
    return found


def within(shape: Array, limits: Range) -> Array:
    """A profile (N,) of sizes up to one, about the middle of a range."""
    low, high = limits
    return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * shape)


def _is_acceleration(i: Input) -> bool:
    return bool(i.unit) and convertible(i.unit, "m/s^2")
