"""How smooth an edge is: second differences of its coefficients, weighed by the evidence.

The prior of an edge's coefficients c (K,) is Gaussian with precision (P-splines: Eilers & Marx,
Statistical Science 11, 1996, p. 89; as a prior: Lang & Brezger, J. Comp. Graph. Stat. 13, 2004)

    Λ(ρ) = Dᵀ diag(e^{ρ(z)}) D / s² + I/(K (s/10)²),   |D c|² = ∫ (d²δ/dz²)² dz,

with D the second differences and s the size of the equation.  The second part says that a
discrepancy is small beside the physics that it corrects; it is weak wherever the data speak, and
makes the prior proper.  log λ = ρ(z) is constant, or a broken line along the edge: then it may be
rough in one place and smooth elsewhere.  A step at zero has a ρ of its own, and precision e^ρ/s².

ρ maximises the marginal likelihood of the linearised problem,

    log p(y|ρ) = ½ bᵀ(A + Λ)⁻¹b - ½ log|A + Λ| + ½ log|Λ| + const,   A = JᵀJ, b = Jᵀ(Jθ - r),

(MacKay, Neural Computation 4, 1992, p. 415), whose gradient is exact, times a weak prior of ρ.
Structures are compared by what is left when ρ is integrated out, by Laplace's approximation around
that maximum (ibid., p. 426): one that may choose a ρ more would otherwise win by the choice alone.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from pikanid.discrepancy.edges import EdgePlan
from pikanid.discrepancy.settings import USUAL, DiscrepancySettings

STIFF = 8.0  # numerical: log λ of an edge that is nearly straight
SMOOTHEST, ROUGHEST = 18.0, -12.0  # numerical: of log λ: nothing changes beyond
WIDER = 1.3  # numerical: how much wider than the evidence they are drawn
# Curvature of the evidence where it says nothing.
FLAT = 0.1  # numerical: ρ is then known to a few units, its limits


@dataclass(frozen=True, eq=False)
class EdgePrior:
    """The prior of the coefficients at positions `at` (K,) in θ.

    `size` is the root mean square of the equation's right-hand side, `pieces` the number of pieces
    of log λ; `hats` (K', pieces) spreads them over the second differences `bends` (K', K).  The ρ
    of an edge holds its pieces, and the step's where there is a step; `largest` is the prior's
    standard deviation of a discrepancy, in units of `size`.
    """

    plan: EdgePlan
    at: np.ndarray
    size: float
    pieces: int = 1
    largest: float = USUAL.largest

    @functools.cached_property
    def bends(self) -> np.ndarray:
        """Second differences in units of the equation's size."""
        return self.plan.bends() / self.size

    @functools.cached_property
    def hats(self) -> np.ndarray:
        """Shares of the pieces in every second difference."""
        if self.pieces == 1:
            return np.ones((len(self.bends), 1))
        place, nodes = np.linspace(0, 1, len(self.bends)), np.linspace(0, 1, self.pieces)
        return np.column_stack([np.interp(place, nodes, row) for row in np.eye(self.pieces)])

    @property
    def count(self) -> int:
        """Length of the edge's ρ."""
        return self.pieces + self.plan.step

    def precision(self, rho: np.ndarray) -> np.ndarray:
        """Λ (K, K) at ρ (count,)."""
        weight = np.exp(self.hats @ rho[: self.pieces])
        full = self.bends.T @ (weight[:, None] * self.bends)
        full[np.diag_indices(len(full))] += 1.0 / (
            len(full) * (self.largest * self.size) ** 2)
        if self.plan.step:
            full[-1, -1] += np.exp(rho[-1]) / self.size**2
        return full

    def slopes(self, rho: np.ndarray) -> list[np.ndarray]:
        """∂Λ/∂ρ (K, K), one an entry of ρ."""
        weight = np.exp(self.hats @ rho[: self.pieces])
        D = self.bends
        found = [D.T @ ((weight * hat)[:, None] * D) for hat in self.hats.T]
        if self.plan.step:
            found.append(np.zeros((len(self.at), len(self.at))))
            found[-1][-1, -1] = np.exp(rho[-1]) / self.size**2
        return found


