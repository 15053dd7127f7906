"""Models with effects added: made once, in the order of the channels, for each nominal model."""

from __future__ import annotations

from dataclasses import replace

import pikanid as pk
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.fitting.extended import extended


def listed(model: pk.Model) -> dict[str, Candidate]:
    recording = pk.simulate(model, pk.excitation.two_pulse(3.0, 0.01))
    return {c.key: c for c in candidates(sites(model, (recording,)))}


def test_the_same_effects_make_one_model() -> None:
    model = pk.systems.sloshing()
    found = listed(model)
    both = [found["sensor_gain"], found["cubic_stiffness"]]
    assert extended(model, both) is extended(model, both)
    # a sensor shows what acts, whichever is named first
    assert extended(model, both[::-1]) is extended(model, both)
    assert {"k3", "k_out"} <= {*extended(model, both).parameter_names}
    assert extended(model, []) is model


def test_what_is_alike_is_not_the_same() -> None:
    """A model with other values, and an effect in another reading, make models of their own."""
    model = pk.systems.sloshing()
    effect = listed(model)["cubic_stiffness"]
    other = model.with_values(l_theta=0.05)
    assert extended(other, [effect]).values["l_theta"] == 0.05
    assert extended(model, [effect]).values["l_theta"] != 0.05
    damped = replace(effect, extend=lambda m: m.with_term("theta_dot", "-k3*theta_dot"))
    assert extended(model, [damped]).equations != extended(model, [effect]).equations
