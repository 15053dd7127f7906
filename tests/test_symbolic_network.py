"""Whole KANs as formulas: exact Jacobians, significance, pruning, the search, pykan's models."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from pikanid import errors
from pikanid.approximators.kan import build_kan, to_state
from pikanid.approximators.kan.edges import arguments, edges_of, plain
from pikanid.approximators.kan.train import fit_points
from pikanid.formula.expressions import symbol
from pikanid.model import systems
from pikanid.symbolic import Reading, contributions, extract, prune
from pikanid.symbolic.composed import Composition
from pikanid.symbolic.library import LIBRARY
from pikanid.symbolic.prune import _without_spare
from pikanid.symbolic.pushing import push
from pikanid.symbolic.refit import generic_jacobian, refit
from pikanid.symbolic.significance import table

pytestmark = pytest.mark.kan

FORMS = {form.name: form for form in LIBRARY}
FEW = [FORMS[n] for n in ("linear", "quadratic", "cubic", "sine", "exponential", "tanh")]
INPUTS = (symbol("theta"), symbol("omega"))
SUM = (((0,),),)
TWO_LAYERS = (((0,),), ((0,),))
PRODUCT = (((0, 1),), ((0,),))


def points(law: object, noise: float, seed: int = 0, n: int = 500
           ) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(seed)
    x = generator.uniform(-1.0, 1.0, (n, 2))
    clean = law(x[:, 0], x[:, 1])  # type: ignore[operator]
    return x, clean + noise * clean.std() * generator.normal(size=n)


@pytest.fixture(scope="module")
def additive() -> tuple[object, np.ndarray, np.ndarray, Reading]:
    """A KAN of three inputs, the last of which means nothing, and its reading."""
    generator = np.random.default_rng(0)
    x = generator.uniform(-1.0, 1.0, (500, 3))
    y = 2.0 * np.sin(3 * x[:, 0]) + x[:, 1] ** 3 + 0.02 * generator.normal(size=500)
    kan = fit_points(build_kan([3, 1], grid=6), x, y).kan
    return kan, x, y, extract(kan, x, y, inputs=["theta", "omega", "idle"], library=FEW)


def compositions() -> list[tuple[Composition, list[float]]]:
    edges = {(0, 0, 0): FORMS["sine"], (0, 1, 0): FORMS["shifted tanh"]}
    return [
        (Composition(SUM, edges, INPUTS), [1.0, 2.0, 0.5, 3.0, 0.2, 0.1]),
        (Composition(TWO_LAYERS, {**edges, (1, 0, 0): FORMS["exponential"]}, INPUTS),
         [1.0, 2.0, 0.5, 3.0, 0.2, 0.1, 1.5, -0.7, 0.3]),
        (Composition(PRODUCT, {(0, 0, 0): FORMS["quadratic"], (0, 1, 0): FORMS["linear"],
                               (0, 1, 1): FORMS["cubic"], (1, 0, 0): FORMS["signed power"]},
                     INPUTS), [1.0, 0.3, 0.7, 0.2, 0.4, 1.1, 1.5, 0.3]),
    ]


@pytest.mark.parametrize("number", range(3))
def test_jacobian_of_a_composition(number: int) -> None:
    made, theta = compositions()[number]
    x = np.random.default_rng(1).uniform(-1, 1, (40, 2))
    at = np.array(theta)
    J = made.evaluate(at, x)[1]
    for k in range(made.count):
        step = np.zeros(made.count)
        step[k] = 1e-6
        slope = (made.evaluate(at + step, x)[0] - made.evaluate(at - step, x)[0]) / 2e-6
        np.testing.assert_allclose(J[:, k], slope, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("number", range(3))
def test_expression_of_a_composition(number: int) -> None:
    """SymPy's own numbers, point by point, are those of the arrays."""
    made, theta = compositions()[number]
    expression = made.expression([sp.Float(v) for v in theta])
    x = np.array([[0.3, -0.4], [0.9, 0.2]])
    by_sympy = [float(expression.subs({INPUTS[0]: a, INPUTS[1]: b})) for a, b in x]
    np.testing.assert_allclose(made.evaluate(np.array(theta), x)[0], by_sympy, rtol=1e-12)


