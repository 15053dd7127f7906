"""From ranked hypotheses to an answer, on hypotheses made up for the purpose."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from pikanid.mismatch.catalogue.candidate import SYMBOLIC, Candidate
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.detect.residual_tests import Detection
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.judge.evidence import Evidence, Jobs
from pikanid.mismatch.judge.laws_outside import with_formulas
from pikanid.mismatch.judge.prediction import HeldOut
from pikanid.mismatch.judge.verdict import settle
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.model.parts import Parameter
from pikanid.model.systems import sloshing
from pikanid.optimise.levenberg_marquardt import Minimum

SITE = SimpleNamespace(suffix="", swing=1.0, v="v")
ROWS = 1000
APART, ODDS = DEFAULTS.verdict.indistinct, DEFAULTS.verdict.decoy_handicap


def effect(name: str, known: bool = True) -> Candidate:
    return Candidate((name,), name, name, "dynamics", SITE,  # type: ignore[arg-type]  # a stand-in
                     (Parameter(f"p_{name}", 0.0),), lambda m: m, lambda view: (), known=known)


A, B, GUARD = effect("a"), effect("b"), effect("outside", known=False)
LAW = effect(f"{SYMBOLIC}k*q**2")

# Relative errors of every χ² and deviance, as of a processor that adds in another order: none, one
# rounding up or down, any of that size, and errors just above the dead band, which show that no
# case below sits on an edge.
ERRORS = {"exact": (0.0, 0), "up": (1e-12, 1), "down": (-1e-12, 1), "mixed": (1e-12, 2),
          "mixed again": (1e-12, 3), "above the dead band": (1e-6, 4)}


@pytest.fixture(params=ERRORS, autouse=True)
def rounding(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every answer of this file is the same whatever the errors."""
    size, seed = ERRORS[request.param]
    rng = np.random.default_rng(seed)

    def rounded(value: float) -> float:
        return value * (1 + size * (1.0 if seed < 2 else rng.uniform(-1, 1)))

    monkeypatch.setitem(globals(), "rounded", rounded)


def rounded(value: float) -> float:
    return value


def hypothesis(chi2: float, *effects: Candidate, spread: float = 0.0) -> Hypothesis:
    """A fit of 1 ± 0.01 that leaves χ², at a price of 14 for each effect; its noise's doubt."""
    free = [SimpleNamespace(name=n, label=n, guess=1.0, bounds=(-np.inf, np.inf), recording=None)
            for n in ("length", "damping", *(p.name for e in effects for p in e.parameters))]
    r = np.full(ROWS, np.sqrt(chi2 / ROWS))
    whitened = cast(Whitened, SimpleNamespace(
        rows=ROWS, problem=SimpleNamespace(free=free, lower=-np.inf, upper=np.inf),
        records=SimpleNamespace(spread=spread, guess={}), settings=DEFAULTS,
        sizes=np.ones(len(free))))
    found = Minimum(np.ones(len(free)), r, 100.0 * np.eye(ROWS, len(free)), True)
    return Hypothesis(tuple(effects), sloshing(), whitened, found, 14.0 * len(effects))


def answered(fits: list[Hypothesis], deviance: dict[str, float] | None = None,
             refused: tuple[str, ...] = (), unseen: tuple[str, ...] = (),
             contradicted: tuple[str, ...] = (), inert: tuple[str, ...] = (),
             misfit: dict[str, float] | None = None, motion: float = 1e4,
             stiff: tuple[str, ...] = ()) -> Answer:
    """The answer with these held-out evidences (0 unless given) and misfits (1), some effects
    refuted there, some not to be seen or not acting, some contradicted by all recordings together,
    with so much motion there, where some cannot be run.
    """
    fits = [replace(h, minimum=replace(h.minimum, r=h.minimum.r * np.sqrt(
        rounded(h.minimum.chi2) / h.minimum.chi2))) for h in fits]
    keys = sorted({key for h in fits for key in h.key})

    def found(h: Hypothesis, where: tuple[str, ...] = refused) -> Detection:
        p = 1e-6 if h.key & set(where) else 0.5
        return cast(Detection, SimpleNamespace(p_value=p))

    def predicted(h: Hypothesis) -> HeldOut | None:
        if h.key & set(stiff):
            return None
        name = "+".join(sorted(h.key))
        value = rounded((deviance or {}).get(name, 0.0))
        rest = np.array([10.0 * (one in h.key) * (one not in unseen) for one in keys])
        return cast(HeldOut, SimpleNamespace(
            detection=found(h), together=found(h, contradicted), deviance=value,
            misfit=rounded((misfit or {}).get(name, 1.0)), rest=rest, motion=motion,
            acts={f"p_{one}": 0.0 if one in inert else 9.0 for one in keys}))

    def adequate(h: Hypothesis) -> Detection:
        return cast(Detection, SimpleNamespace(p_value=0.5 if h.effects else 1e-9))

    ranked = sorted(fits, key=lambda h: h.score())
    def ahead(jobs: Jobs) -> None:
        """Done ahead of time, as by several threads."""
        for job in jobs:
            job()

    known = Evidence([h for h in ranked if not h.symbolic], 1.0, adequate, predicted, True, True,
                     DEFAULTS, ahead)
    answer = settle(known)
    if answer.verdict != "unnamed":
        return answer
    return with_formulas(answer, replace(known, ranked=ranked))


