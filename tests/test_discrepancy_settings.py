"""Settings of a discrepancy are taken along by all that follows from a fit, and said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tanks import coarse, recording, searching, tank

import pikanid as pk
from pikanid import errors
from pikanid.discrepancy.edges import plan_edges
from pikanid.discrepancy.level import Level
from pikanid.discrepancy.mixture import views
from pikanid.discrepancy.offers import step_offers, variation_offers
from pikanid.discrepancy.settings import DiscrepancySettings

OWN = DiscrepancySettings(strong=1e9, pieces=5, left_out=0.5, draws=50, freedom=(2, 2))


def level_of(own: DiscrepancySettings) -> Level:
    """The fit of the tank's edge, as if it had been made with these settings."""
    level = coarse()
    smoothness = replace(level.fit.smoothness, settings=own)
    return replace(level, fit=replace(level.fit, smoothness=smoothness))


def test_offers_and_their_fits_keep_the_settings() -> None:
    for offer in (*step_offers(level_of(OWN), "x"), *variation_offers(level_of(OWN))):
        assert offer.fit.smoothness.settings is OWN
    (varied,) = variation_offers(level_of(OWN))
    assert varied.pieces == (5,)


def test_a_search_fits_with_its_own_priors() -> None:
    small = replace(searching(), settings=DiscrepancySettings(largest=0.01, iterations=1))
    found = small.first(plan_edges(tank(), ["x"], 8), 8)
    prior, usual = (level.fit.smoothness.priors[0] for level in (found, coarse()))
    assert len(found.fit.history) <= 2 < len(coarse().fit.history)
    assert np.diag(prior.precision(np.array([-12.0]))).min() > 90 * np.diag(
        usual.precision(np.array([-12.0]))).min()


def test_a_structure_below_its_share_is_left_out() -> None:
    (faint,) = views(level_of(replace(OWN, left_out=0.9)), "x", True)
    assert faint.weight == 1.0 and not faint.plans[0].step
    assert len(views(level_of(replace(OWN, left_out=0.0)), "x", True)) == 2


def test_a_result_says_by_which_settings_it_came() -> None:
    found = pk.kan_discrepancy(tank(), recording(0.3, 0), "x", ["x"], grid=[8], steps=False,
                               adaptive=False, settings=OWN)
    assert found.settings is OWN and found.edges[0].freedom == 2 and found.edges[0].draws == 50
    own = {"strong": 1e9, "left_out": 0.5, "pieces": 5, "freedom": (2, 2), "draws": 50}
    assert found.to_dict()["settings"] == found.estimate.settings["settings"] == own
    assert "Settings: strong = 1e+09, left_out = 0.5" in str(found)


def test_usual_settings_are_not_said() -> None:
    found = pk.kan_discrepancy(tank(), recording(0.3, 0), "x", ["x"], grid=[8], steps=False,
                               adaptive=False)
    assert "settings" not in found.to_dict() and "Settings" not in str(found)


def test_what_is_no_setting_is_refused() -> None:
    with pytest.raises(errors.BadSetting, match=r"left_out is 1.5; it must be a number from 0"):
        DiscrepancySettings(left_out=1.5)
