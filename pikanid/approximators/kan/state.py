"""A KAN as plain arrays: copied and changed without pickle or checkpoints."""

from __future__ import annotations

from dataclasses import dataclass, fields
from importlib import import_module
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.approximators.kan.blank import blank_kan, plan_of
from pikanid.approximators.kan.plan import Arity, Array, Base, KanPlan
from pikanid.approximators.kan.tensors import read, write

# Of the inputs last seen, which plots and pruning use, no more than these are kept.
_BATCH = 2000  # limit: more say no more about a range


@dataclass(frozen=True, eq=False)
class LayerState:
    """One layer of edges and the nodes after it, in pykan's words and shapes."""

    grid: Array  # (inputs, G + 2k + 1)
    coef: Array  # (inputs, subnodes, G + k)
    scale_base: Array  # (inputs, subnodes)
    scale_sp: Array
    mask: Array
    node_scale: Array  # (nodes,)
    node_bias: Array
    subnode_scale: Array  # (subnodes,)
    subnode_bias: Array
    symbolic_mask: Array  # (subnodes, inputs)
    symbolic_affine: Array  # (subnodes, inputs, 4)
    symbols: tuple[tuple[str, ...], ...]  # names of the symbolic functions (subnodes, inputs)


@dataclass(frozen=True, eq=False)
class KanState:
    """Everything that makes a pykan model, and up to 2000 of the inputs that it saw last."""

    width: tuple[tuple[int, int], ...]
    k: int
    base: Base
    arity: Arity
    layers: tuple[LayerState, ...]
    batch: Array  # (rows, inputs)

    @property
    def plan(self) -> KanPlan:
        """Shape and knots."""
        knots = tuple(layer.grid for layer in self.layers)
        return KanPlan(self.width, self.k, self.base, self.arity, knots)


ARRAYS = tuple(field.name for field in fields(LayerState) if field.name != "symbols")


def to_state(kan: Any) -> KanState:
    """The state of a pykan model, in arrays of its own.

    >>> from pikanid.approximators.kan import build_kan
    >>> to_state(build_kan([1, [2, 1], 1])).width
    ((1, 0), (2, 1), (1, 0))
    """
    plan = plan_of(kan)
    layers = tuple(
        LayerState(**{name: read(place) for name, place in _places(kan, number).items()},
                   symbols=tuple(tuple(row) for row in kan.symbolic_fun[number].funs_name))
        for number in range(plan.depth)
    )
    seen = np.empty((0, plan.nodes(0))) if kan.cache_data is None else read(kan.cache_data)
    batch = seen[:: max(1, -(-len(seen) // _BATCH))]
    return KanState(plan.width, plan.k, plan.base, plan.arity, layers, batch)


def restored(state: KanState, kind: type, device: str = "cpu") -> Any:
    """A pykan model of a class with this state: `type(kan)` for one like another.

    Raises:
        BadSetting: If arrays do not fit together or a symbolic function is unknown to pykan.
    """
    kan = blank_kan(state.plan, kind, device)
    library = import_module("kan.utils").SYMBOLIC_LIB
    for number, layer in enumerate(state.layers):
        for name, place in _places(kan, number).items():
            values = getattr(layer, name)
            if values.shape != tuple(place.shape) or not np.all(np.isfinite(values)):
                raise errors.BadSetting(
                    errors.kan_coefficients(f"{name} {values.shape}", tuple(place.shape)))
            write(place, values)
        symbolic = kan.symbolic_fun[number]
        for j, row in enumerate(layer.symbols):
            for i, name in enumerate(row):
                if name not in library:
                    raise errors.BadSetting(errors.bad_value("a symbolic edge", name, "in pykan"))
                symbolic.funs_name[j][i] = name
                symbolic.funs[j][i] = library[name][0]
                symbolic.funs_sympy[j][i] = library[name][1]
                symbolic.funs_avoid_singularity[j][i] = library[name][3]
    torch = import_module("torch")
    kan.cache_data = torch.from_numpy(state.batch.copy()).to(device) if state.batch.size else None
    return kan


def _places(kan: Any, number: int) -> dict[str, Any]:
    """Where pykan keeps what `LayerState` names."""
    edges, symbolic = kan.act_fun[number], kan.symbolic_fun[number]
    return {
        "grid": edges.grid,
        "coef": edges.coef,
        "scale_base": edges.scale_base,
        "scale_sp": edges.scale_sp,
        "mask": edges.mask,
        "node_scale": kan.node_scale[number],
        "node_bias": kan.node_bias[number],
        "subnode_scale": kan.subnode_scale[number],
        "subnode_bias": kan.subnode_bias[number],
        "symbolic_mask": symbolic.mask,
        "symbolic_affine": symbolic.affine,
    }
