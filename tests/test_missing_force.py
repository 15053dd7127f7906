"""The shape of a missing force, the end set aside, and what to record next."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.beyond.force_shape import ForceShape, force_shape
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.model import Model, Parameter, systems
from pikanid.recording import excitation

SIGMA = 0.1 * np.pi / 180
FRICTION = systems.sloshing().with_term(
    "theta_dot", "-c*sign(theta_dot)", [Parameter("c", 0.5)])


def recording(truth: Model, seed: int = 3) -> pk.Recording:
    return pk.simulate(truth, excitation.planar_moves(10, 20.0, seed=seed), sigma=SIGMA, seed=seed)


def shape(truth: Model) -> ForceShape:
    opened = open_case(systems.sloshing(), (recording(truth),), None, None,
                       lambda text: None, DEFAULTS)
    return force_shape(opened.base, opened.sites[0], opened.candidates)


@pytest.mark.parametrize(("term", "argument"), [
    ("-0.2*sign(theta_dot)", "theta_dot"), ("-30*theta**3", "theta"),
    pytest.param("-abs(theta_dot)*theta_dot", "theta_dot", marks=pytest.mark.slow)])
def test_a_static_law_is_found_over_its_own_state(term: str, argument: str) -> None:
    found = shape(systems.sloshing().with_term("theta_dot", term))
    assert found.depends_on(DEFAULTS) == (argument,)
    assert [e.argument for e in found.edges] == ["theta", "theta_dot", "u_x"]


@pytest.mark.slow
def test_a_lag_is_not_taken_for_a_static_law() -> None:
    lagging = systems.sloshing().map_input("u_x", [Parameter("tau", 0.004)], lag="tau")
    assert shape(lagging).static_law is None


def test_nothing_missing_has_no_shape() -> None:
    found = shape(systems.sloshing())
    assert found.depends_on(DEFAULTS) == () and found.static_law


@pytest.mark.slow
def test_edge_of_drag_bends_against_the_motion() -> None:
    """Without its straight line, -v|v| rises on the left and falls on the right of its middle."""
    edge = shape(systems.sloshing().with_term("theta_dot", "-abs(theta_dot)*theta_dot")).edges[1]
    left, right = edge.values[0], edge.values[-1]
    assert left > 0 and right < -5 * edge.std[-1]


@pytest.mark.slow
def test_without_held_out_the_end_has_to_be_predicted() -> None:
    dx = pk.diagnose(systems.sloshing(), recording(FRICTION))
    assert dx.verdict == "unconfirmed"
    assert dx.hypotheses[0].effects[0].ids == ("coulomb_friction",)
    assert dx.held_out is not None and dx.held_out.rmse_after < 0.3 * dx.held_out.rmse_before
    assert dx.held_out.curves["theta"].t.min() >= 13.9  # of 20 s
    assert "held-out" in dx.next_experiment and dx.shape is not None
    assert dx.force_over_time is not None and dx.where.time == dx.force_over_time.windows
    assert len(dx.plot().subfigs) == 3
    edge = next(e for e in dx.shape.edges if e.argument == "theta_dot")
    assert edge.law is not None  # what is given looks as what was read off the recording
    assert np.all(np.abs(edge.law - edge.values) < 4 * edge.std)
    assert np.std(edge.law) > 4 * np.mean(edge.std)
