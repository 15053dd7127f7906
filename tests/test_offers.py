"""Offers of a finer structure: judged by the linear problem, as a fit of it would be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tanks import coarse, searching

from pikanid.discrepancy.level import Level
from pikanid.discrepancy.offers import Offer, finer_gain, step_offers, variation_offers


def balance(offer: Offer) -> np.ndarray:
    """Gradient of the penalised cost at an offer's fit, in posterior standard deviations."""
    fit = offer.fit
    H = fit.information + fit.smoothness.precision(fit.rho)
    return np.asarray((H @ fit.theta - fit.gain) / np.sqrt(np.diag(H)))


def held(level: Level) -> Level:
    """The level with its first parameter at a bound, a little off its best."""
    fit = level.fit
    inside = np.array(fit.inside)
    inside[0] = False
    theta = np.array(fit.theta)
    theta[0] *= 1.01
    return replace(level, fit=replace(fit, theta=theta, inside=inside))


def test_an_offer_stands_at_the_least_penalised_cost() -> None:
    level = coarse()
    for offer in (*step_offers(level, "x"), *variation_offers(level)):
        assert np.abs(balance(offer)).max() < 1e-6
        assert offer.fit.inside.all()
        assert [p.argument for p in offer.plans] == ["x"]


def test_an_offer_moves_nothing_that_is_held_at_a_bound() -> None:
    level = held(coarse())
    for offer in (*step_offers(level, "x"), *variation_offers(level)):
        np.testing.assert_array_equal(offer.fit.inside[1:], True)
        assert not offer.fit.inside[0] and offer.fit.theta[0] == level.fit.theta[0]
        assert np.abs(balance(offer)[1:]).max() < 1e-6


def test_an_offer_says_what_it_changes() -> None:
    level = coarse()
    (step,), (varied,) = step_offers(level, "x"), variation_offers(level)
    assert [p.step for p in step.plans] == [True] and step.pieces == (1,)
    assert len(step.fit.theta) == len(level.fit.theta) + 1
    assert varied.plans == level.plans and varied.pieces == (9,)
    for offer in (step, varied):
        assert offer.gain == pytest.approx(offer.fit.evidence - level.fit.evidence)


def test_no_step_where_the_argument_only_touches_zero() -> None:
    level = coarse()
    for centre in (1.0, -1.0):
        touching = (replace(level.plans[0], centre=centre, halfwidth=1.0),)
        assert step_offers(replace(level, plans=touching), "x") == []


def test_the_gain_of_a_finer_grid_is_that_of_its_fit() -> None:
    level, search = coarse(), searching()
    assert finer_gain(level, "x", level.plans) == pytest.approx(0.0, abs=1e-9)
    finer = [p.over(a, 16) for p, a in zip(level.plans, level.visited.arguments.T, strict=True)]
    rise = search.again(level, finer, level.pieces).fit.evidence - level.fit.evidence
    assert finer_gain(level, "x", finer) == pytest.approx(rise, abs=0.3)
