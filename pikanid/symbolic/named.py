"""`Candidate` and `NamedEdge`: what an edge may be, how probable, with which constants."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

import numpy as np
import sympy as sp

from pikanid.estimate.rounding import rounded
from pikanid.formula import units
from pikanid.formula.expressions import symbol
from pikanid.symbolic.curve import Curve
from pikanid.symbolic.fitting import FormFit
from pikanid.symbolic.library import NOTHING, Form, X
from pikanid.symbolic.settings import USUAL, SymbolicSettings

NO_SIMPLE_FORM = "no simple form"
SHOWN = 5  # layout: candidates in a table


@dataclass(frozen=True, eq=False)
class Candidate:
    """One form on one edge.

    Attributes:
        form, fit: What it is and its best constants.
        probability: Among all candidates, "nothing" and "no simple form".
        score: BIC less twice the log of the prior.
        adequacy: Probability of what it leaves behind, were it right.
        agrees: Whether its curve is the first candidate's, as far as the data can tell.
    """

    form: Form
    fit: FormFit
    probability: float
    score: float
    adequacy: float
    agrees: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its constants: amplitudes, parameters inside, offset."""
        return (*self.form.amplitudes, *(k.name for k in self.form.knobs), "d")

    @property
    def values(self) -> dict[str, float]:
        """The constants."""
        every = [*self.fit.amplitudes, *self.fit.inside, self.fit.offset]
        return {n: float(v) for n, v in zip(self.names, every, strict=True)}

    @property
    def std(self) -> dict[str, float]:
        """Standard errors of the constants."""
        spread = np.sqrt(np.maximum(np.diag(self.fit.covariance), 0.0))
        return {n: float(s) for n, s in zip(self.names, spread, strict=True)}

    def units(self, unit: str, x_unit: str) -> dict[str, str]:
        """Units of the constants, for an edge in `unit` over an argument in `x_unit`.

        Amplitudes of a power that is not whole are per that power of the argument's SI number.
        """
        found = {}
        for name, power in zip(self.form.amplitudes, self.form.powers, strict=True):
            found[name] = units.product((unit, 1), (x_unit, -(power or 0)))
        for knob in self.form.knobs:
            found[knob.name] = "" if knob.power is None else units.product((x_unit, knob.power))
        found["d"] = units.product((unit, 1))
        return found

    @property
    def expression(self) -> sp.Expr:
        """In x and the names of the constants."""
        return self.form.expression

    def numeric(self, argument: str = "x") -> sp.Expr:
        """With numbers in it, of an argument."""
        swap: dict[sp.Symbol, sp.Expr] = {symbol(n): sp.Float(v) for n, v in self.values.items()}
        swap[X] = symbol(argument) if argument.isidentifier() else X
        return self.expression.xreplace(swap)

    @property
    def text(self) -> str:
        """The constants with their standard errors."""
        return ", ".join(f"{n} = {rounded(v, self.std[n])}" for n, v in self.values.items())


@dataclass(frozen=True, eq=False)
class NamedEdge:
    """What an edge may be, ranked.

    Attributes:
        curve: The edge.
        candidates: Most probable first; those that leave a trace in the residual have probability
            0.
        unnamed: Probability of "no simple form".
        noise: Standard deviation of the noise that is left (1 where it was given), in whitened
            units.
        settings: By which it was named.
    """

    curve: Curve
    candidates: tuple[Candidate, ...]
    unnamed: float
    noise: float
    settings: SymbolicSettings = USUAL

    @property
    def best(self) -> Candidate:
        """The most probable form; worth little where `name` is "no simple form"."""
        return self.candidates[0]

    @property
    def name(self) -> str:
        """The most probable form's name, "nothing" or "no simple form"."""
        return NO_SIMPLE_FORM if self.unnamed > self.best.probability else self.best.form.name

    @property
    def probability(self) -> float:
        """Of the name, with every form that cannot be told apart from it."""
        if self.name == NO_SIMPLE_FORM:
            return self.unnamed
        return float(sum(c.probability for c in self.candidates if c.agrees))

    @property
    def std(self) -> np.ndarray | None:
        """Standard deviation of the edge (n,): given, or that of the noise around it."""
        if self.curve.std is not None:
            return self.curve.std
        return np.full(len(self.curve.x), self.noise)

    @property
    def range(self) -> tuple[float, float]:
        """Where the name holds."""
        return self.curve.low, self.curve.high

    @property
    def expression(self) -> sp.Expr | None:
        """The best form in x and its constants' names; None for "no simple form"."""
        return None if self.name == NO_SIMPLE_FORM else self.best.expression

    def sentence(self) -> str:
        """The answer as a sentence."""
        low, high = self.range
        where = f"over {low:.3g} ... {high:.3g}"
        start = f"{self.curve.argument}: {self.name} {where} (probability {self.probability:.2g})"
        if self.name in (NO_SIMPLE_FORM, NOTHING.name):
            return start
        return f"{start}: {self.best.expression} with {self.best.text}"

    def rows(self) -> list[tuple[str, str, float, float]]:
        """Name, expression with numbers, probability and adequacy of the first candidates."""
        shown = [(c.form.name, f"{sp.N(c.numeric(), 4)}", c.probability, c.adequacy)
                 for c in self.candidates[:SHOWN]]
        shown.append((NO_SIMPLE_FORM, "", self.unnamed, 1.0))
        return sorted(shown, key=lambda r: -r[2])

    def __str__(self) -> str:
        lines = [self.sentence()]
        lines += [f"  {p:7.3f}  {name:<24} {text}" for name, text, p, _ in self.rows()]
        return "\n".join(lines)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        body = "".join(
            f"<tr><td>{escape(name)}</td><td>{escape(text)}</td><td>{p:.3f}</td><td>{a:.2g}</td>"
            "</tr>" for name, text, p, a in self.rows())
        return (f"<p>{escape(self.sentence())}</p><table><tr><th>form</th><th>formula</th>"
                f"<th>probability</th><th>adequacy p</th></tr>{body}</table>")
