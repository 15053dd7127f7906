"""A reading put back into pykan: every edge of a copy becomes what it was named."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import sympy as sp

from pikanid import errors
from pikanid.approximators.kan.deep import DeepKAN
from pikanid.approximators.kan.edges import edges_of
from pikanid.approximators.kan.push import SymbolicEdge
from pikanid.approximators.kan.push import push as fix
from pikanid.formula.expressions import symbol
from pikanid.symbolic.library import NOTHING, X
from pikanid.symbolic.numeric import Array, compiled
from pikanid.symbolic.reading import Reading


def push(reading: Reading) -> Any:
    """A pykan model whose edges are the named formulas, with the constants of the refit.

    pykan's plot, its `symbolic_formula` and its forward pass show what was read.  The model that
    was read stays as it is, and pykan's table of functions too.

    Raises:
        BadSetting: The reading is not that of a KAN.
    """
    if reading.kan is None or reading.composition is None:
        raise errors.BadSetting(errors.nothing_to_push())
    made, theta = reading.composition, reading.theta
    edges = {}
    for place, form, at in made.edges:
        own = [*form.amplitudes, *(k.name for k in form.knobs)]
        swap = {symbol(n): sp.Float(float(v)) for n, v in zip(own, theta[at], strict=True)}
        formula = (form.expression - symbol("d")).xreplace(swap)
        edges[place] = SymbolicEdge(form.name, _function(formula), _formula(formula))
    offsets = tuple(np.array(theta[first:first + made.subnodes(layer)])
                    for layer, first in enumerate(made.offsets))
    live = {(e.layer, e.source, e.target) for e in edges_of(DeepKAN(reading.kan))}
    gone = tuple(p for p in live if made.forms.get(p, NOTHING) is NOTHING)
    return fix(reading.kan, edges, offsets, gone)


def _function(formula: sp.Expr) -> Callable[[Array], Array]:
    function = compiled((X,), (formula,))
    return lambda u: function(u)[0]


def _formula(formula: sp.Expr) -> Callable[[sp.Expr], sp.Expr]:
    return lambda u: formula.xreplace({X: u})
