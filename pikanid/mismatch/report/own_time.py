"""The unit of time in which what is found is told: the model's own."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from functools import lru_cache

from pikanid.formula.grammar import written
from pikanid.formula.units import measure
from pikanid.model import Model
from pikanid.pieces.time_unit import time_unit
from pikanid.recording import Recording

SECOND = "s"


def own_time(model: Model, recordings: Iterable[Recording]) -> str:
    """The unit of time that a model's units hold; where they hold none, the one in which times of
    recordings read well; seconds where they hold several.

    Args:
        model: Nominal, so that nothing is there but what the user wrote.
        recordings: That it is to explain.
    """
    units = {*(p.unit for p in model.parameters if p.free), *(x.unit for x in model.states),
             *(u.unit for u in model.inputs), *(o.unit for o in model.outputs)}
    held = {name for unit in units if unit for name, _ in measure(unit).powers if _is_time(name)}
    if held:
        return held.pop() if len(held) == 1 else SECOND
    return time_unit(max(r.stop - r.start for r in recordings))[1]


@lru_cache(maxsize=256)
def told_in(unit: str, time: str) -> tuple[float, str]:
    """What a number in a unit is to be multiplied by to be in the same with another unit of time in
    the place of seconds, and that one.

    >>> told_in("degC/s", "h"), told_in("N*s/m", "s"), told_in("J/K", "min")
    ((3600.0, 'degC/h'), (1.0, 'N*s/m'), (1.0, 'J/K'))
    """
    found = dict(measure(unit).powers) if unit and time != SECOND else {}
    if SECOND not in found or time in found:
        return 1.0, unit
    power = found[SECOND]
    named = {time if name == SECOND else name: exponent for name, exponent in found.items()}
    return measure(time).scale ** -float(power), written(named)


def _is_time(name: str) -> bool:
    return measure(name).kind == (("[time]", Fraction(1)),)
