"""The sentence about what to record next."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.report.advice import PROVE, REPEAT, STRENGTHEN, advice, explore
from pikanid.mismatch.report.findings import Explanation
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel

RATE = float(np.sqrt(9.81 / 0.045))


def explanation(title: str, term: str, identifier: str = "law", score: float = 0.0
                ) -> Explanation:
    model = pk.systems.sloshing().with_term("theta_dot", term, [pk.Parameter("a", 0.5)])
    effects = (SimpleNamespace(ids=(identifier,), once=False),)
    return cast(Explanation, SimpleNamespace(
        title=title, model=model, effects=effects, score=score))


@pytest.fixture(scope="module")
def records() -> Records:
    rec = pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=0.002, seed=0)
    level = cast(NoiseModel, SimpleNamespace(sigma=0.002))
    return Records((rec,), ({"theta": level},), DEFAULTS)


FRICTION = explanation("dry friction", "-a*sign(theta_dot)")
DRAG = explanation("drag", "-a*abs(theta_dot)*theta_dot")


@pytest.mark.slow
def test_a_profile_that_tells_them_apart_is_proposed(records: Records) -> None:
    text = advice("set", (FRICTION, DRAG), records, RATE, True)
    assert text.startswith("To tell dry friction from drag: run ")
    assert "`pikanid design`" in text


def test_what_no_profile_tells_apart_is_said_to_be_so(records: Records) -> None:
    twin = explanation("the same again", "-a*sign(theta_dot)")
    text = advice("set", (FRICTION, twin), records, RATE, True)
    assert text.startswith("No usual profile tells dry friction from the same again")


@pytest.mark.parametrize(("score", "alike"), [(0.2, True), (3.0, False)])
def test_what_predicts_the_same_is_told_to_need_another_sensor(
        records: Records, score: float, alike: bool) -> None:
    other = explanation("drag", "-a*abs(theta_dot)*theta_dot", score=score)
    text = advice("set", (FRICTION, other), records, 0.0, True)
    assert text.startswith(f"To tell dry friction from drag: record {explore(True, 0.0)}.")
    assert ("differs (by 0.2 of chi-squared): if it stays so, only another quantity" in text
            ) == alike


@pytest.mark.parametrize("value", [0.4, 7.0])
def test_the_best_profile_is_proposed_only_where_it_separates(
        records: Records, value: float, monkeypatch: pytest.MonkeyPatch) -> None:
    best = SimpleNamespace(value=value, separated=3.0, before=0.2, repeated=0.3,
                           profile=SimpleNamespace(name="a slow sweep"))
    monkeypatch.setattr("pikanid.mismatch.report.advice.next_experiment", lambda *_, **__: best)
    text = advice("set", (FRICTION, DRAG), records, RATE, True)
    if value < best.separated:
        assert text == ("No usual profile tells dry friction from drag (at best 0.4 standard "
                        "deviations apart): only a larger stroke, less noise or a second sensor "
                        "would.")
    else:
        assert text.startswith("To tell dry friction from drag: run a slow sweep, expected to set "
                               "them 7 standard deviations apart (now 0.2;")


def test_other_verdicts_have_sentences_of_their_own(records: Records) -> None:
    assert advice("named", (FRICTION,), records, RATE, True) == ""
    assert explore(True, RATE) in advice("unnamed", (), records, RATE, True)
    assert explore(True, RATE) in advice("unconfirmed", (FRICTION,), records, RATE, True)
    assert explore(False, 0.0) in advice("partial", (FRICTION,), records, 0.0, True, driven=False)
    assert advice("unconfirmed", (FRICTION,), records, RATE, False) == PROVE
    once = cast(Explanation, SimpleNamespace(
        title="a push", effects=(SimpleNamespace(ids=("disturbance",), once=True),)))
    assert advice("unconfirmed", (once,), records, RATE, True, weak=True) == REPEAT
    idle = advice("unconfirmed", (FRICTION,), records, RATE, True, weak=True, idle=["a wall"])
    assert "a wall acts there as well" in idle
    assert advice("unconfirmed", (FRICTION,), records, RATE, True, weak=True) == STRENGTHEN


def test_what_to_record_suits_the_plant() -> None:
    assert "resonance" in explore(True, RATE) and "decay" in explore(True, RATE)
    motor = explore(True, 0.0)
    assert "steps" in motor and "resonance" not in motor and "decay" not in motor
    pendulum = explore(False, RATE)
    assert "decay" in pendulum and "resonance" not in pendulum and "steps" not in pendulum


def test_a_likelier_law_outside_the_catalogue_is_to_be_told_apart(records: Records) -> None:
    outside = explanation("the same again", "-a*sign(theta_dot)", "symbolic:-a*sign(theta_dot)")
    text = advice("unconfirmed", (FRICTION, outside), records, RATE, True, weak=True)
    assert text.startswith("No usual profile tells dry friction from the same again")
