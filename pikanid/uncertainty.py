"""How far an estimate can be trusted: Fisher information, Cramér-Rao bound, profiles.

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
from pikanid.optimise.levenberg_marquardt import minimise
from pikanid.problem import FreeParameter, Problem
from pikanid.recording import Recording
from pikanid.shooting import Shooting
from pikanid.simulation.simulate import with_outputs


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
        return "Cramér-Rao bound: " + ", ".join(f"std({n}) >= {self.std(n):.3g}" for n in self.names)


def cramer_rao(model: Model, recording: Recording | Sequence[Recording],
               sigma: float | Mapping[str, float] | None = None) -> CramerRao:
    """The Cramér-Rao bound of an experiment at the model's parameter values.

    Parameters
    ----------
    model : values of its free parameters are taken as true
    recording : one or several; where an output is missing its samples are taken at the recording's
        own times, so that an excitation alone will do
    sigma : noise of the outputs, if the recordings do not carry it

    Raises
    ------
    pikanid.errors.BadSetting : no σ is known for an output

    >>> from pikanid import excitation, systems
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


def covariance(jacobian: np.ndarray, estimated: np.ndarray) -> np.ndarray:
    """(JᵀJ)⁻¹ (n, n) of standardised residuals, by singular values of the scaled Jacobian.

    Directions that the data do not see get an infinite variance; parameters that are not
    `estimated` (n,) (held at a bound) get NaN.
    """
    n = jacobian.shape[1]
    result = np.full((n, n), np.nan)
    inside = np.flatnonzero(estimated)
    J = np.linalg.qr(jacobian[:, inside], mode="r")
    norms = np.linalg.norm(J, axis=0) if len(inside) else np.empty(0)
    seen = norms > 0
    block = np.zeros((len(inside), len(inside)))
    if seen.any():
        _, s, vt = np.linalg.svd(J[:, seen] / norms[seen], full_matrices=False)
        good = s > s[0] * 1e-12
        inner = (vt[good].T / s[good] ** 2) @ vt[good] if good.all() else (
            (vt.T / np.where(good, s, s[0] * 1e-12) ** 2) @ vt)
        block[np.ix_(seen, seen)] = inner / np.outer(norms[seen], norms[seen])
    block[~seen, ~seen] = np.inf
    result[np.ix_(inside, inside)] = block
    return result


def identifiability_warnings(jacobian: np.ndarray, free: Sequence[FreeParameter],
                             estimated: np.ndarray, limit: float = 1e6) -> list[str]:
    """Sentences about parameters, or combinations of them, that the data do not determine."""
    names = [f.label for f, e in zip(free, estimated, strict=True) if e]
    if not names:
        return []
    J = np.linalg.qr(jacobian[:, estimated], mode="r")
    norms = np.linalg.norm(J, axis=0)
    notes = [errors.no_influence(n) for n, size in zip(names, norms, strict=True) if size == 0]
    seen = norms > 0
    if seen.sum() < 2:
        return notes
    _, s, vt = np.linalg.svd(J[:, seen] / norms[seen], full_matrices=False)
    if s[-1] < s[0] / limit:
        visible = [n for n, k in zip(names, seen, strict=True) if k]
        weights = vt[-1] / np.max(np.abs(vt[-1]))
        parts = [f"{w:+.2g}·{n}" for w, n in zip(weights, visible, strict=True) if abs(w) > 0.1]
        notes.append(errors.unidentifiable(" ".join(parts), s[0] / max(s[-1], 1e-300)))
    return notes


@dataclass(frozen=True)
class Profile:
    """Profile likelihood of one parameter: the best cost over all others at each value.

    `values` (k,), `excess` (k,) = 2 (cost - least cost) in units of σ²; `interval` where the excess
    stays below the χ²₁ quantile (Raue et al., Bioinformatics 25, 2009, p. 1923), an infinite end
    where it never leaves it.
    """

    name: str
    values: np.ndarray
    excess: np.ndarray
    interval: tuple[float, float]
    level: float


