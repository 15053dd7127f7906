"""Edges that the data do not ask for go, one at a time, the rest refitted after every removal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.approximators.kan.edges import edges_of, groups_of, plain, without_edge
from pikanid.approximators.kan.train import PointFit, fit_points
from pikanid.symbolic.numeric import Array
from pikanid.symbolic.significance import Contribution, contributions


@dataclass(frozen=True, eq=False)
class Pruned:
    """A KAN without its insignificant edges.

    Attributes:
        kan: A new pykan model; the one that was given is as it was.
        fit: Its least squares on the data.
        removed: The edges that went, in order, each as it was judged.
    """

    kan: Any
    fit: PointFit
    removed: tuple[Contribution, ...]


def prune(kan: Any, x: Array, y: Array, *, alpha: float = 0.01, refit: bool = True) -> Pruned:
    """Remove edges whose contribution is not significant at level α.

    The least significant edge goes first; the others are fitted again before the next is judged.
    A removal that the data resist (the residual grows significantly) is taken back.  Behind more
    than one layer every other edge is then tried, the faintest first, since its part may be one
    that the rest can take over.  The last edge stays.

    Args:
        kan: A pykan model with one output.
        x, y: Data (M, inputs), (M,).
        alpha: Level of each Wald test.
        refit: Whether the model is fitted to the data before the first test.

    Raises:
        BadSetting: A level outside 0 ... 1, data that do not fit the model.
    """
    if not 0.0 < alpha < 1.0:
        raise errors.BadSetting(errors.bad_value("alpha", alpha, "between 0 and 1"))
    fit = fit_points(plain(kan, np.asarray(x, float)), x, y, iterations=100 if refit else 0)
    removed: list[Contribution] = []
    kept: set[tuple[int, int, int | None]] = set()
    while len(edges_of(fit.network)) > 1:
        judged = [c for c in contributions(fit, x) if c.target is not None
                  and (c.layer, c.source, c.target) not in kept and c.p_value > alpha]
        if not judged:
            break
        weakest = max(judged, key=lambda c: (c.p_value, -c.size))
        layer, source, target = weakest.layer, weakest.source, weakest.target
        assert target is not None
        smaller = fit_points(without_edge(fit.kan, layer, source, target), x, y)
        if _worse(smaller, fit, alpha):
            kept.add((layer, source, target))
            continue
        fit = smaller
        removed.append(weakest)
    if len(groups_of(fit.network.plan)) > 1:
        fit, spare = _without_spare(fit, x, y, alpha)
        removed += spare
    return Pruned(fit.kan, fit, tuple(removed))


def _without_spare(fit: PointFit, x: np.ndarray, y: np.ndarray, alpha: float
                   ) -> tuple[PointFit, list[Contribution]]:
    """Edges that the others can do without, once they are fitted again.

    Where layers or factors can share a law in many ways, every edge may have its part in it and yet
    none be needed.
    """
    removed: list[Contribution] = []
    tried: set[tuple[int, int, int | None]] = set()
    while len(edges_of(fit.network)) > 1:
        left = [c for c in contributions(fit, x) if c.target is not None
                and (c.layer, c.source, c.target) not in tried]
        if not left:
            break
        weakest = min(left, key=lambda c: c.size)
        tried.add((weakest.layer, weakest.source, weakest.target))
        assert weakest.target is not None
        smaller = fit_points(without_edge(
            fit.kan, weakest.layer, weakest.source, weakest.target), x, y)
        if not _worse(smaller, fit, alpha):
            fit = smaller
            removed.append(weakest)
            tried = set()
    return fit, removed


def _worse(smaller: PointFit, larger: PointFit, alpha: float) -> bool:
    """F test of the two residuals."""
    from scipy.stats import f as fisher

    few, many = float(smaller.residual @ smaller.residual), float(larger.residual
                                                                  @ larger.residual)
    extra = max(larger.effective - smaller.effective, 1.0)
    rest = max(len(larger.residual) - larger.effective, 1.0)
    return bool(fisher.sf((few - many) / extra / (many / rest + 1e-300), extra, rest) < alpha)
