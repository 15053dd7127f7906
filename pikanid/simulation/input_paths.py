"""Play, limited rates and the past of inputs, for kernels that know none: more inputs instead.

Behind a play of ±b, begun at e·b in it, and a limit R of its rate, after B before the record, an
input is v = c + s·b + o·e·b + q·R + a·B (`pikanid.problem.held.acting`).  Between two knots c, s,
o, q and a are straight lines, and the derivatives by b, e, R and B those of the formula: the
sensitivities come out exact.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np
import sympy as sp

from pikanid.formula.expressions import symbol
from pikanid.model import Input, Model
from pikanid.problem.held import HeldInput, PiecewiseInput, acting

Paths = Sequence[np.ndarray]  # (m,) each, as from `pikanid.problem.evaluated.paths`


def with_parts(model: Model) -> Model:
    """The model with every input that is `shaped` written as c + s·b + o·e·b + q·R + a·B; the
    parts s, o, q and a are its last inputs.

    >>> from pikanid.model import systems
    >>> with_parts(systems.sloshing()).input_names
    ('u_x', 'u_z')
    """
    # most models have none, and which model it is takes longer to tell
    return _with_parts(model) if any(i.shaped for i in model.inputs) else model


@functools.lru_cache(maxsize=64)
def _with_parts(model: Model) -> Model:
    plain = {"unit": "", "backlash": sp.S.Zero, "rate_limit": sp.S.Zero, "backlash_start": None,
             "past": None}
    added, swap = [], {}
    for item in model.inputs:
        whole = symbol(item.name)
        for what, formula in _factors(item).items():
            part = dataclasses.replace(item, name=_fresh(model, f"{item.name}_{what}"), **plain)
            added.append(part)
            whole += symbol(part.name) * formula
        swap[symbol(item.name)] = whole
    own = tuple(dataclasses.replace(i, **{**plain, "unit": i.unit}) for i in model.inputs)
    return model.replace(
        inputs=(*own, *added),
        equations={n: e.xreplace(swap) for n, e in model.equations.items()},
        outputs=tuple(o.with_swapped(swap) for o in model.outputs))


def _factors(item: Input) -> dict[str, sp.Expr]:
    """What each part of an input is multiplied by, by the name of the part."""
    found = {"side": item.backlash, "ramp": item.rate_limit}
    found = {what: formula for what, formula in found.items() if formula != 0}
    # what is zero now may be estimated: only what is not given has no part
    if item.backlash_start is not None:
        found["open"] = item.backlash_start * item.backlash
    return found if item.past is None else {**found, "past": item.past}


def _fresh(model: Model, name: str) -> str:
    while name in model.symbols:
        name += "_"
    return name


def split(model: Model, held: tuple[HeldInput, ...], paths: Paths
          ) -> tuple[HeldInput | PiecewiseInput, ...]:
    """The inputs of `with_parts(model)` for the paths of its own ones."""
    own: list[HeldInput | PiecewiseInput] = []
    added: list[PiecewiseInput] = []
    for item, h, half, rate, start, before in zip(model.inputs, held, *paths, strict=True):
        if not item.shaped:
            own.append(h)
            continue
        acts = acting(h, None if item.backlash == 0 else float(half), float(rate), float(start),
                      bool(np.isfinite(before)))
        own.append(acts.carrier)
        added += [getattr(acts, what) for what in _factors(item)]
    return (*own, *added)


def combined(model: Model, U: np.ndarray, paths: Paths) -> np.ndarray:
    """The model's own inputs (L, m) from those of `with_parts(model)` (L, m + parts)."""
    own, part = U[:, :len(model.inputs)].copy(), len(model.inputs)
    for j, (item, half, rate, start, before) in enumerate(zip(model.inputs, *paths, strict=True)):
        factors = {"side": half, "open": start * half, "ramp": rate, "past": before}
        for what in _factors(item):
            own[:, j] += factors[what] * U[:, part]
            part += 1
    return own