@dataclass(frozen=True, eq=False)
class Smoothness:
    """The priors of all edges together; ρ (k_1 + k_2 + ...,) holds theirs one by one.

    `weak` (n,) are fixed precisions of the entries of θ that are not coefficients.
    """

    priors: tuple[EdgePrior, ...]
    weak: np.ndarray
    settings: DiscrepancySettings = USUAL

    @property
    def stiff(self) -> np.ndarray:
        """ρ of edges that are nearly straight."""
        return np.full(sum(p.count for p in self.priors), STIFF)

    def split(self, rho: np.ndarray) -> list[np.ndarray]:
        """ρ edge by edge."""
        return np.split(rho, np.cumsum([p.count for p in self.priors])[:-1])

    def carry(self, rho: np.ndarray, other: Smoothness) -> np.ndarray:
        """ρ as a start for other priors of the same edges."""
        parts = []
        for old, own, new in zip(self.priors, self.split(rho), other.priors, strict=True):
            pieces = own[: old.pieces]
            if new.pieces != old.pieces:
                pieces = np.full(new.pieces, pieces.mean())
            step = own[old.pieces:] if old.plan.step else np.array([STIFF])
            parts.append(np.append(pieces, step if new.plan.step else []))
        return np.concatenate(parts)

    def precision(self, rho: np.ndarray) -> np.ndarray:
        """Λ (n, n)."""
        full = np.diag(self.weak)
        for prior, own in zip(self.priors, self.split(rho), strict=True):
            full[np.ix_(prior.at, prior.at)] = prior.precision(own)
        return full

    def choose(self, A: np.ndarray, b: np.ndarray, start: np.ndarray) -> np.ndarray:
        """The ρ of largest evidence (times its prior).

        The evidence has several maxima: it is climbed from `start` and from stiff edges.

        Args:
            A, b: JᵀJ (n, n) and Jᵀ(Jθ - r) (n,) in units of the noise.
        """
        from scipy.optimize import minimize

        # the square of all that is fitted is a part of the cost: beside it no tolerance is fine
        whole = self.cost(A, b, start)[0]

        def cost(rho: np.ndarray) -> tuple[float, np.ndarray]:
            found, gradient = self.cost(A, b, rho)
            return found - whole, gradient

        found = [minimize(cost, first, jac=True, method="L-BFGS-B",
                          bounds=[(ROUGHEST, SMOOTHEST)] * len(start),
                          options={"maxiter": 60, "ftol": 1e-8})
                 for first in (start, np.full_like(start, STIFF))]
        return np.asarray(min(found, key=lambda f: f.fun).x)

    def evidence(self, A: np.ndarray, b: np.ndarray, rho: np.ndarray) -> float:
        """Log evidence of the structure, ρ integrated out around its best value `rho`."""
        prior = np.eye(len(rho)) / self.settings.spread**2
        for k in range(len(rho)):
            unit = np.eye(len(rho))[k]
            prior[k] += self._steps(unit)[1]
        volume = np.linalg.slogdet(prior)[1] - np.linalg.slogdet(self.curvature(A, b, rho))[1]
        return 0.5 * float(volume) - self.cost(A, b, rho)[0]

    def cost(self, A: np.ndarray, b: np.ndarray, rho: np.ndarray) -> tuple[float, np.ndarray]:
        """-log evidence, with the prior of ρ, and its gradient in ρ."""
        from scipy.linalg import cho_factor, cho_solve

        factor = cho_factor(A + self.precision(rho))
        # an explicit inverse times b would err by far more than the difference of two evidences
        theta, inverse = cho_solve(factor, b), cho_solve(factor, np.eye(len(b)))
        cost = -0.5 * float(b @ theta) + float(np.log(np.diag(factor[0])).sum())
        gradient = []
        for prior, own in zip(self.priors, self.split(rho), strict=True):
            own_precision = prior.precision(own)
            cost -= 0.5 * float(np.linalg.slogdet(own_precision)[1])
            spread = inverse[np.ix_(prior.at, prior.at)] - np.linalg.inv(own_precision)
            c = theta[prior.at]
            gradient += [0.5 * float(np.sum(spread * slope) + c @ slope @ c)
                         for slope in prior.slopes(own)]
        steps, back = self._steps(rho)
        off = (rho - self.settings.usual) / self.settings.spread
        cost += 0.5 * float(steps @ steps) + 0.5 * float(off @ off)
        return cost, np.array(gradient) + back + off / self.settings.spread

    def _steps(self, rho: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Differences of neighbouring pieces over their prior deviation, and the gradient of half
        their square.
        """
        steps, back, usual = [], [], self.settings.step
        for prior, own in zip(self.priors, self.split(rho), strict=True):
            step = np.diff(own[: prior.pieces]) / usual
            steps.append(step)
            edge = np.zeros(len(own))
            edge[1: prior.pieces] += step / usual
            edge[: prior.pieces - 1] -= step / usual
            back.append(edge)
        return np.concatenate(steps), np.concatenate(back)

    def plausible(self, A: np.ndarray, b: np.ndarray, rho: np.ndarray
                  ) -> list[tuple[np.ndarray, float]]:
        """Smoothnesses around the best ρ and their weights: importance sampling of the evidence.

        Drawn are quasi-random points of a normal distribution that is wider than the evidence.
        """
        from scipy.stats import norm, qmc

        values, vectors = np.linalg.eigh(np.linalg.inv(self.curvature(A, b, rho)))
        unit = norm.ppf(qmc.Sobol(len(rho), seed=0).random(self.settings.plausible))
        drawn = rho + WIDER * unit @ (vectors * np.sqrt(values)).T
        drawn = np.clip(drawn, ROUGHEST, SMOOTHEST)
        log = np.array([-self.cost(A, b, r)[0] for r in drawn]) + 0.5 * np.sum(unit**2, axis=1)
        weight = np.exp(log - log.max())
        weight /= weight.sum()
        return [(r, float(w)) for r, w in zip(drawn, weight, strict=True) if w > 1e-4]

    def curvature(self, A: np.ndarray, b: np.ndarray, rho: np.ndarray) -> np.ndarray:
        """Curvature (k, k) of the cost in ρ by differences of its gradient, at least FLAT."""
        k = len(rho)
        found = np.zeros((k, k))
        for i in range(k):
            move = np.zeros(k)
            move[i] = 0.1
            ahead, behind = (self.cost(A, b, rho + s * move)[1] for s in (1.0, -1.0))
            found[i] = (ahead - behind) / 0.2
        values, vectors = np.linalg.eigh(0.5 * (found + found.T))
        return np.asarray((vectors * np.maximum(values, FLAT)) @ vectors.T)
