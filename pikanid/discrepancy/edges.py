"""The model with an additive KAN in one of its equations: one spline edge an argument.

    x_e' = f_e(x, u; p) + b + Σ_j δ_j,   δ_j = spline_j(z_j) [+ J_j sign(a_j)],
    z_j = (a_j(x, u, t) - centre_j)/halfwidth_j

Knots are those of a KAN: uniform over [-1, 1] in z and going on beyond it.  Centre and half-width
are fixed parameters of the model, not numbers in its formulas, so that one compiled model serves
every range of visited values.  A step J at zero, simulated as an event, is for laws that jump where
their argument changes sign, as dry friction does: no smooth curve follows them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid import errors
from pikanid.approximators.bspline import BSpline
from pikanid.model import Model, Output, Parameter, Spline

DEGREE = 3  # definition: cubic splines
OFFSET = "delta_offset"
# Trajectories move while they are fitted.
MARGIN = 0.05  # numerical: of the visited range, on either side


@dataclass(frozen=True)
class EdgePlan:
    """Where one edge stands: its argument and the grid over it.

    The grid has `intervals` equal pieces over centre ± halfwidth (in the argument's unit); `step`
    adds a jump at zero as the last coefficient.
    """

    name: str
    argument: str
    centre: float
    halfwidth: float
    intervals: int
    step: bool = False

    @property
    def spline(self) -> Spline:
        """The model's spline, over z in [-1, 1]."""
        places = np.arange(-DEGREE, self.intervals + DEGREE + 1)
        return Spline(self.name, DEGREE, tuple(
            round(float(z), 12) for z in 2.0 * places / self.intervals - 1.0))

    @property
    def size(self) -> int:
        """Number of coefficients K, the step's among them."""
        return self.intervals + DEGREE + self.step

    @property
    def coefficient_names(self) -> tuple[str, ...]:
        """The model's parameters that hold the coefficients."""
        return self.spline.coefficient_names + ((f"{self.name}_step",) if self.step else ())

    @property
    def limits(self) -> tuple[float, float]:
        """Ends of the grid, in the argument's unit."""
        return self.centre - self.halfwidth, self.centre + self.halfwidth

    @property
    def constant(self) -> np.ndarray:
        """Coefficients (K,) of the function 1."""
        return np.append(np.ones(self.intervals + DEGREE), np.zeros(int(self.step)))

    def basis(self, a: np.ndarray) -> np.ndarray:
        """Basis functions (M, K) at arguments a (M,); beyond the grid its end values."""
        z = np.clip((a - self.centre) / self.halfwidth, -1.0, 1.0)
        splines = BSpline(DEGREE, np.array(self.spline.knots)).basis(z).toarray()
        return np.column_stack([splines, np.sign(a)]) if self.step else np.asarray(splines)

    def bends(self) -> np.ndarray:
        """Second differences (G + 1, K), scaled so that |bends c|² = ∫ (d²δ/dz²)² dz."""
        differences = np.diff(np.eye(self.intervals + DEGREE), 2, axis=0)
        scaled = (0.5 * self.intervals) ** 1.5 * differences
        return np.pad(scaled, ((0, 0), (0, int(self.step))))

    def over(self, a: np.ndarray, intervals: int) -> EdgePlan:
        """The same edge with a grid over the visited arguments a (M,)."""
        low, high = float(np.min(a)), float(np.max(a))
        if not (np.isfinite([low, high]).all() and high > low):
            raise errors.BadSetting(errors.edge_argument_still(self.argument, low))
        half = 0.5 * (high - low) * (1.0 + 2.0 * MARGIN)
        return replace(self, centre=0.5 * (low + high), halfwidth=half, intervals=intervals)


def plan_edges(model: Model, arguments: Sequence[str], intervals: int) -> tuple[EdgePlan, ...]:
    """One edge an argument, over a grid that is yet to be placed.

    Raises:
        BadSetting: No argument, or one given twice.
        BadModel: An argument that is no formula in the model's names.
    """
    if not arguments or len(set(arguments)) < len(arguments):
        raise errors.BadSetting(errors.bad_value(
            "arguments", tuple(arguments), "one or several different formulas"))
    taken = model.symbols | {s.name for s in model.splines}
    plans = []
    for text in arguments:
        model.formula(text, f"argument '{text}' of the discrepancy")
        name = "delta_" + re.sub(r"\W+", "_", text).strip("_")
        while name in taken:
            name += "_"
        taken = taken | {name}
        plans.append(EdgePlan(name, text, 0.0, 1.0, intervals))
    return tuple(plans)


def extend(model: Model, equation: str, plans: Sequence[EdgePlan]) -> Model:
    """The model with the offset b and the edges, all zero, added to an equation."""
    unit = f"({model.state(equation).unit or '1'})/s"
    extended = model.with_term(equation, OFFSET, [
        Parameter(OFFSET, 0.0, unit, description="constant part of the discrepancy")])
    for plan in plans:
        centre, half = f"{plan.name}_centre", f"{plan.name}_halfwidth"
        extended = extended.with_parameters(
            Parameter(centre, plan.centre, free=False, description=f"of {plan.argument}"),
            Parameter(half, plan.halfwidth, free=False, description=f"of {plan.argument}"))
        extended = extended.with_edge(
            equation, f"(({plan.argument}) - {centre})/{half}", plan.spline)
        if plan.step:
            extended = extended.with_term(
                equation, f"{plan.name}_step*sign({plan.argument})",
                [Parameter(f"{plan.name}_step", 0.0, unit, description="jump at zero")])
    return extended


def argument_model(model: Model, plans: Sequence[EdgePlan]) -> Model:
    """The nominal model with the arguments of the edges as its outputs."""
    return model.replace(outputs=tuple(
        Output(f"seen_{p.name}", model.formula(p.argument, f"argument '{p.argument}'"))
        for p in plans))
