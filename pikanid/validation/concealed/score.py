"""How good are diagnoses of concealed recordings?  Entries of a truth file against diagnosis.json.

An answer is `named` or `set`; every other verdict names nothing.  It is *right* if one of at most
two hypotheses is the truth, *wrong* if none is.  Twins count as one effect.  A hypothesis is the
truth only if it holds every hidden effect and no other.  Of two hidden effects one may be too weak
to be told (the recording without it fits to less than 4σ): who then names the other one alone has
named the *visible* part, and is neither right nor wrong.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from scipy.optimize import linear_sum_assignment

from pikanid.validation.concealed.answers import check_case, read_answer
from pikanid.validation.concealed.visibility import FROM_NOMINAL, FROM_RIVAL

Entry = Mapping[str, Any]
Outcome = Literal["right", "long", "visible", "wrong", "formula", "alarm", "silent"]
ANSWERS = ("named", "set")
MOST_HYPOTHESES = 2  # definition: that an answer may name
SYMBOLIC = "symbolic:"
# Laws that an entry of the catalogue includes: dry friction with or without a rise at low speed.
INCLUDED = {"stribeck_friction": "coulomb_friction"}
# What the formula of a law that is in no catalogue must hold; who writes another one is wrong.
FORMULAS = {
    "stribeck_friction": r"exp\(.*sign\(\w+_dot\)",
    "hard_stop": r"max\(.*\)\*\(1 [+-] ",
    "one_way_friction": r"sign\([^)]*_dot\) [+-] (1|force_0)|force_0 [+-] .*sign\([^)]*_dot\)",
    "rate_limited_input": r"changing by at most",
    "soft_saturation": r"u_\w\*\*3|Abs\(u_\w\)|tanh\(",
    "quintic_stiffness": r"theta\*\*5|signed_power\(theta,",
    "even_stiffness": r"theta\*\*2|Abs\(theta\)",
    "velocity_coupled_drive": r"u_\w\*theta_dot",
}


@dataclass(frozen=True)
class Score:
    """One diagnosis against the truth.

    Attributes:
        case: Id.
        kind: Class of the case.
        nameable: Whether the recordings could tell.
        nominal: Distance of the refitted nominal model [σ].
        verdict: Of the diagnosis.
        mismatch: Whether it says that something is missing.
        outcome: `right`; `long` (the truth among more than two hypotheses); `visible` (the part of
            the truth that could be told among at most two hypotheses); `wrong`; `formula` (a
            symbolic law of the kind that is hidden, where that is in no catalogue); `alarm`
            (something is missing, nothing named, where nothing hides); `silent`.
        reason: Of a wrong answer: `indistinguishable` (the truth's best rival, closer than 4σ: no
            method could know), `part` of the truth, `extra` effects besides it, `near` (the entry
            that the hidden law resembles), `nothing` is hidden, or `other`.
        hypotheses: How many were given.
        relative_weight: Of the most probable one; None where nothing is answered.
        first_is_truth: Whether that one is the truth, its visible part, or a formula of its kind.
        within: Whether each base parameter lies within 3 standard errors of the truth; None where
            none is compared.
        held_out: RMSE after the diagnosis over the noise; None where it is not given.
    """

    case: str
    kind: str
    nameable: bool
    nominal: float
    verdict: str
    mismatch: bool
    outcome: Outcome
    reason: str
    hypotheses: int
    relative_weight: float | None
    first_is_truth: bool
    within: bool | None
    held_out: float | None


@dataclass(frozen=True)
class Share:
    """A count with Wilson's 95 % interval.

    >>> print(Share(0, 240))
    0/240 (0.0 %, 95 %: 0.0 to 1.6 %)
    """

    count: int
    n: int

    @property
    def interval(self) -> tuple[float, float]:
        """Of the share, 0 to 1."""
        return wilson(self.count, self.n)

    def __str__(self) -> str:
        if self.n == 0:
            return "0/0"
        low, high = (100 * bound for bound in self.interval)
        share = 100 * self.count / self.n
        return f"{self.count}/{self.n} ({share:.1f} %, 95 %: {low:.1f} to {high:.1f} %)"


def wilson(count: int, n: int, z: float = 1.959963984540054) -> tuple[float, float]:
    """Score interval of a share (E. B. Wilson 1927); from 0 to 1 if n is 0.

    >>> low, high = wilson(95, 100)
    >>> round(low, 3), round(high, 3)
    (0.888, 0.978)
    """
    if n == 0:
        return 0.0, 1.0
    share, spread = count / n, z**2 / n
    middle = (share + spread / 2) / (1 + spread)
    half = math.sqrt(share * (1 - share) * spread + spread**2 / 4) / (1 + spread)
    return max(0.0, middle - half), min(1.0, middle + half)


def judge(case: Entry, diagnosis: Entry) -> Score:
    """Compare a diagnosis with the entry of its case in the truth file.

    Args:
        case: Element of `cases` of a truth file.
        diagnosis: Content of diagnosis.json.

    Raises:
        BadSetting: If what is compared is missing in either, or of another type.

    >>> truth = {"id": "001", "class": "single", "nameable": True, "base": {},
    ...          "effects": [{"id": "input_delay", "twins": ["sensor_delay"], "near": ""}],
    ...          "visibility": {"nominal": 40.0, "effects": [40.0],
    ...                         "best_rival": [], "best_rival_distance": 9.0}}
    >>> answer = {"verdict": "named", "mismatch": True, "hypotheses": [
    ...     {"effects": [{"ids": ["sensor_delay"]}], "probability": 0.97}]}
    >>> judge(truth, answer).outcome
    'right'
    """
    check_case(case)
    answer = read_answer(diagnosis, case["id"])
    truth = [{effect["id"], *effect["twins"], INCLUDED.get(effect["id"], effect["id"])}
             for effect in case["effects"]]
    given = answer.hypotheses
    outcome, reason = _outcome(case, truth, answer.verdict, answer.mismatch, given)
    answered = answer.verdict in ANSWERS and bool(given)
    return Score(
        case["id"], case["class"], case["nameable"], float(case["visibility"]["nominal"]),
        answer.verdict, answer.mismatch, outcome, reason, len(given),
        answer.probabilities[0] if answered else None,
        answered and any(_same([_read(effect) for effect in given[0]], t)
                         for t in (truth, _visible(case, truth)) if t),
        _within(case["base"], answer.after), answer.held_out)


def tally(scores: Iterable[Score]) -> dict[str, Share]:
    """What the scores of a set amount to.

    `right` counts nameable cases only; `wrong` counts all, `wrong_strictly` also answers that name
    the visible part; `wrong_but_knowable` leaves out the answers that no method could have known to
    be wrong; `false_alarm` counts cases that hide
    nothing, `missed` those whose effect is at least 5σ strong.
    """
    every = list(scores)
    nameable = [s for s in every if s.nameable]
    nothing = [s for s in every if s.kind == "nothing"]
    strong = [s for s in every if s.kind != "nothing" and s.nominal >= FROM_NOMINAL]
    right = [s for s in nameable if s.outcome == "right"]
    wrong = [s for s in every if s.outcome == "wrong"]
    answers = [s for s in every if s.verdict in ANSWERS]
    compared = [s for s in right if s.within is not None]
    ratios = [s.held_out for s in right if s.held_out is not None]
    return {
        "right": Share(len(right), len(nameable)),
        "wrong": Share(len(wrong), len(every)),
        "wrong_strictly": Share(
            len(wrong) + sum(s.outcome == "visible" for s in every), len(every)),
        "wrong_of_answers": Share(len(wrong), len(answers)),
        "wrong_but_knowable": Share(
            sum(s.reason != "indistinguishable" for s in wrong), len(every)),
        "formula": Share(sum(s.outcome == "formula" for s in every), len(every)),
        "false_alarm": Share(sum(s.mismatch for s in nothing), len(nothing)),
        "missed": Share(sum(not s.mismatch for s in strong), len(strong)),
        "parameters_within_3_std": Share(sum(bool(s.within) for s in compared), len(compared)),
        "held_out_within_1.1_noise": Share(sum(ratio <= 1.1 for ratio in ratios), len(ratios))}


def reliability(scores: Iterable[Score],
                edges: Sequence[float] = (0.0, 0.5, 0.7, 0.9, 0.97, 1.0),
                ) -> list[tuple[float, Share]]:
    """For each interval of stated weight that occurs: its mean, and how often it was true.

    Only the most probable hypothesis of each answer counts.
    """
    stated = [(s.relative_weight, s.first_is_truth) for s in scores
              if s.relative_weight is not None]
    rows = []
    for low, high in pairwise(edges):
        inside = [(p, hit) for p, hit in stated
                  if low <= p < high or (p == high == edges[-1])]
        if inside:
            mean = sum(p for p, _ in inside) / len(inside)
            rows.append((mean, Share(sum(hit for _, hit in inside), len(inside))))
    return rows


def _outcome(case: Entry, truth: list[set[str]], verdict: str, mismatch: bool,
             explanations: Sequence[list[set[str]]]) -> tuple[Outcome, str]:
    if verdict not in ANSWERS:
        if not truth:
            return ("alarm" if mismatch else "right"), ""
        return "silent", ""
    if not truth:
        return "wrong", "nothing"
    if any(_same(explanation, truth) for explanation in explanations):
        return ("right" if len(explanations) <= MOST_HYPOTHESES else "long"), ""
    visible = _visible(case, truth)
    if visible and len(explanations) <= MOST_HYPOTHESES and any(
            _same(explanation, visible) for explanation in explanations):
        return "visible", ""
    read = [[_read(effect) for effect in explanation] for explanation in explanations]
    if any(_same(explanation, truth) for explanation in read):
        return "formula", ""
    return "wrong", _reason(case, truth, read)


def _read(effect: set[str]) -> set[str]:
    """Ids of an effect, with those of the hidden laws that its formula is one of."""
    return effect | {law for law, pattern in FORMULAS.items() for identifier in effect
                     if identifier.startswith(SYMBOLIC) and re.search(pattern, identifier)}


def _visible(case: Entry, truth: list[set[str]]) -> list[set[str]]:
    return [effect for effect, distance in zip(truth, case["visibility"]["effects"], strict=True)
            if distance >= FROM_RIVAL]


def _reason(case: Entry, truth: list[set[str]], explanations: list[list[set[str]]]) -> str:
    seen = case["visibility"]
    rival = [{identifier} for identifier in seen["best_rival"]]
    near = [{effect["near"]} if effect["near"] else {effect["id"], *effect["twins"]}
            for effect in case["effects"]]
    if float(seen["best_rival_distance"]) < FROM_RIVAL and any(
            _same(explanation, rival) for explanation in explanations):
        return "indistinguishable"
    if any(_contains(truth, explanation) for explanation in explanations):
        return "part"
    if any(_contains(explanation, truth) for explanation in explanations):
        return "extra"
    if any(_same(explanation, near) for explanation in explanations):
        return "near"
    return "other"


def _contains(larger: Sequence[set[str]], smaller: Sequence[set[str]]) -> bool:
    """Whether every effect of the smaller has a partner of its own in the larger."""
    if len(smaller) > len(larger):
        return False
    apart = np.array([[not a & b for b in larger] for a in smaller]).reshape(-1, len(larger))
    return not apart[linear_sum_assignment(apart)].any()


def _same(explanation: Sequence[set[str]], truth: Sequence[set[str]]) -> bool:
    return len(explanation) == len(truth) and _contains(explanation, truth)


def _within(base: Entry, after: Mapping[str, tuple[float, float]]) -> bool | None:
    both = [(base[name]["value"], *after[name]) for name in base if name in after]
    both = [(value, fit, std) for value, fit, std in both if std]
    if not both:
        return None
    return all(abs(fit - value) <= 3 * std for value, fit, std in both)