def test_constants_that_trade_count_once() -> None:
    """exp(b(h)): inner scale and b, inner offset and amplitude: two of seven constants are free."""
    made = Composition(TWO_LAYERS, {(0, 0, 0): FORMS["sine"], (0, 1, 0): FORMS["quadratic"],
                                    (1, 0, 0): FORMS["exponential"]}, INPUTS)
    x, y = points(lambda a, b: np.exp(np.sin(3 * a) + b**2), 0.01)
    shape = generic_jacobian(made, x)
    fit = refit(made, np.array([0.8, 2.9, 0.9, 0.1, 1.2, 1.1, 0.0]), x, y, shape)
    assert fit is not None and made.count == 7 and fit.rank == 5


def test_additive_network_is_read(additive: tuple[object, np.ndarray, np.ndarray, Reading]) -> None:
    _, x, _, reading = additive
    theta, omega = INPUTS
    names = {n: symbol(n) for n in reading.names}
    expected = names["a_theta"] * sp.sin(names["b_theta"] * theta) + names["a_omega"] * omega**3
    assert sp.simplify(reading.expression - expected) == 0
    found = dict(zip(reading.names, zip(reading.values, reading.std, strict=True), strict=True))
    for name, truth in (("a_theta", 2.0), ("b_theta", 3.0), ("a_omega", 1.0)):
        value, std = found[name]
        assert abs(value - truth) < 4.0 * std < 0.1
    assert reading.ok and reading.error_data == pytest.approx(0.02, rel=0.1)
    assert reading.ranges[0] == (x[:, 0].min(), x[:, 0].max())


def test_insignificant_input_goes_and_the_model_stays(
        additive: tuple[object, np.ndarray, np.ndarray, Reading]) -> None:
    kan, x, y, reading = additive
    before = to_state(kan)
    result = prune(kan, x, y)
    after = to_state(kan)
    assert [(c.layer, c.source, c.target) for c in result.removed] == [(0, 2, 0)]
    assert before.layers[0].mask.all() and np.array_equal(
        before.layers[0].coef, after.layers[0].coef)
    assert to_state(result.kan).layers[0].mask.sum() == 2
    assert symbol("idle") not in reading.expression.free_symbols


def test_contribution_and_its_error(
        additive: tuple[object, np.ndarray, np.ndarray, Reading]) -> None:
    kan, x, y, _ = additive
    fit = fit_points(kan, x, y)
    found = contributions(fit, x, attribution=True)
    edges = {c.source: c for c in found if c.target is not None}
    assert edges[0].size == pytest.approx(np.std(2.0 * np.sin(3 * x[:, 0])), abs=4 * edges[0].std)
    assert edges[1].size == pytest.approx(np.std(x[:, 1] ** 3), abs=4 * edges[1].std)
    assert edges[0].p_value < 1e-10 and edges[2].p_value > 0.001
    assert all(c.attribution is not None for c in found)
    shown = table(found)
    assert shown["what"].tolist() == 3 * ["edge"] + 3 * ["node"]
    for column in ("layer", "source", "target"):
        wanted = [getattr(c, column) for c in found]
        assert [None if v != v else v for v in shown[column]] == wanted
    assert shown[["contribution", "std", "p", "attribution"]].to_numpy(float).tolist() == [
        [c.size, c.std, c.p_value, c.attribution] for c in found]


def test_null_edges_keep_the_stated_level() -> None:
    """p-values of an idle input over 60 seeds: below 0.05 about as often as stated."""
    below = 0
    for seed in range(60):
        generator = np.random.default_rng(seed)
        x = generator.uniform(-1, 1, (200, 2))
        y = x[:, 0] ** 2 + 0.1 * generator.normal(size=200)
        found = contributions(fit_points(build_kan([2, 1], grid=5), x, y), x)
        idle = next(c for c in found if c.source == 1 and c.target is not None)
        below += idle.p_value < 0.05
    assert below <= 9  # binomial(60, 0.05) exceeds 9 once in a thousand


