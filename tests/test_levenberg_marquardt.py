"""Least squares within bounds: against SciPy, at walls, and where nothing is determined."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from pikanid.optimise.levenberg_marquardt import Minimum, Rows, descend, minimise


@pytest.mark.parametrize("seed", range(10))
def test_linear_problems_in_a_box_are_solved_as_by_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    A, b = rng.normal(size=(20, 4)), 3 * rng.normal(size=20)
    lower, upper = -rng.uniform(0, 0.5, 4), rng.uniform(0, 0.5, 4)
    found = descend(lambda q: Rows(A @ q - b, A), np.zeros(4), lower, upper, 30,
                    lambda at: 1e-12 * at.cost)
    assert found is not None and found.converged
    np.testing.assert_allclose(found.theta, lsq_linear(A, b, (lower, upper)).x, atol=1e-6)
    at_wall = (found.theta == lower) | (found.theta == upper)
    assert at_wall.any()  # exactly, not up to rounding


def valley(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rosenbrock's, a bent one."""
    return (np.array([10 * (q[1] - q[0] ** 2), 1 - q[0]]),
            np.array([[-20 * q[0], 10.0], [-1.0, 0.0]]))


def test_a_bent_valley_is_followed_to_its_end() -> None:
    none = np.full(2, np.inf)
    found = descend(lambda q: Rows(*valley(q)), np.array([-1.2, 1.0]), -none, none, 100,
                    lambda at: 1e-20)
    assert found is not None and found.converged
    np.testing.assert_allclose(found.theta, 1.0, atol=1e-8)


