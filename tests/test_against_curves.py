"""Families and names that free curves do as well without are not sure."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from weighing import effect

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.judge.explanations import Explanations
from pikanid.mismatch.judge.kinds import Kind, kinds_of
from pikanid.mismatch.judge.partial import Doubtful, Instead, Part, Present
from pikanid.mismatch.search.screen import Screen
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps import against_curves as curves
from pikanid.mismatch.steps import surely
from pikanid.mismatch.steps.against_curves import against_curves
from pikanid.mismatch.steps.opening import open_case

SIGMA = 0.002
MODEL = pk.systems.sloshing()


def case_of(rig: pk.Model) -> Case:
    train, later = (pk.simulate(rig, pk.excitation.planar_moves(8, 10.0, seed=seed), sigma=SIGMA,
                                seed=seed) for seed in (1, 2))
    return open_case(MODEL, (train,), (later,), None, lambda text: None, DEFAULTS)


def judged(case: Case, *keys: str) -> Part:
    """What is left of effects that seemed to be sure, by their names."""
    own = tuple(next(c for c in case.candidates if c.key == key) for key in keys)
    (_, starts), = Screen(case.base, own[:1]).singles(1)
    case.search.refine([(own, starts if len(own) == 1 else [case.base.point])])
    h = next(h for h in case.search.ranked() if h.key == {*keys})
    sure = tuple(Present(kinds_of(e, h, DEFAULTS.part.dry)[0], e, e.ids, {}, 1.0, 1.0, 50.0, 50.0,
                         0.95) for e in own)
    return against_curves(case, Explanations((), 1.0), Part(sure, (), h, 1.0, 0.95),
                          [{"theta": SIGMA}] * 2)


def test_an_amplifier_that_bends_is_no_mode() -> None:
    """That is, or a curve of the input."""
    found = judged(case_of(MODEL.map_input("u_x", function="0.6*tanh(u_x/0.6)")), "second_mode")
    [p] = found.present
    assert not p.names and p.instead and p.instead.kind == Kind("input curve")


def test_an_amplifier_that_pushes_harder_one_way_is_no_constant_force() -> None:
    """Its mean is one, and a curve of the input has it, too, without any force at rest; what pushes
    at rest is none of that curve's.
    """
    [p] = judged(case_of(MODEL.map_input("u_x", function="u_x + 0.2*abs(u_x)")),
                 "static_bias").present
    assert not p.names and p.instead and p.instead.kind == Kind("input curve")
    tilted = MODEL.with_term("theta_dot", "10 - 5*tanh(theta_dot)")
    assert [p.names for p in judged(case_of(tilted), "static_bias").present] == [("static_bias",)]


def test_no_curve_takes_the_place_of_a_mode() -> None:
    """Of a state or of the input: a mode is neither."""
    case = case_of(MODEL)
    mode = next(c for c in case.candidates if c.key == "second_mode")
    rig = mode.applied(MODEL).with_values({"a_2": 20.0, "omega_2": 40.0, "zeta_2": 0.02})
    found = judged(case_of(rig), "second_mode")
    assert [p.names for p in found.present] == [("second_mode",)] and not found.doubtful


@pytest.mark.parametrize(("pair", "sure"), [
    (("coulomb_friction", "input_gain"), {"dry friction"}),
    (("coulomb_friction", "static_bias"), {"dry friction"}),
    (("cubic_stiffness", "input_gain"), set())])
def test_what_one_curve_does_by_itself_is_not_several_effects(
        pair: tuple[str, str], sure: set[str]) -> None:
    """A drag that fades at high speed: of effects that it is not, none is there; one that it may be
    stays where it does most of it.
    """
    rig = MODEL.with_term("theta_dot", "-4.5*theta_dot*abs(theta_dot)*exp(-abs(theta_dot))")
    found = judged(case_of(rig), *pair)
    assert {p.family for p in found.present} == sure
    assert len(found.doubtful) == 2 - len(sure)
    # of the curve that a drag is, a constant force is a share that need not be there beside it
    assert all("in its place" in d.why if d.kind.family == "constant force" else
               "by itself" in d.why for d in found.doubtful)


@pytest.mark.parametrize(("key", "states"), [
    ("static_bias", ["theta", "theta_dot"]), ("coulomb_friction", ["theta_dot"]),
    ("even_stiffness", ["theta"]), ("second_mode", []), ("wobble", [])])
def test_what_a_curve_of_a_state_may_be(key: str, states: list[str]) -> None:
    """A mode and what changes with time are none, and a constant is one of anything."""
    own = next(c for c in case_of(MODEL).candidates if c.key == key)
    assert [s for s in own.site.moving if curves._may_be_of(own, s)] == states


def test_several_effects_that_no_curve_is_are_compared_with_one() -> None:
    """A force of one range of speeds is no mode beside a constant force."""
    rig = MODEL.with_term("theta_dot", "1.5*exp(-((theta_dot - 0.8)/0.5)**2)")
    found = judged(case_of(rig), "second_mode", "static_bias")
    assert not found.present and all("by itself" in d.why for d in found.doubtful)


def test_a_limit_keeps_its_name() -> None:
    found = judged(case_of(MODEL.map_input("u_x", saturation=0.5)), "input_saturation")
    assert [p.names for p in found.present] == [("input_saturation",)]


@pytest.mark.parametrize(("family", "states"), [
    ("restoring force", ["v"]), ("dry friction", ["q"]), ("timing", ["q", "v"])])
def test_beside_a_member_no_curve_is_the_family_itself(
        monkeypatch: pytest.MonkeyPatch, family: str, states: list[str]) -> None:
    """With a curve of the deflection any spring is any other."""
    monkeypatch.setattr(curves, "with_free_curve", lambda *args: args[3])
    h: Any = SimpleNamespace(effects=(), minimum=SimpleNamespace(chi2=1.0))
    found: list[Any] = list(curves._beside(MODEL, h, sure_of(family)))
    assert found == states


SITE: Any = SimpleNamespace(q="q", v="v", moving=("q", "v"), inputs=("u",))


def sure_of(family: str, instead: str = "") -> Any:
    """A family that is there, or one of two."""
    own: Any = SimpleNamespace(argument="", site=SITE)
    return Present(Kind(family), own, (), {}, 1.0, 1.0, 50.0, 50.0, 0.95,
                   Instead(Kind(instead), own) if instead else None)


@pytest.mark.parametrize(("families", "tried"), [
    (("restoring force", ""), ["v", "u"]), (("restoring force", "gain"), ["v"]),
    (("gain", "dry friction"), ["q"]), (("dry friction", "restoring force"), ["u"]),
    # an input that acts elsewhere has a mean as well
    (("mode", "constant force"), ["q", "v", "u", "w"]), (("mode", "timing"), ["q", "v", "u"])])
def test_no_curve_stands_for_either_of_two_families(
        monkeypatch: pytest.MonkeyPatch, families: tuple[str, str], tried: list[str]) -> None:
    """Of what one of them depends on it would be that one; those for a constant force are zero at
    zero, and stand beside it as well.
    """
    asked: list[str] = []
    for name in ("with_free_curve", "with_free_input"):
        monkeypatch.setattr(curves, name, lambda *args: asked.append(args[3]))
    for name in ("state_curve", "input_curve"):
        monkeypatch.setattr(curves, name, lambda h, name, site, zero_at_zero: asked.append(
            name * zero_at_zero))
    monkeypatch.setattr(curves, "with_and_instead", lambda *args: (None, None))
    h: Any = SimpleNamespace(effects=(), minimum=SimpleNamespace(chi2=1.0))
    case: Any = SimpleNamespace(model=SimpleNamespace(input_names=("u", "w")),
                                search=SimpleNamespace(workers=1))
    assert all(kappa == np.inf for _, kappa in curves._in_its_place(
        case, h, sure_of(*families), [], 1.0, []))
    assert asked == tried


SPRING, CURVE = Kind("restoring force", "v"), Kind("input curve")


@pytest.mark.parametrize(("families", "kappas", "held", "instead", "dominance"), [
    (("mode", ""), {SPRING: 9.0, None: 8.0, CURVE: 7.0}, "", None, 7.0),
    (("mode", ""), {SPRING: 0.9, None: 8.0, CURVE: 7.0}, "", SPRING, 7.0),
    (("mode", ""), {SPRING: 9.0, None: 8.0, CURVE: 0.7}, "", CURVE, 8.0),
    (("gain", ""), {SPRING: 1.0, None: 17.0}, "", SPRING, 17.0)])
def test_where_only_curves_of_one_family_do_as_well_it_is_one_of_two(
        families: tuple[str, str], kappas: dict[Kind | None, float], held: str,
        instead: Kind | None, dominance: float) -> None:
    found = against(families, kappas, held)
    assert isinstance(found, Present) and found.dominance == dominance and not found.names
    assert (found.instead.kind if found.instead else None) == instead


@pytest.mark.parametrize(("families", "kappas", "held"), [
    (("mode", ""), {SPRING: 9.0, None: 0.8}, ""),  # a curve of the rate is of two families
    (("mode", ""), {SPRING: 0.9, CURVE: 0.8}, ""),  # curves of two families
    (("mode", ""), {SPRING: 0.9, CURVE: 7.0}, "restoring force"),  # which is there anyway
    (("mode", "timing"), {SPRING: 0.9, CURVE: 7.0}, ""),  # one of two already
    (("gain", ""), {SPRING: 1.0, None: 15.0}, "")])  # of a scale error more is asked
def test_where_more_curves_do_as_well_none_is_sure(
        families: tuple[str, str], kappas: dict[Kind | None, float], held: str) -> None:
    found = against(families, kappas, held)
    least = min(kappas.values())
    told = f"{least:.2g} times as much" if least >= 1 else "less in its place"
    assert isinstance(found, Doubtful) and f"leaves {told}" in found.why


def against(families: tuple[str, str], kappas: dict[Kind | None, float], held: str
            ) -> Present | Doubtful:
    h: Any = SimpleNamespace(effects=(effect("spring", held),) if held else (), blurred=())
    return curves._against(sure_of(*families), h, DEFAULTS.part, list(kappas.items()))


@pytest.mark.parametrize(("held", "sure", "verdict"), [
    ("ab", "", "named"),          # two effects may be all that is missing
    ("abc", "abc", "named"),      # three are, where each is sure by its name
    ("abc", "ab", "partial"),     # else it is said which of them are
    ("abc", "", "unconfirmed")])
def test_many_effects_are_all_only_where_each_is_sure(
        monkeypatch: pytest.MonkeyPatch, held: str, sure: str, verdict: str) -> None:
    h: Any = SimpleNamespace(effects=[effect(name) for name in held], key=frozenset(held))
    present: Any = tuple(SimpleNamespace(names=(name,)) for name in sure)
    part = Part(present, (), h, 1.0, 0.95) if sure else None
    monkeypatch.setattr(surely, "_sure", lambda case: (None, part))
    monkeypatch.setattr(surely, "sure_channels", lambda *_: ("dynamics",))
    case: Any = SimpleNamespace(settings=DEFAULTS, proves=True, base=None, candidates=(),
                                search=SimpleNamespace(ranked=list))
    found = surely.with_sure_part(case, Answer("named", (h,), ()), h)
    assert found.verdict == verdict
    assert bool(found.doubt) == (verdict == "unconfirmed")
