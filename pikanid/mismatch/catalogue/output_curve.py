"""Catalogue: an output follows one of the states that it is the sum of in a curve.

Where a free parameter says how an output of several terms follows a state, as the slope of a cell's
open-circuit voltage over its charge, that may be no straight line.  Of an output of one term the
sensor's own curve says the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np
import sympy as sp

from pikanid.formula.expressions import symbol
from pikanid.formula.names import free_name
from pikanid.model import Effect, Model
from pikanid.model.parts import Parameter

SHARE = 0.05  # numerical: of an output's range, at which its curve is looked for first


def output_curves(model: Model, motion: Callable[[], Mapping[str, np.ndarray]],
                  ranges: Mapping[str, float], taken: Iterable[str] = ()) -> Iterator[Effect]:
    """For each state that such an output holds with a free parameter.

    The curve is of second and third order about the middle of what the state covers: what a line is
    of it, the model's own parameters are.

    Args:
        model: Whose outputs.
        motion: Values (L,) of each state along the recordings; asked where there is one.
        ranges: Of each output, from lowest to highest.
        taken: Names, beside the model's own, that the parameters must not have.

    >>> cell = Model.from_dict({
    ...     "states": {"charge": {}}, "inputs": {"I": {}}, "equations": {"charge": "-I"},
    ...     "parameters": {"slope": {"guess": 0.5}, "R": {"guess": 0.03}},
    ...     "outputs": {"U": {"expression": "slope*charge - R*I"}}})
    >>> [e.name for e in output_curves(cell, lambda: {"charge": np.linspace(0, 1)}, {"U": 0.6})]
    ['a curve of charge in U']
    """
    used = {*model.symbols, *taken}
    free = {symbol(n) for n in model.free_names}
    for output in (o for o in model.outputs if o.name in ranges):
        terms = sp.Add.make_args(output.expression)
        for x in model.state_names if len(terms) > 1 else ():
            if not output.expression.diff(symbol(x)).free_symbols & free:
                continue
            low, high = float(motion()[x].min()), float(motion()[x].max())
            if low == high:
                continue
            span, middle = (high - low) / 2, (high + low) / 2
            size, skew = (free_name(f"{kind}_{x}_{output.name}", used) for kind in ("bend", "skew"))
            along = f"(({x} - ({middle:.4g}))/{span:.4g})"
            yield Effect(
                "output_curve", f"a curve of {x} in {output.name}", (
                    Parameter(size, SHARE * (ranges[output.name] or 1.0), output.unit),
                    Parameter(skew, 0.0, "1")), (size, 0.0), family="sensor curve",
                variant=f"{x},{output.name}", outputs={output.name: {
                    "offset": f"{size}*{along}**2*(1 + {skew}*{along})"}})