def test_a_glance_saves_derivatives_and_leads_to_the_same_minimum() -> None:
    none, full, glances = np.full(2, np.inf), [0, 0], 0

    def evaluate(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        full[-1] += 1
        return valley(q)

    def glance(q: np.ndarray) -> np.ndarray:
        nonlocal glances
        glances += 1
        return valley(q)[0]

    start = np.array([-1.2, 1.0])
    plain = minimise(evaluate, start, -none, none, 100, tolerance=1e-12)
    full.append(0)
    quick = minimise(evaluate, start, -none, none, 100, tolerance=1e-12, glance=glance)
    assert plain is not None and quick is not None
    assert glances > 0 and full[-1] < full[-2]
    np.testing.assert_array_equal(quick.theta, plain.theta)
    np.testing.assert_array_equal(quick.J, plain.J)


def test_a_glance_that_promises_more_than_there_is_leads_nowhere() -> None:
    """Where no derivatives are, no step is taken."""
    none = np.full(2, np.inf)

    def evaluate(q: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        return valley(q) if q[0] == -1.2 else None

    found = minimise(evaluate, np.array([-1.2, 1.0]), -none, none, glance=lambda q: valley(q)[0])
    assert found is not None and not found.converged
    np.testing.assert_array_equal(found.theta, [-1.2, 1.0])


def test_a_parameter_with_equal_bounds_stays() -> None:
    found = minimise(valley, np.array([-1.0, 0.25]), np.array([-2.0, 0.25]), np.array([2.0, 0.25]),
                     100, tolerance=1e-12)
    assert found is not None and found.theta[1] == 0.25
    grid = np.linspace(-2, 2, 4001)
    least = grid[np.argmin([float(np.sum(valley(np.array([x, 0.25]))[0] ** 2)) for x in grid])]
    # two rows: a tenth of what they leave is not worth a step
    assert abs(found.theta[0]) == pytest.approx(abs(least), abs=0.1)


def test_what_the_data_do_not_tell_does_not_move_the_rest() -> None:
    """Two alike columns and an empty one: the fit is found, the undetermined stays finite."""
    A = np.column_stack([np.ones(5), np.ones(5), np.zeros(5), np.arange(5.0)])
    b = 2.0 + 3.0 * np.arange(5.0)
    wide = np.full(4, 1e6)
    found = descend(lambda q: Rows(A @ q - b, A), np.zeros(4), -wide, wide, 50, lambda at: 1e-15)
    assert found is not None
    assert found.at.cost < 1e-10 and found.theta[3] == pytest.approx(3.0)
    assert found.theta[2] == 0.0 and found.theta[0] + found.theta[1] == pytest.approx(2.0)


@pytest.mark.parametrize(("sizes", "found"), [(None, False), (np.array([np.inf, 2.0]), True)])
def test_a_step_stays_where_a_parameter_has_its_order_of_magnitude(sizes: np.ndarray | None,
                                                                   found: bool) -> None:
    """The second parameter hardly shows, and a stiff one cannot be simulated: without its size all
    steps go there, until hardly any step is left for the first.
    """
    def shaft(q: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        if not 0.0 < q[1] < 20.0:
            return None
        slope = np.array([[1e3 * np.exp(-q[0]), 0.0], [-1e3 * np.exp(-q[0]), 0.0], [0.0, 1e-4]])
        return np.array([1e3 * (np.exp(-1.0) - np.exp(-q[0])), 1e3 * (np.exp(-q[0])
                         - np.exp(-1.0)), 1e-4 * q[1] - 10.0]), slope

    end = minimise(shaft, np.array([4.0, 2.0]), np.zeros(2), np.full(2, 1e9), 8, sizes=sizes)
    assert end is not None and bool(abs(end.theta[0] - 1.0) < 1e-3) is found


def test_no_start_and_no_step() -> None:
    box = np.zeros(1), np.ones(1)
    assert minimise(lambda q: None, np.zeros(1), *box) is None

    def only_here(q: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        return (np.full(2000, 9.0), np.full((2000, 1), -1.0)) if q[0] == 0 else None

    lost = minimise(only_here, np.zeros(1), *box)
    assert lost is not None and not lost.converged and lost.theta[0] == 0.0


@pytest.mark.parametrize(("patience", "most"), [(None, 200), (6, 8)])
def test_a_fit_is_given_up_when_asked_to(patience: int | None, most: int) -> None:
    """Steps of a twentieth of the way leave nine tenths of the cost each."""
    calls = 0

    def slow(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        nonlocal calls
        calls += 1
        return np.full(50, 10.0 - q[0]), np.full((50, 1), -20.0)

    def give_up(count: int, last: float, cost: float) -> bool:
        assert 0.8 * last < cost < last
        return patience is not None and count >= patience

    found = minimise(slow, np.zeros(1), np.full(1, -99.0), np.full(1, 99.0), 150, give_up=give_up)
    assert found is not None
    assert (found.chi2 < 1.0) == (patience is None)
    assert 7 <= calls <= most


def test_what_a_bound_holds_takes_nothing_up() -> None:
    r, J = np.array([1.0, 2.0]), np.array([[1.0, 1.0], [0.5, -2.0]])  # slopes 2 and -3
    found = Minimum(np.array([0.0, 1.0]), r, J, True)
    low, high = np.zeros(2), np.ones(2)
    assert found.movable(low, high).tolist() == [[0.0, 0.0], [0.0, 0.0]]
    inside = Minimum(np.array([0.5, 1.0]), r, J, True)
    assert inside.movable(low, high).tolist() == [[1.0, 0.0], [0.5, 0.0]]
    pulled_off = Minimum(np.array([1.0, 0.0]), r, J, True)  # χ² falls inwards
    assert pulled_off.movable(low, high).tolist() == J.tolist()


@pytest.mark.parametrize(("steep", "start"), [(1e2, [4.0, 16.0]), (1e3, [0.0, 0.0]),
                                              (1e4, [0.0, 0.0])])
def test_a_step_that_failed_shows_how_a_valley_bends(steep: float, start: list[float]) -> None:
    calls = 0

    def bent(q: np.ndarray) -> Rows:
        nonlocal calls
        calls += 1
        return Rows(np.array([steep * (q[1] - q[0] ** 2), 1 - q[0]]),
                    np.array([[-2 * steep * q[0], steep], [-1.0, 0.0]]))

    none, needed, ends = np.full(2, np.inf), [], []
    for bend in (Rows.bend, None):
        calls = 0
        found = descend(bent, np.array(start), -none, none, 300, lambda at: 1e-16, bend=bend)
        assert found is not None
        needed.append(calls)
        ends.append(float(np.abs(found.theta - 1.0).max()))
    assert ends[0] < 1e-6
    assert needed[0] < 0.75 * needed[1] or ends[1] > 0.5  # which never gets there


def test_a_step_to_where_squares_overflow_is_none() -> None:
    """An unstable model grows beyond what can be squared, and no warning is given."""
    def growing(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        # flatter where it begins than on the way, so that the first step goes to 4
        return (q - 1.0 if q[0] < 2.0 else np.array([1e170])), np.array([[0.25]])

    found = minimise(growing, np.zeros(1), np.full(1, -9.0), np.full(1, 9.0), 60)
    assert found is not None and found.chi2 < 0.1
    assert minimise(growing, np.full(1, 3.0), np.full(1, 2.5), np.full(1, 9.0)) is None
