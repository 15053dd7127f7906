"""`pk.kan_discrepancy` on models small enough to know everything about, and on slosh data."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.linalg import block_diag
from tanks import coarse, recording, tank

import pikanid as pk
from pikanid import errors
from pikanid.discrepancy import Discrepancy, Edge, api, functional
from pikanid.discrepancy.edges import EdgePlan
from pikanid.discrepancy.level import Level
from pikanid.discrepancy.settings import DiscrepancySettings
from pikanid.formula.expressions import symbol
from pikanid.problem.problem import Problem
from pikanid.uncertainty import cramer_rao


@pytest.fixture(scope="module")
def found() -> Discrepancy:
    """A cubic law, found."""
    return pk.kan_discrepancy(tank(), recording(0.3, 0), "x", ["x"], grid=[8], steps=False)


def cubic(x: np.ndarray) -> np.ndarray:
    return -0.3 * x**3


def test_a_missing_law_lies_in_its_band(found: Discrepancy) -> None:
    edge = found.edge("x")
    assert found.significant == (edge,)
    assert found.nominal.adequacy.verdict == "misfit"
    assert found.adequate and found.p_value < 1e-6
    low, high = edge.simultaneous
    true = edge.fix_gauge(cubic)
    # at the ends, where a cubic bends most, one smoothness for the whole edge is too smooth
    assert np.mean((low <= true) & (true <= high)) >= 0.9
    assert edge.share_inside(lambda x: 0.0 * x) < 0.3
    assert np.all((low <= edge.band[0] + 1e-12) & (high >= edge.band[1] - 1e-12))


def test_extended_model_reproduces_the_fit(found: Discrepancy) -> None:
    again = pk.simulate(found.model, recording(0.3, 0))
    np.testing.assert_allclose(again["x"].values, found.estimate.fits[0].fitted, atol=1e-5)


def test_edge_is_its_spline(found: Discrepancy) -> None:
    edge = found.edge("x")
    limits = edge.gauge.plan.limits
    step = (limits[1] - limits[0]) / 8
    spline = BSpline(limits[0] + step * np.arange(-3, 12), edge.coefficients, 3)
    np.testing.assert_allclose(edge(edge.grid), spline(edge.grid), atol=1e-12)
    np.testing.assert_allclose(edge.values, spline(edge.grid), atol=1e-12)


def test_covariance_of_values(found: Discrepancy) -> None:
    edge = found.edge("x")
    a = edge.grid[::20]
    V = edge.covariance_of_values(a)
    np.testing.assert_allclose(np.sqrt(np.diag(V)), edge.std[::20], rtol=1e-9)
    assert np.linalg.eigvalsh(V).min() > -1e-12 * V.max()
    rng = np.random.default_rng(0)
    drawn = rng.multivariate_normal(edge.coefficients, edge.covariance, 20000)
    values = edge.gauge.plan.basis(a) @ drawn.T
    np.testing.assert_allclose(np.cov(values), V, atol=0.05 * V.max())


def test_gauge_functions_change_no_edge(found: Discrepancy) -> None:
    edge = found.edge("x")
    free = edge.gauge_functions(edge.grid)
    lines = np.column_stack([np.ones_like(edge.grid), edge.grid])
    left = lines - free @ np.linalg.lstsq(free, lines, rcond=None)[0]
    assert np.abs(left).max() < 0.02 * np.abs(edge.grid).max()
    np.testing.assert_allclose(
        edge.fix_gauge(lambda x: cubic(x) + 5.0 - 2.0 * x), edge.fix_gauge(cubic), atol=0.02)


def test_what_is_shown(found: Discrepancy) -> None:
    content = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert content["adequate"] and content["edges"][0]["significant"]
    assert content["edges"][0]["argument_unit"] == "m" and found.unit == "(m)/s"
    assert "x: up to" in str(found)
    assert "<table>" in found._repr_html_()
    assert len(found.plot().axes) == 1


def test_plain_numbers_are_the_attributes(found: Discrepancy) -> None:
    edge = found.edge("x")
    jumping = replace(
        edge, jump_probability=0.9, coefficients=np.append(edge.coefficients, 0.7),
        covariance=block_diag(edge.covariance, 0.04),
        gauge=replace(edge.gauge, plan=replace(edge.gauge.plan, step=True)))
    for one, step in ((edge, None), (jumping, {"value": 0.7, "std": 0.2, "probability": 0.9})):
        told = one.to_dict()
        for name in ("argument", "argument_unit", "unit", "range", "p_value", "freedom",
                     "significant", "values", "std"):
            np.testing.assert_array_equal(told.pop(name), getattr(one, name))
        np.testing.assert_array_equal(told.pop("argument_values"), one.grid)
        np.testing.assert_array_equal([told.pop("lower"), told.pop("upper")], one.band)
        assert told == {"step": step}
    told = found.to_dict()
    for name in ("equation", "unit", "adequate", "p_value", "alpha", "evidence"):
        assert told.pop(name) == getattr(found, name)
    assert told == {"offset": {"value": found.offset[0], "std": found.offset[1]},
                    "edges": [edge.to_dict()], "estimate": found.estimate.to_dict(),
                    "nominal": found.nominal.to_dict()}


def test_the_functional_is_asked_for_the_coarsest_grid(found: Discrepancy,
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    """What the relaxation itself says of the edge is asked below, at length."""
    def relaxed(nominal: pk.Estimate, problem: Problem, equation: str, plans: Sequence[EdgePlan],
                intervals: int, settings: DiscrepancySettings) -> Level:
        assert settings == DiscrepancySettings()
        assert nominal is found.nominal and problem.model.name == "tank"
        assert (equation, [p.argument for p in plans], intervals) == ("x", ["x"], 8)
        return coarse()

    monkeypatch.setattr(api, "relaxed_level", relaxed)
    other = pk.kan_discrepancy(tank(), recording(0.3, 0), "x", ["x"], grid=[8, 16],
                               nominal=found.nominal, method="functional")
    assert other.estimate.settings["method"] == "functional"
    np.testing.assert_allclose(other.edge("x").values, found.edge("x").values, atol=1e-6)


def test_the_estimate_is_kept_on_disk(found: Discrepancy, tmp_path: Any) -> None:
    found.estimate.save(tmp_path / "found.json")
    again = pk.Estimate.load(tmp_path / "found.json")
    np.testing.assert_array_equal(again.theta, found.estimate.theta)
    np.testing.assert_array_equal(again.covariance, found.estimate.covariance)


def test_same_data_same_numbers(found: Discrepancy) -> None:
    again = pk.kan_discrepancy(tank("other"), recording(0.3, 0), "x", ["x"], grid=[8], steps=False,
                               nominal=found.nominal)
    np.testing.assert_array_equal(again.edge("x").values, found.edge("x").values)


@pytest.mark.parametrize("seed", range(4))
def test_clean_data_show_nothing(seed: int) -> None:
    clean = pk.kan_discrepancy(tank(), recording(0.0, seed), "x", ["x"], grid=[8], steps=False)
    assert clean.significant == () and clean.adequate
    assert clean.edge("x").share_inside(lambda x: 0.0 * x) >= 0.5
    assert "nothing" in str(clean)


def test_the_relaxation_sees_the_prior_as_data(found: Discrepancy,
                                               monkeypatch: pytest.MonkeyPatch) -> None:
    """Outputs whose squares add up to the penalty of the coefficients, recorded as zero."""
    class Asked(Exception):
        pass

    seen: list[Problem] = []

    def asked(problem: Problem, settings: object) -> None:
        seen.append(problem)
        raise Asked

    monkeypatch.setattr(functional, "fit_relaxed", asked)
    level = coarse()
    with pytest.raises(Asked):
        functional.relaxed_level(found.nominal, Problem(found.nominal.fitted_model,
                                                        recording(0.3, 0)), "x", level.plans, 8)
    (problem,) = seen
    rows = [o for o in problem.model.outputs if o.name.startswith("prior_")]
    labels, prior = [f.label for f in problem.free], level.fit.smoothness
    theta = np.random.default_rng(0).normal(size=len(labels))
    at = dict(zip(map(symbol, labels), theta, strict=True))
    values = np.array([float(o.expression.subs(at)) for o in rows])
    for o in rows:
        channel = problem.recordings[0][o.name]
        assert channel.values.mean() == 0.0 and channel.sigma == pytest.approx(np.sqrt(2.0))
    wanted = theta @ prior.precision(prior.stiff) @ theta
    assert values @ values == pytest.approx(wanted, rel=1e-6)


@pytest.mark.slow
def test_the_functional_sees_the_same_edge(found: Discrepancy) -> None:
    relaxed = pk.kan_discrepancy(tank(), recording(0.3, 0), "x", ["x"], grid=[8],
                                 method="functional")
    edge, other = relaxed.edge("x"), found.edge("x")
    assert edge.significant
    np.testing.assert_allclose(edge(other.grid), other.values, atol=4 * other.std.max())


@pytest.mark.kan
def test_pykan_model_is_the_edges(found: Discrepancy, tmp_path: Any,
                                  monkeypatch: pytest.MonkeyPatch) -> None:
    torch = pytest.importorskip("torch")
    from pikanid.approximators.kan import load, save

    monkeypatch.chdir(tmp_path)
    kan, edge = found.kan(), found.edge("x")
    assert [list(w) for w in kan.width] == [[1, 0], [1, 0]]
    values = kan(torch.from_numpy(edge.grid[:, None]))[:, 0].detach().numpy()
    np.testing.assert_allclose(values, edge.values + found.offset[0], atol=1e-12)
    assert list(tmp_path.iterdir()) == []
    save(kan, tmp_path / "kan.npz")
    again = load(tmp_path / "kan.npz")
    np.testing.assert_array_equal(
        again(torch.from_numpy(edge.grid[:, None]))[:, 0].detach().numpy(), values)


@pytest.mark.kan
def test_products_go_through_multiplication_nodes() -> None:
    torch = pytest.importorskip("torch")
    from pikanid.approximators.kan.additive import additive_kan

    rng = np.random.default_rng(1)
    limits = [(-1.0, 2.0), (-3.0, 3.0), (-4.0, 5.0)]
    coefficients, steps = [rng.normal(size=9) for _ in limits], [0.0, 0.7, 0.0]
    kan = additive_kan(limits, 6, coefficients, steps, 0.3, [[0], [1], [0, 2]])
    assert [list(w) for w in kan.width] == [[3, 0], [2, 1], [1, 0]]
    x = rng.uniform([-1.0, -3.0, -1.5], [2.0, 3.0, 1.5], (60, 3))
    wanted = np.full(60, 0.3)
    for z, (low, high), c, step in zip((x[:, 0], x[:, 1], x[:, 0] * x[:, 2]), limits, coefficients,
                                       steps, strict=True):
        h = (high - low) / 6
        wanted += BSpline(low + h * np.arange(-3, 10), c, 3)(z) + step * np.sign(z)
    values = kan(torch.from_numpy(x))[:, 0].detach().numpy()
    np.testing.assert_allclose(values, wanted, atol=1e-12)


@pytest.mark.parametrize(("options", "kind"), [
    ({"equation": "y"}, errors.BadModel),
    ({"arguments": []}, errors.BadSetting),
    ({"arguments": ["x", "x"]}, errors.BadSetting),
    ({"arguments": ["z"]}, errors.BadModel),
    ({"arguments": ["x; import os"]}, errors.BadModel),
    ({"arguments": ["a"]}, errors.BadSetting),
    ({"grid": []}, errors.BadSetting),
    ({"grid": [20, 10]}, errors.BadSetting),
    ({"grid": [2]}, errors.BadSetting),
    ({"grid": [8.5]}, errors.BadSetting),
    ({"alpha": 0.0}, errors.BadSetting),
    ({"method": "magic"}, errors.BadSetting),
])
def test_bad_input_is_one_sentence(options: dict[str, Any], kind: type[Exception],
                                   found: Discrepancy) -> None:
    given: dict[str, Any] = {"equation": "x", "arguments": ["x"], "grid": [8],
                             "nominal": found.nominal} | options
    with pytest.raises(kind) as raised:
        pk.kan_discrepancy(tank(), recording(0.3, 0), **given)
    said = str(raised.value)
    assert "\n" not in said
    if {"grid", "alpha", "method"} & set(options):
        assert re.search(rf"\b{next(iter(options))}\b", said)


def test_an_edge_that_is_not_there(found: Discrepancy) -> None:
    with pytest.raises(errors.BadModel, match="'u'"):
        found.edge("u")


LAWS: dict[str, tuple[str, str, Callable[[np.ndarray], np.ndarray]]] = {
    "dry friction": ("sign(theta_dot)", "theta_dot", np.sign),
    "drag": ("abs(theta_dot)*theta_dot", "theta_dot", lambda a: np.abs(a) * a),
    "cubic spring": ("theta**3", "theta", lambda a: a**3),
}


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_laws_of_slosh_data(law: str) -> None:
    """Sizes are 100 Cramér-Rao bounds, chosen before any fit."""
    term, argument, shape = LAWS[law]
    sigma, edges = 0.1 * np.pi / 180, list[Edge]()
    for seed in range(3):
        drive = pk.excitation.planar_moves(10, 20.0, seed=seed)
        model = pk.systems.sloshing().with_term(
            "theta_dot", f"-c*{term}", [pk.Parameter("c", 0.0)])
        size = 100 * cramer_rao(model, drive, sigma=sigma).std("c")
        data = pk.simulate(model.with_values(c=size), drive, sigma=sigma, seed=seed)
        found = pk.kan_discrepancy(pk.systems.sloshing(), data, "theta_dot",
                                   ["theta", "theta_dot", "u_x"], grid=[10])
        edge = found.edge(argument)
        assert edge.significant and found.adequate
        assert (edge.jump_probability > 0.5) == (law == "dry friction")
        low, high = edge.simultaneous
        true = edge.fix_gauge(lambda a, size=size: -size * shape(a))
        # the simultaneous band holds a whole curve 19 times in 20; all of it but a few points here
        assert np.mean((true >= low) & (true <= high)) >= 0.9
        edges.append(edge)
    assert len(edges) == 3


def test_information_of_an_edge_is_what_the_data_leave(found: Discrepancy) -> None:
    """The true law leaves what noise leaves, another one more; parameters' part is not seen."""
    edge = found.edge("x")
    basis = edge.gauge.plan.basis(edge.gauge.a)
    least = -float(edge.gain @ np.linalg.pinv(edge.information, 1e-10) @ edge.gain)

    def left(values: np.ndarray) -> float:
        c = np.linalg.lstsq(basis, values, rcond=None)[0]
        return float(c @ edge.information @ c - 2.0 * edge.gain @ c) - least

    law = np.linalg.lstsq(basis, cubic(edge.gauge.a), rcond=None)[0]
    size = float(law @ edge.information @ law)
    assert left(cubic(edge.gauge.a)) < 30.0  # χ² of nine
    assert left(0.9 * cubic(edge.gauge.a)) > 60.0
    assert left(np.zeros(len(edge.gauge.a))) > 0.9 * size
    for own in (edge.gauge.plan.constant, edge.gauge.removed[:, -1]):
        shown = own * np.linalg.norm(basis @ law) / np.linalg.norm(basis @ own)
        assert abs(shown @ edge.information @ shown) < 1e-3 * size
