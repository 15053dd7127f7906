"""How far two computations of one quantity may be apart, and how far they are."""

from __future__ import annotations

import numpy as np

from pikanid.validation.equivalence.setting import Array

# Relative to the largest entry.
MATRICES = 1e-12  # numerical: rounding of sums over some hundred points
GRADIENTS = 1e-10  # numerical: and of automatic differentiation on top


def difference(a: Array, b: Array) -> float:
    """Largest difference relative to the largest entry."""
    scale = max(float(np.abs(a).max()), float(np.abs(b).max()))
    return float(np.abs(a - b).max()) / scale if scale else 0.0
