"""What is asked of a name where less would do: one law of no catalogue, or something once."""

from __future__ import annotations

from dataclasses import replace

from test_verdict import BASE, GUARD, A, B, answered, effect, hypothesis

from pikanid.model.parts import Parameter

ONCE = replace(effect("once"), absent=True)
SPEAKS = {"": 300.0, "a": 150.0, "b": 150.0, "outside": 100.0}


def test_what_happens_once_beside_another_effect_needs_as_much_as_that() -> None:
    weak = answered([BASE, hypothesis(1500.0, A), hypothesis(1350.0, A, ONCE)], {"": 400.0})
    assert weak.verdict == "unconfirmed" and "200 are asked" in weak.doubt
    strong = answered([BASE, hypothesis(1500.0, A), hypothesis(1250.0, A, ONCE)], {"": 400.0})
    assert strong.verdict == "named" and sorted(strong.given[0].key) == ["a", "once"]


def test_several_are_not_sure_where_one_law_of_no_catalogue_explains_as_much() -> None:
    """Though held-out recordings refuse that one: others that are in none may pass."""
    pair = [BASE, hypothesis(1500.0, A), hypothesis(1500.0, B), hypothesis(1000.0, A, B)]
    assert answered(pair, SPEAKS).verdict == "named"
    near, far = (answered([*pair, hypothesis(chi2, GUARD)], SPEAKS, refused=("outside",))
                 for chi2 in (1012.0, 1040.0))
    assert near.verdict == "unconfirmed" and "fewer laws" in near.doubt
    assert far.verdict == "named"


def test_a_power_law_that_may_be_in_proportion_is_what_a_model_has() -> None:
    """Its exponent is 1 ± 0.01 here; where a law in proportion is an entry, both are given."""
    n = Parameter("m", 0.5)
    power = replace(effect("power"), parameters=(Parameter("p_power", 0.0), n), exponent=n)
    alone = answered([BASE, hypothesis(1000.0, power)])
    assert alone.verdict == "unconfirmed" and "may be in proportion" in alone.doubt
    entry = replace(effect("linear"), exponent=1.0)
    both = answered([BASE, hypothesis(1000.0, power), hypothesis(1002.0, entry)])
    assert both.verdict == "set" and not both.doubt
