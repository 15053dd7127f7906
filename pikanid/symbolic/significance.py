"""What every edge and node of a KAN contributes to its output, and how sure that is.

The contribution of an edge is the root mean square, over the data, of what the output loses when
the edge is replaced by its mean; linearised it is A c with the edge's coefficients c.  From the
Gauss-Newton covariance V of the fit follow its standard error (delta method) and the Wald test of
A c = 0.  A node contributes what all edges leaving it do together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import chi2

from pikanid.approximators.kan.edges import KanEdge, arguments, beside, edges_of
from pikanid.approximators.kan.train import PointFit
from pikanid.symbolic.numeric import Array

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Contribution:
    """One edge (layer, source, target), or one node (layer, source) with `target` None.

    `size` and `std` are in the output's unit; `attribution` is pykan's score where it was asked.
    """

    layer: int
    source: int
    target: int | None
    size: float
    std: float
    p_value: float
    attribution: float | None = None


def contributions(fit: PointFit, x: Array, attribution: bool = False) -> tuple[Contribution, ...]:
    """Of every active edge, then of every hidden and input node.

    Args:
        fit: A KAN at the least squares of its points.
        x: Their inputs (M, inputs).
        attribution: Whether pykan's scores are computed for comparison.
    """
    edges = edges_of(fit.network)
    inputs = arguments(fit.kan, x)
    c = fit.network.coefficients
    scores = _scores(fit.kan, x) if attribution else None
    effects = [_effect(fit, edge, inputs[edge.layer][:, edge.source]) for edge in edges]
    found = []
    for edge, A in zip(edges, effects, strict=True):
        size, std, p = _size(A, c[edge.at], fit.covariance(edge.at, beside(edges, edge)))
        score = None if scores is None else float(scores[0][edge.layer][edge.target, edge.source])
        found.append(Contribution(edge.layer, edge.source, edge.target, size, std, p, score))
    for layer, node in sorted({(e.layer, e.source) for e in edges}):
        own = [k for k, e in enumerate(edges) if (e.layer, e.source) == (layer, node)]
        at = np.concatenate([edges[k].at for k in own])
        A = np.hstack([effects[k] for k in own])
        V = block_diag(*(fit.covariance(edges[k].at, beside(edges, edges[k])) for k in own))
        size, std, p = _size(A, c[at], V)
        score = None if scores is None else float(scores[1][layer][node])
        found.append(Contribution(layer, node, None, size, std, p, score))
    return tuple(found)


def table(found: Sequence[Contribution]) -> pd.DataFrame:
    """One row an edge or node."""
    import pandas as pd

    rows = [("node" if f.target is None else "edge", f.layer, f.source, f.target, f.size, f.std,
             f.p_value, f.attribution) for f in found]
    columns = ["what", "layer", "source", "target", "contribution", "std", "p", "attribution"]
    return pd.DataFrame(rows, columns=columns)


def _effect(fit: PointFit, edge: KanEdge, u: Array) -> Array:
    """A (M, K): coefficients to the output's change against the edge's mean."""
    basis = edge.basis(u)
    J = fit.jacobian[:, edge.at]
    weight = np.einsum("mk,mk->m", basis, basis)
    downstream = np.einsum("mk,mk->m", J, basis) / np.where(weight > 0.0, weight, 1.0)
    return J - downstream[:, None] * basis.mean(axis=0)


def _size(A: Array, c: Array, V: Array) -> tuple[float, float, float]:
    """Root mean square of A c, its standard error, and the p-value of A c = 0."""
    moments = A.T @ A / len(A)
    square = float(c @ moments @ c)
    size = float(np.sqrt(max(square, 0.0)))
    slope = moments @ c / size if size > 0.0 else np.zeros(len(c))
    values, vectors = np.linalg.eigh(moments)
    seen = values > 1e-8 * max(values[-1], 1e-300)
    if not seen.any():  # nothing behind the edge passes it on
        return 0.0, 0.0, 1.0
    root = (vectors[:, seen] * np.sqrt(values[seen])).T
    spread = root @ V @ root.T
    known, turn = np.linalg.eigh(0.5 * (spread + spread.T))
    good = known > 1e-9 * max(known[-1], 1e-300)
    z = (turn.T @ (root @ c))[good] / np.sqrt(known[good])
    p = float(chi2.sf(float(z @ z), int(good.sum()))) if good.any() else 1.0
    return size, float(np.sqrt(max(slope @ V @ slope, 0.0))), p


def _scores(kan: Any, x: Array) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    from pikanid.approximators.kan.prune import scores

    found = scores(kan, x)
    return found.edges, found.nodes
