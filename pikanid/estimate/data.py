"""What an `Estimate` holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from pikanid.model import Model
from pikanid.objective.adequacy import Adequacy
from pikanid.optimise.box import met
from pikanid.problem.problem import FreeParameter


@dataclass(frozen=True, eq=False)
class Fit:
    """Measured against fitted, for an output of a recording; arrays (N,) in the model's unit.

    `sigma` is the noise, `spread` the standard deviation of `fitted` that the parameters'
    covariance gives to first order; None where they are not known.
    """

    recording: str
    output: str
    unit: str
    t: np.ndarray
    measured: np.ndarray
    fitted: np.ndarray
    sigma: np.ndarray | None = None
    spread: np.ndarray | None = None

    @classmethod
    def joined(cls, fits: Sequence[Fit]) -> Fit:
        """One of segments of a recording."""
        def whole(parts: Sequence[np.ndarray | None]) -> np.ndarray | None:
            known = [p for p in parts if p is not None]
            return np.concatenate(known) if len(known) == len(parts) else None

        return replace(
            fits[0], t=np.concatenate([f.t for f in fits]),
            measured=np.concatenate([f.measured for f in fits]),
            fitted=np.concatenate([f.fitted for f in fits]),
            sigma=whole([f.sigma for f in fits]), spread=whole([f.spread for f in fits]))

    @property
    def residual(self) -> np.ndarray:
        """measured - fitted (N,)."""
        return self.measured - self.fitted

    @property
    def rmse(self) -> float:
        """Root mean square of the residual."""
        return float(np.sqrt(np.mean(self.residual**2)))


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The states of one recording on a time grid: t (L,), x (L, n)."""

    t: np.ndarray
    x: np.ndarray


@dataclass(frozen=True, eq=False)
class EstimateData:
    """The fields of `pikanid.Estimate`, where they are described."""

    model: Model
    strategy: str
    free: tuple[FreeParameter, ...]
    theta: np.ndarray
    covariance: np.ndarray
    fits: tuple[Fit, ...]
    trajectories: tuple[Trajectory, ...]
    cost: float
    adequacy: Adequacy
    converged: bool
    settings: Mapping[str, Any] = field(default_factory=dict)
    history: tuple[Mapping[str, float], ...] = ()
    warnings: tuple[str, ...] = ()
    seconds: float = float("nan")
    seed: int | None = None
    version: str = ""
    approximator: Any = None

    # --- parameters ------------------------------------------------------------------------------

    @property
    def at_bound(self) -> np.ndarray:
        """(n_free,) which parameters ended at a bound: how far they would go is not known."""
        low, high = (np.array([f.bounds[k] for f in self.free], float) for k in (0, 1))
        return met(self.theta, low, high)
