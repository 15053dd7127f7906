"""A case that is opened, and hypotheses of it."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case


@pytest.fixture(scope="module")
def case() -> Case:
    """A pendulum with a cubic spring and an offset of its sensor."""
    model = pk.systems.sloshing()
    truth = model.with_term("theta_dot", "-k3*theta**3", [pk.Parameter("k3", 200.0)]).map_output(
        "theta", function="theta + 0.001")
    train, later = (pk.simulate(truth, pk.excitation.planar_moves(6, 10.0, seed=seed),
                                sigma=0.002, seed=seed) for seed in (1, 2))
    return open_case(model, (train,), (later,), None, lambda text: None, DEFAULTS)


def hypothesis(case: Case, *keys: str, **start: float) -> Hypothesis:
    listed = {c.key: c for c in case.candidates}
    found = fitted(case.model, [listed[k] for k in keys], case.records, [start], 30)
    assert found is not None
    return found


def keys(effects: Sequence[Candidate]) -> set[str]:
    return {e.key for e in effects}
