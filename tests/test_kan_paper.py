"""Table II's PIKAN: it stops where L-BFGS stops, and says how far from a minimum that is."""

from __future__ import annotations

import numpy as np
import pytest
from relaxing import guessed, random_point, slosh

pytest.importorskip("torch", reason="needs the `kan` extra")
pytest.importorskip("kan.MultKAN", reason="needs the `kan` extra")

from pikanid.strategies.pikan import PIKAN

pytestmark = pytest.mark.kan


@pytest.fixture(scope="module")
def estimate():  # type: ignore[no-untyped-def]
    return PIKAN(protocol="paper").fit(guessed(), slosh(0.1))


def test_settings_are_those_of_the_table(estimate) -> None:  # type: ignore[no-untyped-def]
    assert [row["lam"] for row in estimate.history] == [0.0, 0.05, 0.1, 1.0]
    assert estimate.settings["degree"] == 3 and estimate.settings["intervals"] == 40
    assert estimate.settings["physics"] == "sum" and estimate.settings["lam"] == 1.0
    assert estimate.history[-1]["iterations"] <= 500
    assert estimate.approximator.kan.grid == 40


def test_gradient_at_the_stop_is_reported(estimate) -> None:  # type: ignore[no-untyped-def]
    assert estimate.settings["gradient_norm"] > 0.0
    assert estimate.settings["steps"] == estimate.history[-1]["iterations"]
    stopped = any("L-BFGS" in note for note in estimate.warnings)
    assert stopped != (estimate.settings["steps"] < 500)


def test_a_fit_of_the_papers_kind_is_no_success(estimate) -> None:  # type: ignore[no-untyped-def]
    """At λ = 1 and G = 40 the minimiser lies far away; the verdict says so."""
    assert estimate.adequacy.verdict == "misfit"
    assert np.all(np.isfinite(estimate.theta))


def test_deterministic(estimate) -> None:  # type: ignore[no-untyped-def]
    again = PIKAN(protocol="paper").fit(guessed(), slosh(0.1))
    assert np.array_equal(again.theta, estimate.theta)


def test_gradient_of_the_descent_is_that_of_the_jacobian() -> None:
    from pikanid.problem.chains import find_chains
    from pikanid.problem.problem import Problem
    from pikanid.simulation.vectorfield import VectorField
    from pikanid.strategies.kan_grids import KanGrid
    from pikanid.strategies.kan_paper import cost_and_gradient
    from pikanid.strategies.relaxation import Setup

    problem = Problem(guessed(), [slosh(0.1), slosh(1.0, seed=1)])
    for form in ("second_order", "state"):
        setup = Setup(problem, VectorField(problem.model), find_chains(problem.model, form),
                      given_start=True, weighted=False, nondimensional=False)
        functional = setup.functional(KanGrid(10, 3, False, "sum"))
        at = random_point(functional, 3)
        residual = functional.residual(at.coefficients, at.theta, 0.3)
        jacobian = functional.jacobian(at.coefficients, at.theta, 0.3)
        value, gradient = cost_and_gradient(functional, at, 0.3)
        assert np.isclose(value, residual @ residual, rtol=1e-12)
        wanted = 2 * jacobian.T @ residual
        assert np.allclose(gradient, wanted, rtol=1e-10, atol=1e-12 * np.abs(wanted).max())
