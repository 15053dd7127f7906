"""What χ² counts for where the noise does not explain all that the best hypothesis leaves."""

from __future__ import annotations

from collections.abc import Iterable

from pikanid.mismatch.fitting.decisions import in_order
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.least_squares import repeated


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
