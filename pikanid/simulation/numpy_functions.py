"""What formulas call when they are evaluated as NumPy functions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pikanid.model import Model
from pikanid.simulation.layout import STEEP


class SplineValues:
    """NumPy evaluation of a model's spline functions from coefficients passed as arguments."""

    def __init__(self, model: Model):
        self.model = model

    def __call__(self, index: int, order: int, z: np.ndarray, *coefficients: float) -> np.ndarray:
        spline = self.model.splines[int(index)]
        return basis(spline.knots, spline.degree, np.atleast_1d(z), int(order)) @ np.array(
            coefficients)


def columns(values: Sequence[Any], count: int) -> np.ndarray:
    """Arrays (M,) and constants side by side (M, len(values))."""
    out = np.empty((count, len(values)), dtype=np.result_type(float, *values))
    for k, value in enumerate(values):
        out[:, k] = value
    return out


def basis(knots: Sequence[float], degree: int, z: np.ndarray, order: int) -> np.ndarray:
    """B-splines (M, size) at z (M,), or a derivative of an order."""
    from scipy.interpolate import BSpline

    size = len(knots) - degree - 1
    spline = BSpline(np.asarray(knots, float), np.eye(size), degree, extrapolate=True)
    return spline(z, nu=order)


def positive_power(base: np.ndarray, n: np.ndarray) -> np.ndarray:
    """bⁿ, nothing where b is not positive."""
    with np.errstate(all="ignore"):
        return np.where(np.asarray(base) > 0, np.power(np.maximum(base, 0.0), n),
                        np.where(np.asarray(n) == 0, 1.0, 0.0))


def power_slope(base: np.ndarray, n: np.ndarray) -> np.ndarray:
    """n·bⁿ⁻¹, zero very near b = 0 where n < 1."""
    with np.errstate(all="ignore"):
        steep = (np.asarray(n) < 1) & (np.asarray(base) < STEEP)
        return np.where(steep, 0.0, n * positive_power(base, np.asarray(n) - 1))


def log_abs(x: np.ndarray) -> np.ndarray:
    """ln |x|, 0 at 0."""
    with np.errstate(all="ignore"):
        return np.where(np.asarray(x) == 0, 0.0, np.log(np.abs(x)))
