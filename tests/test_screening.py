"""Answers to a force along a fitted trajectory: against the exact sensitivities of a fit."""

from __future__ import annotations

import numpy as np
from tanks import coarse

from pikanid.discrepancy.edges import OFFSET
from pikanid.discrepancy.screening import _mean_sign, spline_responses


def test_splines_answer_as_their_coefficients_do() -> None:
    level = coarse()
    exact = level.shooting.jacobian(level.fit.theta)[:, level.places[0]]
    found = spline_responses(level.shooting, level.fit.theta, "x", level.plans)
    np.testing.assert_allclose(found, exact, atol=0.01 * np.abs(exact).max())


def test_basis_functions_add_up_to_a_constant_force() -> None:
    level = coarse()
    labels = [f.label for f in level.problem.free]
    exact = level.shooting.jacobian(level.fit.theta)[:, labels.index(OFFSET)]
    found = spline_responses(level.shooting, level.fit.theta, "x", level.plans).sum(axis=1)
    np.testing.assert_allclose(found, exact, atol=0.01 * np.abs(exact).max())


def test_mean_sign_is_the_share_on_either_side() -> None:
    before = np.array([-1.0, 3.0, 2.0, 0.0, -2.0, 0.0])
    after = np.array([3.0, -1.0, 1.0, 2.0, 0.0, 0.0])
    np.testing.assert_allclose(_mean_sign(before, after), [0.5, 0.5, 1.0, 1.0, -1.0, 0.0])
    line = np.linspace(-1.0, 3.0, 100_001)
    assert abs(np.sign(line).mean() - 0.5) < 1e-4
