"""A KAN as plain arrays: copied, changed, saved and loaded without pickle or checkpoints."""

from __future__ import annotations

import io
import json
import os
import zipfile
from dataclasses import dataclass, fields
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from pikanid import errors
from pikanid.approximators.kan.build import blank_kan, plan_of, read, write
from pikanid.approximators.kan.kinks import Kink
from pikanid.approximators.kan.plan import Arity, Array, Base, KanPlan
from pikanid.approximators.kan.shallow import ShallowKAN
from pikanid.outputs import atomically

_FORMAT = "pikanid-kan"
_VERSION = 1
# Of the inputs last seen, which plots and pruning use, no more than these are kept.
_BATCH = 2000


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


_ARRAYS = tuple(field.name for field in fields(LayerState) if field.name != "symbols")


def to_state(kan: Any) -> KanState:
    """The state of a pykan model, in arrays of its own.

    >>> from pikanid.approximators.kan import build_kan
    >>> to_state(build_kan([1, [2, 1], 1])).width
    ((1, 0), (2, 1), (1, 0))
    """
    plan = plan_of(kan)
    layers = tuple(
        LayerState(
            **{name: read(place) for name, place in _places(kan, number).items()},
            symbols=tuple(tuple(row) for row in kan.symbolic_fun[number].funs_name),
        )
        for number in range(plan.depth)
    )
    seen = np.empty((0, plan.nodes(0))) if kan.cache_data is None else read(kan.cache_data)
    batch = seen[:: max(1, -(-len(seen) // _BATCH))]
    return KanState(plan.width, plan.k, plan.base, plan.arity, layers, batch)


def from_state(state: KanState, device: str = "cpu") -> Any:
    """A pykan model with this state.

    Raises:
        BadSetting: If arrays do not fit together or a symbolic function is unknown to pykan.
    """
    kan = blank_kan(state.plan, device)
    library = import_module("kan.utils").SYMBOLIC_LIB
    for number, layer in enumerate(state.layers):
        for name, place in _places(kan, number).items():
            values = getattr(layer, name)
            if values.shape != tuple(place.shape) or not np.all(np.isfinite(values)):
                raise errors.BadSetting(
                    errors.kan_coefficients(f"{name} {values.shape}", tuple(place.shape))
                )
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


def save(kan: Any, path: str | os.PathLike[str]) -> None:
    """Write a pykan model or a `ShallowKAN` (with its kinks) to ``path``, .npz or .json.

    Raises:
        BadSetting: If the ending is another.
    """
    path = Path(path)
    kinks = None
    if isinstance(kan, ShallowKAN):
        kinks = [{"time": q.time, "order": q.order, "jump": q.jump.tolist()} for q in kan.kinks]
        kan = kan.kan
    state = to_state(kan)
    arrays = {"batch": state.batch}
    for number, layer in enumerate(state.layers):
        arrays |= {f"layer{number}_{name}": getattr(layer, name) for name in _ARRAYS}
    header = {
        "format": _FORMAT,
        "version": _VERSION,
        "width": state.width,
        "k": state.k,
        "base": state.base,
        "arity": state.arity,
        "symbols": [layer.symbols for layer in state.layers],
        "kinks": kinks,
    }
    if path.suffix not in (".npz", ".json"):
        raise errors.BadSetting(errors.kan_file(str(path), "the ending must be .npz or .json"))
    content = io.BytesIO()
    if path.suffix == ".json":
        lists = {name: values.tolist() for name, values in arrays.items()}
        content.write(json.dumps(header | {"arrays": lists}).encode())
    else:
        stored: dict[str, Any] = {"header": np.array(json.dumps(header)), **arrays}
        np.savez(content, **stored)
    atomically(path, content.getvalue())


def load(path: str | os.PathLike[str], device: str = "cpu") -> Any:
    """What `save` wrote: a pykan model, or a `ShallowKAN` where one was saved.

    Raises:
        BadSetting: If the file is missing, foreign or damaged.
    """
    try:
        with open(path, "rb") as file:
            header, arrays = _read_file(file, Path(path).suffix)
        state, kinks = _state(header, arrays)
    except (OSError, EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile) as fault:
        raise errors.BadSetting(errors.kan_file(str(path), str(fault))) from fault
    kan = from_state(state, device)
    return kan if kinks is None else ShallowKAN(kan, kinks)


def _read_file(file: BinaryIO, suffix: str) -> tuple[dict[str, Any], dict[str, Array]]:
    if suffix == ".json":
        header = json.load(file)
        arrays = {n: np.array(a, dtype=float) for n, a in header.pop("arrays").items()}
        return header, arrays
    with np.load(file, allow_pickle=False) as stored:
        arrays = {n: np.asarray(stored[n]) for n in stored.files}
    return json.loads(str(arrays.pop("header"))), arrays


def _state(header: dict[str, Any], arrays: dict[str, Array]) -> tuple[KanState, list[Kink] | None]:
    if header["format"] != _FORMAT or header["version"] > _VERSION:
        raise ValueError(f"its format is {header['format']} {header['version']}")
    width = tuple((int(sums), int(products)) for sums, products in header["width"])
    k, base, arity = int(header["k"]), header["base"], header["arity"]
    if base not in ("zero", "silu"):
        raise ValueError(f"its base function is {base}")
    layers = []
    for number, symbols in enumerate(header["symbols"]):
        mine = {name: arrays[f"layer{number}_{name}"] for name in _ARRAYS}
        if mine["grid"].ndim != 2 or np.any(np.diff(mine["grid"], axis=1) <= 0.0):
            raise ValueError(f"the knots of layer {number} do not increase")
        layers.append(LayerState(**mine, symbols=tuple(tuple(row) for row in symbols)))
    if len(layers) != len(width) - 1:
        raise ValueError("its number of layers does not fit its width")
    factors = arity if isinstance(arity, int) else tuple(tuple(row) for row in arity)
    batch = arrays["batch"].reshape(-1, sum(width[0]))
    state = KanState(width, k, base, factors, tuple(layers), batch)
    if header["kinks"] is None:
        return state, None
    knots = layers[0].grid[0]
    return state, [
        Kink(q["time"], q["order"], np.array(q["jump"]), knots, k) for q in header["kinks"]]


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
