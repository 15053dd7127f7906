"""One answer against one truth: right, wrong, or how much of it is there; see `score`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.optimize import linear_sum_assignment

from pikanid.validation.concealed.answers import Answer
from pikanid.validation.concealed.families import families_of_entry
from pikanid.validation.concealed.sizing import STRONG
from pikanid.validation.concealed.visibility import FROM_RIVAL

Outcome = Literal["right", "long", "visible", "part", "wrong", "formula", "alarm", "silent"]
ANSWERS = ("named", "set")
MOST_HYPOTHESES = 2  # definition: of an answer that is right
SYMBOLIC = "symbolic:"
# Laws that an entry of the catalogue includes: dry friction, with or without a rise at low speed,
# with a sharp or a rounded reversal; and of a temperature, where that has an entry, one that fades
# is the exchange with a hidden store to the letter.
INCLUDED = {"stribeck_friction": "coulomb_friction", "smooth_friction": "coulomb_friction",
            "fading_memory": "hidden_storage"}
# Entries that a truth holds beside more: liquid has a second planar mode, which stays linear.
HELD = {"potential_flow": "second_mode"}
# Of a force that swings by itself, and of no parameter that does.
SWINGS = r"^(?!.*->).*sin\([^)]*\bt\b"
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
    "smooth_friction": r"tanh\([^)]*theta_dot",
    "asymmetric_spring": r"Abs\((\w+ - )?theta\)|max\(-?theta(, 0)?\)",
    "warming_damping": r"d_theta\*\(1 \+ \w+\*exp\(-t/",
    "fluid_memory": r"\(theta_dot - wake\)",
    "fading_memory": r"\(wake\w* - \w+\)|\(\w+ - wake\w*\)",
    "position_friction": r"theta\*\*2\*sign\(theta_dot\)",
    "cable_drag": r"max\(theta - \w+, 0\)\*\*2",
    "cogging": r"sin\([^)]*\*theta\b",
    "quadratic_input": r"u_\w\*\*2",
    "one_way_gain": r"Abs\(\w+\)",
    "local_force": r"exp\(",
    "periodic_force": SWINGS,
    "background_vibration": SWINGS,
    "pumped_parameter": r"-> \w+\*\(1 \+ \w+\*sin\(",
    "wobbling_length": r"-> l_theta\*\(1 \+ \w+\*sin\(",
    "parametric_excitation": r"-> (l_theta|g)\*\(1 \+ \w+\*sin\(",
    "product_of_states": r"\w+\*\w+\*\w+",
    "bilinear_input": r"\w+\*\w+\*\w+",
    "bounded_loss": r"/\(\w+ \+ [Aa]bs\(\w+\)\)",
    "one_sided_spring": r"max\(\w+ - \w+, 0\)\*\*2",
    "rippled_sensor": r"sin\(",
}

Effects = list[set[str]]


@dataclass(frozen=True)
class Truth:
    """What a case hides.

    Attributes:
        effects: Ids by any of which each hidden effect is named.
        laws: The same of each law that is left beside them.
        families: Of each hidden effect.
        law_families: Of each law.
        distances: Of the best fit without each hidden effect [σ].
    """

    effects: Effects
    laws: Effects
    families: Effects
    law_families: Effects
    distances: tuple[float, ...]

    @property
    def visible(self) -> Effects:
        """The effects that could be told."""
        return [effect for effect, distance in zip(self.effects, self.distances, strict=True)
                if distance >= FROM_RIVAL]


def truth_of(case: Mapping[str, Any]) -> Truth:
    """From an entry of a truth file that `check_case` has passed."""
    left = case.get("remainder", [])
    return Truth(
        [_ids(effect) for effect in case["effects"]], [_ids(law) for law in left],
        [families_of_entry(effect) for effect in case["effects"]],
        [families_of_entry(law) for law in left],
        tuple(float(distance) for distance in case["visibility"]["effects"]))


def outcome_of(case: Mapping[str, Any], truth: Truth, answer: Answer) -> tuple[Outcome, str]:
    """Outcome and reason as in `score.Score`."""
    if answer.verdict == "partial":
        return _of_parts(truth, answer.present)
    if answer.verdict not in ANSWERS:
        return ("silent" if truth.effects else "alarm" if answer.mismatch else "right"), ""
    if not truth.effects:
        return "wrong", "nothing"
    if truth.laws:
        return _beside_remainder(truth, answer.hypotheses)
    given, few = answer.hypotheses, len(answer.hypotheses) <= MOST_HYPOTHESES
    if any(same(explanation, truth.effects) for explanation in given):
        return ("right" if few else "long"), ""
    visible = truth.visible
    if visible and any(same(explanation, visible) for explanation in given):
        return ("visible", "") if few else ("long", "visible")
    readings = [[read(effect) for effect in explanation] for explanation in given]
    if any(same(explanation, truth.effects) for explanation in readings):
        return "formula", ""
    return "wrong", _reason(case, truth.effects, readings)


def found(truth: Truth, answer: Answer, outcome: Outcome) -> tuple[int, int, int, int]:
    """Of the hidden effects of at least `STRONG` σ: how many, found, found by name, and found only
    as one of two families.

    A wrong answer finds nothing.
    """
    strong = [k for k, distance in enumerate(truth.distances) if distance >= STRONG]
    if not strong or outcome not in ("right", "part"):
        return len(strong), 0, 0, 0
    if answer.verdict == "partial":
        named = [any(ids & truth.effects[k] for _, ids in answer.present) for k in strong]
        family, either = ([any(not ids and families & truth.families[k] and len(families) <= most
                               for families, ids in answer.present) for k in strong]
                          for most in (1, 2))
    else:
        best = max((explanation for explanation in map(_readings, answer.hypotheses)
                    if contains([*truth.effects, *truth.laws], explanation)),
                   key=lambda explanation: sum(
                       any(effect & truth.effects[k] for effect in explanation) for k in strong))
        named = [any(effect & truth.effects[k] for effect in best) for k in strong]
        family = either = named
    every, known = (sum(map(any, zip(named, one, strict=True))) for one in (either, family))
    return len(strong), every, sum(named), every - known


def read(effect: set[str]) -> set[str]:
    """Ids of an effect, with those of the hidden laws that its formula is one of."""
    return effect | {law for law, pattern in FORMULAS.items() for identifier in effect
                     if identifier.startswith(SYMBOLIC) and re.search(pattern, identifier)}


def same(explanation: Sequence[set[str]], truth: Sequence[set[str]]) -> bool:
    """Whether both hold the same effects."""
    return len(explanation) == len(truth) and contains(explanation, truth)


def contains(larger: Sequence[set[str]], smaller: Sequence[set[str]]) -> bool:
    """Whether every effect of the smaller has a partner of its own in the larger.

    >>> contains([{"input_delay", "sensor_delay"}], [{"sensor_delay"}, {"input_delay"}])
    False
    """
    if len(smaller) > len(larger):
        return False
    apart = np.array([[not a & b for b in larger] for a in smaller]).reshape(-1, len(larger))
    return not apart[linear_sum_assignment(apart)].any()


def _ids(effect: Mapping[str, Any]) -> set[str]:
    return {effect["id"], *effect["twins"], INCLUDED.get(effect["id"], effect["id"])}


def _readings(explanation: Sequence[set[str]]) -> Effects:
    return [read(effect) for effect in explanation]


def _of_parts(truth: Truth,
              present: Sequence[tuple[frozenset[str], frozenset[str]]]) -> tuple[Outcome, str]:
    if not present:
        return "silent", ""
    if not truth.effects:
        return "wrong", "nothing"
    named = [effect | {HELD[i] for i in effect & HELD.keys()}
             for effect in (*truth.effects, *truth.laws)]
    hidden = [*truth.families, *truth.law_families]
    for families, ids in present:
        hit = (any(ids & effect for effect in named) if ids
               else any(families & of_one for of_one in hidden))
        if not hit:
            return "wrong", "other" if ids else "family"
    return "part", ""


def _beside_remainder(truth: Truth, given: Sequence[Effects]) -> tuple[Outcome, str]:
    """What is said has to be there; all that is there cannot be said."""
    readings = [_readings(explanation) for explanation in given]
    there = [explanation for explanation in readings
             if explanation and contains([*truth.effects, *truth.laws], explanation)]
    if there:
        if len(given) > MOST_HYPOTHESES:
            return "long", ""
        whole = any(contains(explanation, truth.effects) for explanation in there)
        return ("right" if whole else "part"), ""
    if any(contains(explanation, truth.effects) for explanation in readings):
        return "wrong", "extra"
    return "wrong", "other"


def _reason(case: Mapping[str, Any], truth: Effects, explanations: Sequence[Effects]) -> str:
    seen = case["visibility"]
    rival = [{identifier} for identifier in seen["best_rival"]]
    near = [{effect["near"]} if effect["near"] else {effect["id"], *effect["twins"]}
            for effect in case["effects"]]
    if float(seen["best_rival_distance"]) < FROM_RIVAL and any(
            same(explanation, rival) for explanation in explanations):
        return "indistinguishable"
    if any(contains(truth, explanation) for explanation in explanations):
        return "part"
    if any(contains(explanation, truth) for explanation in explanations):
        return "extra"
    if any(same(explanation, near) for explanation in explanations):
        return "near"
    return "other"
