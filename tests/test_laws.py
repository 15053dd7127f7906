"""Laws of several edges as one answer: what they leave is added up over all of them."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.formula.expressions import symbol
from pikanid.symbolic.curve import Curve
from pikanid.symbolic.fitting import FormFit
from pikanid.symbolic.laws import chosen, reading_of_laws, sum_of_laws
from pikanid.symbolic.library import LIBRARY, Form, user_form
from pikanid.symbolic.named import NamedEdge
from pikanid.symbolic.naming import name_curve
from pikanid.symbolic.reading import Reading

X = np.linspace(-1.0, 1.0, 200)
FEW = [form for form in LIBRARY if form.name in ("linear", "quadratic", "cubic")]


def edge(law: np.ndarray, noise: float, free: np.ndarray | None = None) -> NamedEdge:
    """A law with a constant and some noise on it; `free` columns count for nothing."""
    y = law + 0.4 + noise * np.random.default_rng(0).normal(size=X.size)
    curve = Curve.of_covariance(X, y, noise**2 * np.eye(X.size), free=free)
    return name_curve(curve, FEW)


def read(*edges: NamedEdge) -> Reading:
    named = {(0, k, 0): e for k, e in enumerate(edges)}
    arguments, ranges = ["theta", "theta_dot"][: len(edges)], [(-1.0, 1.0)] * len(edges)
    laws = sum_of_laws(pk.systems.sloshing(), arguments, chosen(named), ranges)
    return reading_of_laws(laws, named, arguments, ranges, (), np.array([1.0]), [laws.label],
                           laws.covariance)


def test_what_laws_leave_is_added_up() -> None:
    cubic, square = edge(X**3, 0.02), edge(0.7 * X**2, 0.05)
    one, other, both = read(cubic), read(square), read(cubic, square)
    assert dict(both.forms) == {(0, 0, 0): "cubic", (0, 1, 0): "quadratic"}
    assert both.error_network == pytest.approx(np.hypot(one.error_network, other.error_network))
    assert both.spread == pytest.approx(np.hypot(one.spread, other.spread))
    # the best law of one edge alone leaves what a straight line through its points would
    for reading, named, law in ((one, cubic, X**3), (other, square, X**2)):
        columns = np.column_stack([law, np.ones(X.size)])
        left = np.linalg.lstsq(columns, named.curve.y, rcond=None)[1][0] / X.size
        assert reading.error_network == pytest.approx(np.sqrt(left), rel=1e-6)
        assert reading.spread == pytest.approx(np.std(named.curve.y), rel=1e-9)


def test_free_columns_count_neither_as_law_nor_as_error() -> None:
    bare, tilted = edge(X**3, 0.02, X[:, None]), edge(X**3 + 5.0 * X, 0.02, X[:, None])
    one, other = read(bare), read(tilted)
    assert set(one.forms.values()) == set(other.forms.values()) == {"cubic"}
    assert other.error_network == pytest.approx(one.error_network, rel=1e-6)
    assert other.spread == pytest.approx(one.spread, rel=1e-6)


TANK = pk.Model.from_dict({
    "states": {"x": {"unit": "cm", "initial": 3.0}, "y": {"unit": "degC", "initial": 3.0}},
    "inputs": {"u": {"unit": "cm/s"}, "w": {"unit": "K/s"}},
    "equations": {"x": "u", "y": "w"},
    "outputs": {"x": {"unit": "cm", "expression": "x"}}})
OWN = [user_form(text) for text in (
    "q*sqrt(x)", "q*x**1.5", "q*sqrt(x - r)", "q*log(x) + p*x**2", "q/(x - r)**2")]


@pytest.mark.parametrize("form", [*LIBRARY[1:], *OWN], ids=lambda form: form.name)
def test_every_law_has_units_that_meet_in_an_equation(form: Form) -> None:
    """Lengths in cm, and distances from 0 degC; numbers stay those of the units that are given."""
    amplitudes = np.linspace(0.5, 1.5, len(form.columns))
    inside = np.array(form.typical(2.0, 4.0))
    fit = FormFit(form, amplitudes, inside, 0.0, 0.0, np.eye(1), np.zeros(1), np.zeros(1))
    at = 3.3
    for state, unit in (("x", "cm/s"), ("y", "K/s")):
        laws = sum_of_laws(TANK, [state], {(0, 0, 0): fit}, [(2.0, 4.0)], unit)
        values = np.array([p.value for p in laws.parameters])
        columns = form.values(np.array([at]), *values[len(amplitudes):])
        told = sum(a * np.ravel(column)[0] for a, column in zip(amplitudes, columns, strict=True))
        extended = TANK.with_term(state, laws.expression, [*laws.parameters, *laws.fixed])
        known = {symbol(p.name): p.value for p in extended.parameters}
        here = extended.equations[state].xreplace(known).xreplace(
            {symbol(state): at, symbol("u"): 0.0, symbol("w"): 0.0})
        assert float(here) == pytest.approx(told, rel=1e-9)
        plain = laws.numeric.xreplace(known).xreplace({symbol(state): at})
        assert float(plain) == pytest.approx(told, rel=1e-9)
