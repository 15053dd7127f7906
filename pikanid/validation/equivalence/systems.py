"""Right-hand sides θ̈ = f(θ, θ̇, u; p), written out by hand for NumPy and again for torch.

They are not generated from `pikanid.Model`: the checker is to find faults in what is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class System:
    """One oscillator.

    Attributes:
        acceleration: f(x, v, u, p) in NumPy, each (M,).
        slopes: its derivatives by x, v (M,) and p (M, P).
        torch: f again, for torch tensors.
        excitation: u(t), from the right at switches.
        switches: where u jumps.
        truth: parameters.
        start: state at t = 0.
    """

    acceleration: Callable[[Array, Array, Array, Array], Array]
    slopes: Callable[[Array, Array, Array, Array], tuple[Array, Array, Array]]
    torch: Callable[[Any, Any, Any, Any], Any]
    excitation: Callable[[Array], Array]
    switches: tuple[float, ...]
    truth: tuple[float, ...]
    start: tuple[float, float]


_G, _M = 9.81, 0.30  # definition: [m/s²] and [kg], as in the paper


def _slosh(x: Array, v: Array, u: Array, p: Array) -> Array:
    length, damping = p
    return (u * np.cos(x) - _G * np.sin(x)) / length - damping / _M * v * np.cos(x) ** 2


def _slosh_slopes(x: Array, v: Array, u: Array, p: Array) -> tuple[Array, Array, Array]:
    length, damping = p
    cos, sin = np.cos(x), np.sin(x)
    by_x = (-u * sin - _G * cos) / length + damping / _M * v * 2.0 * cos * sin
    by_v = -damping / _M * cos**2
    by_length = -(u * cos - _G * sin) / length**2
    return by_x, by_v, np.stack([by_length, -v * cos**2 / _M], axis=1)


def _slosh_torch(x: Any, v: Any, u: Any, p: Any) -> Any:
    cos = x.cos()
    return u / p[0] * cos - 9.81 / p[0] * x.sin() - p[1] / 0.30 * v * cos.pow(2)


def _pulses(t: Array) -> Array:
    return 1.0 * ((t >= 0.2) & (t < 0.6)) - 1.0 * ((t >= 1.2) & (t < 1.6))


def _duffing(x: Array, v: Array, u: Array, p: Array) -> Array:
    damping, linear, cubic = p
    return u - damping * v - linear * x - cubic * x**3


def _duffing_slopes(x: Array, v: Array, u: Array, p: Array) -> tuple[Array, Array, Array]:
    damping, linear, cubic = p
    by_x = -linear - 3.0 * cubic * x**2
    return by_x, np.full_like(x, -damping), np.stack([-v, -x, -(x**3)], axis=1)


def _duffing_torch(x: Any, v: Any, u: Any, p: Any) -> Any:
    return u - p[0] * v - x * (p[1] + p[2] * x * x)


def _cosine(t: Array) -> Array:
    return 0.8 * np.cos(1.3 * t)


SYSTEMS = {
    "sloshing": System(_slosh, _slosh_slopes, _slosh_torch, _pulses, (0.2, 0.6, 1.2, 1.6),
                       (0.045, 0.15), (0.0, 0.0)),
    "duffing": System(_duffing, _duffing_slopes, _duffing_torch, _cosine, (), (0.3, 1.0, 0.7),
                      (0.5, 0.0)),
}  # definition: that both forms are compared on
