"""Of two families one is surely there where neither is by itself."""

from __future__ import annotations

import pytest
from weighing import COULOMB, DRAG, RULE, effect, never, weighed

from pikanid.mismatch.judge.explanations import Weighed
from pikanid.mismatch.judge.kinds import Kind
from pikanid.mismatch.judge.partial import Doubtful, Present, _one_of_two
from pikanid.mismatch.settings.settings import DEFAULTS

SPRING, GAIN = effect("cubic_stiffness", "restoring force"), effect("input_gain", "gain")


def of_two(kind: Kind, *found: Weighed) -> Present | Doubtful:
    return _one_of_two(kind, found[0], found, RULE, DEFAULTS.least_proof, never)


def test_of_two_families_that_do_as_well_one_is_there() -> None:
    """A spring beside the model's own or a scale error: without either 30 times as much is left."""
    found = of_two(Kind("gain"), weighed((GAIN,), 1.0, 0.6), weighed((SPRING,), 1.2, 0.399),
                   weighed((DRAG,), 30.0, 0.001))
    assert isinstance(found, Present) and found.names == () and found.instead is not None
    assert found.instead.kind == Kind("restoring force", "v") and found.instead.effect is SPRING
    assert found.dominance == pytest.approx(30.0)
    assert found.probability_family == pytest.approx(0.999)
    assert list(found.alternatives) == ["cubic_stiffness"]


@pytest.mark.parametrize("rest", [
    # as much as is asked of a scale error is not left without either
    [weighed((SPRING,), 1.2, 0.399), weighed((DRAG,), 12.0, 0.001)],
    # a third family does as well
    [weighed((SPRING,), 1.2, 0.399), weighed((DRAG,), 1.4, 0.001)],
    # what does as well holds both
    [weighed((SPRING, DRAG), 1.2, 0.399), weighed((COULOMB,), 1.4, 0.0), weighed((), 90.0, 0.001)],
    # neither is probable enough
    [weighed((SPRING,), 1.2, 0.35), weighed((DRAG,), 30.0, 0.05)]])
def test_of_more_than_two_families_none_is_said(rest: list[Weighed]) -> None:
    assert isinstance(of_two(Kind("gain"), weighed((GAIN,), 1.0, 0.6), *rest), Doubtful)


def test_a_family_that_is_improbable_is_not_one_of_two() -> None:
    found = of_two(Kind("gain"), weighed((GAIN,), 1.0, 0.005), weighed((SPRING,), 1.2, 0.994),
                   weighed((DRAG,), 30.0, 0.001))
    assert isinstance(found, Doubtful) and "probability is 0.005" in found.why


def test_a_family_that_is_sure_by_itself_stands_for_no_other() -> None:
    found = of_two(Kind("dry friction", "v"), weighed((COULOMB,), 1.0, 0.995),
                   weighed((DRAG,), 5.0, 0.005))
    assert isinstance(found, Present) and found.instead is None
    assert found.names == ("coulomb_friction",)
    # what the leading explanation holds anyway stands in nothing's place
    both = of_two(Kind("dry friction", "v"), weighed((COULOMB, DRAG), 1.0, 0.995),
                  weighed((DRAG,), 2.0, 0.005), weighed((), 50.0, 0.0))
    assert isinstance(both, Doubtful)
