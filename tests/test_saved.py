"""Edges out of an estimate, as it was saved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tanks import coarse, recording, searching, tank

import pikanid as pk
from pikanid import errors
from pikanid.discrepancy import Discrepancy
from pikanid.symbolic import extract
from pikanid.symbolic.library import LIBRARY
from pikanid.symbolic.saved import _plans

FEW = [form for form in LIBRARY if form.name in ("linear", "quadratic", "cubic", "signed square")]


@pytest.fixture(scope="module")
def found() -> Discrepancy:
    return pk.kan_discrepancy(tank(), recording(0.3, 0), "x", ["x"], grid=[8], steps=False,
                              nominal=searching().nominal)


def test_edges_stand_in_the_model_of_an_estimate(found: Discrepancy) -> None:
    (plan,), (wanted,) = _plans(found.estimate), coarse().plans
    assert replace(plan, centre=0.0, halfwidth=1.0) == replace(wanted, centre=0.0, halfwidth=1.0)
    np.testing.assert_allclose([plan.centre, plan.halfwidth], [wanted.centre, wanted.halfwidth])


def test_an_edge_of_an_estimate_is_its_spline(found: Discrepancy) -> None:
    reading, plan = extract(found.estimate, library=FEW), found.edge("x").gauge.plan
    curve = reading.edges[0, 0, 0].curve
    at = [found.estimate.index(n) for n in plan.coefficient_names]
    values = plan.basis(curve.x) @ found.estimate.theta[at]
    low, high = coarse().plans[0].limits
    assert (curve.x[0], curve.x[-1]) == pytest.approx(
        (low + 0.05 * (high - low) / 1.1, high - 0.05 * (high - low) / 1.1))
    np.testing.assert_allclose(curve.y, values, atol=1e-12)
    assert (curve.samples, curve.argument) == (found.estimate.n, "x")
    (weight,) = reading.contributions
    assert weight.size == pytest.approx(np.std(values), rel=1e-9)


def test_a_model_without_edges_has_none_to_read() -> None:
    with pytest.raises(errors.BadSetting, match="tank"):
        extract(searching().nominal)
