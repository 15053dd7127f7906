"""Explanations that leave room for one that nobody has listed, on hypotheses made up for it."""

from __future__ import annotations

from dataclasses import replace

from test_verdict import BASE, GUARD, LAW, A, answered, effect, hypothesis

from pikanid.mismatch.catalogue.candidate import SYMBOLIC
from pikanid.mismatch.settings.settings import DEFAULTS


def test_a_set_of_many_is_not_confirmed() -> None:
    most = DEFAULTS.verdict.crowd
    names = [effect(f"e{k}") for k in range(most + 1)]
    weak = hypothesis(1100.0)
    fits = [weak, *(hypothesis(1000.0 + 0.1 * k, e) for k, e in enumerate(names))]
    few, many = answered(fits[:-1]), answered(fits)
    assert (few.verdict, len(few.given)) == ("set", most)
    assert (many.verdict, len(many.given)) == ("unconfirmed", most + 1)
    assert f"where {most + 1} explanations do" in many.doubt
    # few laws do what is strong
    assert answered([BASE, *fits[1:]]).verdict == "set"
    # of those that are one law under several names, one counts
    twins = [replace(e, twin="scale") for e in names[-2:]]
    assert answered([*fits[:-2], *(hypothesis(1001.0, e) for e in twins)]).verdict == "set"
    # nor does what adds to one of them
    more = hypothesis(989.0, names[0], effect("more"))
    assert answered([*fits[:-1], more]).verdict == "set"


def test_a_formula_whose_form_is_not_told_is_not_confirmed() -> None:
    other = effect(f"{SYMBOLIC}k*abs(q)")
    fits = [BASE, hypothesis(1000.0, A), hypothesis(1013.0, GUARD), hypothesis(1000.0, LAW)]
    given = answered([*fits, hypothesis(1003.0, other)], {"outside": 9.0}, refused=("a",))
    assert given.verdict == "unconfirmed" and len(given.given) == 2
    assert "which form" in given.doubt
    clear = answered([*fits, hypothesis(1030.0, other)], {"outside": 9.0}, refused=("a",))
    assert clear.verdict == "named" and clear.given[0].key == {LAW.key}
