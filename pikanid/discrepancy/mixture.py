"""Edges when the data leave open whether a law jumps at zero.

Structures with and without a step are weighed by their evidence (in the linear problem around the
fit), and bands hold both: mean and covariance of the mixture (Hoeting, Madigan, Raftery & Volinsky,
Statistical Science 14, 1999, p. 383).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid.discrepancy.bands import Posterior, posterior
from pikanid.discrepancy.edges import EdgePlan
from pikanid.discrepancy.fit import PenalisedFit
from pikanid.discrepancy.level import Level
from pikanid.discrepancy.offers import step_offers


@dataclass(frozen=True, eq=False)
class View:
    """One structure: its probability, its fit and what is known then."""

    weight: float
    plans: tuple[EdgePlan, ...]
    fit: PenalisedFit
    known: Posterior

    def edge(self, k: int, step: bool) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients (K,) of edge k, covariance (K, K); with `step` a missing step is a zero."""
        at = self.fit.smoothness.priors[k].at
        c, V = self.known.mean[at], self.known.covariance[np.ix_(at, at)]
        more = int(step and not self.plans[k].step)
        return np.pad(c, (0, more)), np.pad(V, ((0, more), (0, more)))


def views(level: Level, equation: str, steps: bool) -> tuple[View, ...]:
    """The fit, and beside it every step that it does without though the data may ask for it."""
    offers = step_offers(level, equation) if steps else []
    odds = np.exp(np.minimum([0.0, *(o.gain for o in offers)], 500.0))
    share, least = odds / odds.sum(), level.fit.smoothness.settings.left_out
    likely = np.where(share >= least, share, 0.0)
    # the fit itself always stays: it is the only one that was fitted, not foretold
    likely[0] = max(share[0], least)
    likely /= likely.sum()
    plans = [level.plans, *(o.plans for o in offers)]
    fits = [level.fit, *(o.fit for o in offers)]
    return tuple(View(float(w), p, f, posterior(f))
                 for w, p, f in zip(likely, plans, fits, strict=True) if w > 0)


def mixed_plans(seen: Sequence[View]) -> tuple[EdgePlan, ...]:
    """The edges with every step that any structure has."""
    return tuple(replace(same[0], step=any(p.step for p in same))
                 for same in zip(*(v.plans for v in seen), strict=True))


def mixed_edge(seen: Sequence[View], k: int, step: bool) -> tuple[np.ndarray, np.ndarray]:
    """Mean (K,) and covariance (K, K) of the coefficients of edge k."""
    parts = [(v.weight, *v.edge(k, step)) for v in seen]
    mean = np.sum([w * c for w, c, _ in parts], axis=0)
    spread = np.sum([w * (V + np.outer(c - mean, c - mean)) for w, c, V in parts], axis=0)
    return mean, spread
