"""Formulas into a pykan model, so that pykan's own plot and formula show them.

pykan's `fix_symbolic` takes a function with SymPy's too, and knows it from then on by nothing but
the edge; its table of names, `SYMBOLIC_LIB`, is left as it was.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
import sympy as sp

from pikanid.approximators.kan.build import from_state
from pikanid.approximators.kan.plan import Array
from pikanid.approximators.kan.quiet import undisturbed
from pikanid.approximators.kan.state import to_state
from pikanid.approximators.kan.tensors import read, write


@dataclass(frozen=True, eq=False)
class SymbolicEdge:
    """What an edge becomes: its label, the function of arrays and the formula of one symbol."""

    label: str
    function: Callable[[Array], Array]
    formula: Callable[[sp.Expr], sp.Expr]


def push(kan: Any, edges: Mapping[tuple[int, int, int], SymbolicEdge],
         offsets: tuple[Array, ...] = (), masked: tuple[tuple[int, int, int], ...] = ()) -> Any:
    """A new model whose edges (layer, source, target) are symbolic.

    Args:
        kan: A pykan model; it stays as it is.
        edges: The functions.
        offsets: Biases of the subnodes, layer by layer; as they are unless given.
        masked: Edges that are removed.

    Raises:
        BadSetting: If pykan is missing.
    """
    state = to_state(kan)
    made = from_state(state)
    torch = import_module("torch")
    library = import_module("kan.utils").SYMBOLIC_LIB
    before = dict(library)
    try:
        with undisturbed(double=True), torch.no_grad():
            for (layer, i, s), edge in edges.items():
                symbolic = made.symbolic_fun[layer]
                symbolic.funs_name[s][i] = edge.label
                symbolic.funs[s][i] = _on_tensors(edge.function)
                symbolic.funs_sympy[s][i] = edge.formula
                symbolic.funs_avoid_singularity[s][i] = _plainly(_on_tensors(edge.function))
                affine = read(symbolic.affine)
                affine[s, i] = (1.0, 0.0, 1.0, 0.0)
                write(symbolic.affine, affine)
                made.set_mode(layer, i, s, mode="s")
            for layer, i, s in masked:
                made.remove_edge(layer, i, s)
            for layer, offset in enumerate(offsets):
                write(made.subnode_bias[layer], offset)
            if made.cache_data is not None:
                made(made.cache_data)
    finally:
        library.clear()
        library.update(before)
    return made


def _on_tensors(function: Callable[[Array], Array]) -> Callable[[Any], Any]:
    torch = import_module("torch")
    return lambda u: torch.from_numpy(np.array(function(u.detach().cpu().numpy()))).to(u.device)


def _plainly(function: Callable[[Any], Any]) -> Callable[[Any, Any], tuple[Any, Any]]:
    """pykan asks for a variant that bends singularities away; there are none in the range."""
    return lambda x, threshold: (threshold, function(x))
