"""KANs on disk: arrays and a header, .npz or .json, without pickle."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.approximators.kan.build import from_state
from pikanid.approximators.kan.kinks import Kink
from pikanid.approximators.kan.plan import Arity, Array, KanPlan
from pikanid.approximators.kan.shallow import ShallowKAN
from pikanid.approximators.kan.state import ARRAYS, KanState, LayerState, to_state
from pikanid.storage.entries import Entry
from pikanid.storage.limits import MOST_JSON, archived, file_bytes, json_content, parsed
from pikanid.storage.outputs import atomically

_FORMAT = "pikanid-kan"
_VERSION = 1  # definition: of the format that files name


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
        arrays |= {f"layer{number}_{name}": getattr(layer, name) for name in ARRAYS}
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
        raise errors.BadSetting(errors.unreadable(
            "saved KAN", str(path), "the ending must be .npz or .json"))
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
    def wrong(detail: str) -> errors.BadSetting:
        return errors.BadSetting(errors.unreadable("saved KAN", str(path), detail))

    if Path(path).suffix == ".json":
        header = json_content(path, wrong)
        arrays = header.pop("arrays", None) if isinstance(header, dict) else None
    else:
        arrays = archived(file_bytes(path, wrong, MOST_JSON), wrong)
        header = parsed(str(arrays.pop("header", "")).encode(errors="replace"), wrong)
    state, kinks = from_content(header, arrays, wrong)
    kan = from_state(state, device)
    return kan if kinks is None else ShallowKAN(kan, kinks)


MOST_NODES = 1000  # limit: of all layers together
MOST_EDGES = 50_000  # limit: of all layers together: each is a Python object in pykan
_HEADER = ("format", "version", "width", "k", "base", "arity", "symbols", "kinks")


def from_content(header: Any, arrays: Any,
                 wrong: Callable[[str], errors.PikanidError]) -> tuple[KanState, list[Kink] | None]:
    """The network that a file's content describes; `wrong` makes the exception from a sentence.

    Raises:
        PikanidError: If anything in it is of another type, shape or size.
    """
    get = Entry(header, "its header", wrong).table(_HEADER)
    get["format"].text((_FORMAT,))
    get["version"].integer(1, _VERSION)
    width = tuple((a.integer(0, MOST_NODES), b.integer(0, MOST_NODES))
                  for a, b in (e.pair() for e in get["width"].items(least=2, most=MOST_NODES)))
    k, base = get["k"].integer(1, 9), get["base"].text(("zero", "silu"))
    if width[0][1] or min(map(sum, width)) < 1 or sum(map(sum, width)) > MOST_NODES:
        raise wrong(errors.kan_width(width))
    factors = _arity(get["arity"], width)
    plan = KanPlan(width, k, base, factors, ())  # type: ignore[arg-type]  # one of the two
    if sum(plan.nodes(n) * plan.subnodes(n + 1) for n in range(plan.depth)) > MOST_EDGES:
        raise wrong(errors.too_many_entries("its list of edges", MOST_EDGES + 1, MOST_EDGES))
    found = Entry(arrays, "its arrays", wrong).table(optional=None)
    symbols = get["symbols"].items(most=plan.depth)
    if len(symbols) != plan.depth:
        raise wrong("its number of layers does not fit its width")
    layers = tuple(_layer(found, plan, n, symbols[n], wrong) for n in range(plan.depth))
    batch = _array(found, "batch", wrong, None, plan.nodes(0))
    state = KanState(width, k, plan.base, factors, layers, batch)
    if get["kinks"].value is None:
        return state, None
    return state, [_kink(e, layers[0].grid[0], k, plan.nodes(1)) for e in get["kinks"].items()]


def _arity(entry: Entry, width: tuple[tuple[int, int], ...]) -> Arity:
    if not isinstance(entry.value, list):
        return entry.integer(2, MOST_NODES)
    rows = tuple(tuple(f.integer(2, MOST_NODES) for f in row.items(most=MOST_NODES))
                 for row in entry.items(most=MOST_NODES))
    if [len(row) for row in rows] != [products for _, products in width]:
        raise entry.fail("a number for every product node")
    return rows


def _layer(found: dict[str, Entry], plan: KanPlan, number: int, symbols: Entry,
           wrong: Callable[[str], errors.PikanidError]) -> LayerState:
    inputs, subnodes, nodes = plan.nodes(number), plan.subnodes(number + 1), plan.nodes(number + 1)
    grid = _array(found, f"layer{number}_grid", wrong, inputs, None)
    if grid.shape[1] < 2 * plan.k + 2 or np.any(np.diff(grid, axis=1) <= 0.0):
        raise wrong(f"the knots of layer {number} are too few or do not increase")
    shapes = {
        "coef": (inputs, subnodes, grid.shape[1] - plan.k - 1),
        **dict.fromkeys(("scale_base", "scale_sp", "mask"), (inputs, subnodes)),
        **dict.fromkeys(("node_scale", "node_bias"), (nodes,)),
        **dict.fromkeys(("subnode_scale", "subnode_bias"), (subnodes,)),
        "symbolic_mask": (subnodes, inputs), "symbolic_affine": (subnodes, inputs, 4)}
    arrays = {name: _array(found, f"layer{number}_{name}", wrong, *shape)
              for name, shape in shapes.items()}
    rows = [[name.text(longest=50) for name in row.items(most=MOST_NODES)]
            for row in symbols.items(most=MOST_NODES)]
    if len(rows) != subnodes or any(len(row) != inputs for row in rows):
        raise symbols.fail(f"a table of {subnodes} times {inputs} names")
    return LayerState(grid=grid, **arrays, symbols=tuple(map(tuple, rows)))


def _array(found: dict[str, Entry], name: str, wrong: Callable[[str], errors.PikanidError],
           *shape: int | None) -> Array:
    """An array of the file, finite and of this shape (None: any length)."""
    if name not in found:
        raise wrong(errors.entry_lacks("it", [name]))
    entry = found[name].called(f"its array {name}")
    values = entry.value
    if isinstance(values, np.ndarray):
        fits = values.dtype.kind in "fiu" and values.ndim == len(shape) and all(
            n in (None, m) for n, m in zip(shape, values.shape, strict=True))
        if not fits:
            raise entry.fail(f"numbers of shape {shape}")
        values = values.astype(float)
    else:
        values = entry.array(*shape)
    if not np.all(np.isfinite(values)):
        raise wrong(f"its array {name} is not finite")
    return values


def _kink(entry: Entry, knots: Array, k: int, outputs: int) -> Kink:
    get = entry.table(("time", "order", "jump"))
    jump = get["jump"].array(outputs)
    if not np.all(np.isfinite(jump)):
        raise get["jump"].fail("finite numbers")
    return Kink(get["time"].number(float(knots[k]), float(knots[-k - 1])),
                get["order"].integer(1, k), jump, knots, k)
