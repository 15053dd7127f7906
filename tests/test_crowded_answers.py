"""Explanations that leave room for one that nobody has listed, on hypotheses made up for it."""

from __future__ import annotations

import itertools
from dataclasses import replace

from test_verdict import BASE, GUARD, LAW, A, answered, effect, hypothesis

from pikanid.mismatch.catalogue.candidate import SYMBOLIC
from pikanid.mismatch.settings.settings import DEFAULTS

WEAK = hypothesis(1100.0)
MOST = DEFAULTS.verdict.crowd
NAMES = [effect(f"e{k}") for k in range(MOST + 1)]
FITS = [hypothesis(1000.0 + 0.5 * k, e) for k, e in enumerate(NAMES)]


def test_a_weak_set_of_many_is_not_confirmed() -> None:
    few, many = answered([WEAK, *FITS[:-1]]), answered([WEAK, *FITS])
    assert (few.verdict, len(few.given)) == ("set", MOST)
    assert (many.verdict, len(many.given)) == ("unconfirmed", MOST + 1)
    assert "nobody has listed" in many.doubt
    # few laws do what is strong
    assert answered([BASE, *FITS]).verdict == "set"
    # of those that are one law under several names, one counts
    twins = [replace(e, twin="scale") for e in NAMES[-2:]]
    assert answered([WEAK, *FITS[:-2], *(hypothesis(1002.0, e) for e in twins)]).verdict == "set"
    # nor does what adds to one of them
    more = hypothesis(989.0, NAMES[0], effect("more"))
    assert answered([WEAK, *FITS[:-1], more]).verdict == "set"


def test_laws_that_are_one_motion_in_all_recordings_count_as_one() -> None:
    """As a dead zone that is never entered, an offset of the input and a constant force; a law
    outside the catalogue is then the same in other words.
    """
    one = [hypothesis(1000.0 + 0.01 * k, e) for k, e in enumerate(NAMES)]
    given = answered([WEAK, *one, hypothesis(1000.05, GUARD)])
    assert given.verdict == "set"
    assert {h.key for h in given.given} == {frozenset({e.key}) for e in NAMES}
    # what differs in the held-out recording alone is another law
    for k in range(len(NAMES)):
        apart = answered([WEAK, *one], {NAMES[j].key: 0.5 * j for j in range(k + 1)})
        assert (apart.verdict == "set") is (k < MOST)
    other = answered([WEAK, *one, hypothesis(1000.05, GUARD)], {"outside": 1.0})
    assert other.verdict == "unconfirmed" and "nobody has listed" in other.doubt


def test_a_law_outside_the_catalogue_counts_against_a_set() -> None:
    """Beside what is weak, and beside many, though not beside one or two that are strong."""
    for base, known in itertools.product((BASE, WEAK), (FITS[:1], FITS[:-1])):
        given = answered([base, *known, hypothesis(1000.25, GUARD)])
        assert (given.verdict == "set") == (base is BASE and len(known) == 1)
        assert {GUARD.key} in [h.key for h in given.given]


def test_what_happens_once_has_to_be_strong() -> None:
    """No other recording speaks of it: a weak one may be whatever else happens once."""
    once = replace(A, absent=True)
    assert answered([BASE, hypothesis(1000.0, once)]).verdict == "named"
    assert answered([WEAK, hypothesis(1000.0, once)]).verdict == "named"
    weak = answered([hypothesis(1095.0), hypothesis(1000.0, once)])
    assert weak.verdict == "unconfirmed" and "in any other recording" in weak.doubt
    assert "100 are asked" in weak.doubt  # half of what is asked of an effect in two recordings
    assert answered([hypothesis(1095.0), hypothesis(1000.0, A)]).verdict == "named"


def test_a_formula_whose_form_is_not_told_is_not_confirmed() -> None:
    other = effect(f"{SYMBOLIC}k*abs(q)")
    fits = [BASE, hypothesis(1000.0, A), hypothesis(1013.0, GUARD), hypothesis(1000.0, LAW)]
    given = answered([*fits, hypothesis(1003.0, other)], {"outside": 9.0}, refused=("a",))
    assert given.verdict == "unconfirmed" and len(given.given) == 2
    assert "which form" in given.doubt
    clear = answered([*fits, hypothesis(1030.0, other)], {"outside": 9.0}, refused=("a",))
    assert clear.verdict == "named" and clear.given[0].key == {LAW.key}


def test_a_formula_that_was_read_has_to_be_strong_for_its_form() -> None:
    """Another form would do as well where it is weak: more is asked than of an entry."""
    assert LAW.read and not A.read
    asked = DEFAULTS.verdict.minor_strong
    for more, verdict in ((-1.0, "unconfirmed"), (1.0, "named")):
        found = answered([hypothesis(1000.0 + asked + more), hypothesis(1000.0, LAW)])
        assert found.verdict == verdict
        assert ("too weak for its form" in found.doubt) is (more < 0)
