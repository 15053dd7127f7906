"""`Edge`: one term of a discrepancy, freed from what the parameters could do in its place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pikanid.discrepancy.bands import simultaneous_factor
from pikanid.discrepancy.gauge import Gauge
from pikanid.discrepancy.settings import USUAL

NORMAL_95 = 1.959963984540054  # definition: quantile of the normal distribution


@dataclass(frozen=True, eq=False)
class Edge:
    """One term δ(argument) of the discrepancy, gauge-fixed, over the visited range.

    Attributes:
        argument: Formula of the model's names.
        argument_unit: Of a state, an input or a parameter; "" for other formulas.
        name: Of its spline in the model.
        grid, values, std: Argument (M,), edge (M,) and posterior standard deviation (M,), in the
            unit of the equation (`unit`).
        coefficients, covariance: Of the gauge-fixed edge (K,), (K, K); the last one is the step's
            where there is a step.
        p_value, freedom: Of the Wald test that the edge is zero, and its degrees of freedom.
        significant: At the discrepancy's α, with Holm's correction over all edges.
        jump_probability: Of a step at zero; between 0 and 1 the band holds both, edges with a step
            and without.
        effective: Effective degrees of freedom that the fit spent on the edge beyond its gauge
            part.
        gauge: What was taken out of it.
        information, gain: (K, K), (K,) of what the data alone say, smooth or not: coefficients c,
            not gauge-fixed, leave χ² = cᵀ information c - 2 gainᵀ c + const, parameters at their
            best.
        draws: Of a simultaneous band.
    """

    argument: str
    argument_unit: str
    name: str
    unit: str
    grid: np.ndarray
    values: np.ndarray
    std: np.ndarray
    coefficients: np.ndarray
    covariance: np.ndarray
    p_value: float
    freedom: int
    significant: bool
    jump_probability: float
    effective: float
    gauge: Gauge = field(repr=False)
    information: np.ndarray = field(repr=False)
    gain: np.ndarray = field(repr=False)
    draws: int = field(default=USUAL.draws, repr=False)

    @property
    def range(self) -> tuple[float, float]:
        """The visited range of the argument: outside it the edge means nothing."""
        return float(self.grid[0]), float(self.grid[-1])

    @property
    def band(self) -> tuple[np.ndarray, np.ndarray]:
        """Pointwise 95 % band: lower and upper (M,)."""
        return self.values - NORMAL_95 * self.std, self.values + NORMAL_95 * self.std

    @property
    def simultaneous(self) -> tuple[np.ndarray, np.ndarray]:
        """The band (M,) that holds the whole curve with probability 95 %."""
        factor = simultaneous_factor(self.gauge.plan.basis(self.grid), self.covariance,
                                     draws=self.draws)
        return self.values - factor * self.std, self.values + factor * self.std

    def covariance_of_values(self, argument: np.ndarray) -> np.ndarray:
        """Posterior covariance (M, M) of the edge's values at arguments (M,).

        Values go together along an edge: what fits its shape has to know how.  `gauge_functions`
        are what such a fit may add freely.
        """
        basis = self.gauge.plan.basis(np.asarray(argument, float))
        return np.asarray(basis @ self.covariance @ basis.T)

    def gauge_functions(self, argument: np.ndarray) -> np.ndarray:
        """What the edge cannot show, at arguments (M,): columns (M, m), the constant among them."""
        return np.asarray(self.gauge.plan.basis(np.asarray(argument, float)) @ self.gauge.removed)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers for JSON."""
        low, high = self.band
        return {"argument": self.argument, "argument_unit": self.argument_unit, "unit": self.unit,
                "range": list(self.range), "p_value": self.p_value, "freedom": self.freedom,
                "significant": self.significant, "step": None if self.step is None else {
                    "value": self.step[0], "std": self.step[1],
                    "probability": self.jump_probability},
                "argument_values": self.grid.tolist(), "values": self.values.tolist(),
                "std": self.std.tolist(), "lower": low.tolist(), "upper": high.tolist()}

    @property
    def step(self) -> tuple[float, float] | None:
        """J of J·sign(argument), half the jump at zero, and its standard deviation; None without.

        Where the data leave a jump open (`jump_probability` below 1) J is a mean over both answers.
        """
        if not self.gauge.plan.step:
            return None
        return float(self.coefficients[-1]), float(np.sqrt(self.covariance[-1, -1]))

    def __call__(self, argument: np.ndarray) -> np.ndarray:
        """The gauge-fixed edge at arguments (M,), which must lie in its range to mean anything."""
        return np.asarray(self.gauge.plan.basis(np.asarray(argument, float)) @ self.coefficients)

    def fix_gauge(self, law: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """A law of the argument, as this edge would show it, on `grid` (M,).

        A law's mean, and what the free parameters can do in its place, is not the edge's to show.
        """
        return self.gauge.fix(law, self.grid)

    def share_inside(self, law: Callable[[np.ndarray], np.ndarray]) -> float:
        """Share of the visited range over which a law lies inside the pointwise 95 % band."""
        off = np.abs(self.values - self.fix_gauge(law))
        return float(np.mean(off <= NORMAL_95 * self.std))

    def sentence(self) -> str:
        """What was found, as a sentence."""
        low, high = self.range
        where = f"over {low:.3g} ... {high:.3g}"
        if not self.significant:
            return f"{self.argument}: nothing {where} (p = {self.p_value:.2g})"
        jump = "" if self.step is None else (
            f", a step of {self.step[0]:.3g} ± {self.step[1]:.1g} at zero with probability "
            f"{self.jump_probability:.2g}")
        size = float(np.max(np.abs(self.values)))
        return (f"{self.argument}: up to {size:.3g} {self.unit} {where} "
                f"(p = {self.p_value:.2g}{jump})")
