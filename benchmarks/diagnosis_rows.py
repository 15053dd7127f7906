"""Rows of diagnoses of real recordings, for a report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pikanid.mismatch.report.diagnosis import Diagnosis


@dataclass(frozen=True)
class Row:
    """One diagnosis: verdict, effects of each hypothesis, held-out RMSE before and after [unit],
    further figures in words, and wall-clock seconds.
    """

    recording: str
    verdict: str
    hypotheses: tuple[str, ...]
    before: float
    after: float
    unit: str
    seconds: float
    remark: str = ""


def row(recording: str, dx: Diagnosis, seconds: float, remark: str = "") -> Row:
    """What a diagnosis says."""
    names = tuple(" + ".join("/".join(e.ids) for e in h.effects) for h in dx.hypotheses)
    if dx.present:
        names = ("surely " + " and ".join("/".join(p.ids) or p.title for p in dx.present),)
    proof = dx.held_out
    before, after = (np.nan, np.nan) if proof is None else (proof.rmse_before, proof.rmse_after)
    return Row(recording, dx.verdict, names, before, after, "" if proof is None else proof.unit,
               seconds, remark)


def laws(dx: Diagnosis) -> str:
    """What the first hypothesis adds, with its constants."""
    effects = dx.hypotheses[0].effects if dx.hypotheses else ()
    return ", ".join(" ".join([e.expression, *(f"({n} = {v.value:.3g} ± {v.std:.2g} {v.unit})"
                                               for n, v in e.parameters.items())])
                     for e in effects)


def table(rows: Sequence[Row]) -> str:
    """Rows as a Markdown table."""
    lines = ["| recording | verdict | hypotheses | held-out RMSE | seconds | |",
             "| --- | --- | --- | --- | --- | --- |"]
    lines += [f"| {r.recording} | {r.verdict} | {'; '.join(r.hypotheses) or '-'} | {_rmse(r)} | "
              f"{r.seconds:.0f} | {r.remark} |" for r in rows]
    return "\n".join(lines)


def _rmse(r: Row) -> str:
    if np.isnan(r.before):
        return "-"
    return f"{r.before:.3g} → {r.after:.3g} {r.unit}"
