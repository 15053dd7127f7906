"""Kolmogorov-Arnold networks: the only room that knows pykan, which it imports late.

`build_kan` makes a real pykan model without pykan's side effects; `ShallowKAN`, `DeepKAN` and
`KanCurve` evaluate one fast, with time derivatives and Jacobians in the coefficients; `refine`,
`prune`, `save`, `load` and `plot` are safe versions of pykan's own.
"""

from __future__ import annotations

from pikanid.approximators.kan.build import build_kan, from_state, planned_kan
from pikanid.approximators.kan.curve import KanCurve
from pikanid.approximators.kan.deep import DeepKAN
from pikanid.approximators.kan.file import load, save
from pikanid.approximators.kan.kinks import Kink
from pikanid.approximators.kan.plot import plot
from pikanid.approximators.kan.prune import prune
from pikanid.approximators.kan.refine import Refinement, refine, regrid
from pikanid.approximators.kan.shallow import ShallowKAN
from pikanid.approximators.kan.state import to_state
from pikanid.approximators.kan.sweeps import KanJet

__all__ = [
    "DeepKAN",
    "KanCurve",
    "KanJet",
    "Kink",
    "Refinement",
    "ShallowKAN",
    "build_kan",
    "from_state",
    "load",
    "planned_kan",
    "plot",
    "prune",
    "refine",
    "regrid",
    "save",
    "to_state",
]
