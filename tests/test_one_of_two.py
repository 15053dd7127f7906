"""Of two families one is surely there where neither is by itself."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from opened import case, hypothesis, keys
from weighing import COULOMB, DRAG, RULE, effect, weighed

from pikanid.mismatch.case import Case
from pikanid.mismatch.judge import explanations
from pikanid.mismatch.judge.explanations import Weighed
from pikanid.mismatch.judge.kinds import Kind
from pikanid.mismatch.judge.partial import Doubtful, Instead, Part, Present, _one_of_two
from pikanid.mismatch.report import part as reported_as
from pikanid.mismatch.search.neighbours import with_bent_scales
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps import remaining, surely

__all__ = ["case"]  # the fixture
SPRING, GAIN = effect("cubic_stiffness", "restoring force"), effect("input_gain", "gain")


def of_two(kind: Kind, *found: Weighed) -> Present | Doubtful:
    return _one_of_two(kind, found[0], found, DEFAULTS, 1.0)


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


def test_one_family_in_either_of_two_equations_says_which() -> None:
    there, here = (effect("cubic_stiffness", "restoring force") for _ in range(2))
    there.site.v = "w"
    found = of_two(Kind("restoring force", "v"), weighed((here,), 1.0, 0.6),
                   weighed((there,), 1.2, 0.399), weighed((DRAG,), 30.0, 0.001))
    assert isinstance(found, Present) and found.instead is not None
    places = remaining._places(found)
    assert places == ("v", "w")
    said = reported_as.Present("restoring force", (), "cubic stiffness", "-k*q**3", {}, 0.6, 1.0,
                               30.0, 1.2, 0.9, {}, {}, "restoring force", places)
    assert said.title == "a restoring force in v' or in w'"
    other = of_two(Kind("gain"), weighed((GAIN,), 1.0, 0.6), weighed((SPRING,), 1.2, 0.399),
                   weighed((DRAG,), 30.0, 0.001))
    assert isinstance(other, Present) and remaining._places(other) == ()


def test_one_law_of_two_families_is_told_as_one() -> None:
    def law(family: str, expression: str, *ids: str) -> reported_as.Present:
        return reported_as.Present(family, ids, family, expression, {}, 0.6, 1.0, 30.0, 1.2, 0.9,
                                   {}, {})

    both = [law("dry friction", "-c*abs(q)*sign(v)"), law("drag", "-c*abs(q)*sign(v)")]
    assert reported_as.titles_of([*both, law("timing", "lag", "sensor_lag")]) == [
        "one law that counts as dry friction and drag", "timing"]
    two = [law("dry friction", "-c*sign(v)"), law("drag", "-q2*abs(v)*v")]
    assert reported_as.titles_of(two) == ["dry friction", "drag"]


def test_what_holds_neither_of_two_families_is_fitted_beside_the_rest(
        monkeypatch: pytest.MonkeyPatch) -> None:
    lead, rest = (SimpleNamespace(effects=e, key=frozenset(one.key for one in e), values={},
                                  blurred=frozenset()) for e in ((GAIN, DRAG), (DRAG,)))
    tried: list[Any] = []
    monkeypatch.setattr(surely, "_one_more", lambda *args: bool(tried.append(args[1:])) or True)
    search: Any = SimpleNamespace(settings=DEFAULTS, fits={rest.key: rest})
    explained: Any = SimpleNamespace(leaders=lambda share: (lead,))
    either, sure = (Present(kind, e, (), {}, 1.0, 1.0, 9.0, 1.0, 0.9, other) for kind, e, other in (
        (Kind("gain"), GAIN, Instead(Kind("restoring force", "v"), SPRING)),
        (Kind("drag", "v"), DRAG, None)))
    assert surely._without_either(search, explained, Part((either, sure), (), lead, 1.0, 0.9))
    assert tried == [(rest, ["gain", "restoring force"])]
    assert not surely._without_either(search, explained, Part((sure,), (), lead, 1.0, 0.9))
    assert not surely._without_either(search, explained, None)


def test_the_best_without_both_families_are_compared() -> None:
    """However many do better that hold the one or the other."""
    gain, *springs, neither = (
        SimpleNamespace(effects=e, values={}, blurred=frozenset(), fit=k, symbolic=False,
                        determines=lambda effect: True)
        for k, e in enumerate([(GAIN,), *[(SPRING,)] * 30, (DRAG,)]))
    pool = explanations._pool([gain, *springs, neither], RULE)
    assert neither in pool and len(pool) < 20


def test_a_curve_of_an_input_is_compared_with_scales_that_bend() -> None:
    """At the levels of a switched input a limit and a parabola pass through the same points."""
    def law(key: str, family: str, channel: str = "input", next_to: str = "") -> Any:
        return SimpleNamespace(key=key, families=(family,), channel=channel, next_to=next_to)

    limit, drag = law("input_saturation", "input curve"), law("quadratic_drag", "drag", "dynamics")
    bent = law("input_gain_bent_2", "gain", next_to="input_gain")
    every = (limit, drag, bent, law("input_gain", "gain"),
             law("sensor_gain_bent_2", "gain", "sensor", "sensor_gain"))
    h: Any = SimpleNamespace(effects=(drag, limit), key={drag.key, limit.key}, point={"l": 1.0})
    assert [*with_bent_scales(h, every)] == [((drag, bent), [{"l": 1.0}])]
    h.effects = (drag,)
    assert not [*with_bent_scales(h, every)]


def test_a_law_is_compared_with_what_contains_it_beside_all_the_rest(case: Case) -> None:
    """From an exponent and a size: from nothing no step leads to an exponent."""
    jobs: list[Any] = []
    search: Any = SimpleNamespace(settings=DEFAULTS, candidates=case.candidates,
                                  budget_exhausted=True, fits={},
                                  refine=lambda found, _: jobs.extend(found))
    surely._compared(search, hypothesis(case, "quadratic_drag", "static_bias"))
    starts = [start for effects, found in jobs for start in found
              if keys(effects) == {"power_drag", "static_bias"}]
    assert any(start.get("n") == 1.8 and "c_n" in start for start in starts)


@pytest.mark.parametrize(("known", "channel", "instead"), [
    (False, "input", "input curve"), (False, "sensor", "sensor curve"), (True, "input", None)])
def test_a_scale_that_bends_is_one_or_a_curve(known: bool, channel: str, instead: str | None
                                              ) -> None:
    scale: Any = effect("input_gain_bent_2", "gain", known=known)
    scale.channel = channel
    p = Present(Kind("gain"), scale, scale.ids, {}, 1.0, 1.0, 9.0, 1.0, 0.95)
    h: Any = SimpleNamespace(effects=(scale,), blurred=frozenset())
    [found] = surely._without_shares(Part((p,), (), h, 1.0, 0.95), []).present
    assert found.instead == (instead and Instead(Kind(instead), scale))
    assert found.names == (() if instead else scale.ids)
