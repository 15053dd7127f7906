"""Users' own effects in a diagnosis: offered, told apart, named, and never named in vain."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid import errors
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.detect.tangent import directions
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.model.effects_file import from_table

TANKS: dict[str, Any] = {
    "name": "tanks",
    "states": {"x1": {"unit": "cm", "initial": 5.0}, "x2": {"unit": "cm", "initial": 4.0}},
    "inputs": {"u": {"unit": "V"}},
    "parameters": {"k1": {"unit": "cm^0.5/s", "guess": 0.5, "bounds": [0, 5]},
                   "k2": {"unit": "cm^0.5/s", "guess": 0.5, "bounds": [0, 5]},
                   "b": {"unit": "cm/s/V", "guess": 0.3, "bounds": [0, 5]}},
    "equations": {"x1": "-k1*sqrt(max(x1, 0)) + b*u",
                  "x2": "k1*sqrt(max(x1, 0)) - k2*sqrt(max(x2, 0))"},
    "outputs": {"y": {"unit": "cm", "expression": "x2"}},
    "effects": {
        "overflow": {
            "name": "overflow of the first tank",
            "parameters": {"k_o": {"unit": "1/s", "guess": 0.1, "bounds": [0, 10]},
                           "h": {"unit": "cm", "guess": 7.0, "bounds": [5, 15]}},
            "add": {"x1": "-k_o*max(x1 - h, 0)", "x2": "k_o*max(x1 - h, 0)"}, "null": {"k_o": 0}},
        "evaporation": {
            "parameters": {"e": {"unit": "1/s", "guess": 0.01, "bounds": [0, 1]}},
            "add": {"x2": "-e*x2"}, "null": {"e": 0}}}}


def rig(seed: int, overflow: float, evaporation: float) -> pk.Recording:
    """Two tanks, by another integrator than the kit's, at rest between random steps of 20 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 400.0)
    u = np.repeat(rng.uniform(0.5, 7.0, 20), 20)
    x, seen = np.array([5.0, 4.0]), [4.0]
    for held in u[:-1]:
        def rates(_: float, x: np.ndarray, held: float = held) -> list[float]:
            over = overflow * max(x[0] - 9.0, 0.0)
            out = 0.45 * np.sqrt(max(x[0], 0.0))
            return [0.35 * held - out - over,
                    out + over - 0.42 * np.sqrt(max(x[1], 0.0)) - evaporation * x[1]]

        x = solve_ivp(rates, (0.0, 1.0), x, method="DOP853", rtol=1e-9, atol=1e-10).y[:, -1]
        seen.append(float(x[1]))
    y = np.array(seen) + rng.normal(0.0, 0.03, len(t))
    return pk.Recording.from_arrays(t, {"u": u, "y": y}, units={"u": "V", "y": "cm"})


@pytest.mark.parametrize(("overflow", "evaporation", "wanted"), [
    (0.4, 0.0, ("overflow",)), (0.0, 0.05, ("evaporation",)), (0.0, 0.0, None)])
def test_of_two_own_effects_the_one_that_acts_is_named(
        overflow: float, evaporation: float, wanted: tuple[str, ...] | None) -> None:
    train, held_out = (rig(seed, overflow, evaporation) for seed in (1, 2))
    dx = pk.diagnose(pk.Model.from_dict(TANKS), train, held_out)
    if wanted is None:
        assert dx.verdict == "none"
        return
    assert dx.verdict == "named"
    effect, = dx.hypotheses[0].effects
    assert effect.ids == wanted
    true = {"k_o": 0.4, "h": 9.0, "e": 0.05}
    for name, value in effect.parameters.items():
        assert value.std is not None and abs(value.value - true[name]) < 4 * value.std


LAWS = {
    "quadratic_drag": ({"c": {"unit": "1/rad", "guess": 0.1, "bounds": [0, 9]}},
                       {"theta_dot": "-c*abs(theta_dot)*theta_dot"}),
    "cubic_stiffness": ({"k": {"unit": "1/(rad*s)^2", "guess": 1.0}},
                        {"theta_dot": "-k*theta**3"}),
    "coulomb_friction": ({"f": {"unit": "rad/s^2", "guess": 0.1, "bounds": [0, 9]}},
                         {"theta_dot": "-f*sign(theta_dot)"}),
}


@pytest.mark.parametrize("law", LAWS)
def test_signs_by_simulation_are_those_of_the_catalogue(law: str) -> None:
    """The catalogue's own laws, written as text: derivatives of simulations against the tangent."""
    parameters, add = LAWS[law]
    size = next(iter(parameters))
    own, = from_table({"own": {"parameters": parameters, "add": add, "null": {size: 0}}}, "test")
    model = pk.systems.sloshing()
    run = pk.simulate(model, pk.excitation.planar_moves(6, 10.0, seed=1), sigma=0.002, seed=1)
    case = open_case(model.with_candidates(own), (run,), None, None, lambda text: None, DEFAULTS)
    asked = [c for c in case.candidates if c.ids[0] in ("own", law) and not c.variant]
    found = directions(case.base.whitened, case.base.minimum.theta, asked)
    ours, theirs = (found.D[:, [asked[k].ids[0] == i for k in found.owner]][:, 0]
                    for i in ("own", law))
    # the tangent takes forces at samples, between which a sign changes earlier or later
    close = 0.05 if law == "coulomb_friction" else 0.01
    assert np.linalg.norm(ours - theirs) <= close * np.linalg.norm(theirs)


def test_unknown_twins_are_refused() -> None:
    model = pk.Model.from_dict({**TANKS, "effects": {
        "loss": {**TANKS["effects"]["evaporation"], "twins": ["nobody"]}}})
    with pytest.raises(errors.PikanidError, match="'nobody'"):
        pk.diagnose(model, rig(1, 0.0, 0.0), rig(2, 0.0, 0.0))


def test_an_id_of_the_catalogue_is_taken() -> None:
    own = from_table({"parameter_drift": TANKS["effects"]["evaporation"]}, "test")
    model = pk.Model.from_dict({**TANKS, "effects": {}})
    with pytest.raises(errors.BadModel, match="'parameter_drift' is there already"):
        candidates(sites(model, (rig(1, 0.0, 0.0),)), own)


def test_twins_form_a_group() -> None:
    first, second = from_table({
        "loss": {**TANKS["effects"]["evaporation"], "twins": ["sensor_gain"]},
        "seep": {**TANKS["effects"]["evaporation"], "twins": ["loss"]}}, "test")
    model = pk.Model.from_dict({**TANKS, "effects": {}})
    listed = candidates(sites(model, (rig(1, 0.0, 0.0),)), (first, second))
    group = {c.ids[0]: c.twin for c in listed if {"loss", "seep", "sensor_gain"} & set(c.ids)}
    assert len(set(group.values())) == 1 and group["loss"]
