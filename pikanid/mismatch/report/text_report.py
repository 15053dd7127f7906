"""A diagnosis in words."""

from __future__ import annotations

from pikanid.estimate.rounding import rounded, with_unit
from pikanid.mismatch.catalogue.candidate import SYMBOLIC
from pikanid.mismatch.report.findings import DiagnosisData
from pikanid.mismatch.report.sheets import parameters
from pikanid.pieces.sentences import p_text

TOLD = 8  # layout: parameters of the model in a line


def places(dx: DiagnosisData) -> list[str]:
    """The channels in which something surely acts; of the dynamics with the equation, where the
    model has several that say more than that a state is another one's rate.
    """
    equations = dx.before.model.equations.values()
    which = f", in {dx.where.equation}'" if sum(not e.is_Symbol for e in equations) > 1 else ""
    return [f"{c}{which}" if c == "dynamics" else c for c in dx.where.channels]


def lines_of(dx: DiagnosisData) -> list[str]:
    """Verdict, where, what, proof, what to do next, notes and settings, line by line."""
    lines = [dx.sentence()]
    if dx.mismatch:
        place = " and ".join(places(dx)) or "channel undecided"
        region = ", ".join(map(str, dx.where.region))
        lines.append(f"Where: {place}" + (f"; at {region}" if region else "")
                     + (f"; in time at {dx.where.times}" if dx.where.time else ""))
        if dx.where.parameters:
            lines.append("  with a free force there: " + ", ".join(
                f"{name} = {with_unit(rounded(v.value, v.std), v.unit)}"
                for name, v in dx.where.parameters.items()))
    lines += [f"Surely: {part.sentence()}" for part in dx.present]
    lines += dx.remainder.lines() if dx.remainder is not None else []
    lines += dx.closest.lines() if dx.closest is not None else []
    for h in dx.hypotheses:
        lines.append(f"What: {h.title}{dx.odds(h)}")
        for e in h.effects:
            # what an input or a sensor becomes is no term of an equation
            added = (e.ids[0].startswith(SYMBOLIC) and e.channel == "dynamics"
                     and " -> " not in e.expression)
            left = f"{e.equation}' += " if added else ""
            lines.append(f"  {left}{e.expression}   [{', '.join(e.ids)}]")
            for name, v in e.parameters.items():
                lines.append(f"    {name} = {with_unit(rounded(v.value, v.std), v.unit)}")
    lines += _of_model(dx) if dx.hypotheses or not dx.mismatch else []
    lines += [f"Not: {title}: {why}" for title, why in dx.not_given[:4]]
    if dx.held_out is not None and dx.hypotheses:
        p = dx.held_out
        several = len(p.outputs) > 1
        told = []
        for output, error in p.outputs.items():
            moved = (f", {error.moved:.3g} with the parameters moved within their errors"
                     if p.sensitive(dx.settings) else "")
            change = with_unit(f"{error.before:.3g} -> {error.after:.3g}", error.unit)
            whose = f"of '{output}' " if several else ""
            told.append(f"{whose}{change}{moved} (noise {error.noise:.3g})")
        lines.append(f"Proof: held-out RMSE {'; '.join(told)}, {p_text(p.p_value)}")
    if dx.patch is not None:
        lines.append(f"Patch: {dx.patch.sentence()}.")
    if dx.next_experiment:
        lines.append(f"Next: {dx.next_experiment}")
    return [*lines, *dx.noise, *dx.notes, str(dx.settings)]


def _of_model(dx: DiagnosisData) -> list[str]:
    """The model's parameters before and after, or alone, in a line; none where it has none."""
    units = {f.label: f.unit for f in dx.after.free}
    told = [f"{name} = {with_unit(' -> '.join(values), units[name])}"
            for name, *values, _ in parameters(dx).rows]
    more = f"; and {len(told) - TOLD} more" if len(told) > TOLD else ""
    return [f"Model: {'; '.join(told[:TOLD])}{more}"] if told else []
