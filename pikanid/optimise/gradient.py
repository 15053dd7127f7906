"""Joint gradient descent (Table I): Adam, then L-BFGS, on a loss with two parts.

Both keep the best iterate, so that a loss which turns to NaN or diverges costs the rest of the run
but not what was found; both are deterministic, and leave torch's global settings as they were.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from pikanid.approximators import Array

Progress = Callable[[dict[str, float]], None]
EVERY = 100  # limit: steps between two reports
BETAS, EPSILON = (0.9, 0.999), 1e-12  # definition: of Adam (2015)
MEMORY = 50  # limit: pairs that L-BFGS remembers
DIVERGED = 1e6  # numerical: times the first loss


class Loss(Protocol):
    """The two sums of squares of Eq. (2), per sample, as functions of all unknowns z (n,)."""

    def __call__(self, z: Tensor) -> tuple[Tensor, Tensor]:
        """Data and physics part, differentiable scalars."""


class Slope(Protocol):
    """The same with the gradient of data + λ·physics."""

    def __call__(self, z: Array, lam: float) -> tuple[float, float, Array]:
        """Data and physics part at z (n,), and the gradient (n,)."""


class Weight(Protocol):
    """λ during Adam."""

    def __call__(self, step: int, loss: Loss, z: Tensor) -> float:
        """λ of this step."""


@dataclass(frozen=True)
class Ramp:
    """λ rises linearly from `start` to `stop` over `steps`."""

    start: float
    stop: float
    steps: int

    def __call__(self, step: int, loss: Loss, z: Tensor) -> float:
        """λ of this step."""
        return self.start + (self.stop - self.start) * min(1.0, step / max(self.steps - 1, 1))


@dataclass
class GradNorm:
    """λ such that both parts pull equally hard: ‖∇data‖/‖∇physics‖, smoothed.

    The loss balancing by gradient statistics of Wang, Teng & Perdikaris (SIAM J. Sci. Comput. 43,
    2021, A3055), with norms in place of extreme values.
    """

    lam: float = 0.0
    every: int = 100
    momentum: float = 0.9
    largest: float = 1e6
    _begun: bool = field(default=False, init=False)

    def __call__(self, step: int, loss: Loss, z: Tensor) -> float:
        """λ of this step; renewed every `every` steps."""
        if step % self.every == 0:
            at = z.detach().requires_grad_()
            pulls = [torch.linalg.vector_norm(torch.autograd.grad(part, at, retain_graph=True)[0])
                     for part in loss(at)]
            wanted = float(pulls[0] / torch.clamp(pulls[1], min=1e-300))
            if np.isfinite(wanted):
                old = self.momentum * self.lam if self._begun else 0.0
                share = 1.0 - self.momentum if self._begun else 1.0
                self.lam, self._begun = min(old + share * wanted, self.largest), True
        return self.lam


@dataclass(frozen=True, eq=False)
class Descent:
    """Where a descent stopped: the best iterate, its loss parts, and how it went."""

    z: Array
    lam: float
    data: float
    physics: float
    steps: int
    gradient: float  # norm at the best iterate; NaN where it was not recorded
    finished: bool  # stationary, rather than out of steps
    diverged: bool
    history: tuple[dict[str, float], ...] = ()

    @property
    def loss(self) -> float:
        """data + λ·physics."""
        return self.data + self.lam * self.physics


def present(device: str) -> bool:
    """Whether torch has this device.

    >>> present("cpu"), present("abacus")
    (True, False)
    """
    try:
        kind = torch.device(device).type
    except RuntimeError:
        return False
    return kind == "cpu" or (kind == "cuda" and torch.cuda.is_available())


@contextmanager
def one_thread() -> Iterator[None]:
    """Run torch on one thread meanwhile: layers this small lose time on two, much on busy cores.

    The number of threads is as before afterwards.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def adam(loss: Loss, start: Array, *, steps: int, weight: Weight, goal: float | None = None,
         rate: float = 1e-3, decay: float = 1.0, lower: Array | None = None,
         upper: Array | None = None, device: str = "cpu", progress: Progress | None = None
         ) -> Descent:
    """Adam (Kingma & Ba, 2015) from `start` (n,), every step put back inside the bounds.

    Args:
        weight: λ at every step.
        goal: The λ by which iterates are compared, as λ moves meanwhile; the last one if None.
        rate, decay: Learning rate of the first step, and what it has shrunk to by the last.
        lower, upper: Bounds (n,).
        progress: Called every 100 steps with step, lam, data and physics.
    """
    z = _tensor(start, device)
    box = [None if b is None else _tensor(b, device) for b in (lower, upper)]
    first, second = torch.zeros_like(z), torch.zeros_like(z)
    best, best_cost, best_parts, history = z.clone(), np.inf, (np.nan, np.nan), []
    bad, lam, step = False, 0.0, 0
    limit = np.inf
    slope = _slope_of(loss, device)
    for step in range(1, steps + 1):
        lam = weight(step - 1, loss, z)
        data, physics, pull = slope(z.cpu().numpy(), lam)
        parts, gradient = (data, physics), _tensor(pull, device)
        cost = parts[0] + (lam if goal is None else goal) * parts[1]
        if not cost < limit:
            bad = True
            break
        if step == 1:
            limit = DIVERGED * max(cost, 1e-300)
        if cost < best_cost or goal is None:
            best.copy_(z)
            best_cost, best_parts = cost, parts
        if step % EVERY == 0 or step == 1:
            history.append(_report(step, lam, parts, progress))
        first.lerp_(gradient, 1.0 - BETAS[0])
        second.mul_(BETAS[1]).addcmul_(gradient, gradient, value=1.0 - BETAS[1])
        size = rate * decay ** (step / steps) / (1.0 - BETAS[0] ** step)
        spread = (second / (1.0 - BETAS[1] ** step)).sqrt_().add_(EPSILON)
        z.addcdiv_(first, spread, value=-size)
        if box[0] is not None and box[1] is not None:
            torch.clamp(z, box[0], box[1], out=z)
    return Descent(best.cpu().numpy(), lam if goal is None else goal, *best_parts, step, np.nan,
                   False, bad, tuple(history))


