"""How good are diagnoses of concealed recordings?  Entries of a truth file against diagnosis.json.

An answer is `named` or `set`; every other verdict names nothing.  It is *right* if one of at most
two hypotheses is the truth, *wrong* if none is.  Twins count as one effect.  A hypothesis is the
truth only if it holds every hidden effect and no other.  Of two hidden effects one may be too weak
to be told (the recording without it fits to less than 4σ): who then names the other one alone has
named the *visible* part, and is neither right nor wrong.

A `partial` answer says what is surely there; it is right as far as it goes if every name or family
that it gives belongs to something that hides.  Where laws of no catalogue are left beside the
hidden effects, the whole cannot be said: there an answer is right if it holds every hidden effect
and nothing that does not hide, and right as far as it goes if some effects are not in it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from pikanid.validation.concealed.answers import check_case, read_answer
from pikanid.validation.concealed.outcome import ANSWERS, Outcome, found, outcome_of, truth_of
from pikanid.validation.concealed.visibility import FROM_NOMINAL

Entry = Mapping[str, Any]
TRUE: tuple[Outcome, ...] = ("right", "visible", "formula")  # definition: of one hypothesis


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
        outcome: `right`; `visible` (the part of the truth that could be told, among at most two
            hypotheses); `long` (either among more than two); `part` (all that is said
            to be surely there is); `wrong`; `formula` (a symbolic law of the kind that is hidden,
            where that is in no catalogue); `alarm` (something is missing, nothing named, where
            nothing hides); `silent`.
        reason: Of a wrong answer: `indistinguishable` (the truth's best rival, closer than 4σ: no
            method could know), `part` of the truth, `extra` effects besides it, a `family` that
            does not hide, `near` (the entry that the hidden law resembles), `nothing` is hidden,
            or `other`; of a `long` one `visible` if only the visible part is in it.
        hypotheses: How many were given.
        probability: Of the most probable one; None where nothing is answered.
        first_is_truth: Whether that one is the truth, its visible part, or a formula of its kind;
            beside laws of no catalogue, whether it holds every hidden effect and nothing that does
            not hide.
        within: Whether each base parameter lies within 3 standard errors of the truth; None where
            none is compared.
        held_out: RMSE after the diagnosis over the noise; None where it is not given.
        beside: Whether laws of no catalogue are left beside the hidden effects.
        strong: How many hidden effects are at least 80σ strong.
        found: How many of them an answer that is not wrong gives, by name or family.
        found_by_name: How many by name.
        found_of_two: How many only as one of two families.
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
    probability: float | None
    first_is_truth: bool
    within: bool | None
    held_out: float | None
    beside: bool = False
    strong: int = 0
    found: int = 0
    found_by_name: int = 0
    found_of_two: int = 0


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
    truth = truth_of(case)
    given = answer.hypotheses
    outcome, reason = outcome_of(case, truth, answer)
    answered = answer.verdict in ANSWERS and bool(given)
    strong, by_any, by_name, of_two = found(truth, answer, outcome)
    return Score(
        case["id"], case["class"], case["nameable"], float(case["visibility"]["nominal"]),
        answer.verdict, answer.mismatch, outcome, reason, len(given),
        answer.probabilities[0] if answered else None,
        answered and outcome_of(case, truth, replace(answer, hypotheses=given[:1]))[0] in TRUE,
        _within(case["base"], answer.after), answer.held_out,
        bool(truth.laws), strong, by_any, by_name, of_two)


def tally(scores: Iterable[Score]) -> dict[str, Share]:
    """What the scores of a set amount to.

    `right` counts nameable cases only; `wrong` counts all, `wrong_strictly` also answers that name
    the visible part; `wrong_but_knowable` leaves out the answers that no method could have known to
    be wrong; `false_alarm` counts cases that hide nothing, `missed` those whose effect is at least
    5σ strong.  `found`, `found_by_name` and `found_of_two` count hidden effects of at least 80σ
    beside a remainder.
    """
    every = list(scores)
    nameable = [s for s in every if s.nameable]
    nothing = [s for s in every if s.kind == "nothing"]
    strong = [s for s in every if s.kind != "nothing" and s.nominal >= FROM_NOMINAL]
    right = [s for s in nameable if s.outcome == "right"]
    wrong = [s for s in every if s.outcome == "wrong"]
    answers = [s for s in every if s.verdict in (*ANSWERS, "partial")]
    compared = [s for s in right if s.within is not None]
    strong_beside = sum(s.strong for s in every if s.beside)
    ratios = [s.held_out for s in right if s.held_out is not None]
    return {
        "right": Share(len(right), len(nameable)),
        "wrong": Share(len(wrong), len(every)),
        "wrong_strictly": Share(
            len(wrong) + sum("visible" in (s.outcome, s.reason) for s in every), len(every)),
        "wrong_of_answers": Share(len(wrong), len(answers)),
        "wrong_but_knowable": Share(
            sum(s.reason != "indistinguishable" for s in wrong), len(every)),
        "surely_in_part": Share(sum(s.outcome == "part" for s in every), len(every)),
        "found": Share(sum(s.found for s in every if s.beside), strong_beside),
        "found_by_name": Share(sum(s.found_by_name for s in every if s.beside), strong_beside),
        "found_of_two": Share(sum(s.found_of_two for s in every if s.beside), strong_beside),
        "formula": Share(sum(s.outcome == "formula" for s in every), len(every)),
        "false_alarm": Share(sum(s.mismatch for s in nothing), len(nothing)),
        "missed": Share(sum(not s.mismatch for s in strong), len(strong)),
        "parameters_within_3_std": Share(sum(bool(s.within) for s in compared), len(compared)),
        "held_out_within_1.1_noise": Share(sum(ratio <= 1.1 for ratio in ratios), len(ratios))}


def reliability(scores: Iterable[Score],
                edges: Sequence[float] = (0.0, 0.5, 0.7, 0.9, 0.97, 1.0),
                ) -> list[tuple[float, Share]]:
    """For each interval of stated probability that occurs: its mean, and how often it was true.

    Only the most probable hypothesis of each answer counts.
    """
    stated = [(s.probability, s.first_is_truth) for s in scores
              if s.probability is not None]
    rows = []
    for low, high in pairwise(edges):
        inside = [(p, hit) for p, hit in stated
                  if low <= p < high or (p == high == edges[-1])]
        if inside:
            mean = sum(p for p, _ in inside) / len(inside)
            rows.append((mean, Share(sum(hit for _, hit in inside), len(inside))))
    return rows


def _within(base: Entry, after: Mapping[str, tuple[float, float]]) -> bool | None:
    both = [(base[name]["value"], *after[name]) for name in base if name in after]
    both = [(value, fit, std) for value, fit, std in both if std]
    if not both:
        return None
    return all(abs(fit - value) <= 3 * std for value, fit, std in both)