@pytest.mark.slow
@pytest.mark.parametrize("width, law, form", [
    ([2, 1, 1], lambda a, b: np.exp(np.sin(np.pi * a) + b**2), "exp(sin(theta) + omega**2)"),
    ([2, [0, 1], 1], lambda a, b: a**2 * b, "theta**2*omega")])
def test_two_layers_and_products_are_read(width: list[object], law: object, form: str) -> None:
    x, y = points(law, 0.02, seed=1, n=1000)
    fits = [fit_points(build_kan(width, grid=8, grid_range=[(-1, 1), (-3, 3)], seed=k), x, y)
            for k in range(3)]  # type: ignore[arg-type]
    best = min(fits, key=lambda f: float(f.residual @ f.residual))
    reading = extract(best.kan, x, y, inputs=["theta", "omega"])
    ones = {symbol(n): sp.Integer(n.split("_")[0] != "d") for n in reading.names}
    wanted = sp.sympify(form).xreplace({sp.Symbol("theta"): INPUTS[0], sp.Symbol("omega"):
                                        INPUTS[1]})
    assert reading.ok
    assert sp.simplify(reading.expression.xreplace(ones) - wanted) == 0


def test_reading_goes_into_a_model(
        additive: tuple[object, np.ndarray, np.ndarray, Reading]) -> None:
    *_, reading = additive
    formula = reading.expression.xreplace({symbol("omega"): symbol("theta_dot")})
    model = systems.sloshing().with_term("theta_dot", formula, reading.parameters)
    assert {"a_theta", "b_theta", "a_omega"} <= set(model.free_names)


def test_pushed_formula_is_pykan_s_own(
        additive: tuple[object, np.ndarray, np.ndarray, Reading]) -> None:
    import torch
    from kan.utils import SYMBOLIC_LIB

    kan, x, _, reading = additive
    known = set(SYMBOLIC_LIB)
    pushed = push(reading)
    assert set(SYMBOLIC_LIB) == known
    with torch.no_grad():
        value = pushed(torch.from_numpy(x)).numpy()[:, 0]
    np.testing.assert_allclose(value, reading(x), atol=1e-12)
    formula = pushed.symbolic_formula()[0][0]
    assert formula.has(sp.sin) and len(formula.free_symbols) == 2
    assert not to_state(kan).layers[0].symbolic_mask.any()


def test_models_trained_elsewhere_are_read() -> None:
    """Base function, uneven grid and a symbolic edge become splines that say the same."""
    import torch

    kan = build_kan([2, 1], grid=5, base="silu", seed=3)
    kan.act_fun[0].grid.data[:, 4] += 0.05
    kan.fix_symbolic(0, 1, 0, "sin", fit_params_bool=False, verbose=False, log_history=False)
    x = np.random.default_rng(0).uniform(-1, 1, (300, 2))
    with torch.no_grad():
        value = kan(torch.from_numpy(x)).numpy()[:, 0]
    np.testing.assert_allclose(arguments(plain(kan, x), x)[-1][:, 0], value, atol=2e-4)


def test_network_without_data_is_read() -> None:
    x, y = points(lambda a, b: np.sin(3 * a) + b**3, 0.0)
    kan = fit_points(build_kan([2, 1], grid=10), x, y).kan
    reading = extract(kan, x, inputs=["theta", "omega"], library=FEW)
    assert sorted(reading.forms.values()) == ["cubic", "sine"]
    assert reading.p_value is None and reading.error_data is None and reading.ok
    torch = pytest.importorskip("torch")
    kan(torch.tensor(x))  # what it saw last stands for inputs that are not given
    again = extract(kan, inputs=["theta", "omega"], library=FEW)
    assert again.forms == reading.forms and again.ranges == reading.ranges


