"""What happens once: one entry in two shapes, proved where no lasting effect would do as well."""

from __future__ import annotations

from dataclasses import replace

from test_verdict import BASE, A, B, answered, effect, hypothesis

ONCE = replace(effect("once"), absent=True)
OPEN = replace(effect("once"), absent=True, variant="open", covers={"once": {}})


def test_an_entry_in_two_shapes_is_one_hypothesis() -> None:
    found = answered([BASE, hypothesis(1000.0, ONCE), hypothesis(1001.0, OPEN)])
    assert found.verdict == "named" and [h.key for h in found.given] == [{"once"}]
    beside = answered([BASE, hypothesis(1000.0, A), hypothesis(1001.0, OPEN)])
    assert beside.verdict == "set" and len(beside.given) == 2


def test_what_lasts_may_take_most_of_what_happened_once() -> None:
    """Then it is the more probable kind of law, unless the held-out recording speaks against it."""
    fits = [BASE, hypothesis(1000.0, ONCE), hypothesis(1100.0, B)]
    alike = answered(fits, unseen=("once",))
    assert alike.verdict == "unconfirmed" and "lasting effect" in alike.doubt
    refuted = answered(fits, {"b": 10.0}, unseen=("once",))
    assert refuted.verdict == "named" and not refuted.doubt
    hardly = answered(fits, {"b": 3.0}, unseen=("once",))
    assert hardly.verdict == "unconfirmed"
