"""A diagnosis in words: what its headline says of hypotheses that share a title."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

import pikanid as pk
import pikanid.mismatch.diagnose as module
from pikanid.estimate import Estimate
from pikanid.mismatch.beyond.region import Interval
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.judge.answer import Answer, Verdict
from pikanid.mismatch.report.advice import advice
from pikanid.mismatch.report.diagnosis import Diagnosis
from pikanid.mismatch.report.explained import _behind
from pikanid.mismatch.report.findings import Explanation, NamedEffect, Where
from pikanid.mismatch.report.part import Value
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.mismatch.steps.reporting import reported
from pikanid.model.systems import sloshing
from pikanid.reporting.diagnosis_page import _where

Recordings = tuple[pk.Recording, ...] | None


def explanation(name: str, expression: str, probability: float = 0.5) -> Explanation:
    effect = NamedEffect((name.replace(" ", "_"),), name, expression, {})
    return Explanation((effect,), probability, sloshing(), 0.0, None, None)


def diagnosis(verdict: Verdict, *given: Explanation) -> Diagnosis:
    nothing = cast(Estimate, SimpleNamespace(
        model=sloshing(), free=(), theta=(), covariance=(), at_bound=()))
    return Diagnosis(verdict, 1e-9, DEFAULTS, Where(("dynamics",), "v", (), (), None), given, (),
                     nothing, nothing, None)


def test_only_a_term_of_an_equation_is_added_to_it() -> None:
    term = NamedEffect(("symbolic:-k*v**5",), "a law", "-k*v**5", {}, "dynamics", "v")
    curve = NamedEffect(("symbolic:tanh(k*u)/k",), "a curve", "tanh(k*u)/k", {}, "input", "v")
    said = str(diagnosis("named", Explanation((term, curve), 0.5, sloshing(), 0.0, None, None)))
    assert "\n  v' += -k*v**5   [" in said and "\n  tanh(k*u)/k   [" in said


def test_where_is_said_in_words_and_as_data() -> None:
    said = replace(diagnosis("named", explanation("impact on a wall", "-k*max(q - w, 0)")), where=(
        Where(("dynamics",), "v", ("q",), ((1.0, 2.5),), True, (Interval("q", 0.1, 0.3, "rad"),))))
    assert "Where: dynamics; at q from 0.1 to 0.3 rad; in time at 1 to 2.5 s" in str(said)
    assert _where(said).startswith(
        "<h2>Where</h2><p>Channel: the dynamics; depends on q. It acts at q from 0.1 to 0.3 rad.")
    several = replace(said, where=replace(said.where, channels=("dynamics", "sensor"), region=()))
    assert "Where: dynamics and sensor; in time" in str(several)
    assert "the dynamics and the sensor" in _where(several) and "acts at" not in _where(several)
    beside = replace(said, where=replace(said.where, parameters={"k": Value(30.0, 0.1, "1/s^2")}))
    assert "\n  with a free force there: k = 30.00 ± 0.10 1/s^2\n" in str(beside)
    assert "With a free force there: k = 30.00 ± 0.10 1/s²." in _where(beside)
    none = replace(said, where=replace(said.where, channels=()))
    assert [d.where.channel for d in (said, several, none)] == ["dynamics", "several", "undecided"]
    assert "channel undecided" in str(none) and "undecided between" in _where(none)


def test_parameters_of_the_model_are_told_before_and_after() -> None:
    def estimate(*values: float) -> Estimate:
        free = [SimpleNamespace(label=f"k_{n}", unit="1/s^2") for n in range(len(values))]
        return cast(Estimate, SimpleNamespace(
            model=sloshing(), free=free, theta=np.array(values),
            covariance=1e-4 * np.eye(len(values)), at_bound=[False] * len(values)))

    one = diagnosis("named", explanation("drag", "-q*v"))
    said = str(replace(one, before=estimate(2.0, 5.0), after=estimate(3.0, 5.5)))
    assert ("\nModel: k_0 = 2.000 ± 0.010 -> 3.000 ± 0.010 1/s^2; "
            "k_1 = 5.000 ± 0.010 -> 5.500 ± 0.010 1/s^2\n") in said
    many = str(replace(one, before=estimate(*range(11)), after=estimate(*range(11))))
    assert "k_7 = " in many and "k_8 = " not in many and "; and 3 more\n" in many
    assert "Model:" not in str(one)


@pytest.mark.parametrize(("count", "said"), [
    (3, "law 0; or law 1; or law 2, "), (4, "law 2; or law 3, "),
    (5, "law 2; or one of 2 other explanations, ")])
def test_a_sentence_has_three_explanations(count: int, said: str) -> None:
    """All of them stand below it."""
    given = [explanation(f"law {k}", f"-c*{k}") for k in range(count)]
    for verdict, end in (("set", "which these recordings"), ("unconfirmed", "not confirmed")):
        one = diagnosis(cast(Verdict, verdict), *given)
        assert said + end in one.sentence()
        assert all(f"law {k}" in str(one) for k in range(count))


def test_a_wrong_recording_is_not_blamed_on_the_other() -> None:
    train = pk.Recording.from_arrays([0.0, 1.0, 2.0], {"force": [0.0, 1.0, 0.0]})
    with pytest.raises(pk.errors.BadRecording, match="'u_x'"):
        pk.diagnose(sloshing(), train, pk.simulate(sloshing(), pk.excitation.two_pulse()))


def test_a_unit_of_another_kind_is_said_with_its_recording() -> None:
    train = pk.simulate(sloshing(), pk.excitation.two_pulse()).with_unit("u_x", "kg")
    with pytest.raises(pk.errors.BadUnit, match=r"channel 'u_x': 'kg' cannot.*--unit u_x=UNIT"):
        pk.diagnose(sloshing(), train)


def test_long_times_are_in_hours_and_formulas_have_an_equation() -> None:
    law = explanation("a law", "a*exp(-b*T)")
    law = replace(law, effects=(replace(law.effects[0], ids=("symbolic:a*exp(-b*T)",),
                                        equation="T"),))
    said = replace(diagnosis("named", law), where=(
        Where(("dynamics",), "T", (), ((3600.0, 18_000.0),), None)))
    assert "in time at 1 to 5 h" in str(said)
    assert "\n  T' += a*exp(-b*T)   [symbolic:a*exp(-b*T)]" in str(said)


@pytest.mark.parametrize(("first", "other", "missed", "verdict"), [
    ("unnamed", "partial", 2.0, "partial"), ("unconfirmed", "named", 2.0, "named"),
    ("unnamed", "partial", 0.5, "unnamed"), ("unnamed", "unconfirmed", 2.0, "unnamed"),
    ("unnamed", "none", 2.0, "unnamed"), ("partial", "named", 2.0, "partial"),
    ("none", "named", 2.0, "none"), ("unnamed", pk.errors.BadRecording("short"), 2.0, "unnamed")])
def test_recordings_are_exchanged_where_nothing_is_proved(
        monkeypatch: pytest.MonkeyPatch, first: Verdict, other: Verdict | Exception, missed: float,
        verdict: Verdict) -> None:
    one, two = (pk.simulate(sloshing(), pk.excitation.two_pulse(), sigma=0.002, seed=seed)
                for seed in (1, 2))
    stretch = (0.0, 1.0)

    def opened(model: pk.Model, train: Recordings, later: Recordings, quiet: object,
               **rest: object) -> SimpleNamespace:
        assert (train, later, quiet) in [((one,), (two,), stretch), ((two,), (one,), None),
                                         ((one,), None, stretch)]
        chi2 = 7.0 + (1.0 if train == (one,) else missed)
        base = SimpleNamespace(minimum=SimpleNamespace(chi2=chi2), whitened=SimpleNamespace(rows=7))
        return SimpleNamespace(train=train, proves=later is not None, base=base)

    def diagnosed(case: SimpleNamespace, quiet: object, tell: object) -> Diagnosis:
        if case.train == (one,):
            return diagnosis(first)
        if isinstance(other, Exception):
            raise other
        return replace(diagnosis(other), notes=("its own",))

    monkeypatch.setattr(module, "open_case", opened)
    monkeypatch.setattr(module, "_diagnosed", diagnosed)
    found = pk.diagnose(sloshing(), one, two, quiet=stretch)
    assert found.verdict == verdict
    assert found.exchanged == (first != verdict)
    assert found.notes == ((module.EXCHANGED, "its own") if found.exchanged else ())
    assert pk.diagnose(sloshing(), one, quiet=stretch).verdict == first  # nothing to exchange


@pytest.mark.parametrize("verdict", ["set", "unconfirmed"])
def test_no_headline_says_the_same_twice(verdict: Verdict) -> None:
    forth = explanation("friction in one direction", "-c*(sign(v) + 1)/2")
    back = explanation("friction in one direction", "-c*(sign(v) - 1)/2")
    said = diagnosis(verdict, forth, back).sentence()
    assert "(-c*(sign(v) + 1)/2); or" in said and "(-c*(sign(v) - 1)/2)" in said
    # what adds the same to the model is one hypothesis, whatever it is called inside
    said = diagnosis(verdict, forth, forth).sentence()
    assert said.count("friction in one direction") == 1 and "one of" not in said
    said = diagnosis(verdict, forth, explanation("backlash", "-b")).sentence()
    assert "friction in one direction; or backlash" in said


@pytest.mark.parametrize("gap", [-10.0, -0.4, 0.0, 0.4])
def test_what_fits_no_worse_is_not_said_to_fit_worse(gap: float) -> None:
    for given in (True, False):
        assert "higher" not in _behind(gap, given) and "0" not in _behind(gap, given)


@pytest.mark.parametrize("stiffer", [0.0, 400.0])
def test_what_only_the_held_out_recording_shows_is_to_be_looked_for_there(stiffer: float) -> None:
    nominal = sloshing()
    other = nominal.with_term("theta_dot", "-k3*theta**3", [pk.Parameter("k3", stiffer)])
    train, later = (pk.simulate(model, pk.excitation.planar_moves(3, 4.0, seed=seed), sigma=0.002,
                                seed=seed) for seed, model in ((1, nominal), (2, other)))
    case = open_case(nominal, (train,), (later,), None, lambda text: None, DEFAULTS)
    result = reported(case, case.detected(), Answer("none", (), ()), case.sites[0], None)
    assert result.verdict == "none" and result.held_out is not None
    assert (result.held_out.p_value < 0.01) == (stiffer > 0)
    assert any("does not predict the held-out one" in n for n in result.notes) == (stiffer > 0)


def test_what_happened_once_is_not_confirmed_elsewhere() -> None:
    """The other recording is predicted without it, which proves nothing of it."""
    given = explanation("a force local in time", "peak*exp(-(t - 2)**2)")
    once = replace(given, effects=(replace(given.effects[0], once=True),))
    assert diagnosis("named", given).sentence().endswith("confirmed on the held-out recording.")
    said = diagnosis("named", once).sentence()
    assert said.endswith("confirmed as what happened once, and not on the held-out recording, "
                         "which is predicted without it.")
    both = replace(once, effects=(*given.effects, *once.effects))
    assert diagnosis("named", both).sentence().endswith(
        "confirmed on the held-out recording, a force local in time as what happened once.")
    records = cast(Records, None)
    assert "take that effect out" in advice("named", [once], records, 1.0, True)
    assert advice("named", [given], records, 1.0, True) == ""


def test_effects_of_one_name_are_told_apart_by_their_equations() -> None:
    law = explanation("a memory that fades", "k*z")
    one, other, third = (replace(law.effects[0], name=name, equation=of) for name, of in (
        ("a memory that fades", "x1"), ("a memory that fades", "x2"), ("an offset", "h")))
    assert replace(law, effects=(one, other, third)).title == (
        "a memory that fades in x1', a memory that fades in x2' and an offset")
    assert replace(law, effects=(one, third)).title == "a memory that fades and an offset"


def test_noise_that_may_be_all_is_said() -> None:
    said = replace(diagnosis("unnamed"), doubt=pk.errors.may_be_noise([0.83])).sentence()
    assert said.endswith("explains it; it may be noise alone, with a correlation of 0.83 between "
                         "neighbours, which a quiet stretch or the same recorded again would tell.")
    assert "correlation" not in pk.errors.may_be_noise([])
