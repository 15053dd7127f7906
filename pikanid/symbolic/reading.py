"""`Reading`: a network as a formula, with standard errors and what it leaves unexplained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.estimate.rounding import rounded
from pikanid.formula.expressions import symbol
from pikanid.model import Parameter
from pikanid.settings import changed, told
from pikanid.symbolic.composed import Composition, Groups, Place
from pikanid.symbolic.named import NamedEdge
from pikanid.symbolic.numeric import Array, compiled
from pikanid.symbolic.settings import USUAL, SymbolicSettings
from pikanid.symbolic.significance import Contribution

if TYPE_CHECKING:
    from matplotlib.figure import Figure



@dataclass(frozen=True, eq=False)
class Reading:
    """What a network says.

    Attributes:
        expression: SymPy, in the inputs' names and its constants.
        names, values, covariance: Of the constants (k,), (k,), (k, k).
        inputs: Names or formulas of the inputs.
        ranges: Lowest and highest value of every input: outside them the formula means nothing.
        edges: Every edge that was read, by (layer, source, target).
        contributions: Of edges and nodes, those removed included.
        probability: Of this choice of forms among those tried.
        alternatives: (forms, probability) of the runners-up.
        error_network, error_data: Root mean square of formula less network, and of data less
            formula.
        spread: Standard deviation of the data (or of the network where there are none).
        p_value: Probability of leaving so much more than the network does, were the formula right;
            None without data.
        forms: The form chosen for every edge.
        units: Of the constants, "" where not known.
        fixed: Units by which arguments are divided that have to be numbers, and zeros of
            temperature scales that powers count from.
        kan, composition, theta: The network that was read, pruned, and the formula in its places
            with all its constants.
        estimate: Of the model with the formula in it, where it was refitted inside an ODE.
        caution: Why the formula cannot be trusted whatever its fit, or "".
        settings: By which it was read.
    """

    expression: sp.Expr
    names: tuple[str, ...]
    values: Array
    covariance: Array
    inputs: tuple[str, ...]
    ranges: tuple[tuple[float, float], ...]
    edges: Mapping[Place, NamedEdge]
    contributions: tuple[Contribution, ...]
    probability: float
    alternatives: tuple[tuple[str, float], ...]
    error_network: float
    error_data: float | None
    spread: float
    p_value: float | None
    forms: Mapping[Place, str]
    units: Mapping[str, str] = field(default_factory=dict)
    fixed: tuple[Parameter, ...] = ()
    kan: Any = field(default=None, repr=False)
    composition: Composition | None = field(default=None, repr=False)
    theta: Array = field(default_factory=lambda: np.empty(0), repr=False)
    estimate: Estimate | None = field(default=None, repr=False)
    caution: str = ""
    settings: SymbolicSettings = USUAL

    @property
    def ok(self) -> bool:
        """Whether the formula says all that the network says, as far as the data can tell."""
        if self.caution:
            return False
        if self.p_value is not None:
            return self.p_value >= self.settings.adequate
        return self.error_network <= self.settings.close * self.spread

    @property
    def std(self) -> Array:
        """Standard errors of the constants (k,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The constants as parameters of a model, free, at their values, and what is fixed.

        `model.with_term(equation, reading.expression, reading.parameters)` adds what was read.
        """
        return (*(Parameter(n, float(v), self.units.get(n, ""), description="read from a KAN")
                  for n, v in zip(self.names, self.values, strict=True)), *self.fixed)

    @property
    def numeric(self) -> sp.Expr:
        """The formula with numbers in it."""
        swap = {symbol(n): sp.Float(float(v))
                for n, v in zip(self.names, self.values, strict=True)}
        swap |= {symbol(p.name): sp.Integer(int(p.value)) for p in self.fixed}
        return self.expression.xreplace(swap)

    def __call__(self, x: Array) -> Array:
        """The formula at inputs (M, n), which must lie in their ranges to mean anything.

        Raises:
            BadSetting: Another number of inputs, or inputs that are formulas.
        """
        x = np.asarray(x, float).reshape(len(x), -1)
        if x.shape[1] != len(self.inputs) or not all(n.isidentifier() for n in self.inputs):
            raise errors.BadSetting(errors.reading_inputs(x.shape[1], self.inputs))
        found = compiled(tuple(symbol(n) for n in self.inputs), (self.numeric,))
        return np.array(found(*x.T)[0])

    def latex(self, digits: int = 4) -> str:
        """The formula with numbers, as LaTeX."""
        return str(sp.latex(_shortened(self.numeric, digits)))

    def sentence(self) -> str:
        """The verdict as a sentence."""
        where = ", ".join(f"{n} in {a:.3g} ... {b:.3g}"
                          for n, (a, b) in zip(self.inputs, self.ranges, strict=True))
        share = self.error_network / self.spread if self.spread > 0 else 0.0
        if self.caution:
            return self.caution
        if not self.ok:
            return (f"No simple form says what the network says over {where}: the best one found "
                    f"is off by {share:.2%} of its spread.")
        left = "" if self.error_data is None else f", {self.error_data:.3g} off the data"
        return (f"Over {where} the formula is {share:.2%} of the spread off the network{left} "
                f"(probability {self.probability:.2g}).")

    @property
    def groups(self) -> Groups:
        """Layer by layer, the subnodes that every node multiplies."""
        return self.composition.groups if self.composition else (((0,),),)

    def plot(self, *paths: str | Path) -> Figure:
        """The network: every edge with its band, its weight and its name.

        Written to `paths` too, in the format of each ending: "net.png", "net.svg".
        """
        from pikanid.symbolic.drawing import draw

        return draw(self, *paths)

    def rows(self) -> list[tuple[str, str, str]]:
        """Name, value with standard error, unit of every constant."""
        return [(n, rounded(float(v), float(s)), self.units.get(n, ""))
                for n, v, s in zip(self.names, self.values, self.std, strict=True)]

    def __str__(self) -> str:
        lines = [str(_shortened(self.numeric, 4)), f"  = {self.expression}"]
        lines += [f"  {n} = {v} {u}".rstrip() for n, v, u in self.rows()]
        lines += [f"  {self.sentence()}"]
        lines += [f"  {p:7.3f}  {text}" for text, p in self.alternatives[:3]]
        lines += [f"  {told(self.settings)}"] if changed(self.settings) else []
        return "\n".join(lines)

    __repr__ = __str__

    def _repr_latex_(self) -> str:
        return f"$${self.latex()}$$"

    def _repr_html_(self) -> str:
        body = "".join(f"<tr><td>{escape(n)}</td><td>{escape(v)}</td><td>{escape(u)}</td></tr>"
                       for n, v, u in self.rows())
        return (f"<p>{escape(str(_shortened(self.numeric, 4)))}</p><table><tr><th>constant</th>"
                f"<th>value</th><th>unit</th></tr>{body}</table><p>{escape(self.sentence())}</p>")


def _shortened(expr: sp.Expr, digits: int) -> sp.Expr:
    return expr.xreplace({f: sp.Float(f, digits) for f in expr.atoms(sp.Float)})


def probabilities(scores: Sequence[float]) -> Array:
    """exp(-score/2), summing to one."""
    s = np.asarray(scores, float)
    share = np.exp(-0.5 * (s - s.min()))
    return np.asarray(share / share.sum())
