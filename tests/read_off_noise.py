"""p-values where σ is read off the samples, in closed form: an oracle for tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2, f

LAGS = 12870 / 4900  # sum of squared correlations of fourth differences: C(16, 8)/C(8, 4)²


def p_value(parts: Sequence[tuple[float, float]], dof: int) -> float:
    """Of parts (Σ (residual/σ)², number of differences that told σ, inf where it is given)."""
    freedom = [max(0.37 / LAGS * m, 3.0) for _, m in parts]
    own = np.array([v * (1 - 2 / n) for (v, _), n in zip(parts, freedom, strict=True)])
    value, unsure = own.sum(), np.sum((own / own.sum()) ** 2 / np.array(freedom))
    if unsure == 0:
        return float(chi2.sf(value, dof))
    known = max(1 / unsure, 3.0)
    return float(f.sf(value / dof * known / (known - 2), dof, known))
