"""Edges and parameters together by shooting: penalised Gauss-Newton, exact sensitivities.

    min over θ = (p, b, c):   Σ ((ŷ - y)/σ)² + cᵀ Λ(ρ) c

Every iteration linearises the simulation, chooses the smoothness ρ by the evidence of the linear
problem, and takes the penalised step, damped until the penalised cost falls.

The cost is another one in every iteration, as ρ and the noise are chosen anew, which
`optimise.levenberg_marquardt` cannot have: it would have to settle at one ρ before the next is
chosen.  In four problems (600 samples, one or two edges of 13 coefficients) such turns asked for 7
to 30 sensitivities against 5 to 9 here, and for half to all of the time; in three of them the
evidence was the same to 0.01, in one they led to another maximum of it: results would not stay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.discrepancy.smoothness import Smoothness
from pikanid.objective.shooting import Shooting

TRIES = 8  # limit: dampings of one step


@dataclass(frozen=True, eq=False)
class PenalisedFit:
    """Where the fit stopped.

    `information` A = JᵀJ/s² (n, n) and `gain` b = Jᵀ(Jθ - r)/s² (n,) of the linear problem there, s
    the noise in units of the stated σ (1 where σ is known); `inside` (n,) marks parameters that are
    not held at a bound; `evidence` is the log marginal likelihood, up to a constant.
    """

    theta: np.ndarray
    rho: np.ndarray
    information: np.ndarray
    gain: np.ndarray
    inside: np.ndarray
    noise: float
    smoothness: Smoothness
    evidence: float
    converged: bool
    history: tuple[dict[str, float], ...]

    @property
    def effective(self) -> float:
        """Effective number of parameters: trace of (A + Λ)⁻¹A."""
        H = self.information + self.smoothness.precision(self.rho)
        keep = np.ix_(self.inside, self.inside)
        return float(np.trace(np.linalg.solve(H[keep], self.information[keep])))


def penalised_fit(shooting: Shooting, start: np.ndarray, smoothness: Smoothness,
                  rho: np.ndarray, fixed: bool = False) -> PenalisedFit:
    """Fit from θ = start (n,) and smoothness ρ; with `fixed` ρ stays as it is.

    Raises:
        SimulationFailed: The model cannot be simulated at the start.
    """
    shooting.choose_steps(start, "coarse")
    stated = all(s is not None for s in shooting.known)
    theta, accuracy = np.clip(start, shooting.problem.lower, shooting.problem.upper), "coarse"
    noise, damping, idle, converged = 1.0, 1e-3, 0, False
    history: list[dict[str, float]] = []
    settings = smoothness.settings
    for _ in range(settings.iterations):
        r, J = shooting.residual(theta), shooting.jacobian(theta)
        if r[0] >= 1e10:
            raise errors.SimulationFailed(errors.discrepancy_not_simulated())
        A, b = J.T @ J, J.T @ (J @ theta - r)
        # far from the data the misfit counts as noise: edges then stay smooth and steps short
        before, noise = noise, _noise(r, A, smoothness, rho, stated)
        A, b = A / noise**2, b / noise**2
        if not fixed:
            rho = smoothness.choose(A, b, rho)
        H = A + smoothness.precision(rho)
        step = _bounded(H, b, theta, shooting)[0] - theta
        moved = float(np.sqrt(max(step @ H @ step, 0.0) / len(step)))
        cost = _cost(r, theta, noise, smoothness, rho)
        trial, fallen, damping = _damped(
            shooting, H, b, theta, cost, damping, noise, smoothness, rho)
        history.append({"cost": cost, "fallen": fallen, "moved": moved, "damping": damping,
                        "noise": noise})
        if trial is not None:
            theta = trial
        # along a gauge the valley is curved and flat: where it leads to does not matter
        idle = idle + 1 if history[-1]["fallen"] < settings.idle else 0
        small = (moved < settings.settled or idle >= 2) and abs(noise / before - 1.0) < 0.01
        if trial is None or small:
            if accuracy == "coarse":
                accuracy, damping, idle = "fine", 1e-3, 0
                if shooting.choose_steps(theta, "fine"):
                    continue
            converged = small
            break
    r, J = shooting.residual(theta), shooting.jacobian(theta)
    A, b = J.T @ J / noise**2, J.T @ (J @ theta - r) / noise**2
    evidence = smoothness.evidence(A, b, rho) - 0.5 * float(
        (J @ theta - r) @ (J @ theta - r)) / noise**2 - len(r) * np.log(noise)
    _, inside = _bounded(A + smoothness.precision(rho), b, theta, shooting)
    return PenalisedFit(theta, rho, A, b, inside, noise, smoothness, evidence, converged,
                        tuple(history))


def _cost(r: np.ndarray, theta: np.ndarray, noise: float, smoothness: Smoothness,
          rho: np.ndarray) -> float:
    return float(r @ r) / noise**2 + float(theta @ smoothness.precision(rho) @ theta)


def _damped(shooting: Shooting, H: np.ndarray, b: np.ndarray, theta: np.ndarray, cost: float,
            damping: float, noise: float, smoothness: Smoothness, rho: np.ndarray
            ) -> tuple[np.ndarray | None, float, float]:
    """A step that lowers the cost, damped as far as it must be (Levenberg-Marquardt), or None.

    Also returned: by how much the cost has fallen, and the damping for the next step.
    """
    scale = np.diag(H)
    for _ in range(TRIES):
        trial = _bounded(H + np.diag(damping * scale), b + damping * scale * theta, theta,
                         shooting)[0]
        found = _cost(shooting.residual(trial), trial, noise, smoothness, rho)
        if found <= cost * (1 + 1e-9):
            return trial, cost - found, max(0.1 * damping, 1e-9)
        damping *= 10.0
    return None, 0.0, damping


def _bounded(H: np.ndarray, b: np.ndarray, theta: np.ndarray, shooting: Shooting
             ) -> tuple[np.ndarray, np.ndarray]:
    """The minimiser of the quadratic model, parameters that would leave their bounds held there."""
    lower, upper = shooting.problem.lower, shooting.problem.upper
    free = np.ones(len(b), bool)
    aim = np.array(theta)
    for _ in range(len(b)):
        right = b[free] - H[np.ix_(free, ~free)] @ aim[~free]
        aim[free] = np.linalg.solve(H[np.ix_(free, free)], right)
        outside = free & ((aim < lower) | (aim > upper))
        if not outside.any():
            break
        aim[outside] = np.clip(aim[outside], lower[outside], upper[outside])
        free &= ~outside
    return aim, free


def _noise(r: np.ndarray, A: np.ndarray, smoothness: Smoothness, rho: np.ndarray,
           stated: bool) -> float:
    """Standard deviation of the residuals, in units of the stated σ; 1 where σ explains them."""
    noise = max(float(np.sqrt(r @ r / len(r))), 1e-300)
    H = A / noise**2 + smoothness.precision(rho)
    used = float(np.trace(np.linalg.lstsq(H, A / noise**2, rcond=None)[0]))
    dof = max(len(r) - used, 1.0)
    # a χ² far beyond its mean is no chance
    if stated and float(r @ r) < dof + smoothness.settings.louder * np.sqrt(2.0 * dof):
        return 1.0
    return float(np.sqrt(float(r @ r) / dof))