def profile(model: Model, recordings: Recording | Sequence[Recording], theta: np.ndarray,
            name: str, level: float = 0.95, points: int = 12) -> Profile:
    """Profile likelihood interval of a shared parameter around a fitted θ.

    Steps outwards from the optimum on both sides, refitting all others, until the excess passes
    the quantile or the parameter's bound is met; the crossing is interpolated.

    Parameters
    ----------
    model, recordings, theta : as fitted (`estimate.model`, ..., `estimate.theta`)
    name : the parameter
    level : coverage of the interval
    points : values a side at most
    """
    from scipy.stats import chi2

    problem = Problem(model, recordings)
    shooting = Shooting(problem)
    shooting.choose_steps(theta, "fine")
    labels = [f.label for f in problem.free]
    if name not in labels:
        raise errors.BadModel(errors.not_in_model("free parameter", name, labels))
    k = labels.index(name)
    others = np.arange(len(theta)) != k
    r0 = shooting.residual(theta)
    scale = 1.0
    if shooting.adequacy(theta).source != "given":
        scale = float(r0 @ r0) / max(shooting.rows - len(theta), 1)
    quantile = float(chi2.ppf(level, 1))
    std = float(np.sqrt(covariance(shooting.jacobian(theta), np.ones(len(theta), bool))[k, k]
                        * scale))
    found: dict[float, float] = {float(theta[k]): 0.0}
    ends = [problem.lower[k], problem.upper[k]]
    limits = []
    for side, bound in zip((-1.0, 1.0), ends, strict=True):
        current, before, end = theta[others].copy(), 0.0, side * np.inf
        step = std * np.sqrt(quantile) / 2
        for count in range(1, points + 1):
            # equal steps first, then longer ones: a flat profile must be left in finite time
            value = float(np.clip(theta[k] + side * step * (count if count < 5 else 2.0 ** (count - 2)),
                                  *ends))

            def embed(q: np.ndarray, fixed: float = value) -> np.ndarray:
                full = np.empty(len(theta))
                full[k], full[others] = fixed, q
                return full

            best = minimise(lambda q, e=embed: shooting.residual(e(q)),
                            lambda q, e=embed: shooting.jacobian(e(q))[:, others], current,
                            problem.lower[others], problem.upper[others])
            current = best.theta
            excess = (2 * best.cost - float(r0 @ r0)) / scale
            previous = max(found, key=lambda v: side * v)
            found[value] = excess
            if excess >= quantile:
                share = (np.sqrt(quantile) - np.sqrt(max(before, 0))) / max(
                    np.sqrt(excess) - np.sqrt(max(before, 0)), 1e-300)
                end = previous + share * (value - previous)
                break
            if value == bound:
                end = bound
                break
            before = excess
        limits.append(float(end))
    order = sorted(found)
    return Profile(name, np.array(order), np.array([found[v] for v in order]),
                   (limits[0], limits[1]), level)


@dataclass(frozen=True)
class Partition:
    """Information about p with the trajectory's coefficients known and with them estimated as well.

    `alone` (n, n) = F_pp, `effective` (n, n) = F_pp - F_pc F_cc⁻¹ F_cp (Schur complement); `shares`
    (n,) how much of each parameter's own information is left.
    """

    alone: np.ndarray
    effective: np.ndarray

    @property
    def shares(self) -> np.ndarray:
        """effective/alone for each parameter with the others known."""
        return np.diag(self.effective) / np.diag(self.alone)


def information_partition(coefficients: np.ndarray, parameters: np.ndarray) -> Partition:
    """Effective Fisher information on p when coefficients c are estimated jointly.

    Parameters
    ----------
    coefficients : ∂r/∂c (rows, K) of the standardised residual [data; √λ physics]
    parameters : ∂r/∂p (rows, n)

    >>> part = information_partition(np.array([[1.0], [0.0]]), np.array([[1.0], [1.0]]))
    >>> part.shares
    array([0.5])
    """
    alone = parameters.T @ parameters
    q, _ = np.linalg.qr(coefficients)
    rest = parameters - q @ (q.T @ parameters)
    return Partition(alone, rest.T @ rest)
