"""Walls hit dozens of times, found from far off by fits of longer and longer beginnings."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.catalogue.forces import wall_impact
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.extended import extended
from pikanid.mismatch.fitting.progressive_horizon import progressive_horizon, rough
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel
from pikanid.optimise.levenberg_marquardt import minimise

SIGMA = 0.002
TRUE = {"wall": 0.1, "k_wall": 20000.0}


def opened(seed: int, wall: float) -> tuple[Whitened, np.ndarray]:
    """Half a hundred impacts within 20 s, and where a fit begins."""
    model = pk.systems.sloshing()
    truth = model.with_term("theta_dot", "-20000*max(theta - 0.1, 0)")
    driven = pk.excitation.multisine(np.arange(1.0, 4.0, 0.17), 20.0, seed=seed)
    recording = pk.simulate(truth, driven, sigma=SIGMA, seed=seed)
    records = Records((recording,), ({"theta": NoiseModel(SIGMA, 0.0, 0.0, 0.01, "")},), DEFAULTS)
    effect = wall_impact(sites(model, records.recordings)[0])[0]
    whitened = Whitened(extended(model, [effect]), records)
    problem = whitened.problem
    begin = {"wall": wall, "k_wall": 14000.0, "d_theta": 1.3 * model.parameter("d_theta").value}
    theta = np.array([begin.get(f.name, f.guess) for f in problem.free])
    return whitened, theta


@pytest.mark.parametrize(("seed", "wall"), [(0, 0.05), (1, 0.07), (2, 0.13), (3, 0.16)])
def test_a_wall_is_found_from_far_off(seed: int, wall: float) -> None:
    whitened, theta = opened(seed, wall)
    effect = wall_impact(sites(pk.systems.sloshing(), whitened.records.recordings)[0])[0]
    found = progressive_horizon(whitened, [effect], theta)
    assert found is not None
    assert found.chi2 == pytest.approx(whitened.rows, abs=4 * np.sqrt(2 * whitened.rows))
    values = dict(zip([f.name for f in whitened.problem.free], found.theta, strict=True))
    assert values["wall"] == pytest.approx(TRUE["wall"], rel=0.01)
    assert values["k_wall"] == pytest.approx(TRUE["k_wall"], rel=0.1)
    # from the same place, the whole record leads nowhere
    problem = whitened.problem
    plain = minimise(whitened.residual, theta, problem.lower, problem.upper
                     ) if whitened.choose_steps(theta, misfit=1e4) else None
    assert plain is None or plain.chi2 > 3 * whitened.rows


def test_a_wall_is_found_where_the_motion_begins_late_and_gently() -> None:
    """The first beginnings say nothing of the wall, and would lead the other parameters away."""
    model, t = pk.systems.sloshing(), np.arange(2001) * 0.01
    truth = model.with_term("theta_dot", "-20000*max(theta - 0.15, 0)")
    driven = pk.excitation.multisine(np.arange(1.0, 4.0, 0.17), 20.0, seed=4)
    u = np.interp(t, driven["u_x"].time, driven["u_x"].values) * np.clip((t - 2) / 6, 0, 1)
    recording = pk.simulate(truth, pk.Recording.from_arrays(t, {"u_x": u}, {"u_x": "m/s^2"}),
                            sigma=SIGMA, seed=4)
    records = Records((recording,), ({"theta": NoiseModel(SIGMA, 0.0, 0.0, 0.01, "")},), DEFAULTS)
    effect = wall_impact(sites(model, records.recordings)[0])[0]
    whitened = Whitened(extended(model, [effect]), records)
    # as the nominal model's fit, misled by the impacts, may have left it
    begin = {"wall": 0.08, "k_wall": 10000.0, "l_theta": 0.047, "d_theta": 0.5}
    theta = np.array([begin.get(f.name, f.guess) for f in whitened.problem.free])
    found = progressive_horizon(whitened, [effect], theta)
    assert found is not None
    assert found.chi2 == pytest.approx(whitened.rows, abs=4 * np.sqrt(2 * whitened.rows))
    values = dict(zip([f.name for f in whitened.problem.free], found.theta, strict=True))
    assert values["wall"] == pytest.approx(0.15, rel=0.01)


def test_what_is_known_besides_counts() -> None:
    """A fit that knows one parameter firmly keeps it: then the beginning is not explained."""
    whitened, theta = opened(0, 0.1)
    k = [f.name for f in whitened.problem.free].index("wall")
    effect = wall_impact(sites(pk.systems.sloshing(), whitened.records.recordings)[0])[0]

    def known(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        row = np.zeros((1, len(at)))
        row[0, k] = 1e9
        return row[:, k] * (at[k] - 0.12), row

    assert progressive_horizon(whitened, [effect], theta, known) is None


def test_only_laws_with_hills_are_rough() -> None:
    model = pk.systems.sloshing()
    recording = pk.simulate(model, pk.excitation.two_pulse(), sigma=SIGMA, seed=0)
    wall = wall_impact(sites(model, (recording,))[0])
    assert rough(1300.0, 1000, wall, DEFAULTS) and not rough(1100.0, 1000, wall, DEFAULTS)
    assert not rough(1e9, 1000, [], DEFAULTS)
