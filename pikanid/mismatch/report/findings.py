"""What a `Diagnosis` holds: where, which explanations, what proves them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from pikanid.estimate import Estimate
from pikanid.mismatch.beyond.force_shape import ForceShape
from pikanid.mismatch.beyond.latent_force import ForceOverTime
from pikanid.mismatch.beyond.patch import Patch
from pikanid.mismatch.beyond.region import Interval
from pikanid.mismatch.catalogue.candidate import Channel
from pikanid.mismatch.judge.answer import Verdict
from pikanid.mismatch.report.part import CLOSE, SHOWN, Closest, Present, Remainder, Value
from pikanid.mismatch.settings.settings import Settings
from pikanid.model import Model
from pikanid.pieces.sentences import enumerated, p_text
from pikanid.pieces.time_unit import spans

TOLD = 3  # layout: explanations in the sentence; all of them stand below it


@dataclass(frozen=True)
class NamedEffect:
    """One effect of a hypothesis: its ids (several where twins cannot be told apart), its name for
    people, what is added to the model, its parameters, its channel, the state in whose equation it
    acts or, of an input or a sensor, shows first, and whether it happens once, in one recording.
    """

    ids: tuple[str, ...]
    name: str
    expression: str
    parameters: Mapping[str, Value]
    channel: str = "dynamics"
    equation: str = ""
    once: bool = False


@dataclass(frozen=True)
class Explanation:
    """A hypothesis: effects, posterior probability, model, tests.

    The probability is that of its criterion among all that explain the recordings, laws outside the
    catalogue among them, and a law that nothing listed holds (`Settings.verdict.unforeseen`).
    """

    effects: tuple[NamedEffect, ...]
    probability: float
    model: Model
    score: float
    p_train: float | None
    p_held_out: float | None
    why_not: str = ""

    @property
    def title(self) -> str:
        """In words, with the equation of those that share a name."""
        names = [e.name for e in self.effects]
        return enumerated([n if names.count(n) == 1 else f"{n} in {e.equation}'"
                           for n, e in zip(names, self.effects, strict=True)] or ["nothing"])


@dataclass(frozen=True)
class Where:
    """Where something is missing.

    Attributes:
        channels: In which something surely acts; none where that is not decided.
        equation: Whose right-hand side is incomplete.
        depends_on: States, and of a force without a name also inputs.
        time: Seconds of the first recording.
        static_law: Whether a static law of the states can do it; None where that is not known.
        region: Part of a state or an input in which it acts; empty where it acts always, or no
            region can be told.
        parameters: Of the model, with the region left to a force without a name: from clean motion;
            empty where the region is that of a law that is given.
    """

    channels: tuple[Channel, ...]
    equation: str
    depends_on: tuple[str, ...]
    time: tuple[tuple[float, float], ...]
    static_law: bool | None
    region: tuple[Interval, ...] = ()
    parameters: Mapping[str, Value] = field(default_factory=dict)

    @property
    def channel(self) -> Literal["dynamics", "input", "sensor", "several", "undecided"]:
        """The one channel, "several", or "undecided"."""
        if len(self.channels) == 1:
            return self.channels[0]
        return "several" if self.channels else "undecided"

    @property
    def times(self) -> str:
        """The first windows of time, in words; empty where there are none."""
        return spans(self.time, SHOWN)


@dataclass(frozen=True)
class OutputError:
    """RMSE of one output's prediction, in its unit: before, after, and after with the parameters
    `moved` within their errors; and its noise.
    """

    before: float
    after: float
    moved: float
    noise: float
    unit: str


@dataclass(frozen=True, eq=False)
class Curves:
    """One output of the first held-out recording: times (N,), what was measured and predicted
    there, before and after; for the first output also with the parameters `moved`.
    """

    t: np.ndarray
    measured: np.ndarray
    before: np.ndarray
    after: np.ndarray
    moved: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Proof:
    """Held-out record: errors of each output by name, p-value, the curves of each by name, and
    names: of the recordings, and of the effects given first that are not met there.
    """

    outputs: Mapping[str, OutputError]
    p_value: float
    curves: Mapping[str, Curves]
    recordings: tuple[str, ...] = ()
    not_met: tuple[str, ...] = ()

    def sensitive(self, settings: Settings) -> bool:
        """Whether the prediction depends on how exactly the parameters are known: after impacts, a
        small error makes another motion.
        """
        return any(e.after > settings.verdict.sensitive * e.moved for e in self.outputs.values())

    @property
    def worst(self) -> str:
        """The output that the nominal model misses most, in units of its noise."""
        return max(self.outputs, key=lambda name: (
            self.outputs[name].before / max(self.outputs[name].noise, 1e-300)))

    @property
    def of_worst(self) -> OutputError:
        """Of that one."""
        return self.outputs[self.worst]

    @property
    def rmse_before(self) -> float:
        """Of that one."""
        return self.of_worst.before

    @property
    def rmse_after(self) -> float:
        """Of that one."""
        return self.of_worst.after

    @property
    def noise(self) -> float:
        """Of that one."""
        return self.of_worst.noise

    @property
    def unit(self) -> str:
        """Of that one."""
        return self.of_worst.unit

    def to_dict(self) -> dict[str, Any]:
        """For diagnosis.json: of the worst output, and of each where there are several."""
        found = {**_rmse(self.of_worst), "p_value": self.p_value}
        if self.not_met:
            found["not_met"] = list(self.not_met)
        if len(self.outputs) > 1:
            found["output"] = self.worst
            found["outputs"] = {name: _rmse(e) for name, e in self.outputs.items()}
        return found


def _rmse(e: OutputError) -> dict[str, Any]:
    return {"rmse_before": e.before, "rmse_after": e.after, "noise": e.noise, "unit": e.unit}


@dataclass(frozen=True, eq=False)
class DiagnosisData:
    """The fields of `pikanid.Diagnosis`, where they are described."""

    verdict: Verdict
    p_value: float
    settings: Settings
    where: Where
    hypotheses: tuple[Explanation, ...]
    rejected: tuple[Explanation, ...]
    before: Estimate
    after: Estimate
    held_out: Proof | None
    noise: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    undetectable_below: Mapping[str, Value] = field(default_factory=dict)
    next_experiment: str = ""
    seconds: float = 0.0
    shape: ForceShape | None = None
    force_over_time: ForceOverTime | None = None
    patch: Patch | None = None
    doubt: str = ""
    present: tuple[Present, ...] = ()
    remainder: Remainder | None = None
    closest: Closest | None = None
    exchanged: bool = False

    @property
    def alpha(self) -> float:
        """Rate of false alarms that was asked for."""
        return self.settings.alpha

    @property
    def mismatch(self) -> bool:
        """Whether something is missing."""
        return self.verdict != "none"

    @property
    def model(self) -> Model:
        """The extended model at its estimates; the nominal one where nothing is named."""
        return self.after.fitted_model

    def behind(self, h: Explanation) -> float | None:
        """χ² with the penalty for its parameters, from that of what is given first."""
        return h.score - self.hypotheses[0].score if self.hypotheses else None

    @property
    def not_given(self) -> list[tuple[str, str]]:
        """Title of each hypothesis that is not given, and why it is not."""
        return [(title, h.why_not) for title, h in zip(
            titles_apart(self.rejected), self.rejected, strict=True)]

    def odds(self, h: Explanation) -> str:
        """How probable a hypothesis is, to stand after its title; nothing where more is left."""
        return "" if self.verdict == "partial" else f" (probability {h.probability:.3f})"

    def sentence(self) -> str:
        """The verdict as an engineer would put it."""
        if self.verdict == "none":
            p = f"p = {self.p_value:.2g}"
            return f"The model explains the recording: nothing beyond noise ({p})."
        head = f"Something is missing in the model ({p_text(self.p_value, 1)}): "
        titles = list(dict.fromkeys(titles_apart(self.hypotheses)))
        if self.verdict == "named" or (self.verdict == "set" and len(titles) == 1):
            return f"{head}{titles[0]}, confirmed {self._confirmed_on}."
        if self.verdict == "set":
            return head + f"one of {_first(titles)}, which these recordings cannot tell apart."
        if self.verdict == "partial" and self.remainder is not None:
            return head + self.remainder.beside(self.present, self.settings.adequate)
        if self.verdict == "unconfirmed":
            doubt = f": {self.doubt}." if self.doubt else " on other data."
            if self.hypotheses[0].probability >= self.settings.verdict.guessed:
                return f"{head}perhaps {_first(titles)}, not confirmed{doubt}"
            near = enumerated(self.closest.effects) if self.closest else _first(titles)
            return (f"{head}nothing in the catalogue explains it; closest comes {near}, "
                    f"not confirmed{doubt}")
        it = "all of it" if self.closest and self.closest.share_explained >= CLOSE else "it"
        doubt = f"; {self.doubt}" if self.doubt else ""
        return f"{head}nothing in the catalogue explains {it}{doubt}."

    @property
    def _confirmed_on(self) -> str:
        effects, met = self.hypotheses[0].effects, "on the held-out recording"
        later = self.held_out.not_met if self.held_out else ()
        if once := [e.name for e in effects if e.once]:
            if len(once) == len(effects):
                return f"as what happened once, and not {met}, which is predicted without it"
            return f"{met}, {enumerated(once)} as what happened once"
        here = "where this recording meets it: the held-out one does not"
        return met if not later else here if len(later) == len(effects) else (
            f"{met}, and {enumerated(later)} {here}")


def _first(titles: Sequence[str]) -> str:
    more = len(titles) - TOLD
    others = [f"one of {more} other explanations"] if more > 1 else titles[TOLD:]
    return "; or ".join([*titles[:TOLD], *others])


def titles_apart(given: Sequence[Explanation]) -> list[str]:
    """The title of each; of hypotheses that share one, with what they add to the model."""
    titles = [h.title for h in given]
    return [t if titles.count(t) == 1 else f"{t} ({'; '.join(e.expression for e in h.effects)})"
            for t, h in zip(titles, given, strict=True)]
