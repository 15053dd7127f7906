"""`Edge` and `Discrepancy`: what the search for missing physics returns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from pikanid import errors
from pikanid.discrepancy.bands import simultaneous_factor
from pikanid.discrepancy.gauge import Gauge
from pikanid.estimate import Estimate
from pikanid.model import Model

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NORMAL_95 = 1.959963984540054


@dataclass(frozen=True, eq=False)
class Edge:
    """One term δ(argument) of the discrepancy, gauge-fixed, over the visited range.

    Attributes
    ----------
    argument : formula of the model's names
    argument_unit : of a state, an input or a parameter; "" for other formulas
    name : of its spline in the model
    grid, values, std : argument (M,), edge (M,) and posterior standard deviation (M,), in the unit
        of the equation (`unit`)
    coefficients, covariance : of the gauge-fixed edge (K,), (K, K); the last one is the step's
        where there is a step
    p_value, freedom : of the Wald test that the edge is zero, and its degrees of freedom
    significant : at the discrepancy's α, with Holm's correction over all edges
    jump_probability : of a step at zero; between 0 and 1 the band holds both, edges with a step
        and without
    effective : effective degrees of freedom that the fit spent on the edge beyond its gauge part
    gauge : what was taken out of it
    information, gain : (K, K), (K,) of what the data alone say, smooth or not: coefficients c, not
        gauge-fixed, leave χ² = cᵀ information c - 2 gainᵀ c + const, parameters at their best
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
        factor = simultaneous_factor(self.gauge.plan.basis(self.grid), self.covariance)
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


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """An additive KAN inside one equation of a model, fitted together with its parameters.

    Attributes
    ----------
    model : the extended model at its estimates, ready to simulate.  Its splines hold the edges and
        whatever share of the nominal terms the fit gave them; `edges` are freed from that share
    estimate : parameters, offset and coefficients with their posterior covariance
    nominal : the estimate of the model without edges
    equation : the state in whose equation the edges stand
    edges : one an argument
    offset : constant part and its standard deviation, all edges' means included
    p_value : of the test that all edges together are zero, gauge-fixed.  It can be small where no
        edge is significant: then something is missing, but the data do not tell of what argument
    alpha : level of significance of the edges, together
    evidence : log marginal likelihood, up to a constant
    """

    model: Model
    estimate: Estimate
    nominal: Estimate
    equation: str
    edges: tuple[Edge, ...]
    offset: tuple[float, float]
    p_value: float
    alpha: float
    evidence: float

    @property
    def significant(self) -> tuple[Edge, ...]:
        """The edges that are not zero."""
        return tuple(e for e in self.edges if e.significant)

    @property
    def adequate(self) -> bool:
        """Whether static laws of the arguments, added to the equation, explain the recording (χ²).

        If not, what is missing depends on something else or on the past, or sits in a sensor or an
        input: the edges then show what static laws would have to be, not what is there.
        """
        return self.estimate.adequacy.verdict != "misfit"

    @property
    def unit(self) -> str:
        """Unit of the discrepancy."""
        return self.edges[0].unit

    def edge(self, argument: str) -> Edge:
        """The edge of an argument.

        Raises
        ------
        pikanid.errors.BadModel : there is none
        """
        named = {e.argument: e for e in self.edges}
        if argument not in named:
            raise errors.BadModel(errors.not_in_model("edge", argument, list(named)))
        return named[argument]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers for JSON: verdict, edges over their ranges, parameters."""
        return {"equation": self.equation, "unit": self.unit, "adequate": self.adequate,
                "p_value": self.p_value, "alpha": self.alpha, "evidence": self.evidence,
                "offset": {"value": self.offset[0], "std": self.offset[1]},
                "edges": [e.to_dict() for e in self.edges],
                "estimate": self.estimate.to_dict(), "nominal": self.nominal.to_dict()}

    def plot(self) -> Figure:
        """Every edge with its band over its visited range."""
        from pikanid.discrepancy.drawing import draw

        return draw(self)

    def kan(self) -> Any:
        """The gauge-fixed edges as a real pykan model of `kan_inputs`.

        Its width is [n, 1]; arguments that are products of names go through multiplication nodes,
        [inputs, [sums, products], 1].  Grids are the edges' own; a step at zero is a symbolic edge
        (`sgn`) beside the spline.  The offset is the bias of its output.

        Raises
        ------
        pikanid.errors.BadSetting : torch or pykan is missing
        """
        from pikanid.approximators.kan.additive import additive_kan

        inputs = self.kan_inputs
        factors = {e.argument: [inputs.index(f) for f in _factors(e.argument)] for e in self.edges}
        # sums come before products
        edges = sorted(self.edges, key=lambda e: len(factors[e.argument]) > 1)
        plans = [e.gauge.plan for e in edges]
        return additive_kan(
            limits=[p.limits for p in plans], intervals=plans[0].intervals,
            coefficients=[e.coefficients[: p.intervals + 3]
                          for e, p in zip(edges, plans, strict=True)],
            steps=[e.step[0] if e.step else 0.0 for e in edges], offset=self.offset[0],
            factors=[factors[e.argument] for e in edges])

    @property
    def kan_inputs(self) -> tuple[str, ...]:
        """The formulas whose values the pykan model takes, column by column."""
        return tuple(dict.fromkeys(f for e in sorted(
            self.edges, key=lambda e: len(_factors(e.argument)) > 1)
            for f in _factors(e.argument)))

    def __str__(self) -> str:
        lines = [f"Discrepancy of {self.nominal.model.name} in the equation of {self.equation}"]
        lines += [f"  {e.sentence()}" for e in self.edges]
        lines.append(f"  offset {self.offset[0]:.3g} ± {self.offset[1]:.1g} {self.unit}")
        lines.append(f"  {self.estimate.sentence()}")
        return "\n".join([*lines, *(f"  warning: {w}" for w in self.estimate.warnings)])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        from pikanid.discrepancy.drawing import page

        return page(self)


def _factors(argument: str) -> list[str]:
    """The names that an argument multiplies; the argument itself where it is no such product."""
    parts = [part.strip() for part in argument.split("*")]
    product = len(set(parts)) > 1 and all(part.isidentifier() for part in parts)
    return parts if product else [argument]
