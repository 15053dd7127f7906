"""Explanations that leave so much and are so probable, of stand-ins for effects."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.judge.explanations import Weighed
from pikanid.mismatch.judge.kinds import kinds_of
from pikanid.mismatch.settings.settings import DEFAULTS

RULE = DEFAULTS.part


def effect(name: str, *families: str, covers: tuple[str, ...] = (), known: bool = True,
           twin: str = "", parts: Any = None, shape_of: tuple[str, ...] = (),
           brief: Any = None) -> Candidate:
    return cast(Candidate, SimpleNamespace(
        key=name, name=name, ids=(name,), families=families,
        covers={key: {} for key in covers}, known=known, twin=twin, lasts=True,
        parts=parts, shape_of=shape_of, brief=brief, parameters=(), exponent=None,
        channel="dynamics", absent=False, read=False, alike=twin, site=SimpleNamespace(v="v")))


COULOMB = effect("coulomb_friction", "dry friction")
HYSTERESIS = effect("hysteresis", "dry friction")
DRAG = effect("quadratic_drag", "drag")


def weighed(effects: tuple[Candidate, ...], left: float, weight: float, share: float = 0.95,
            later: float | None = None, rows: float = 1e6) -> Weighed:
    """An explanation that leaves so much [σ²] of so many rows, and so much of each held-out sample
    [σ].
    """
    h: Any = SimpleNamespace(effects=effects, values={}, blurred=frozenset(),
                             minimum=SimpleNamespace(chi2=rows * (1 + left)),
                             explained_away=lambda *given: False)
    predicted: Any = SimpleNamespace(rest=np.full(100, left if later is None else later),
                                     deviance=0.0, acts={})
    return Weighed(h, predicted, left, 0.0, weight, share,
                   frozenset(k for e in effects for k in kinds_of(e, h, RULE.dry)))
