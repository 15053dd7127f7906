"""Where a law acts: the same one elsewhere is a rival, fitted from where the answer stands."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.fitting.descent import Start
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.search.places import elsewhere
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case

STEP, HOLD, COUNT = 0.01, 30, 1000
J_M, J_L, K, D, B, LOAD = 0.016, 0.02, 12.0, 0.02, 0.011, -20.0


def angles(torque: np.ndarray) -> np.ndarray:
    """(N, 2) of a motor and a load [rad] whose shaft is soft; a constant force accelerates the load
    by `LOAD` [rad/s²].  Exact between samples.
    """
    dynamics = np.zeros((6, 6))  # both angles, both speeds, torque, one
    dynamics[0, 2] = dynamics[1, 3] = 1.0
    shaft = np.array([K, -K, D, -D, 0.0, 0.0])
    dynamics[2] = (np.array([0.0, 0.0, -B, 0.0, 1.0, 0.0]) - shaft) / J_M
    dynamics[3] = (np.array([0.0, 0.0, 0.0, -B, 0.0, J_L * LOAD]) + shaft) / J_L
    whole = expm(dynamics * STEP)
    state, seen = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0]), []
    for u in torque:
        state[4] = u
        seen.append(state[:2].copy())
        state = whole @ state
    return np.array(seen)


def opened(sigma: float) -> Case:
    def recorded(seed: int) -> pk.Recording:
        rng = np.random.default_rng(seed)
        torque = np.repeat(rng.uniform(-1.0, 1.0, -(-COUNT // HOLD)), HOLD)[:COUNT]
        y = angles(torque) + sigma * rng.standard_normal((COUNT, 2))
        return pk.Recording.from_arrays(
            STEP * np.arange(COUNT), {"tau": torque, "phi_m": y[:, 0], "phi_l": y[:, 1]},
            {"tau": "N*m", "phi_m": "rad", "phi_l": "rad"})

    return open_case(pk.systems.two_mass_drive(), (recorded(1),), (recorded(2),), None,
                     lambda text: None, DEFAULTS)


def fit(case: Case, effect: Candidate, start: Start | dict[str, float]) -> Hypothesis:
    found = fitted(case.model, [effect], case.records, [start], 30)
    assert found is not None
    return found


@pytest.mark.parametrize(("sigma", "told"), [(2.6, False), (0.02, True)])
def test_the_same_force_on_the_other_mass_is_a_rival(sigma: float, told: bool) -> None:
    """At coarse noise the shaft's twist does not tell on which mass a constant force acts; from
    where the nominal model ends, the fit on the other mass stayed thousands above.
    """
    case = opened(sigma)
    own = next(c for c in case.candidates if c.key == "static_bias_phi_l")
    answer = fit(case, own, {**case.records.guess, "bias_phi_l": 0.8 * LOAD})
    assert answer.minimum.chi2 < 1.1 * answer.whitened.rows
    force = answer.values["J_l"] * answer.values["bias_phi_l"]
    assert force == pytest.approx(J_L * LOAD, rel=0.02)

    rivals = {job[0][0].key: job[1][0] for job in elsewhere(answer, case.candidates)}
    assert set(rivals) == {"static_bias_phi_m"}
    start = rivals["static_bias_phi_m"]
    assert isinstance(start, Start)
    # one force on both, as the shaft holds them together
    assert start.values["bias_phi_m"] * answer.values["J_m"] == pytest.approx(force, rel=0.1)
    other = next(c for c in case.candidates if c.key == "static_bias_phi_m")
    above = fit(case, other, start).minimum.chi2 - answer.minimum.chi2
    assert above > 100 if told else abs(above) < 8


def test_what_acts_at_one_place_only_has_no_rival_elsewhere() -> None:
    case = opened(0.02)
    own = next(c for c in case.candidates if "actuator_lag" in c.ids)
    assert not [*elsewhere(fit(case, own, {own.parameters[0].name: 0.01}), case.candidates)]
