"""What a `Diagnosis` says where not everything is explained: what is surely there, what is left."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any

from pikanid.estimate.rounding import with_unit
from pikanid.formula.units import parse
from pikanid.mismatch.report.own_time import SECOND, told_in
from pikanid.model.parts import Parameter
from pikanid.pieces.sentences import enumerated
from pikanid.pieces.time_unit import spans

SHOWN = 6  # layout: windows of time that are listed
CLOSE = 0.5  # layout: share explained from which on what comes closest is told with its doubts
# families that are no words for something that is there
IN_WORDS = {"constant force": "a constant force", "coupling": "a coupling",
            "gain": "another gain", "input curve": "a curve of an input", "loss": "a loss",
            "mode": "a further mode", "once": "something that happened once",
            "rate curve": "a curve of a rate", "restoring force": "a restoring force",
            "sensor curve": "a curve of a sensor", "slow change": "a slow change",
            "source": "a source", "storage": "a storage", "timing": "a delay or a lag"}


@dataclass(frozen=True)
class Value:
    """A number with its standard error and unit."""

    value: float
    std: float
    unit: str = ""


@dataclass(frozen=True)
class Present:
    """A family of effects that is surely there although something is left.

    Attributes:
        family: Of physics, as "dry friction".
        ids: Its name, where no other member of the family does as well, with what small motions
            cannot tell from it, as a lag of the sensor from one of the actuator; else empty.
        name: Of the member in the best explanation, for people; where that is sure, with those.
        expression: As that is added to the model.
        alternatives: Other members that were compared: names by key.
        probability: Posterior of that member.
        probability_family: Posterior of the family.
        dominance: κ: how many times more the best explanation without the family leaves; None where
            there is none.
        dominance_within: The same of the best explanation with another member of the family.
        share: Of the held-out misfit's square that the best explanation explains.
        parameters: Estimates, with standard errors as the noise alone would have them.
        std_with_remainder: Standard errors with the remainder counted in, and how far apart
            explanations that are not ruled out have them.
        or_family: Another family, where one of both is surely there, and which one is not sure;
            else empty.
        places: States in whose equations the two act, where they are one family.
    """

    family: str
    ids: tuple[str, ...]
    name: str
    expression: str
    alternatives: Mapping[str, str]
    probability: float
    probability_family: float
    dominance: float | None
    dominance_within: float | None
    share: float
    parameters: Mapping[str, Value]
    std_with_remainder: Mapping[str, float]
    or_family: str = ""
    places: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """The name where it is sure, otherwise the family, or both of two."""
        if self.places:
            equations = " or in ".join(f"{v}'" for v in self.places)
            return f"{in_words(self.family)} in {equations}"
        if self.or_family:
            return f"either {in_words(self.family)} or {in_words(self.or_family)}"
        return self.name if self.ids else in_words(self.family)

    @property
    def compared(self) -> list[str]:
        """Names of the other members, each once."""
        return [name for name in dict.fromkeys(self.alternatives.values()) if name != self.name]

    def sentence(self) -> str:
        """In words."""
        what = "which one" if self.or_family else "its form"
        unsure = f"; {what} is not sure, compared with {', '.join(self.compared)}" * bool(
            self.compared)
        here = "" if self.name in (self.family, in_words(self.family)) else f"here as {self.name}"
        said = (here + unsure).removeprefix("; ")
        within = "" if self.ids or not said else f" ({said})"
        if self.dominance is None:
            return f"{self.title}{within}: no explanation does without it"
        return (f"{self.title}{within}: without it the best explanation leaves "
                f"{self.dominance:.2g} times as much")

    def to_dict(self) -> dict[str, Any]:
        """For diagnosis.json."""
        return {"family": self.family, "or_family": self.or_family or None,
                "places": list(self.places) or None,
                "ids": list(self.ids) or None, "exact": bool(self.ids),
                "expression": self.expression, "alternatives": list(self.alternatives),
                "probability": self.probability, "probability_family": self.probability_family,
                "dominance": self.dominance, "dominance_within": self.dominance_within,
                "share_explained": self.share,
                "parameters": {n: {"value": v.value, "std": v.std, "unit": v.unit,
                                   "std_with_remainder": self.std_with_remainder[n]}
                               for n, v in self.parameters.items()}}


def titles_of(found: Sequence[Present]) -> list[str]:
    """The title of each, of those last of which one of two is there; families that one law is a
    member of together are one.
    """
    laws: dict[object, list[Present]] = {}
    for p in sorted(found, key=lambda p: bool(p.or_family)):
        laws.setdefault(p.expression if not p.ids and not p.or_family else id(p), []).append(p)
    return [own[0].title if len(own) == 1 else
            f"one law that counts as {enumerated([p.family for p in own])}"
            for own in laws.values()]


def in_words(family: str) -> str:
    """A family as something that is there.

    >>> in_words("timing"), in_words("dry friction")
    ('a delay or a lag', 'dry friction')
    """
    return IN_WORDS.get(family, family)


@dataclass(frozen=True)
class Remainder:
    """What the best explanation leaves, beside noise.

    Attributes:
        share_explained: Of the square of the nominal misfit, noise taken off, in the held-out
            recordings, with the parameters as they were fitted.
        share_train: The same in the recordings that were fitted.
        output: That the nominal model misses most in the held-out recordings.
        rmse_before: Of that one, nominal.
        rmse: The same with the explanation.
        rmse_moved: The same with its parameters moved within their errors.
        noise: Of that output.
        unit: Of these.
        p_value: Of so much being left, if there is nothing but noise.
        overdispersion: What χ² is divided by, as neighbouring rows of a misfit say the same.
        independent_rows: What the rows that were fitted count for.
        frequency: [Hz] below which half of the held-out remainder's power lies.
        time: Seconds of the first recording in which it is louder than noise.
        doubtful: Family or effect that is fitted but not sure, and why.
    """

    share_explained: float
    share_train: float
    output: str
    rmse_before: float
    rmse: float
    rmse_moved: float
    noise: float
    unit: str
    p_value: float
    overdispersion: float
    independent_rows: float
    frequency: float
    time: tuple[tuple[float, float], ...]
    doubtful: tuple[tuple[str, str], ...]

    def beside(self, found: Sequence[Present], adequate: float) -> str:
        """What is surely there and how much is left; something else, where the p-value is less than
        what is `adequate`.
        """
        more = ", and something else" if self.p_value < adequate else ""
        return f"surely {enumerated(titles_of(found))}{more}. {self.sentence()}."

    def sentence(self) -> str:
        """In words."""
        size, before, noise = (with_unit(f"{v:.3g}", self.unit)
                               for v in (self.rmse, self.rmse_before, self.noise))
        share = almost(self.share_explained)
        return (f"{share[0].upper()}{share[1:]} of the held-out misfit is explained; of "
                f"{before} (RMSE of {self.output}) {size} are left, beside noise of {noise}")

    def lines(self) -> list[str]:
        """Where it is, and what keeps more from being sure."""
        loud = spans(self.time, SHOWN) or "no stretch of it"
        slow = f"below {self.frequency:.3g} Hz" if self.frequency else "constant, or nearly so"
        return [f"Left: half of it {slow}; louder than noise at {loud}",
                *(f"Not sure: {in_words(what)}: {why}" for what, why in self.doubtful)]

    def to_dict(self) -> dict[str, Any]:
        """For diagnosis.json."""
        found = asdict(self)
        found["time"] = [list(span) for span in self.time]
        found["doubtful"] = [{"family": what, "why": why} for what, why in self.doubtful]
        return found


def almost(share: float) -> str:
    """A share in percent, which is not 100 where something is left.

    >>> almost(0.876), almost(0.9971), almost(0.99999)
    ('88 %', '99.7 %', 'more than 99.9 %')
    """
    if share < 0.995:
        return f"{100 * share:.0f} %"
    return f"{100 * share:.1f} %" if share < 0.9995 else "more than 99.9 %"


@dataclass(frozen=True)
class Closest:
    """What comes closest where nothing is sure.

    Attributes:
        effects: Names of its effects.
        ids: Of each.
        share_explained: Of the square of the nominal misfit, noise taken off, in the held-out
            recordings.
        doubtful: Each family in it, that which is nearest to being sure first, and what keeps it
            from that.
    """

    effects: tuple[str, ...]
    ids: tuple[tuple[str, ...], ...]
    share_explained: float
    doubtful: tuple[tuple[str, str], ...]

    def lines(self) -> list[str]:
        """In words."""
        explained = f"{almost(self.share_explained)} of the held-out misfit"
        if self.share_explained < CLOSE:
            return [f"Nothing comes close: {enumerated(self.effects)} explains {explained}"]
        return [f"Closest, and not sure: {enumerated(self.effects)}: {explained} is explained",
                *(f"Not sure: {in_words(what)}: {why}" for what, why in self.doubtful)]

    def to_dict(self) -> dict[str, Any]:
        """For diagnosis.json."""
        return {"effects": [list(own) for own in self.ids],
                "share_explained": self.share_explained,
                "doubtful": [{"family": what, "why": why} for what, why in self.doubtful]}


def values_of(parameters: tuple[Parameter, ...], values: Mapping[str, float],
              std: Mapping[str, float], overdispersion: float = 1.0,
              spread: Mapping[str, float] = MappingProxyType({}), time: str = SECOND
              ) -> dict[str, Value]:
    """Estimates of an effect's parameters, with variances multiplied by the overdispersion; the
    square of a spread, by name, is added to them.  `time` is the unit in place of seconds.
    """
    told = {p.name: told_in(parse(p.unit), time) for p in parameters if p.name in values}
    return {name: Value(times * values[name], times * math.hypot(
                std[name] * overdispersion**0.5, spread.get(name, 0.0)), unit)
            for name, (times, unit) in told.items()}
