"""`Discrepancy`: what the search for missing physics returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pikanid import errors
from pikanid.discrepancy.edge import Edge
from pikanid.discrepancy.settings import USUAL, DiscrepancySettings
from pikanid.estimate import Estimate
from pikanid.model import Model
from pikanid.settings import changed, told

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """An additive KAN inside one equation of a model, fitted together with its parameters.

    Attributes:
        model: The extended model at its estimates, ready to simulate.  Its splines hold the edges
            and whatever share of the nominal terms the fit gave them; `edges` are freed from that
            share.
        estimate: Parameters, offset and coefficients with their posterior covariance.
        nominal: The estimate of the model without edges.
        equation: The state in whose equation the edges stand.
        edges: One an argument.
        offset: Constant part and its standard deviation, all edges' means included.
        p_value: Of the test that all edges together are zero, gauge-fixed.  It can be small where
            no edge is significant: then something is missing, but the data do not tell of what
            argument.
        alpha: Level of significance of the edges, together.
        evidence: Log marginal likelihood, up to a constant.
        settings: By which it was found.
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
    settings: DiscrepancySettings = USUAL

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

        Raises:
            BadModel: There is none.
        """
        named = {e.argument: e for e in self.edges}
        if argument not in named:
            raise errors.BadModel(errors.not_in_model("edge", argument, list(named)))
        return named[argument]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers for JSON: verdict, edges over their ranges, parameters."""
        own = changed(self.settings)
        return {"equation": self.equation, "unit": self.unit, "adequate": self.adequate,
                "p_value": self.p_value, "alpha": self.alpha, "evidence": self.evidence,
                "offset": {"value": self.offset[0], "std": self.offset[1]},
                "edges": [e.to_dict() for e in self.edges],
                "estimate": self.estimate.to_dict(), "nominal": self.nominal.to_dict(),
                **({"settings": own} if own else {})}

    def plot(self) -> Figure:
        """Every edge with its band over its visited range."""
        from pikanid.discrepancy.drawing import draw

        return draw(self.edges, f"{self.nominal.model.name}: missing in the equation of "
                                f"{self.equation}")

    def kan(self) -> Any:
        """The gauge-fixed edges as a real pykan model of `kan_inputs`.

        Its width is [n, 1]; arguments that are products of names go through multiplication nodes,
        [inputs, [sums, products], 1].  Grids are the edges' own; a step at zero is a symbolic edge
        (`sgn`) beside the spline.  The offset is the bias of its output.

        Raises:
            BadSetting: Torch or pykan is missing.
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
        if changed(self.settings):
            lines.append(f"  {told(self.settings)}")
        return "\n".join([*lines, *(f"  warning: {w}" for w in self.estimate.warnings)])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        from pikanid.discrepancy.drawing import page

        title = (f"Discrepancy of {self.nominal.model.name} in the equation of "
                 f"{self.equation}")
        return page(self.edges, title, self.estimate.sentence(), self.plot())


def _factors(argument: str) -> list[str]:
    """The names that an argument multiplies; the argument itself where it is no such product."""
    parts = [part.strip() for part in argument.split("*")]
    product = len(set(parts)) > 1 and all(part.isidentifier() for part in parts)
    return parts if product else [argument]
