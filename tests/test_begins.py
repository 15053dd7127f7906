"""Effects that need to know how a recording in operation begins: play of an input, and its lag."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.model import Model

MODEL = Model.from_dict({
    "states": {"h": {"unit": "m", "initial": 1.0}},
    "inputs": {"u": {"unit": "V", "hold": "zero"}},
    "parameters": {"a": {"unit": "m/(s*V)", "guess": 1.0}, "c": {"unit": "1/s", "guess": 0.5}},
    "equations": {"h": "a*u - c*h"}, "outputs": {"y": {"unit": "m", "expression": "h"}}})


def driven(about: float, seed: int = 0) -> pk.Recording:
    """Random steps about a level; at rest before it where that is 0."""
    u = about + np.repeat(np.random.default_rng(seed).normal(size=40), 10)
    u[:10] = about
    return pk.Recording.from_arrays(0.05 * np.arange(400), {"u": u}, units={"u": "V"})


def called(name: str, *recordings: pk.Recording, channel: str = "input") -> Candidate:
    """The entry with the most parameters."""
    return max((c for c in candidates(sites(MODEL, recordings))
                if c.ids == (name,) and c.channel == channel), key=lambda c: len(c.parameters))


@pytest.mark.parametrize("name", ["actuator_lag", "hysteresis"])
def test_only_in_operation_is_the_beginning_unknown(name: str) -> None:
    for recordings, count in (((driven(0.0),), 0), ((driven(2.0),), 1),
                              ((driven(0.0), driven(2.0)), 1)):
        found = called(name, *recordings)
        assert len(found.begins) == count and len(found.parameters) == 1 + count
        assert all(p.scope == "recording" for p in found.parameters[1:])


def test_an_actuator_that_is_not_where_it_is_told_to_be_at_first() -> None:
    """Its lag against the closed form: h follows w = b·exp(-t/τ) beside what it is told."""
    lag = called("actuator_lag", driven(2.0))
    model = lag.applied(MODEL).with_values(tau_a=0.4, d_lag=-1.5, a=1.0, c=0.5)
    still = pk.Recording.from_arrays(0.05 * np.arange(400), {"u": np.full(400, 2.0)},
                                     units={"u": "V"})
    t, found = 0.05 * np.arange(400), pk.simulate(model, still, sigma=0.0)["y"].values
    steady = 4.0 + (1.0 - 4.0) * np.exp(-0.5 * t)
    extra = -1.5 / (0.5 - 1 / 0.4) * (np.exp(-t / 0.4) - np.exp(-0.5 * t))
    np.testing.assert_allclose(found, steady + extra, atol=1e-7)


def test_each_recording_begins_by_itself() -> None:
    model = called("actuator_lag", driven(2.0)).applied(MODEL)
    made = [pk.simulate(model.with_values(tau_a=0.3, d_lag=d), driven(2.0, seed), sigma=0.005,
                        seed=seed) for seed, d in ((1, 1.0), (2, -0.5))]
    est = pk.NLS().fit(model.with_values(tau_a=0.1), made)
    for name, of, true in (("tau_a", None, 0.3), ("d_lag", 0, 1.0), ("d_lag", 1, -0.5)):
        assert abs(est.value(name, of) - true) < 4 * est.std(name, of) < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["actuator_lag", "sensor_lag"])
def test_a_beginning_that_nobody_knows_decides_nothing(name: str) -> None:
    """Where an actuator may begin anywhere, its lag and one of the sensor do about as well."""
    lag = called(name, driven(2.0), channel="input" if name == "actuator_lag" else "sensor")
    truth = lag.applied(MODEL).with_values(
        **{lag.parameters[0].name: 0.3, **({"d_lag": -1.0} if name == "actuator_lag" else {})})
    train, later = (pk.simulate(truth, driven(2.0, seed), sigma=0.01, seed=seed)
                    for seed in (1, 2))
    dx = pk.diagnose(MODEL, train, later)
    assert dx.verdict in ("named", "set")
    assert any(name in e.ids for h in dx.hypotheses for e in h.effects)
