"""How held-out recordings are judged: what uncertainty costs, and all recordings together."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.extended import extended
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.lowest import lowest
from pikanid.mismatch.judge import prediction, together
from pikanid.mismatch.judge.doubt import worth
from pikanid.mismatch.judge.prediction import held_out
from pikanid.mismatch.judge.prior import Prior, room
from pikanid.mismatch.judge.together import _from_levels
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.optimise.levenberg_marquardt import Minimum, minimise


def prior(root: np.ndarray) -> Prior:
    n = len(root)
    return Prior(root, np.zeros(n), np.zeros(n), 0.0, np.zeros(n), np.eye(n), tuple(range(n)))


def test_uncertainty_costs_how_much_narrower_a_recording_makes_it() -> None:
    root, rng = np.diag([2.0, 5.0]), np.random.default_rng(0)
    later = rng.standard_normal((40, 2))
    J = np.vstack([later, root])
    expected = np.log(np.linalg.det(root.T @ root + later.T @ later) / np.linalg.det(root.T @ root))
    assert room(J, [0, 1], prior(root)) == pytest.approx(expected, rel=1e-9)


def test_what_a_recording_has_for_itself_costs_the_same_in_any_unit() -> None:
    root, rng = np.diag([2.0]), np.random.default_rng(1)
    J = np.vstack([rng.standard_normal((40, 3)), np.zeros((1, 3))])
    J[-1, 0] = 2.0
    one = room(J, [0], prior(root))
    J[:, 1:] *= [57.3, 1e-3]
    assert room(J, [0], prior(root)) == pytest.approx(one, rel=1e-9)
    # two more parameters of its own cost twice the logarithm of its rows
    assert one - room(J[:, :1], [0], prior(root)) == pytest.approx(2 * np.log(41), abs=1.0)


def test_a_law_that_tells_nothing_far_from_its_estimates_gains_nothing_there() -> None:
    J = np.zeros((41, 1))  # as of a limit that is never met
    assert room(J, [0], prior(np.array([[3.0]]))) == 0.0


def test_what_shows_more_elsewhere_was_known_better_there_as_well() -> None:
    """Where all of a parameter shows a million times as much, a fit would have known it as much
    better; of what is hardly narrower nobody asks.
    """
    later, root = np.random.default_rng(3).standard_normal((40, 2)), np.diag([6.0, 7.0])
    usual = np.vstack([later, root])
    scales = np.array([1e6, 1.0])
    moved = np.vstack([later * scales, root])
    assert room(moved, [0, 1], prior(root)) > 20
    assert room(moved, [0, 1], prior(root), lambda: prior(root * scales)) == pytest.approx(
        room(usual, [0, 1], prior(root)), rel=1e-9)

    def asked() -> Prior:
        raise AssertionError

    assert 0 < room(usual, [0, 1], prior(root), asked) < 2


def opened(size: float) -> Case:
    """The nominal pendulum, on two recordings of one with a spring that stiffens."""
    model = pk.systems.sloshing()
    truth = model.with_term("theta_dot", "-k3*theta**3", [pk.Parameter("k3", size)])
    train, later = (pk.simulate(truth, pk.excitation.planar_moves(6, 10.0, seed=seed),
                                sigma=0.002, seed=seed) for seed in (1, 2))
    return open_case(model, (train,), (later,), None, lambda text: None, DEFAULTS)


def test_what_is_weak_in_each_recording_adds_up() -> None:
    case = opened(4.0)
    predicted = case.predicted(case.base)
    assert predicted is not None and predicted.together is not None
    apart = case.test(case.base).p_value, predicted.detection.p_value
    assert min(apart) > 0.01 and predicted.together.p_value < 0.001


def test_a_wall_that_a_fit_to_all_recordings_has_lost_is_found_again() -> None:
    """Met once in one recording, never in the other: where it does not act, nothing leads back."""
    model, t = pk.systems.sloshing(), np.arange(1001) * 0.01
    truth = model.with_term("theta_dot", "-5000*max(theta - 0.238, 0)")

    def pushed(size: float) -> pk.Recording:
        u = np.where((t > 1) & (t < 1.1), size, 0.0)
        driven = pk.Recording.from_arrays(t, {"u_x": u}, {"u_x": "m/s^2"})
        return pk.simulate(truth, driven, sigma=0.0005, seed=int(100 * size))

    case = open_case(model, (pushed(2.0), pushed(1.9)), None, None, lambda text: None, DEFAULTS)
    wall = next(c for c in case.candidates if c.key == "wall_impact")
    whitened = Whitened(extended(case.model, [wall]), case.records)
    far = np.array([{"wall": 0.4, "k_wall": 30.0}.get(f.name, f.guess)
                    for f in whitened.problem.free])
    assert whitened.choose_steps(far)
    lost = minimise(whitened.residual, far, whitened.problem.lower, whitened.problem.upper)
    assert lost is not None and lost.chi2 > 2 * whitened.rows
    one = fitted(case.model, [wall], case.records, [{"wall": 0.23, "k_wall": 3000.0}], 40)
    assert one is not None
    found = _from_levels(whitened, one, lost)
    assert found.chi2 == pytest.approx(whitened.rows, abs=4 * np.sqrt(2 * whitened.rows))


def test_nothing_adds_up_where_nothing_is_missing() -> None:
    case = opened(0.0)
    predicted = case.predicted(case.base)
    assert predicted is not None and predicted.together is not None
    assert predicted.together.p_value > 0.01
    # all parameters are shared: the joint fit has as many degrees of freedom as each
    assert predicted.together.power == pytest.approx(
        case.base.whitened.rows + len(predicted.rest), rel=0.1)


def test_no_prediction_counts_on_a_better_fit_of_the_first_recording() -> None:
    """A fit that stopped short of its minimum must not be credited with what it would still gain.
    """
    case = opened(4.0)
    h = case.base
    theta = h.minimum.theta * [1.01, 1.0]
    at = h.whitened.residual(theta)
    assert at is not None
    short = replace(h, minimum=replace(h.minimum, theta=theta, r=at[0], J=at[1]))
    assert short.minimum.chi2 > h.minimum.chi2 + 1000
    whole, later = case.predicted(h), case.predicted(short)
    assert whole is not None and later is not None
    assert later.chi2 > whole.chi2 - 1


@pytest.mark.parametrize(("depth", "seed"), [(0.97, 2), (0.985, 4), (0.99, 1)])
def test_a_wall_that_was_hardly_touched_predicts_a_hard_hit(depth: float, seed: int) -> None:
    """From there its stiffness is known within a factor of ten, and of no use as a straight line:
    without a fit of both recordings the misfit of the second one is 12 to 2000 times the noise.
    """
    train = pk.excitation.two_pulse()
    later = train.with_channels(replace(train["u_x"], values=1.5 * train["u_x"].values))
    top = float(np.max(pk.simulate(pk.systems.sloshing(), train)["theta"].values))
    truth = pk.systems.sloshing().with_term("theta_dot", f"-6000*max(theta - {depth * top}, 0)")
    seen = [pk.simulate(truth, r, sigma=0.0017, seed=seed + k)
            for k, r in enumerate((train, later))]
    case = open_case(pk.systems.sloshing(), (seen[0],), (seen[1],), None,
                     lambda text: None, DEFAULTS)
    wall = next(c for c in case.candidates if c.key == "wall_impact")
    begin = {"wall": 0.95 * depth * top, "k_wall": 60.0, "l_theta": 0.045, "d_theta": 0.15}
    found = fitted(case.model, [wall], case.records, [begin], 30)
    assert found is not None and case.later is not None
    predicted = held_out(found, case.model, case.later, case.candidates, case.rate)
    assert predicted is not None
    # noise, and what the move costs the first recording
    assert predicted.chi2 < 501 + 4 * np.sqrt(2 * 501)
    assert predicted.rmse_moved["theta"] == pytest.approx(0.0017, rel=0.1)


def test_settings_bound_the_fits_to_held_out_recordings(monkeypatch: pytest.MonkeyPatch) -> None:
    limits: list[int] = []

    def watched(whitened: Whitened, start: np.ndarray, limit: int, **more: Any) -> Minimum | None:
        limits.append(limit)
        return lowest(whitened, start, limit, **more)

    for module in (prediction, together):
        monkeypatch.setattr(module, "lowest", watched)
    own = DEFAULTS.with_values({"budget.held_out": 4, "budget.beginnings": 5})
    model = pk.systems.sloshing().with_initial(theta="free")
    train, later = (pk.simulate(model, pk.excitation.planar_moves(3, 5.0, seed=seed),
                                sigma=0.002, seed=seed) for seed in (1, 2))
    case = open_case(model, (train,), (later,), None, lambda text: None, own)
    predicted = case.predicted(case.base)
    assert predicted is not None and set(limits) == {4, 5}
    limits.clear()
    assert predicted.together is not None and limits == [4]


def test_what_holds_a_rig_at_rest_is_not_idle() -> None:
    """Nothing acts there, but without friction the rig would move."""
    model = pk.systems.sloshing()
    rig = model.with_term("theta_dot", "-2*sign(theta_dot)")
    t = np.arange(800) / 100
    weak = pk.Recording.from_arrays(t, {"u_x": 0.05 * np.sin(3 * t)}, {"u_x": "m/s^2"})
    train, later = (pk.simulate(rig, run, sigma=0.002, seed=seed) for seed, run in enumerate((
        pk.excitation.planar_moves(8, 10.0, seed=1), weak)))
    case = open_case(model, (train,), (later,), None, lambda text: None, DEFAULTS)
    friction = next(c for c in case.candidates if c.key == "coulomb_friction")
    found = fitted(case.model, [friction], case.records, [{"c": 1.8}], 30)
    assert found is not None and found.values["c"] == pytest.approx(2.0, abs=0.1)
    held, moved = (case.predicted(h) for h in (found, case.base))
    assert held is not None and moved is not None and held.motion < 1.0 and not held.acts
    assert worth(friction, held, moved) > 10 * DEFAULTS.least_proof
    # where no model without it can be run, that there is a motion is all that can be seen
    assert worth(friction, held, None) == held.motion and worth(friction, None, moved) == 0.0
