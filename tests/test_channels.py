"""In which channels effects act."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

import pikanid as pk
from pikanid.mismatch.catalogue.candidate import SYMBOLIC, Candidate
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.channels import acts_in, needed


@pytest.fixture(scope="module")
def site() -> Site:
    return sites(pk.systems.sloshing(), (pk.excitation.two_pulse(),))[0]


@pytest.fixture(scope="module")
def by_key(site: Site) -> dict[str, Candidate]:
    return {c.key: c for c in candidates((site,))}


@pytest.mark.parametrize(("key", "channels"), [
    ("coulomb_friction", {"dynamics"}), ("input_dead_zone", {"input"}), ("sensor_gain", {"sensor"}),
    ("input_delay", {"dynamics", "input", "sensor"}),
    # of the input's push and the speed: either's
    ("velocity_coupled_drive", {"dynamics", "input"}), ("soft_saturation", {"input"})])
def test_entries_act_where_they_say(by_key: dict[str, Candidate], key: str, channels: set[str]
                                    ) -> None:
    assert acts_in(by_key[key]) == channels


@pytest.mark.parametrize(("formula", "channels"), [
    ("-k*theta**2", {"dynamics"}), ("a*abs(u_x)", {"input"}),
    ("a*u_x*theta_dot", {"dynamics", "input"})])
def test_a_formula_acts_where_its_arguments_are(site: Site, formula: str, channels: set[str]
                                                ) -> None:
    law = Candidate((SYMBOLIC + formula,), formula, formula, "dynamics", site, (), lambda m: m,
                    lambda view: ())
    assert acts_in(law) == channels


def test_an_explanation_needs_the_channels_that_are_sure(by_key: dict[str, Candidate]) -> None:
    effects = tuple(by_key[k] for k in ("input_delay", "coulomb_friction", "sensor_drift"))
    h = cast(Hypothesis, cast(Any, SimpleNamespace(effects=effects)))
    assert needed(h) == {"dynamics", "sensor"}
