"""What χ² counts for where the noise does not explain all that the best hypothesis leaves."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from pikanid.mismatch.fitting.decisions import in_order
from pikanid.mismatch.fitting.hypothesis import Hypothesis


def overdispersion(fits: Iterable[Hypothesis]) -> float:
    """That of the closest fit per degree of freedom, at least one.

    What a misfit leaves is no white noise: neighbouring rows say the same, and an effect that
    follows it gains more than its share.  The more of the residual is misfit, the more it is
    counted by the number of independent rows instead, N / Σ ρ_k² (G. V. Bayley and J. M.
    Hammersley, J. R. Stat. Soc. Suppl. 8, 1946).
    """
    closest = in_order(fits, lambda h: h.minimum.chi2, Hypothesis.place)[0]
    freedom = max(closest.whitened.rows - len(closest.minimum.theta), 1)
    level = max(1.0, closest.minimum.chi2 / freedom)
    return level * repeated(closest.minimum.r) ** (1 - 1 / level)


def repeated(r: np.ndarray) -> float:
    """How many neighbouring rows of a residual (N,) say the same: Σ ρ_k², at least one."""
    n = len(r)
    spectrum = np.abs(np.fft.rfft(r, 2 * n)) ** 2
    rho = np.fft.irfft(spectrum)[1:max(n // 4, 2)] / max(float(r @ r), 1e-300)
    # noise alone has ρ² = 1/N
    return max(1.0, 1 + 2 * float(np.sum(rho**2 - 1 / n)))
