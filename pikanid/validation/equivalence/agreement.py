"""How far two computations of one quantity may be apart, and how far they are."""

from __future__ import annotations

import numpy as np

from pikanid.validation.equivalence.setting import Array

# Relative to the largest entry: rounding of sums over some hundred points, and of automatic
# differentiation on top.
MATRICES = 1e-12
GRADIENTS = 1e-10


def difference(a: Array, b: Array) -> float:
    """Largest difference relative to the largest entry."""
    scale = max(float(np.abs(a).max()), float(np.abs(b).max()))
    return float(np.abs(a - b).max()) / scale if scale else 0.0
