"""`Diagnosis`: the answer to "what is missing?", and its JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pikanid.estimate import Estimate
from pikanid.mismatch.report.drawing import plot_diagnosis
from pikanid.mismatch.report.findings import DiagnosisData
from pikanid.mismatch.report.part import Value
from pikanid.mismatch.report.sheets import held_out, parameters
from pikanid.mismatch.report.text_report import lines_of
from pikanid.pieces.html import tabled, text

if TYPE_CHECKING:
    import matplotlib.figure


@dataclass(frozen=True, eq=False)
class Diagnosis(DiagnosisData):
    """What is missing in a model, according to recordings.

    Attributes:
        verdict: "none" (nothing beyond noise), "named" (one explanation, confirmed on held-out
            data), "set" (several that these data cannot tell apart, confirmed), "partial" (physics
            that is surely there, though not all that is left is explained), "unconfirmed"
            (found, but not proved on other data), "unnamed" (something is missing that neither the
            catalogue nor a confirmed formula explains).
        p_value: Of a mismatch as large as seen, if there is none.
        settings: What was taken as given: error rates, thresholds, budgets.
        where: In which channels, equation, states, seconds and part of the state.
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
        present: What is surely there, where the verdict is "partial".
        remainder: What is left then.
        closest: Of "unnamed" and "unconfirmed" answers with a proof at hand: the explanation that
            would be next, and what keeps it from being sure; None where there is none.
        exchanged: Whether the held-out recordings are the ones explained, and the proof is on the
            others.
    """

    def to_dict(self) -> dict[str, Any]:
        """The content of diagnosis.json."""
        return {
            "schema_version": 2,
            "verdict": self.verdict,
            "mismatch": self.mismatch,
            "p_value": self.p_value,
            "alpha": self.alpha,
            "exchanged": self.exchanged,
            "where": {"channel": self.where.channel, "channels": list(self.where.channels),
                      "equation": self.where.equation if self.mismatch else "",
                      "depends_on": list(self.where.depends_on),
                      "time": [list(span) for span in self.where.time],
                      "static_law": self.where.static_law,
                      "region": [{"state": r.state, "from": r.low, "to": r.high, "unit": r.unit}
                                 for r in self.where.region],
                      "parameters": {n: _entry(v) for n, v in self.where.parameters.items()}},
            "hypotheses": [{
                "effects": [{"ids": list(e.ids), "name": e.name, "expression": e.expression,
                             "channel": e.channel, "equation": e.equation,
                             "parameters": {n: _entry(v) for n, v in e.parameters.items()}}
                            for e in h.effects],
                "probability": h.probability} for h in self.hypotheses],
            "rejected": [{"effects": [list(e.ids) for e in h.effects], "why_not": h.why_not}
                         for h in self.rejected],
            "parameters": {"before": _parameters(self.before), "after": _parameters(self.after)},
            "held_out": None if self.held_out is None else self.held_out.to_dict(),
            "undetectable_below": {
                n: {"value": v.value, "unit": v.unit} for n, v in self.undetectable_below.items()},
            "next_experiment": self.next_experiment,
            "notes": [*self.noise, *self.notes],
            "present": [p.to_dict() for p in self.present],
            "remainder": None if self.remainder is None else self.remainder.to_dict(),
            "closest": None if self.closest is None else self.closest.to_dict(),
            "settings": self.settings.to_dict(),
        }

    def plot(self) -> matplotlib.figure.Figure:
        """Where it is (time), and the proof (held-out before and after)."""
        return plot_diagnosis(self)

    def __str__(self) -> str:
        return "\n".join(lines_of(self))

    __repr__ = __str__

    def _repr_html_(self) -> str:
        first, *rest = lines_of(self)
        tables = [held_out(self), *([parameters(self)] if self.hypotheses else [])]
        return (f"<b>{text(first)}</b>{''.join(tabled(t) for t in tables if t.rows)}"
                f"<pre>{text(chr(10).join(rest))}</pre>")


def _entry(v: Value) -> dict[str, Any]:
    return {"value": v.value, "std": v.std if np.isfinite(v.std) else None, "unit": v.unit}


def _parameters(estimate: Estimate) -> dict[str, Any]:
    std = np.sqrt(np.diag(estimate.covariance))
    return {f.label: {"value": float(v), "std": float(s) if np.isfinite(s) else None,
                      "at_bound": bool(ends)}
            for f, v, s, ends in zip(estimate.free, estimate.theta, std, estimate.at_bound,
                                     strict=True)}
