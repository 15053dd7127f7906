"""What a fit says of parameters that another recording shares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pikanid.mismatch.fitting.hypothesis import Hypothesis

NARROW = 2.0  # numerical: 2 ln of times, on average, that parameters become narrower at most


@dataclass(frozen=True)
class Prior:
    """A fit's information on the parameters with `names`, all of its others estimated too.

    χ² of the fit is |R (θ - θ₁) + z|² and a constant, linearised at θ₁: about its estimates, or
    elsewhere, where the uncertainty of a law far from linear has another shape.

    Attributes:
        root: R (n, n).
        about: θ₁ (n,).
        offset: z (n,).
        constant: By how much χ² at its least exceeds that of the fit.
        all: All of the fit's parameters (p,) at θ₁.
        follow: (p, n) how all of them move along, so that χ² stays least.
        inside: Places of the shared ones among them.
    """

    root: np.ndarray
    about: np.ndarray
    offset: np.ndarray
    constant: float
    all: np.ndarray
    follow: np.ndarray
    inside: tuple[int, ...]

    def residual(self, theta: np.ndarray) -> np.ndarray:
        """(n,) of the shared parameters."""
        return np.asarray(self.root @ (theta - self.about) + self.offset)

    def distance(self, theta: np.ndarray) -> float:
        """From θ₁, in standard deviations."""
        return float(np.linalg.norm(self.root @ (theta - self.about)))


def of_fit(hypothesis: Hypothesis, names: list[str]) -> Prior:
    """The information of a fit, linearised at its estimates: χ² has a slope at those that a bound
    holds.
    """
    free = [f.name for f in hypothesis.whitened.problem.free]
    inside = tuple(free.index(n) for n in names)
    found = hypothesis.minimum
    return _linearised(found.theta, found.J, found.r, inside, found.chi2)


def elsewhere(prior: Prior, hypothesis: Hypothesis, theta: np.ndarray) -> Prior | None:
    """The same, linearised at these shared parameters; None where that cannot be simulated."""
    problem = hypothesis.whitened.problem
    moved = np.clip(prior.all + prior.follow @ (theta - prior.about), problem.lower, problem.upper)
    moved[list(prior.inside)] = theta
    at = hypothesis.whitened.residual(moved)
    if at is None or not np.isfinite(at[1]).all():
        return None
    return _linearised(moved, at[1], at[0], prior.inside, hypothesis.minimum.chi2)


def _linearised(theta: np.ndarray, J: np.ndarray, r: np.ndarray, inside: tuple[int, ...],
                least: float) -> Prior:
    shared, count = list(inside), len(theta)
    others = [k for k in range(count) if k not in inside]
    follow = np.zeros((count, len(inside)))
    follow[shared, np.arange(len(inside))] = 1.0
    rest, left = J[:, shared], r
    if others:
        q, _ = np.linalg.qr(J[:, others])
        follow[others] = -np.linalg.lstsq(J[:, others], rest, rcond=None)[0]
        rest, left = rest - q @ (q.T @ rest), left - q @ (q.T @ left)
    if not inside:
        return Prior(np.empty((0, 0)), np.empty(0), np.empty(0), 0.0, theta, follow, inside)
    q, root = np.linalg.qr(rest)
    z = q.T @ left
    return Prior(root, theta[shared], z, float(left @ left - z @ z) - least, theta, follow, inside)


def room(J: np.ndarray, shared: Sequence[int], fit: Prior,
         there: Callable[[], Prior | None] = lambda: None) -> float:
    """What the parameters' uncertainty costs of the probability density of a recording.

    Shared ones: the logarithm of how much narrower the recording makes what a fit has left of them.
    Others know nothing before, and cost what the recording tells of them beyond one of its rows.
    Where they become very much narrower, that may be the place's doing: a mass that has all but
    vanished shows thousands of times as much of any change when it is twice as large.  What the fit
    has left there is narrower, too.

    Args:
        J: Jacobian of the recording, and below it of what is known before (rows + n, p).
        shared: Places (n,) of the parameters that both have.
        fit: What a fit says, at its estimates.
        there: What it says where J was taken.
    """
    own = [k for k in range(J.shape[1]) if k not in shared]

    def narrower(whole: np.ndarray, before: Prior) -> float:
        q, _ = np.linalg.qr(whole[:, own])
        left = whole[:, shared] - q @ (q.T @ whole[:, shared])
        # far from the estimates a law may tell nothing: no recording makes that uncertainty wider
        return max(_volume(left) - _volume(before.root), 0.0)

    cost = narrower(J, fit)
    if cost > NARROW * len(shared) and (other := there()) is not None:
        both = J.copy()
        both[len(J) - len(shared):] = 0.0
        both[len(J) - len(shared):, shared] = other.root
        cost = min(cost, narrower(both, other))
    return cost + len(own) * float(np.log(len(J)))


def _volume(J: np.ndarray) -> float:
    """ln det JᵀJ."""
    if J.shape[1] == 0:
        return 0.0
    return float(2 * np.sum(np.log(np.maximum(np.abs(np.diag(np.linalg.qr(J, mode="r"))), 1e-300))))