def lbfgs(loss: Loss, start: Array, *, steps: int, lam: float, lower: Array | None = None,
          upper: Array | None = None, device: str = "cpu", memory: int = MEMORY,
          progress: Progress | None = None) -> Descent:
    """L-BFGS-B (Byrd, Lu, Nocedal & Zhu, 1995) at a fixed λ, within bounds (n,)."""
    from scipy.optimize import minimize

    best, parts_of_best, history = start.copy(), (np.nan, np.nan), []
    least, gradient_there, broken, count = np.inf, np.nan, False, 0
    slope_at = _slope_of(loss, device)

    def cost(z: Array) -> tuple[float, Array]:
        nonlocal best, parts_of_best, least, gradient_there, broken
        data, physics, slope = slope_at(z, lam)
        value = data + lam * physics
        if not np.isfinite(value) or not np.all(np.isfinite(slope)):
            broken = True
            return 1e300, np.zeros_like(z)  # the line search turns back
        if value < least:
            best, least, parts_of_best = z.copy(), value, (data, physics)
            gradient_there = float(np.linalg.norm(_projected(slope, z, lower, upper)))
        return value, slope

    def tell(_: Array) -> None:
        nonlocal count
        count += 1
        if count % EVERY == 0:
            history.append(_report(count, lam, parts_of_best, progress))

    bounds = None if lower is None or upper is None else list(zip(lower, upper, strict=True))
    found = minimize(  # type: ignore[call-overload]  # jac=True is not in its stubs
        cost, start, jac=True, method="L-BFGS-B", bounds=bounds, callback=tell,
                     options={"maxiter": steps, "maxfun": 4 * steps, "maxls": 40, "ftol": 1e-15,
                              "gtol": 1e-12, "maxcor": memory})
    finished = bool(found.status == 0) and not broken
    return Descent(best, lam, *parts_of_best, int(found.nit), gradient_there, finished,
                   not np.isfinite(least), tuple(history))


def _slope_of(loss: Loss, device: str) -> Slope:
    """The loss' own `slope`, which may do without a graph, or else `traced_slope`."""
    own: Slope | None = getattr(loss, "slope", None)
    return functools.partial(traced_slope, loss, device) if own is None else own


def traced_slope(loss: Loss, device: str, z: Array, lam: float) -> tuple[float, float, Array]:
    """Data and physics part at z (n,) and the gradient of data + λ·physics, by torch's graph."""
    at = _tensor(z, device).requires_grad_()
    data, physics = loss(at)
    (gradient,) = torch.autograd.grad(data + lam * physics, at)
    return float(data.detach()), float(physics.detach()), gradient.cpu().numpy().astype(float)


def _projected(slope: Array, z: Array, lower: Array | None, upper: Array | None) -> Array:
    """The gradient without what pushes against a bound."""
    if lower is None or upper is None:
        return slope
    return np.where((z <= lower) & (slope > 0) | (z >= upper) & (slope < 0), 0.0, slope)


def _report(step: int, lam: float, parts: tuple[float, float], progress: Progress | None
            ) -> dict[str, float]:
    entry = {"step": float(step), "lam": float(lam), "data": parts[0], "physics": parts[1]}
    if progress is not None:
        progress(entry)
    return entry


def _tensor(values: Array, device: str) -> Tensor:
    return torch.tensor(np.asarray(values, float), dtype=torch.float64, device=device)