def test_what_no_form_says_is_not_read() -> None:
    x, y = points(lambda a, b: np.sin(9 * a**2) * np.exp(a) + b, 0.01)
    kan = fit_points(build_kan([2, 1], grid=30), x, y).kan
    reading = extract(kan, x, y, library=FEW)
    assert not reading.ok
    assert "No simple form" in reading.sentence()


def test_figure_is_written(additive: tuple[object, np.ndarray, np.ndarray, Reading],
                           tmp_path: Path) -> None:
    *_, reading = additive
    figure = reading.plot(tmp_path / "net.png", tmp_path / "net.svg")
    assert (tmp_path / "net.png").read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in (tmp_path / "net.svg").read_bytes()
    titles = [axes.get_title() for axes in figure.axes]
    assert any(t.startswith("sine") for t in titles) and any(t.startswith("cubic") for t in titles)


def test_text_and_html(additive: tuple[object, np.ndarray, np.ndarray, Reading]) -> None:
    *_, reading = additive
    assert "a_theta" in str(reading) and "±" in str(reading)
    assert "<table>" in reading._repr_html_() and "\\sin" in reading.latex()
    digits = re.findall(r"\d+\.\d+", str(reading).splitlines()[0])
    assert digits and all(len(n.replace(".", "").lstrip("0")) <= 4 for n in digits)
    assert "off the data" in reading.sentence() and "of the spread" in reading.sentence()
    still = replace(reading, spread=0.0, error_network=0.0)  # a network that says one number
    assert "0.00% of the spread" in still.sentence()
    lost = replace(reading, p_value=1e-9, error_network=0.25 * reading.spread)
    assert not lost.ok and "off by 25.00% of its spread" in lost.sentence()
    assert replace(reading, caution="Not this one.").sentence() == "Not this one."


def test_bad_data_are_refused() -> None:
    kan = build_kan([2, 1])
    with pytest.raises(errors.BadSetting, match="cannot be fitted"):
        extract(kan, np.zeros((10, 2)), np.zeros(9))
    with pytest.raises(errors.BadSetting, match="do not fit the names"):
        extract(kan, np.zeros((10, 2)), np.zeros(10), inputs=["one"])
    with pytest.raises(errors.BadSetting, match="alpha"):
        prune(kan, np.zeros((10, 2)), np.zeros(10), alpha=2.0)


def test_a_network_is_read_over_the_inputs_that_it_saw_last() -> None:
    import torch

    x, y = points(lambda a, b: a**2 + b**3, 0.0, n=100)
    kan = fit_points(build_kan([2, 1], grid=4), x, y).kan
    with torch.no_grad():
        value = kan(torch.from_numpy(x)).numpy()[:, 0]
    few = [FORMS["quadratic"], FORMS["cubic"]]
    reading = extract(kan, library=few)
    assert list(reading.forms.values()) == ["quadratic", "cubic"]
    np.testing.assert_allclose(reading.ranges, np.column_stack([x.min(axis=0), x.max(axis=0)]))
    off = np.sqrt(np.mean((reading(x) - value) ** 2))
    assert reading.error_network == pytest.approx(off, rel=1e-6, abs=1e-12)
    assert reading.spread == pytest.approx(np.std(value), rel=1e-6) and reading.ok


def test_edges_that_others_can_do_without_go() -> None:
    """The faintest first; nodes are judged with their edges, and what is needed stays."""
    x, y = points(lambda a, b: np.sin(2 * a), 0.01, n=50)
    kan = build_kan([2, 1, 1], grid=3, grid_range=[(-1, 1), (-2, 2)], seed=0)
    fit = fit_points(kan, x, y, iterations=10)
    left, removed = _without_spare(fit, x, y, 0.01)
    assert [(c.layer, c.source, c.target) for c in removed] == [(0, 1, 0)]
    assert [(e.layer, e.source) for e in edges_of(left.network)] == [(0, 0), (1, 0)]
