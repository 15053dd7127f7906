"""Laws that a model lacks: what an edge's data say of them, and which are put into the ODE."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from tanks import recording, searching, tank

import pikanid as pk
from pikanid import errors
from pikanid.approximators.bspline import BSpline
from pikanid.approximators.kan.plan import uniform_extended_knots
from pikanid.discrepancy import Discrepancy
from pikanid.symbolic import extract
from pikanid.symbolic.curve import Curve
from pikanid.symbolic.fitting import fit_form
from pikanid.symbolic.library import LIBRARY
from pikanid.symbolic.missing import _at_limit, _score, _simpler, _tried, edge_curve, sticks
from pikanid.symbolic.naming import name_curve

FORMS = {form.name: form for form in LIBRARY}
FEW = [FORMS[n] for n in ("linear", "quadratic", "cubic", "signed square")]
X = np.linspace(-2.0, 2.0, 400)
SIGMA = 0.1 * np.pi / 180


def edge_with_gauge(law: np.ndarray, bent: float, seed: int) -> Curve:
    """What 400 noisy points say of a spline when an almost linear term beside it is free."""
    B = BSpline(3, uniform_extended_knots(-2.0, 2.0, 10, 3)).basis(X).toarray()
    nominal = np.column_stack([np.ones(X.size), X * (1.0 - bent * np.abs(X))])
    y = (law + 0.02 * np.random.default_rng(seed).normal(size=X.size)) / 0.02
    A, N = B / 0.02, nominal / 0.02
    apart = np.eye(X.size) - N @ np.linalg.pinv(N)
    c = np.linalg.lstsq(B, law, rcond=None)[0]
    return Curve.of_likelihood(X, B, c, 1e-4 * np.eye(c.size), A.T @ apart @ A, A.T @ apart @ y,
                               samples=X.size, free=nominal)


@pytest.mark.parametrize("name, law", [
    ("signed square", 0.8 * X * np.abs(X)), ("cubic", 0.5 * X**3), ("sine", np.sin(3.0 * X))])
def test_law_is_named_beside_a_free_term(name: str, law: np.ndarray) -> None:
    for seed in range(3):
        edge = name_curve(edge_with_gauge(law + 0.7 * X, 0.01, seed))
        assert edge.name == name
        assert edge.probability > 0.9


def test_trace_of_a_nominal_term_is_no_law() -> None:
    """x beside x(1 - 0.01|x|), a hundred times too large, looks like x|x|: it is not offered."""
    curve = edge_with_gauge(-0.8 * X * np.abs(X), 0.01, 0)
    assert list(curve.visible(np.array([X, X * np.abs(X), X**2]))) == [False, True, True]
    assert fit_form(FORMS["linear"], curve) is None
    assert fit_form(FORMS["sign and linear"], curve) is None
    found = fit_form(FORMS["tanh"], curve)
    assert found is None or curve.visible(np.tanh(found.inside[0] * X))


def test_rest_is_one_place() -> None:
    """Samples at rest differ by rounding: no step is looked for between them."""
    x = np.concatenate([X, [1e-19, 3e-18, -2e-18]])
    noise = np.random.default_rng(0).normal(0.0, 0.1, x.size)
    found = fit_form(FORMS["shifted sign"], Curve.of_points(x, np.sign(x - 1e-3) + noise))
    assert found is not None and abs(found.inside[0]) > 1e-9


def test_simpler_laws_are_parts_and_relatives() -> None:
    curve = Curve.of_points(X, np.sign(X) + 0.1 * np.random.default_rng(0).normal(size=X.size))
    edge = name_curve(curve, [FORMS[n] for n in ("sign", "shifted sign", "Stribeck", "cubic")])
    assert [f.form.name for f in _simpler(edge, FORMS["Stribeck"])] == ["sign"]
    assert [f.form.name for f in _simpler(edge, FORMS["shifted sign"])] == ["sign"]
    assert _simpler(edge, FORMS["sign"]) == []


@pytest.mark.parametrize("jump, resting, stuck", [
    (1.0, 30, True), (1.0, 0, False), (0.0, 30, False)])
def test_edge_of_a_model_that_comes_to_rest_is_not_trusted(jump: float, resting: int, stuck: bool
                                                           ) -> None:
    a = np.concatenate([np.linspace(-1.0, 1.0, 1000), np.full(resting, 1e-18)])
    gauge = SimpleNamespace(a=a, weights=np.full(a.size, 1.0 / a.size))
    assert sticks(SimpleNamespace(  # type: ignore[arg-type]
        range=(-1.0, 1.0), gauge=gauge, jump_probability=jump)) == stuck


@pytest.fixture(scope="module")
def found() -> Discrepancy:
    """A cubic law that a tank lacks."""
    return pk.kan_discrepancy(tank(), recording(0.3, 0), "x", ["x"], grid=[8], steps=False,
                              nominal=searching().nominal)


def test_an_edge_alone_says_its_law(found: Discrepancy) -> None:
    reading = extract(found, library=FEW)
    assert dict(reading.forms) == {(0, 0, 0): "cubic"} and reading.ok
    assert reading.values[0] == pytest.approx(-0.3, abs=4 * reading.std[0])
    edge, (weight,) = found.edge("x"), reading.contributions
    assert (weight.size, weight.std, weight.p_value) == pytest.approx(
        (np.sqrt(np.mean(edge.values**2)), np.sqrt(np.mean(edge.std**2)), edge.p_value))


def test_what_is_named_is_the_edge_at_visited_arguments(found: Discrepancy) -> None:
    edge = found.edge("x")
    curve = edge_curve(edge, 123)
    assert set(curve.x) <= set(edge.gauge.a) and len(curve.x) > 100
    assert (curve.x[0], curve.x[-1]) == (edge.gauge.a.min(), edge.gauge.a.max())
    np.testing.assert_allclose(curve.y, edge(curve.x), atol=1e-12)
    assert curve.std is not None
    np.testing.assert_allclose(
        curve.std**2, np.diag(edge.covariance_of_values(curve.x)), rtol=1e-9)
    assert (curve.samples, curve.argument, curve.unit, curve.x_unit) == (123, "x", "(m)/s", "m")


def test_a_law_at_the_end_of_what_it_may_be_is_another_one() -> None:
    edge = name_curve(Curve.of_points(X, np.sign(X)), [FORMS["sign"]])

    def at(name: str, value: float) -> bool:
        fit = SimpleNamespace(form=FORMS[name], inside=np.array([value]))
        return _at_limit(cast(Any, fit), edge)

    assert at("signed power", 0.3) and not at("signed power", 1.5) and at("signed power", 6.5)
    low, high = FORMS["shifted sign"].knobs[0].limits(-2.0, 2.0, X.size)
    assert at("shifted sign", low) and at("shifted sign", high) and not at("shifted sign", 0.1)


@pytest.mark.parametrize("source", ["given", "estimated"])
def test_laws_compete_by_bic_of_the_recordings(source: str, found: Discrepancy,
                                               monkeypatch: pytest.MonkeyPatch) -> None:
    """χ² where the noise is stated, n log(χ²/n) where it is not; what cannot run is left out."""
    left = {"cubic": 400.0, "quadratic": 500.0}

    class Fit:
        def __init__(self, starts: int):
            assert starts == 1

        def fit(self, model: pk.Model, recordings: object) -> object:
            own = {p.name for p in model.parameters}
            assert "a" in own and recordings is data
            name = next((n for n, text in (("cubic", "x**3"), ("quadratic", "x**2"))
                         if text in str(model.equations["x"])), "")
            if not name:
                raise errors.SimulationFailed("it runs away")
            return SimpleNamespace(
                n=401, theta=np.zeros(2), cost=0.5 * left[name],
                adequacy=SimpleNamespace(source=source, value=left[name]))

    data = recording(0.3, 0)
    monkeypatch.setattr("pikanid.strategies.nls.NLS", Fit)
    named = {(0, 0, 0): name_curve(edge_curve(found.edge("x"), 401), FEW)}
    weights: Mapping[str, float] = {f.name: 0.25 if f.name == "cubic" else 0.125 for f in FEW}
    tried: Sequence[Any] = _tried(found, named, data, weights)
    assert tried[0][1].label == "cubic"
    for score, law, estimate in tried:
        chi2 = left[law.label]
        bic = 2 * np.log(401) + (chi2 if source == "given" else 401 * np.log(chi2 / 401))
        assert _score(estimate) == pytest.approx(bic)
        assert score == pytest.approx(bic - 2 * np.log(weights[law.label]))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [100, 102])
@pytest.mark.parametrize("law, size, name", [
    ("sign(theta_dot)", 0.2, "sign"), ("abs(theta_dot)*theta_dot", 0.06, "signed square")])
def test_friction_and_drag_are_named_inside_the_ode(law: str, size: float, name: str, seed: int
                                                    ) -> None:
    """Through the functional, on slosh data of ten moves; with stops, an edge alone can err."""
    truth = pk.systems.sloshing().with_term(
        "theta_dot", f"-c*{law}", [pk.Parameter("c", size)])
    moves = pk.excitation.planar_moves(10, 20.0, acceleration=1.0, velocity=0.5, seed=seed)
    recording = pk.simulate(truth, moves, sigma=SIGMA, seed=seed)
    found = pk.kan_discrepancy(pk.systems.sloshing(), recording, "theta_dot",
                               ["theta", "theta_dot"], grid=[10])
    reading = extract(found, recordings=recording)
    assert dict(reading.forms) == {(0, 1, 0): name}
    assert reading.ok and reading.probability > 0.9
    alone = extract(found)
    assert dict(alone.forms) == dict(reading.forms) or not alone.ok
    assert -reading.values[0] == pytest.approx(size, abs=5 * reading.std[0])


def test_what_is_read_of_a_temperature_goes_into_its_model() -> None:
    """A room in degC that loses heat by T**2: constants carry units, powers a zero."""
    from scipy.integrate import solve_ivp

    room = pk.Model.from_dict({
        "states": {"T": {"unit": "degC", "initial": "free", "guess": 20.0}},
        "inputs": {"P": {"unit": "W"}},
        "parameters": {"r": {"unit": "1/s", "guess": 0.04, "bounds": [0.001, 1.0]},
                       "c": {"unit": "K/s/W", "guess": 0.4, "bounds": [0.001, 1.0]},
                       "T_a": {"unit": "degC", "value": 10.0}},
        "equations": {"T": "c*P - r*(T - T_a)"},
        "outputs": {"y": {"unit": "degC", "expression": "T"}}})
    t = np.linspace(0.0, 200.0, 400)
    P = np.interp(t, np.linspace(0.0, 200.0, 14), np.random.default_rng(1).uniform(0.0, 6.0, 14))
    y = solve_ivp(lambda s, T: 0.5 * np.interp(s, t, P) - 0.02 * (T - 10.0)
                  - 0.002 * T**2, (0.0, 200.0), [20.0], t_eval=t,
                  rtol=1e-9, atol=1e-9).y[0]
    seen = pk.Recording.from_arrays(
        t, {"P": P, "y": y + 0.01 * np.random.default_rng(2).normal(size=t.size)},
        {"P": "W", "y": "degC"}, hold={"P": "first"})
    missing = pk.kan_discrepancy(room, seen, "T", ["T"])
    read = extract(missing, library=[FORMS["quadratic"], FORMS["logarithm"]], recordings=seen)
    assert list(read.forms.values()) == ["quadratic"]
    assert set(read.units.values()) == {"1/(degC*s)"}
    extended = room.with_term("T", read.expression, read.parameters)
    fit = pk.NLS(starts=1).fit(extended, seen)
    assert fit.rmse == pytest.approx(0.01, rel=0.15)