BASE = hypothesis(2000.0)


def test_one_more_effect_that_is_nearly_worth_its_price_is_given_as_well() -> None:
    given = answered([BASE, hypothesis(1000.0, A), hypothesis(989.0, A, B)])
    assert given.verdict == "set"
    assert [sorted(h.key) for h in given.given] == [["a"], ["a", "b"]]
    given = answered([BASE, hypothesis(1000.0, A), hypothesis(996.0, A, B)])
    assert given.verdict == "named" and given.given[0].key == {"a"}


def test_the_held_out_recording_decides_between_them() -> None:
    fits = [BASE, hypothesis(1000.0, A), hypothesis(989.0, A, B)]
    assert answered(fits, {"a": 10.0}).given[0].key == {"a", "b"}
    assert answered(fits, {"a+b": 10.0}).given[0].key == {"a"}


def test_what_fits_a_little_worse_may_predict_far_better() -> None:
    fits = [BASE, hypothesis(1000.0, A), hypothesis(1010.0, B)]
    assert [h.key for h in answered(fits).given] == [{"a"}]
    assert [h.key for h in answered(fits, {"a": 20.0}).given] == [{"b"}]


def test_each_of_several_effects_has_to_help_on_the_held_out_recording() -> None:
    fits = [BASE, hypothesis(1000.0, A), hypothesis(1010.0, B), hypothesis(900.0, A, B)]
    assert answered(fits, {"a": 50.0, "b": 50.0}).verdict == "named"
    needless = answered(fits, {"a": 50.0})
    assert needless.verdict == "unconfirmed" and "does not need a" in needless.doubt
    # where the held-out recording speaks against one more effect, it is not given
    nearly = [BASE, hypothesis(1000.0, A), hypothesis(989.0, A, B)]
    assert answered(nearly, {"a+b": 1.0}).verdict == "named"


def test_a_weak_effect_is_not_named() -> None:
    weak = [hypothesis(1080.0), hypothesis(1000.0, A)]
    given = answered(weak, {"": 5.0})
    assert given.verdict == "unconfirmed" and "weak" in given.doubt
    # both recordings count, and every effect
    assert answered(weak, {"": 20.0}).verdict == "named"
    pair = [BASE, hypothesis(1000.0, A), hypothesis(1900.0, B), hypothesis(910.0, A, B)]
    assert answered(pair, {"": 99.0, "a": 4.0, "b": 99.0}).verdict == "unconfirmed"
    assert answered(pair, {"": 99.0, "a": 20.0, "b": 99.0}).verdict == "named"
    # more of each of two than of one
    assert answered([hypothesis(1091.0), hypothesis(1000.0, A)]).verdict == "named"
    assert answered(pair, {"": 99.0, "a": 1.0, "b": 99.0}).verdict == "unconfirmed"


def test_more_is_asked_where_the_noise_is_little_known() -> None:
    def fits(spread: float) -> list[Hypothesis]:
        return [hypothesis(1180.0), hypothesis(1000.0, A, spread=spread)]

    assert answered(fits(0.1)).verdict == "named"
    assert "204 are asked" in answered(fits(0.5)).doubt
    # known by its order only, no more: some gain is always enough
    strong = [hypothesis(1295.0), hypothesis(1000.0, A, spread=3.0)]
    assert answered(strong).verdict == "named"


def test_what_predicts_worse_than_the_nominal_model_is_not_proved() -> None:
    """However much of that the parameters' errors would forgive."""
    fits = [BASE, hypothesis(1000.0, A)]
    assert answered(fits, misfit={"a": 1.05}).verdict == "named"
    given = answered(fits, misfit={"a": 1.2})
    assert given.verdict == "unconfirmed" and "worse than the nominal" in given.doubt


