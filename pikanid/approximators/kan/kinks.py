"""Kinks beside a spline: what lets the curve's o-th derivative jump where an input switches.

A kink is the truncated power (t - t_j)^o_+/o! less the spline on the KAN's own knots that equals it
on either side: it jumps in its o-th derivative at t_j, is zero more than k cells away, and spans
with the splines what the power itself spans.  So nothing grows with time, and a curve's parts stay
as large as the curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from pikanid.approximators.kan.bases import Array, Index, power_blossom, spline_rows


class KinkTable:
    """Kinks of given (time, order) on one knot sequence.

    `split` (K,) is the first spline right of each kink: those from there on carry its power.
    """

    def __init__(self, places: Sequence[tuple[float, int]], knots: Array, degree: int) -> None:
        self.knots, self.degree = knots, degree
        self.times = np.array([time for time, _ in places])
        self.orders = np.array([order for _, order in places], np.int64)
        n, k = knots.size - degree - 1, degree
        self.centres = sliding_window_view(knots[1:-1], k).mean(axis=1)
        self.split = np.searchsorted(self.centres, self.times).astype(np.int64)
        # Of the splines split - k ... split + k - 1, the only ones that a kink meets.
        self.beside = np.zeros((len(places), 2 * k))
        for number, (time, order) in enumerate(places):
            right = int(self.split[number])
            end = min(n, right + k)
            near = knots[right : end + k + 1]
            self.beside[number, k : k + end - right] = power_blossom(near, k, time, order)

    def join(self, t: Array, derivative: int, first: Index, rows: Array, scale: Array,
             place: Index, begin: Index, local: Array) -> None:
        """Write kink j at time m, over scale[j], to local[m, place[j] - begin[m]].

        ``first`` and ``rows`` are the active splines' (M,) and (M, k + 1) of `spline_rows`.
        """
        from pikanid.approximators.local_basis import join_kinks

        join_kinks(t, derivative, first, rows, self.split, self.beside, self.times, self.orders,
                   scale, place, begin, local)


@dataclass(frozen=True, eq=False)
class Kink:
    """One kink: jump (outputs,) in the order-th derivative at a time [s], beside these knots.

    >>> from pikanid.approximators.kan.plan import uniform_extended_knots
    >>> kink = Kink(1.0, 2, np.array([3.0]), uniform_extended_knots(0.0, 2.0, 20, 5), 5)
    >>> kink(np.array([0.4, 1.6]))[:, 0].tolist()
    [0.0, 0.0]
    >>> before, after = kink(np.array([1.0 - 1e-12, 1.0]), derivative=2)[:, 0]
    >>> round(float(after - before), 6)
    3.0
    """

    time: float
    order: int
    jump: Array
    knots: Array = field(repr=False)
    degree: int

    def __call__(self, t: Array, derivative: int = 0) -> Array:
        """Its part of the curve at ``t`` (M,), shape (M, outputs)."""
        t = np.array(t, float)
        table = KinkTable([(self.time, self.order)], self.knots, self.degree)
        first, rows = spline_rows(t, self.knots, self.degree, derivative)
        found, zeros = np.zeros((t.size, 1)), np.zeros(t.size, np.int64)
        table.join(t, derivative, first, rows, np.ones(1), zeros[:1], zeros, found)
        return found * self.jump
