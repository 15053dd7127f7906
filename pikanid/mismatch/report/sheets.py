"""The tables of a diagnosis."""

from __future__ import annotations

import numpy as np

from pikanid.estimate import Estimate
from pikanid.estimate.rounding import rounded
from pikanid.figures import unit_text
from pikanid.mismatch.report.findings import DiagnosisData
from pikanid.pieces.sheet import Sheet


def held_out(dx: DiagnosisData) -> Sheet:
    """Every output of the held-out recording, by the nominal and the extended model."""
    proof = dx.held_out
    shown = [("nominal", "before"), *([("extended", "after")] if dx.hypotheses else [])]
    if dx.hypotheses and proof is not None and proof.sensitive(dx.settings):
        shown.append(("extended, parameters moved within their errors", "moved"))
    rows = []
    for name, error in proof.outputs.items() if proof is not None else ():
        own = proof.curves.get(name) if proof and len(proof.recordings) == 1 else None
        spread = 0.0 if own is None else float(np.std(own.measured))
        for label, field in [*shown, ("noise", "noise")]:
            rmse = float(getattr(error, field))
            rows.append((label, name, f"{rmse:.3g}", unit_text(error.unit) or "-",
                         f"{100 * (1 - rmse / spread):.2f}" if spread else ""))
    return Sheet(("model", "output", "RMSE", "unit", "fit %"), tuple(rows), ("RMSE", "fit %"))


def parameters(dx: DiagnosisData) -> Sheet:
    """Of the nominal model, before and after; where nothing is missing, its estimates."""
    before, after = (_estimates(found) for found in (dx.before, dx.after))
    if not dx.mismatch:
        return Sheet(("parameter", "estimate ± std. error", "unit"), tuple(
            (f.label, before[f.label], unit_text(f.unit) or "-") for f in dx.before.free))
    return Sheet(("parameter", "before", "after", "unit"), tuple(
        (f.label, before[f.label], after[f.label], unit_text(f.unit) or "-")
        for f in dx.after.free if f.label in before))


def _estimates(found: Estimate) -> dict[str, str]:
    """Each free parameter by its label: with its standard error, or that it ended at a bound."""
    return {f.label: f"its bound {v:.6g}" if ends
            else rounded(float(v), float(found.covariance[k, k]) ** 0.5)
            for k, (f, v, ends) in enumerate(zip(
                found.free, found.theta, found.at_bound, strict=True))}
