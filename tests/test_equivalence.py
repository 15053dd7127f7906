"""A shallow pykan KAN with w_b = 0 trains on Eq. (5): verified, and the verification verified."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the `kan` extra")
pytest.importorskip("kan.MultKAN", reason="needs the `kan` extra")

from pikanid.approximators.kan import build_kan  # noqa: E402
from pikanid.validation.equivalence import (  # noqa: E402
    Check,
    EquivalenceReport,
    Setting,
    compare,
    run_checks,
)
from pikanid.validation.equivalence.checks import apart, compare_paths, settings  # noqa: E402
from pikanid.validation.equivalence.controls import uniqueness  # noqa: E402
from pikanid.validation.equivalence.delivery import delivered_curve  # noqa: E402
from pikanid.validation.equivalence.ipda import IpdaObjective  # noqa: E402
from pikanid.validation.equivalence.network import NetworkLoss  # noqa: E402
from pikanid.validation.equivalence.optimisers import Path as Iterates  # noqa: E402
from pikanid.validation.equivalence.optimisers import Path as Path_  # noqa: E402
from pikanid.validation.equivalence.setting import motion  # noqa: E402
from pikanid.validation.equivalence.systems import SYSTEMS  # noqa: E402

pytestmark = pytest.mark.kan


@pytest.fixture(scope="module")
def report() -> EquivalenceReport:
    parts: list[str] = []
    found = run_checks(quick=True, progress=parts.append)
    assert len(parts) > 20 and parts[-1] == "degree 2 at the end"
    return found


def rows(report: EquivalenceReport, check: str, quantity: str | None = None) -> list[Check]:
    found = [r for r in report.rows if check in r.check and quantity in (None, r.quantity)]
    assert found
    return found


@pytest.mark.parametrize(
    "quantity", ["loss", "gradient in c", "gradient in p", "Jacobian", "Gauss-Newton matrix"]
)
def test_terms_agree(report: EquivalenceReport, quantity: str) -> None:
    limit = 1e-10 if "gradient" in quantity else 1e-12
    found = rows(report, "shallow KAN", quantity)
    assert max(r.difference for r in found) <= limit
    assert {r.tolerance for r in found} == {limit}  # what the report itself asks for


@pytest.mark.parametrize("optimiser", ["L-BFGS", "Adam", "Levenberg-Marquardt"])
def test_optimisers_walk_the_same_path(report: EquivalenceReport, optimiser: str) -> None:
    found = rows(report, "shallow KAN", f"20 iterates of {optimiser}")
    assert len(found) == 6 and max(r.difference for r in found) <= 1e-8
    assert {r.tolerance for r in found} == {1e-8}


def test_minimisers_agree(report: EquivalenceReport) -> None:
    assert max(r.difference for r in rows(report, "shallow KAN", "minimiser")) <= 1e-8


def test_coefficients_are_unique(report: EquivalenceReport) -> None:
    assert all(r.passed for r in rows(report, "uniqueness"))


def test_model_handed_over_is_the_curve(report: EquivalenceReport) -> None:
    assert max(r.difference for r in rows(report, "handed over")) <= 1e-12


def test_deep_step_is_a_tangent_ipda_step(report: EquivalenceReport) -> None:
    assert max(r.difference for r in rows(report, "tangent")) <= 1e-10


@pytest.mark.parametrize(
    ("control", "least"),
    [
        ("w_b = 0.1", 1e-3),
        ("clamped knots", 1e-3),
        ("other collocation points", 1e-3),
        ("deeper KAN", 1e-3),
        ("degree 2 at T", 1e-6),
        ("w_b ≠ 0: hardly unique", 1e5),
    ],
)
def test_controls_differ(report: EquivalenceReport, control: str, least: float) -> None:
    found = rows(report, control)
    assert all(r.must_differ and r.passed for r in found)
    assert min(r.difference for r in found) > least


def test_degree_two_agrees_but_for_the_end(report: EquivalenceReport) -> None:
    assert max(r.difference for r in rows(report, "degree 2 without T")) <= 1e-12


@pytest.mark.parametrize("quick", [False, True])
def test_settings_cover_what_was_promised(quick: bool) -> None:
    every = list(settings(quick=quick))
    assert {(s.form, s.degree) for s in every} == {
        *(("state", k) for k in (2, 3, 4, 5)),
        *(("second-order", k) for k in (3, 4, 5)),
    }
    for attribute in ("system", "grid", "horizon", "weight", "samples", "collocation", "even"):
        values = {getattr(s, attribute) for s in every}
        assert len(values) >= 2, attribute
        assert values == {getattr(s, attribute) for s in settings()}, attribute
    for kinked in (False, True):
        ways = {(s.system, s.form) for s in every if bool(s.kinks) is kinked}
        assert len(ways) == 4, kinked
    for setting in every:
        for grid in (setting.data_times, setting.collocation_times):
            assert grid[0] == 0.0 and grid[-1] == setting.horizon


def test_a_wrong_formula_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """One part in a million in one coefficient of one right-hand side."""
    setting = Setting("sloshing", "second-order", grid=5)
    right = SYSTEMS["sloshing"]
    wrong = dataclasses.replace(
        right, torch=lambda x, v, u, p: right.torch(x, v, u, p * (1.0 + 1e-6))
    )
    monkeypatch.setitem(SYSTEMS, "sloshing", wrong)
    assert not all(check.passed for check in compare(setting))


@pytest.mark.parametrize("quantity", [
    "loss", "gradient in c", "gradient in p", "Jacobian", "Gauss-Newton matrix"])
def test_every_term_notices_a_parameter_off_by_ten_parts_in_a_billion(
        quantity: str, monkeypatch: pytest.MonkeyPatch) -> None:
    setting = Setting("duffing", "state", grid=5, weight=1.0)
    right = SYSTEMS["duffing"]
    monkeypatch.setitem(SYSTEMS, "duffing", dataclasses.replace(
        right, torch=lambda x, v, u, p: right.torch(x, v, u, p * (1.0 + 1e-8))))
    (found,) = (check for check in compare(setting) if check.quantity == quantity)
    assert not found.passed and found.difference < 1e-6


def test_paths_notice_a_parameter_off_by_a_ten_thousandth(monkeypatch: pytest.MonkeyPatch) -> None:
    setting = Setting("duffing", "state", grid=4, samples=21, collocation=31, weight=1.0)
    assert all(check.passed for check in compare_paths(setting, quick=True))
    right = SYSTEMS["duffing"]
    monkeypatch.setitem(SYSTEMS, "duffing", dataclasses.replace(
        right, torch=lambda x, v, u, p: right.torch(x, v, u, p * (1.0 + 1e-4))))
    found = compare_paths(setting, quick=True)
    assert len(found) >= 3 and not any(check.passed for check in found)


def test_paths_are_apart_where_curves_or_parameters_are() -> None:
    basis = np.eye(4)[:, :3]
    z = np.arange(1.0, 15.0).reshape(2, 7)  # two iterates: three rows of two outputs, a parameter
    path = Iterates(z, True)
    assert apart(path, path, basis, 2) == 0.0
    for k, scale in ((6, 14.0), (4, 13.0)):
        moved = z.copy()
        moved[1, k] += 0.5
        found = apart(path, Iterates(moved, True), basis, 2)
        assert found == pytest.approx(0.5 / max(scale, z[1, k] + 0.5))
    longer = Iterates(np.vstack([z, z[1:]]), True)
    assert apart(path, longer, basis, 2) == 0.0
    assert apart(path, dataclasses.replace(longer, converged=False), basis, 2) == np.inf


@pytest.mark.parametrize("system", SYSTEMS)
def test_slopes_by_hand_are_those_of_the_right_hand_side(system: str) -> None:
    model, rng = SYSTEMS[system], np.random.default_rng(0)
    x, v, u = rng.normal(size=(3, 20))
    p = np.array(model.truth)
    by_x, by_v, by_p = model.slopes(x, v, u, p)
    tensors = [torch.tensor(a, requires_grad=True) for a in (x, v, p)]
    force = model.torch(tensors[0], tensors[1], torch.tensor(u), tensors[2])
    np.testing.assert_allclose(force.detach(), model.acceleration(x, v, u, p), rtol=1e-12)
    grad_x, grad_v = torch.autograd.grad(force.sum(), tensors[:2], retain_graph=True)
    np.testing.assert_allclose(by_x, grad_x, rtol=1e-11)
    np.testing.assert_allclose(by_v, grad_v, rtol=1e-11)
    for row in (0, 7, 19):
        (grad_p,) = torch.autograd.grad(force[row], tensors[2], retain_graph=True)
        np.testing.assert_allclose(by_p[row], grad_p, rtol=1e-11)


def test_motion_meets_the_excitation() -> None:
    """The known peak of the slosh profile; a solver that steps over the pulses finds 0."""
    t = np.linspace(0.0, 5.0, 501)
    assert np.rad2deg(np.abs(motion("sloshing", 5.0, t)).max()) == pytest.approx(11.34, abs=0.01)


def test_network_reads_the_knots_of_the_given_model() -> None:
    setting = Setting("duffing", "second-order", grid=6)
    kan = build_kan([1, 1], grid=6, grid_range=(0.0, 5.0))
    network = NetworkLoss(setting, kan)
    assert network.kan is kan
    c = setting.unknowns()
    value, _ = IpdaObjective(setting, network.knots).value_and_gradient(c)
    assert network.value_and_gradient(c)[0] == pytest.approx(value, rel=1e-13)


def test_report_speaks_markdown_json_and_pictures(
    report: EquivalenceReport, tmp_path: Path
) -> None:
    assert report.passed and report.failures == ()
    text = report.to_markdown()
    assert "## What must differ" in text and "**no**" not in text
    assert json.loads(json.dumps(report.to_dict()))["passed"] is True
    figure = report.plot()
    assert len(figure.axes[0].lines) > 20
    page = report.write(tmp_path / "reports")
    assert "equivalence.png" in page.read_text(encoding="utf-8")
    assert sorted(p.name for p in page.parent.iterdir()) == ["equivalence.md", "equivalence.png"]


def test_the_same_seed_gives_the_same_numbers() -> None:
    """Grids, noise and unknowns of a setting, and what is checked with draws of its own."""
    def made(seed: int) -> list[np.ndarray]:
        s = Setting("duffing", "state", even=False, seed=seed)
        return [s.data_times, s.collocation_times, s.data, s.unknowns()]

    for once, again, other in zip(made(3), made(3), made(4), strict=True):
        np.testing.assert_array_equal(once, again)
        assert np.any(once != other)
    assert uniqueness(3) == uniqueness(3)


def test_every_check_says_what_it_compared(report: EquivalenceReport) -> None:
    for row in report.rows:
        assert all(isinstance(text, str) and text for text in
                   (row.check, row.setting, row.quantity)), row
    text = report.to_markdown()
    assert all(row.quantity in text for row in report.rows) and "\n## Every comparison\n" in text
    assert "| yes |" in text


def test_a_report_is_written_anew(report: EquivalenceReport, tmp_path: Path) -> None:
    first = report.write(tmp_path).read_text(encoding="utf-8")
    assert report.write(tmp_path).read_text(encoding="utf-8") == first


def test_ends_of_a_path() -> None:
    path = Path_(np.array([[0.0], [1.0], [2.0]]), True)
    assert path.last().iterates.tolist() == [[2.0]] and path.last().converged
    assert path.first(1).iterates.tolist() == [[0.0], [1.0]]


def test_a_failure_is_reported_as_one() -> None:
    nan = Check("a", "b", "c", float("nan"), 1e-12)
    silent = Check("a", "b", "d", 1e-9, 1e-3, must_differ=True)
    report = EquivalenceReport((nan, silent))
    assert report.failures == (nan, silent) and not report.passed
    assert "2 of 2 checks fail" in report.to_markdown() and "**no**" in report.to_markdown()


@pytest.mark.slow
def test_every_setting() -> None:
    report = run_checks(seed=1)
    assert report.passed, report.failures


def test_what_is_handed_over_is_compared_with_its_slope() -> None:
    found = delivered_curve()
    assert [r.quantity for r in found] == ["curve", "time derivative"] * 3
    assert all(r.passed for r in found)
