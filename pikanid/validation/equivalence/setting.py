"""One case of the comparison: model, form, spline space, grids, λ and random unknowns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from pikanid import errors
from pikanid.validation.equivalence.systems import SYSTEMS, System

Array = NDArray[np.float64]
Form = Literal["state", "second-order"]


@dataclass(frozen=True)
class Setting:
    """A case.

    Attributes:
        system: "sloshing" (Eq. 6) or "duffing".
        form: "state" has one spline a state and the residual ẋ - f, "second-order" one spline and
            the residual of its second derivative.
        degree: Spline degree.
        grid: Grid intervals G.
        horizon: T [s].
        weight: λ.
        samples: Number of data N; both ends included.
        collocation: Number of collocation points M; both ends included.
        even: Whether the data grid is even; random otherwise.
        even_collocation: The same for the collocation grid; as the data grid unless given.
        end: Whether T is a collocation point.
        kinks: Times of enrichments ½(t-t_j)²₊ and (t-t_j)³₊/6.
        seed: Of noise, random grids, coefficients and parameters.
    """

    system: str
    form: Form
    degree: int = 3
    grid: int = 10
    horizon: float = 5.0
    weight: float = 1e-2
    samples: int = 61
    collocation: int = 101
    even: bool = True
    even_collocation: bool | None = None
    end: bool = True
    kinks: tuple[float, ...] = ()
    seed: int = 0

    @property
    def model(self) -> System:
        """The right-hand sides."""
        return SYSTEMS[self.system]

    @property
    def outputs(self) -> int:
        """Splines: two states, or one."""
        return 2 if self.form == "state" else 1

    @property
    def shape(self) -> tuple[int, int]:
        """Coefficients: (splines and kink functions, outputs)."""
        return self.grid + self.degree + 2 * len(self.kinks), self.outputs

    @cached_property
    def data_times(self) -> Array:
        """t_i (N,)."""
        return self._times(self.samples, self.even, 1)

    @cached_property
    def collocation_times(self) -> Array:
        """τ_m (M,)."""
        even = self.even if self.even_collocation is None else self.even_collocation
        points = self._times(self.collocation, even, 2)
        return points if self.end else points[:-1]

    @cached_property
    def data(self) -> Array:
        """y_i (N,): the true motion with 1 % noise."""
        values = motion(self.system, self.horizon, self.data_times)
        noise = np.random.default_rng((self.seed, 3)).normal(size=values.size)
        return values + 0.01 * np.abs(values).max() * noise

    def unknowns(self, size: float = 0.1) -> Array:
        """A random vector: coefficients, row by row, then parameters near the truth."""
        rng = np.random.default_rng((self.seed, 4))
        coefficients = size * rng.normal(size=self.shape[0] * self.shape[1])
        truth = np.array(self.model.truth)
        return np.concatenate([coefficients, truth * rng.uniform(0.8, 1.2, truth.size)])

    def describe(self) -> str:
        """One line for tables."""
        grids = "even" if self.even else "random"
        enriched = f", {len(self.kinks)} kinks" if self.kinks else ""
        return (f"{self.system}, {self.form}, k={self.degree}, G={self.grid}, T={self.horizon:g}, "
                f"λ={self.weight:g}, N={self.samples}, M={self.collocation} {grids}{enriched}")

    def _times(self, number: int, even: bool, stream: int) -> Array:
        if even:
            return np.linspace(0.0, self.horizon, number)
        rng = np.random.default_rng((self.seed, stream))
        inner = np.sort(rng.uniform(0.0, self.horizon, number - 2))
        return np.concatenate([[0.0], inner, [self.horizon]])


def motion(system: str, horizon: float, t: Array) -> Array:
    """The true first state at ``t``, from rest at a displacement, restarted at every switch."""
    model = SYSTEMS[system]
    parameters = np.array(model.truth)

    def rhs(time: float, x: Any) -> list[float]:
        now = np.array([time])
        value = model.acceleration(x[:1], x[1:], model.excitation(now), parameters)
        return [float(x[1]), float(value[0])]

    ends = [0.0, *(s for s in model.switches if s < horizon), horizon]
    state, found = np.array(model.start), np.empty(t.size)
    for left, right in pairwise(ends):
        # The excitation is right-continuous: stay a hair before the end of the piece.
        path = solve_ivp(rhs, (left, np.nextafter(right, left)), state, method="DOP853", rtol=1e-10,
                         atol=1e-12, dense_output=True)
        here = (t >= left) & (t <= right)
        if path.sol is None:
            raise errors.SimulationFailed(errors.not_finite(left, str(state)))
        if here.any():
            found[here] = path.sol(t[here])[0]
        state = path.y[:, -1]
    return found
