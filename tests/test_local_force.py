"""A force without a name that acts in one region of a state only."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.beyond.force_shape import ForceShape, force_shape
from pikanid.mismatch.beyond.local_force import (
    ABOVE,
    ALIKE,
    BELOW,
    Local,
    LocalForce,
    local_force,
)
from pikanid.mismatch.case import Case
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.report.findings import Where
from pikanid.mismatch.report.locate import locate
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.model import systems
from pikanid.simulation.vectorfield import VectorField
from pikanid.symbolic.curve import Curve
from pikanid.validation.concealed.acting import closed, spans
from pikanid.validation.concealed.where import Region, f1, inside, intersection_over_union

MODEL = systems.sloshing()


def test_a_fit_begins_where_a_curve_bends() -> None:
    x = np.linspace(-0.2, 0.1, 120)  # scaled by the largest, 0.2
    force = LocalForce("theta", -0.2, 0.1, (BELOW, ABOVE), MODEL)
    z = x / 0.2
    start = force.start(Curve.of_points(
        x, 3 * np.maximum(z - 0.2, 0) - 2 * np.maximum(-0.5 - z, 0)**2))
    assert [start[force.places[ABOVE]], *(start[force.names[ABOVE][k]] for k in (1, 2))
            ] == pytest.approx([0.2, 3.0, 0.0], abs=0.05)
    assert [start[force.places[BELOW]], *(start[force.names[BELOW][k]] for k in (1, 2))
            ] == pytest.approx([-0.5, 0.0, -2.0], abs=0.05)
    assert force.ends(start) == pytest.approx((-0.1, 0.04))
    chosen = force.start(Curve.of_points(x, 0 * x), (-0.3, 0.6))
    assert (chosen[force.places[BELOW]], chosen[force.places[ABOVE]]) == (-0.3, 0.6)


def test_one_side_leaves_the_other_to_the_end_of_the_range() -> None:
    force = LocalForce("theta", -0.1, 0.2, (ABOVE,), MODEL)
    assert force.ends({force.places[ABOVE]: 0.25}) == pytest.approx((-0.1, 0.05))
    columns = force.matrix(np.array([-1.0, 0.2, 1.0]), {ABOVE: 0.2})
    np.testing.assert_allclose(columns, [[0, 0], [0, 0], [0.8, 0.64]], atol=1e-12)
    assert force.with_powers(2).matrix(np.ones(1), {ABOVE: 0.2}) == pytest.approx(0.64)


def test_alike_on_both_sides_of_zero_is_odd() -> None:
    force = LocalForce("theta", -0.3, 0.2, (ALIKE,), MODEL)
    z = np.linspace(-1, 1, 41)
    columns = force.matrix(z, {ALIKE: 0.5})
    np.testing.assert_allclose(columns, -columns[::-1], atol=1e-12)
    np.testing.assert_allclose(columns[:, 0], np.sign(z) * np.maximum(np.abs(z) - 0.5, 0))
    np.testing.assert_allclose(columns[:, 1], np.sign(z) * np.maximum(np.abs(z) - 0.5, 0)**2)
    assert force.ends({force.places[ALIKE]: 0.5}) == pytest.approx((-0.15, 0.15))
    # no further than the motion
    assert force.ends({force.places[ALIKE]: 0.9}) == pytest.approx((-0.27, 0.2))
    start = force.start(Curve.of_points(0.3 * z, 4 * columns[:, 0]))
    assert start[force.places[ALIKE]] == pytest.approx(0.5)
    assert start[force.names[ALIKE][1]] == pytest.approx(4.0)


@pytest.mark.parametrize("side", [ABOVE, BELOW, ALIKE])
def test_what_is_fitted_is_what_is_drawn(side: str) -> None:
    """The formula that is simulated against the columns that a fit begins with."""
    case = opened()
    (site,) = case.sites
    force = LocalForce("theta", -0.3, 0.2, (side,), MODEL)
    values = {force.places[side]: -0.4 if side == BELOW else 0.4,
              force.names[side][1]: 2.0, force.names[side][2]: -3.0}
    model = force.candidate(site).applied(MODEL).with_values(values)
    theta = np.linspace(-0.3, 0.3, 31)
    x, u = np.column_stack([theta, 0 * theta]), np.zeros((31, len(MODEL.inputs)))
    both = [VectorField(m).rhs(0 * theta, x, u, np.array([m.values[n] for n in m.parameter_names]))
            for m in (model, MODEL)]
    np.testing.assert_allclose(
        (both[0] - both[1])[:, 1],
        force.matrix(theta / 0.3, {side: values[force.places[side]]}) @ [2.0, -3.0], atol=1e-9)


def test_names_do_not_clash_with_those_of_the_model() -> None:
    taken = MODEL.with_parameters(pk.Parameter("local_above", 1.0))
    force = LocalForce("theta", -1.0, 1.0, (ABOVE,), taken)
    assert not {*force.names[ABOVE].values(), *force.places.values()} & set(taken.symbols)


@cache
def opened() -> Case:
    seen = pk.simulate(MODEL, pk.excitation.two_pulse(), sigma=0.002, seed=0)
    return open_case(MODEL, (seen,), None, None, lambda text: None, DEFAULTS)


@cache
def found(term: str) -> tuple[Local | None, Where, dict[str, np.ndarray]]:
    truth = MODEL.with_term("theta_dot", term) if term else MODEL
    moves = pk.excitation.planar_moves(10, 20.0, seed=5)
    seen = pk.simulate(truth, moves, sigma=0.002, seed=5)
    case = open_case(MODEL, (seen,), None, None, lambda text: None, DEFAULTS)
    shape = force_shape(case.base, case.sites[0], case.candidates)
    local = local_force(case.base, case.model, shape, case.sites[0])
    if local is not None:  # a law of that very region is no better
        assert local_force(case.base, case.model, shape, case.sites[0], local.hypothesis)
    where = locate(case.base, case.base, Answer("unnamed", (), ()), case.sites[0], shape, None,
                   case.candidates, local)
    clean = pk.simulate(truth, moves)["theta"]
    return local, where, {"theta": clean.values, "theta_dot": np.gradient(clean.values, clean.time)}


@pytest.mark.slow
@pytest.mark.parametrize(("term", "argument", "place"), [
    ("-12*max(theta_dot - 0.8, 0)", "theta_dot", 0.8),
    ("-400*max(theta - 0.06, 0)", "theta", 0.06)])
def test_the_region_is_found_and_the_parameters_beside_it(
        term: str, argument: str, place: float) -> None:
    local, where, motion = found(term)
    assert local is not None
    regions = [Region(i.state, i.low, i.high) for i in local.intervals]
    acts = motion[argument] > place
    assert 0.02 < acts.mean() < 0.5 and {i.state for i in local.intervals} == {argument}
    assert f1(inside(regions, motion), acts) > 0.9
    # a region of that size somewhere else says nothing
    shuffled = np.random.default_rng(0).permutation(inside(regions, motion))
    assert f1(shuffled, acts) < 0.6
    assert where.region == local.intervals
    for name, true in (("l_theta", 0.045), ("d_theta", 0.15)):
        value = where.parameters[name]
        assert abs(value.value - true) < 4 * value.std < 0.1 * true
    # windows of a force that comes and goes within a period are one
    t = np.linspace(0.0, 20.0, len(acts))
    fitted = t < 14.0  # the rest is set aside, to be predicted
    period = 2 * np.pi / (9.81 / 0.045)**0.5
    true_time = closed(spans(t[fitted], acts[fitted]), period)
    assert intersection_over_union(closed(where.time, period), true_time) > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("term", [
    "", "-60*theta**3", "-abs(theta_dot)*theta_dot", "8*u_x**2"])
def test_a_law_that_acts_always_has_none(term: str) -> None:
    local, where, _ = found(term)
    assert local is None and where.region == () and not where.parameters


def test_without_edges_nothing_is_said() -> None:
    case = opened()
    nothing = ForceShape((), "rad/s^2", None)
    assert local_force(case.base, case.model, nothing, case.sites[0]) is None
