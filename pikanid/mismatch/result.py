"""`Diagnosis`: the answer to "what is missing?", and its JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from pikanid.estimate import Estimate
from pikanid.model import Model
from pikanid.model_parts import Parameter

if TYPE_CHECKING:
    import matplotlib.figure

    from pikanid.mismatch.force_shape import ForceShape
    from pikanid.mismatch.latent_force import ForceOverTime
    from pikanid.mismatch.patch import Patch

# times the held-out RMSE with parameters moved within their errors: more is theirs, not a law's
SENSITIVE = 1.2
Verdict = Literal["none", "named", "set", "unconfirmed", "unnamed"]


@dataclass(frozen=True)
class Value:
    """A number with its standard error and unit."""

    value: float
    std: float
    unit: str = ""


@dataclass(frozen=True)
class NamedEffect:
    """One effect of a hypothesis: its ids (several where twins cannot be told apart), its name for
    people, what is added to the model, and its parameters.
    """

    ids: tuple[str, ...]
    name: str
    expression: str
    parameters: Mapping[str, Value]
    channel: str = "dynamics"


@dataclass(frozen=True)
class Explanation:
    """A hypothesis: effects, probability among those considered, model, tests."""

    effects: tuple[NamedEffect, ...]
    probability: float
    model: Model
    score: float
    p_train: float | None
    p_held_out: float | None
    why_not: str = ""

    @property
    def title(self) -> str:
        """In words."""
        return " and ".join(e.name for e in self.effects) or "nothing"


@dataclass(frozen=True)
class Where:
    """Channel, equation, states, seconds, and whether a static law of the states can do it."""

    channel: Literal["dynamics", "input", "sensor", "undecided"]
    equation: str
    depends_on: tuple[str, ...]
    time: tuple[tuple[float, float], ...]
    static_law: bool | None


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
class Proof:
    """Held-out record: errors of each output by name, p-value; and the first output's curves."""

    outputs: Mapping[str, OutputError]
    p_value: float
    t: np.ndarray
    measured: np.ndarray
    before: np.ndarray
    after: np.ndarray
    moved: np.ndarray

    @property
    def sensitive(self) -> bool:
        """Whether the prediction depends on how exactly the parameters are known: after impacts, a
        small error makes another motion.
        """
        return any(e.after > SENSITIVE * e.moved for e in self.outputs.values())

    @property
    def first(self) -> OutputError:
        """Of the output that is drawn."""
        return next(iter(self.outputs.values()))

    @property
    def rmse_before(self) -> float:
        """Of the first output."""
        return self.first.before

    @property
    def rmse_after(self) -> float:
        """Of the first output."""
        return self.first.after

    @property
    def rmse_moved(self) -> float:
        """Of the first output."""
        return self.first.moved

    @property
    def noise(self) -> float:
        """Of the first output."""
        return self.first.noise

    @property
    def unit(self) -> str:
        """Of the first output."""
        return self.first.unit

    def to_dict(self) -> dict[str, Any]:
        """For diagnosis.json: numbers of the first output, and of each where there are several."""
        found: dict[str, Any] = {
            "rmse_before": self.rmse_before, "rmse_after": self.rmse_after, "noise": self.noise,
            "unit": self.unit, "p_value": self.p_value}
        if len(self.outputs) > 1:
            found["outputs"] = {name: {
                "rmse_before": e.before, "rmse_after": e.after, "noise": e.noise, "unit": e.unit}
                for name, e in self.outputs.items()}
        return found


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What is missing in a model, according to recordings.

    Attributes:
        verdict: "none" (nothing beyond noise), "named" (one explanation, confirmed on held-out
            data), "set" (several that these data cannot tell apart, confirmed), "unconfirmed"
            (found, but not proved on other data), "unnamed" (something is missing that neither the
            catalogue nor a confirmed formula explains).
        p_value: Of a mismatch as large as seen, if there is none.
        alpha: Rate of false alarms that was asked for.
        where: In which channel, equation, states and seconds.
        hypotheses: Explanations given, most probable first.
        rejected: The closest ones that lost, and why.
        before, after: Estimates of the nominal and of the extended model.
        held_out: Proof on the held-out recording; None without one.
        noise: Sentences about the noise level.
        notes: What else the reader should know.
        undetectable_below: Size of each effect that could not have been seen.
        next_experiment: A sentence; empty where none is needed.
        seconds: Of the whole diagnosis.
        shape: The missing force over each state and input, to first order; None without a mismatch.
        force_over_time: The force that would explain the mismatch, over time, with its band; None
            without a mismatch, or where it cannot be computed.
        patch: An edge without a name that improves the prediction; None where something is named,
            or where it is no help.
        doubt: What keeps an explanation that predicts held-out data from being confirmed, if
            anything does.
    """

    verdict: Verdict
    p_value: float
    alpha: float
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

    @property
    def mismatch(self) -> bool:
        """Whether something is missing."""
        return self.verdict != "none"

    @property
    def model(self) -> Model:
        """The extended model at its estimates; the nominal one where nothing is named."""
        return self.after.fitted_model

    def sentence(self) -> str:
        """The verdict as an engineer would put it."""
        if self.verdict == "none":
            return (f"The model explains the recording: nothing beyond noise (p = "
                    f"{self.p_value:.2g}).")
        head = f"Something is missing in the model (p = {self.p_value:.1g}): "
        titles = list(dict.fromkeys(titles_apart(self.hypotheses)))
        if self.verdict == "named" or (self.verdict == "set" and len(titles) == 1):
            return head + f"{titles[0]}, confirmed on the held-out recording."
        if self.verdict == "set":
            return head + "one of " + "; or ".join(titles) + ", which these recordings cannot " \
                "tell apart."
        if self.verdict == "unconfirmed":
            return head + "perhaps " + "; or ".join(titles) + ", not confirmed" + (
                f": {self.doubt}." if self.doubt else " on other data.")
        return head + "nothing in the catalogue explains it."

    def to_dict(self) -> dict[str, Any]:
        """The content of diagnosis.json."""
        return {
            "schema_version": 1,
            "verdict": self.verdict,
            "mismatch": self.mismatch,
            "p_value": self.p_value,
            "alpha": self.alpha,
            "where": {"channel": self.where.channel, "equation": self.where.equation,
                      "depends_on": list(self.where.depends_on),
                      "time": [list(span) for span in self.where.time],
                      "static_law": self.where.static_law},
            "hypotheses": [{
                "effects": [{"ids": list(e.ids), "name": e.name, "expression": e.expression,
                             "parameters": {n: _entry(v) for n, v in e.parameters.items()}}
                            for e in h.effects],
                "probability": h.probability} for h in self.hypotheses],
            "parameters": {"before": _parameters(self.before), "after": _parameters(self.after)},
            "held_out": None if self.held_out is None else self.held_out.to_dict(),
            "undetectable_below": {
                n: {"value": v.value, "unit": v.unit} for n, v in self.undetectable_below.items()},
            "next_experiment": self.next_experiment,
        }

    def plot(self) -> matplotlib.figure.Figure:
        """Where it is (time), and the proof (held-out before and after)."""
        from pikanid.mismatch.drawing import plot_diagnosis

        return plot_diagnosis(self)

    def __str__(self) -> str:
        from pikanid.mismatch.telling import lines_of

        return "\n".join(lines_of(self))

    __repr__ = __str__

    def _repr_html_(self) -> str:
        from html import escape

        from pikanid.mismatch.telling import lines_of

        first, *rest = lines_of(self)
        return f"<b>{escape(first)}</b><pre>{escape(chr(10).join(rest))}</pre>"


def titles_apart(given: Sequence[Explanation]) -> list[str]:
    """The title of each; of hypotheses that share one, with what they add to the model."""
    titles = [h.title for h in given]
    return [t if titles.count(t) == 1 else f"{t} ({'; '.join(e.expression for e in h.effects)})"
            for t, h in zip(titles, given, strict=True)]


def _entry(v: Value) -> dict[str, Any]:
    return {"value": v.value, "std": v.std if np.isfinite(v.std) else None, "unit": v.unit}


def _parameters(estimate: Estimate) -> dict[str, Any]:
    std = np.sqrt(np.diag(estimate.covariance))
    return {f.label: {"value": float(v), "std": float(s) if np.isfinite(s) else None}
            for f, v, s in zip(estimate.free, estimate.theta, std, strict=True)}


def values_of(parameters: tuple[Parameter, ...], values: Mapping[str, float],
              std: Mapping[str, float]) -> dict[str, Value]:
    """Estimates of an effect's parameters."""
    return {p.name: Value(values[p.name], std[p.name], p.unit) for p in parameters
            if p.name in values}
