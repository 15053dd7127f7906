"""Measures of how well a prediction follows what was measured.

The fit per cent is that of MATLAB's `compare`: 100·(1 - |y - ŷ|/|y - mean(y)|).  AIC and BIC are
those of Gaussian noise whose variance is taken from the residual (L. Ljung, System Identification,
2nd ed. 1999, sec. 16.4):

    -2 ln L = N ln(2π RSS/N) + N,   AIC = -2 ln L + 2 k,   BIC = -2 ln L + k ln N.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Score:
    """One output of one recording as one model predicts it.

    Attributes:
        model, recording, output, unit: What.
        held_out: Whether the model was not fitted to it; None if that is not known.
        n: Samples that are scored.
        rmse: Root mean square error, in the output's unit.
        fit: NRMSE fit [%].
        r2: Coefficient of determination.
        chi2, dof, p_value: Σ(error/σ)², its degrees of freedom, and the probability of more where
            the model is right and the noise white.
        sigma, sigma_source: The noise level used for it (root mean square), "given" or "estimated".
        parameters: Number of parameters: estimated ones of the model, and what was fitted to this
            recording (its initial state).
        aic, bic: Information criteria of this output.
    """

    model: str
    recording: str
    output: str
    unit: str
    held_out: bool | None
    n: int
    rmse: float
    fit: float
    r2: float
    chi2: float
    dof: int
    p_value: float
    sigma: float
    sigma_source: str
    parameters: int
    aic: float
    bic: float

    def to_dict(self) -> dict[str, Any]:
        """All of it by name, for JSON."""
        return asdict(self)


def fit_percent(measured: np.ndarray, predicted: np.ndarray) -> float:
    """NRMSE fit [%]: 100 for a perfect prediction, 0 for the mean; no number for a constant.

    Args:
        measured, predicted: (N,).

    >>> round(fit_percent(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 1.0])), 2)
    29.29
    """
    about = float(np.linalg.norm(measured - np.mean(measured)))
    error = float(np.linalg.norm(measured - predicted))
    return 100.0 * (1.0 - error / about) if about > 0 else float("nan")


def information_criteria(residual: np.ndarray, k: int) -> tuple[float, float]:
    """(AIC, BIC) of a residual (N,) of a model with k parameters.

    >>> [round(v, 3) for v in information_criteria(np.array([1.0, -1.0, 1.0, -1.0]), 1)]
    [13.352, 12.738]
    """
    n = len(residual)
    with np.errstate(divide="ignore"):
        deviance = n * float(np.log(2 * np.pi * np.mean(residual**2))) + n
    return deviance + 2 * k, deviance + k * float(np.log(n))


def score(model: str, recording: str, output: str, unit: str, held_out: bool | None,
          measured: np.ndarray, predicted: np.ndarray, sigma: np.ndarray, sigma_source: str,
          parameters: int, fitted_here: int) -> Score:
    """Score a prediction.

    Args:
        model, recording, output, unit, held_out: As in `Score`.
        measured, predicted, sigma: (N,), in the output's unit.
        sigma_source: "given" or "estimated".
        parameters: Counted in AIC and BIC.
        fitted_here: Of these, how many were fitted to this recording: χ² loses as many degrees of
            freedom.
    """
    from scipy.special import chdtrc

    residual = measured - predicted
    n = len(residual)
    dof = max(n - fitted_here, 1)
    spread = float(np.sqrt(np.mean(sigma**2)))
    if not np.all(np.isfinite(predicted)):  # the simulation left the finite numbers
        inf = float("inf")
        return Score(model, recording, output, unit, held_out, n, inf, -inf, -inf, inf, dof, 0.0,
                     spread, sigma_source, parameters, inf, inf)
    chi2 = float(np.sum((residual / sigma) ** 2))
    aic, bic = information_criteria(residual, parameters)
    total = float(np.sum((measured - np.mean(measured)) ** 2))
    return Score(
        model, recording, output, unit, held_out, n,
        float(np.sqrt(np.mean(residual**2))), fit_percent(measured, predicted),
        1.0 - float(residual @ residual) / total if total > 0 else float("nan"),
        chi2, dof, float(chdtrc(dof, chi2)), spread, sigma_source, parameters,
        aic, bic)