def test_an_effect_must_show_where_it_was_found() -> None:
    """The held-out recording is a proof, not where explanations are chosen."""
    fits = [hypothesis(2000.0), hypothesis(1000.0, A), hypothesis(995.0, A, B)]
    deviance = {"": 500.0, "a": 200.0, "a+b": 0.0}
    given = answered(fits, deviance)
    assert given.verdict == "unconfirmed" and "hardly shows b" in given.doubt
    assert answered([*fits[:2], hypothesis(980.0, A, B)], deviance).verdict == "named"
    # what is sure by itself stays an answer beside what predicts a little better
    little = answered([*fits[:2], hypothesis(998.0, A, B)], {"": 500.0, "a": 122.0, "a+b": 100.0})
    assert [h.key for h in little.given] == [{"a", "b"}, {"a"}] and little.verdict == "set"


def test_no_name_is_sure_while_what_is_refused_does_far_better() -> None:
    """It is a part of the truth, or close to it."""
    fits = [BASE, hypothesis(1000.0, A), hypothesis(1003.0, B)]
    sure = answered(fits, {"b": -3.0 - APART + 1.0}, refused=("b",))
    assert (sure.verdict, sure.given[0].key) == ("named", {"a"})
    doubted = answered(fits, {"b": -3.0 - APART - 1.0}, refused=("b",))
    assert (doubted.verdict, doubted.given[0].key) == ("unconfirmed", {"a"})
    assert doubted.doubt == "what explains it far better leaves something unexplained"


@pytest.mark.parametrize("rounding", [e for e in ERRORS if "above" not in e], indirect=True)
def test_exact_ties_fall_the_same_way_whatever_the_rounding() -> None:
    """Each of these sits on a threshold: without a dead band the last digit decides."""
    same = [BASE, hypothesis(1000.0, A), hypothesis(1001.0, GUARD), hypothesis(1000.0, LAW)]
    assert answered(same, refused=("a",)).verdict == "named"
    within = [BASE, hypothesis(1000.0, A), hypothesis(1000.0 + APART, B)]
    assert [h.key for h in answered(within).given] == [{"a"}]
    equal = [BASE, hypothesis(1000.0, B), hypothesis(1000.0, A)]
    given = answered(equal)
    assert given.verdict == "set" and [h.key for h in given.given] == [{"a"}, {"b"}]
    strong = [hypothesis(1090.0), hypothesis(1000.0, A)]
    assert answered(strong).verdict == "named"
    more = DEFAULTS.verdict.needless
    nearly = [BASE, hypothesis(1000.0, A), hypothesis(1000.0 - 14.0 + more, A, B)]
    assert answered(nearly).verdict == "named"


def test_the_most_probable_explanation_comes_first() -> None:
    """Also where it is a law outside the catalogue, or a part of what is missing."""
    given = answered([BASE, hypothesis(1000.0, A), hypothesis(985.0, GUARD)], {"a": -12.0})
    scores = {h.key: h.score() + ODDS * (not h.known) for h in given.given}
    found = [scores[h.key] + {"a": -12.0}.get("+".join(h.key), 0.0) for h in given.given]
    assert len(found) == 2 and found == sorted(found)
    for one in (A, replace(A, exponent=2.0)):  # also where no law of free exponent stands beside
        part = answered([BASE, hypothesis(1000.0, one), hypothesis(1001.0, B)],
                        refused=("a", "b"), misfit={"a": 0.22, "b": 0.21})
        assert part.verdict == "unconfirmed" and [h.key for h in part.given] == [{"a"}, {"b"}]


def test_what_is_sure_is_given_whatever_weak_effect_may_be_there_besides() -> None:
    given = answered([BASE, hypothesis(1000.0, A), hypothesis(1900.0, B), hypothesis(984.0, A, B)])
    assert given.verdict == "set" and not given.doubt
    assert [sorted(h.key) for h in given.given] == [["a", "b"], ["a"]]
    weak = [hypothesis(1034.0), hypothesis(1000.0, A), hypothesis(1030.0, B),
            hypothesis(984.0, A, B)]
    assert answered(weak).verdict == "unconfirmed"


def test_what_all_recordings_together_refute_is_not_given() -> None:
    fits = [BASE, hypothesis(1000.0, A), hypothesis(1100.0, B)]
    assert answered(fits).verdict == "named"
    assert answered(fits, contradicted=("a",)).verdict == "unnamed"


def test_a_law_outside_the_catalogue_that_predicts_far_better_keeps_names_away() -> None:
    fits = [BASE, hypothesis(1000.0, A), hypothesis(1010.0, GUARD)]
    assert answered(fits).verdict == "named"
    assert answered(fits, {"a": 50.0}).verdict == "unnamed"


