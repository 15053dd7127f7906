"""Polynomials that fade: the gate of an exact start, and the kinks at input switches."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.polynomial import Polynomial

from pikanid.approximators import Array


@dataclass(frozen=True)
class Decaying:
    """size·P(s)·e^{-s} + constant for s = rate·(t - centre) >= 0, zero before.

    >>> kink = Decaying(Polynomial([0.0, 0.0, 0.5]), rate=1.0, centre=1.0)
    >>> kink.jet(np.array([0.9, 1.0]), 2)[2]
    array([0., 1.])
    """

    polynomial: Polynomial
    rate: float
    centre: float
    size: float = 1.0
    constant: float = 0.0

    def jet(self, t: Array, order: int) -> Array:
        """Value and derivatives (order + 1, M), from the right at the centre."""
        s = self.rate * (t - self.centre)
        after, decay = s >= 0.0, np.exp(-np.maximum(s, 0.0))
        polynomial, rows = self.polynomial, []
        for k in range(order + 1):
            value = self.size * self.rate**k * polynomial(np.maximum(s, 0.0)) * decay
            rows.append(np.where(after, value + (self.constant if k == 0 else 0.0), 0.0))
            polynomial = polynomial.deriv() - polynomial
        return np.array(rows)


def exponential(terms: int) -> Polynomial:
    """Σ_{j<terms} s^j/j!: times e^{-s} it is 1 up to s^terms."""
    return Polynomial([1.0 / factorial(j) for j in range(terms)])
