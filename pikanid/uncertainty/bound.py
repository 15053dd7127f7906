"""The Cramér-Rao bound: what any unbiased estimator could reach.

With Gaussian noise the information about θ is F = Σ_i (∂h_i/∂θ)ᵀ (∂h_i/∂θ)/σ_i², and no unbiased
estimator has a smaller covariance than F⁻¹ (Cramér-Rao; Kay, Fundamentals of Statistical Signal
Processing: Estimation Theory, 1993, ch. 3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.model import Model
from pikanid.objective.shooting import Shooting
from pikanid.problem.problem import Problem
from pikanid.recording import Recording
from pikanid.simulation.synthetic import with_outputs
from pikanid.uncertainty.information import (
    covariance,
)


@dataclass(frozen=True)
class CramerRao:
    """Fisher information F (n, n) about θ and what follows from it before there is any data.

    Printing shows the smallest possible standard errors.
    """

    names: tuple[str, ...]
    fisher: np.ndarray
    jacobian: np.ndarray

    @property
    def covariance(self) -> np.ndarray:
        """F⁻¹ (n, n)."""
        return covariance(self.jacobian, np.ones(len(self.names), bool))

    def std(self, name: str) -> float:
        """The smallest standard error that an unbiased estimator can have."""
        if name not in self.names:
            raise errors.BadModel(errors.not_in_model("free parameter", name, self.names))
        k = self.names.index(name)
        return float(np.sqrt(self.covariance[k, k]))

    @property
    def correlation(self) -> np.ndarray:
        """Correlation matrix (n, n) of an efficient estimator."""
        c = self.covariance
        s = np.sqrt(np.diag(c))
        return c / np.outer(s, s)

    def __str__(self) -> str:
        parts = [f"std({n}) >= {self.std(n):.3g}" for n in self.names]
        return "Cramér-Rao bound: " + ", ".join(parts)


def cramer_rao(model: Model, recording: Recording | Sequence[Recording],
               sigma: float | Mapping[str, float] | None = None) -> CramerRao:
    """The Cramér-Rao bound of an experiment at the model's parameter values.

    Args:
        model: Values of its free parameters are taken as true.
        recording: One or several; where an output is missing its samples are taken at the
            recording's own times, so that an excitation alone will do.
        sigma: Noise of the outputs, if the recordings do not carry it.

    Raises:
        BadSetting: No σ is known for an output.

    >>> from pikanid.recording import excitation
    >>> from pikanid.model import systems
    >>> bound = cramer_rao(systems.sloshing(), excitation.two_pulse(), sigma=0.1*np.pi/180)
    >>> float(f"{bound.std('l_theta'):.2e}"), float(f"{bound.std('d_theta'):.1e}")
    (9.89e-06, 0.00095)
    """
    given = [recording] if isinstance(recording, Recording) else list(recording)
    full = [_with_sigma(with_outputs(model, r), model, sigma) for r in given]
    problem = Problem(model, full)
    shooting = Shooting(problem)
    theta = problem.guess
    shooting.choose_steps(theta, "fine")
    jacobian = shooting.jacobian(theta)
    return CramerRao(tuple(f.label for f in problem.free), jacobian.T @ jacobian, jacobian)


def _with_sigma(recording: Recording, model: Model, sigma: float | Mapping[str, float] | None
                ) -> Recording:
    for o in model.outputs:
        value = sigma if sigma is None or isinstance(sigma, int | float) else sigma.get(o.name)
        if value is not None:
            recording = recording.with_sigma(**{o.name: value})
        elif recording[o.name].sigma is None and o.sigma is None:
            raise errors.BadSetting(errors.sigma_unknown(o.name))
    return recording