def test_a_law_outside_the_catalogue_that_would_do_as_well_stands_beside_the_name() -> None:
    fits = [BASE, hypothesis(1000.0, A), hypothesis(1001.0, GUARD)]
    given = answered(fits)
    assert given.verdict == "set" and [sorted(h.key) for h in given.given] == [["a"], ["outside"]]
    worse, tied, better = (hypothesis(1000.0 + gap - ODDS, GUARD) for gap in (
        APART + 1.0, 1.0, -1.0))
    assert answered([BASE, hypothesis(1000.0, A), worse]).verdict == "named"
    # somewhat better, and yet no more probable
    tie = answered([BASE, hypothesis(1000.0, A), tied])
    assert tie.verdict == "set" and len(tie.given) == 2
    assert answered([BASE, hypothesis(1000.0, A), hypothesis(1001.0, B),
                     hypothesis(998.5, GUARD)]).verdict == "unconfirmed"
    # one that is more probable keeps the name from being sure
    given = answered([BASE, hypothesis(1000.0, A), better])
    assert given.verdict == "unconfirmed" and "outside" in given.doubt
    # where only the law outside the catalogue is left, nothing has a name
    assert answered(fits, refused=("a",)).verdict == "unnamed"


def test_a_form_next_to_the_name_is_given_where_it_is_likely_enough() -> None:
    """It is one of many: what it is handicapped by is the prior odds against it."""
    near = replace(effect("square", known=False), next_to="a")
    found = [answered([BASE, hypothesis(1000.0, A), hypothesis(1000.0 + gap - ODDS, near)]).verdict
             for gap in (APART - 1.0, APART + 1.0, 1.0, -1.0)]
    assert found == ["set", "named", "set", "unconfirmed"]


def test_twins_beside_a_law_outside_the_catalogue_are_one_hypothesis() -> None:
    one, other = (replace(effect(name), twin="scale") for name in ("gain", "lever"))
    fits = [BASE, hypothesis(1000.0, A, one), hypothesis(1000.1, A, other),
            hypothesis(1001.0, GUARD, one), hypothesis(1001.1, GUARD, other),
            hypothesis(1300.0, A), hypothesis(1900.0, one), hypothesis(1900.0, other)]
    given = answered(fits, {"a": 500.0, "gain": 500.0, "lever": 500.0})
    assert [sorted(h.key) for h in given.given] == [["a", "gain"], ["gain", "outside"]]
    assert given.verdict == "set"
    gain, outside = (given.twins[frozenset({"outside", "gain"})][n] for n in ("gain", "outside"))
    assert gain.ids == gain.words == ("gain", "lever") and outside.ids == ("symbolic:outside",)


def test_a_formula_is_given_only_where_the_catalogue_is_refuted() -> None:
    fits = [BASE, hypothesis(1000.0, A), hypothesis(1000.5, GUARD), hypothesis(1000.0, LAW)]
    refuted = answered(fits, refused=("a",))
    assert refuted.verdict == "named" and [h.key for h in refuted.given] == [{LAW.key}]
    # a formula that explains far less than the law outside the catalogue is none
    poor = [*fits[:3], hypothesis(1012.0, LAW)]
    assert answered(poor, refused=("a",)).verdict == "unnamed"


def test_a_formula_is_not_sure_beside_another_law_that_does_about_as_well() -> None:
    fits = [BASE, hypothesis(1000.0, A), hypothesis(1013.0, GUARD), hypothesis(1000.0, LAW)]
    given = answered(fits, {"outside": -9.0}, refused=("a",))
    assert given.verdict == "unconfirmed" and "about as well" in given.doubt
    better = [*fits[:2], hypothesis(1016.0, GUARD), fits[3]]
    assert answered(better, {"outside": -30.0}, refused=("a",)).verdict != "named"
    assert answered(fits, {"outside": 9.0}, refused=("a",)).verdict == "named"


def test_a_formula_that_is_the_sum_of_two_entries_needs_both() -> None:
    both = replace(effect(f"{SYMBOLIC}k*sign(v) + f"), covers={"a": {}, "b": {}})
    fits = [BASE, hypothesis(1900.0, B), hypothesis(1000.5, GUARD), hypothesis(1000.0, both)]
    assert answered([*fits, hypothesis(1100.0, A)], refused=("a",)).verdict == "named"
    weak = answered([*fits, hypothesis(1040.0, A)], refused=("a",))
    assert weak.verdict == "unconfirmed" and weak.given[0].symbolic and "weak" in weak.doubt


def test_a_law_outside_the_catalogue_that_does_better_than_a_formula_stands_beside_it() -> None:
    fits = [BASE, hypothesis(1000.0, A), hypothesis(1000.0, GUARD)]
    both = answered([*fits, hypothesis(1005.0, LAW)], refused=("a",))
    assert both.verdict == "unconfirmed" and "which form" in both.doubt
    assert {h.key for h in both.given} == {frozenset({GUARD.key}), frozenset({LAW.key})}
    assert answered([*fits, hypothesis(1020.0, LAW)], refused=("a",)).verdict == "unnamed"
