"""Minima of χ² of records: whole or beside what is known, and what a glance at rows counts as."""

from __future__ import annotations

import numpy as np
import pytest
from test_progressive_horizon import opened

from pikanid.mismatch.fitting.lowest import lowest
from pikanid.optimise.levenberg_marquardt import minimise


def test_rows_alone_are_those_with_derivatives_to_the_last_bit() -> None:
    whitened, theta = opened(0, 0.07)
    assert whitened.rows_alone(theta) is None  # no steps are known yet
    assert whitened.choose_steps(theta, misfit=1e4)
    both, alone = whitened.residual(theta), whitened.rows_alone(theta)
    assert both is not None and alone is not None
    np.testing.assert_array_equal(alone, both[0])
    assert whitened.chi2(theta) == pytest.approx(float(alone @ alone), rel=1e-12)


def test_a_simulation_counts_once_with_and_without_derivatives() -> None:
    whitened, theta = opened(0, 0.1)
    assert whitened.choose_steps(theta, misfit=1e4)
    whitened.rows_alone(theta)
    whitened.residual(theta)
    assert whitened.work == whitened.cost
    whitened.residual(theta.copy())
    assert whitened.work == 2 * whitened.cost


def test_a_fit_ends_where_one_with_all_derivatives_does() -> None:
    whitened, theta = opened(1, 0.07)
    assert whitened.choose_steps(theta, misfit=1e4)
    problem, limit = whitened.problem, whitened.settings.budget.iterations
    plain = minimise(whitened.residual, theta, problem.lower, problem.upper, limit,
                     sizes=whitened.sizes)
    before, whitened.work = whitened.work, 0.0
    quick = lowest(whitened, theta, limit)
    assert plain is not None and quick is not None
    np.testing.assert_array_equal(quick.theta, plain.theta)
    np.testing.assert_array_equal(quick.J, plain.J)
    assert whitened.work == before


def test_bounds_and_what_is_known_besides_hold() -> None:
    whitened, theta = opened(0, 0.1)
    assert whitened.choose_steps(theta, misfit=1e4)
    names = [f.name for f in whitened.problem.free]
    upper = whitened.problem.upper.copy()
    upper[names.index("d_theta")] = theta[names.index("d_theta")]
    row = np.zeros((1, len(theta)))
    row[0, names.index("wall")] = 1e9
    found = lowest(whitened, theta, 30, upper=upper,
                   besides=lambda at: (row @ (at - theta), row))
    assert found is not None and len(found.r) == whitened.rows + 1
    values = dict(zip(names, found.theta, strict=True))
    assert values["wall"] == pytest.approx(0.1, abs=1e-6)
    assert values["d_theta"] <= theta[names.index("d_theta")]
