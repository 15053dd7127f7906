"""A diagnosis as one self-contained page of HTML."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from pikanid.estimate.estimate import rounded
from pikanid.mismatch.report.drawing import plot_proof, plot_shape, plot_where
from pikanid.reporting.document import document, drawn, tabled
from pikanid.reporting.sheet import Sheet

if TYPE_CHECKING:
    from pikanid.mismatch.report.diagnosis import Diagnosis
    from pikanid.mismatch.report.findings import Explanation


def page(dx: Diagnosis, title: str) -> str:
    """The page: the verdict, the picture that proves it, what, where, what lost, what next.

    Args:
        dx: To show.
        title: Such as the name of the recording.
    """
    notes = "".join(f"<li>{escape(note)}</li>" for note in (*dx.noise, *dx.notes))
    return document(title, [
        f"<h1>What is missing? {escape(title)}</h1>",
        f'<p class="verdict {dx.verdict}">{escape(dx.sentence())}</p>',
        _proof(dx), _surely(dx), _what(dx), _parameters(dx), _shape(dx),
        _where(dx) if dx.mismatch else "<h2>What the model leaves of the recording</h2>",
        drawn(plot_where(dx), "what is left over time, and the force that would explain it"),
        _lost(dx), _patch(dx), _next(dx),
        f"<h2>Noise and notes</h2><ul>{notes}</ul>",
        f'<p class="small">p = {dx.p_value:.2g} at a false-alarm rate of {dx.alpha:g}; '
        f"{dx.seconds:.1f} s. {escape(str(dx.settings))}</p>"],
        {f"Nominal model: {dx.before.model.name}": dx.before.model},
        [f.recording for f in dx.before.fits])


def _proof(dx: Diagnosis) -> str:
    """The held-out recording, before and after."""
    proof, figure = dx.held_out, plot_proof(dx)
    if proof is None or figure is None:
        why = dx.doubt or "there is no held-out recording"
        return f"<p>Nothing is proved: {escape(why)}.</p>"
    moved = bool(dx.hypotheses) and proof.sensitive(dx.settings)
    headers = ("held-out output", "RMSE before", "RMSE after",
               *(["with parameters moved within their errors"] if moved else []), "noise", "unit")
    rows = tuple((name, f"{e.before:.3g}", f"{e.after:.3g}",
                  *([f"{e.moved:.3g}"] if moved else []), f"{e.noise:.3g}", e.unit or "-")
                 for name, e in proof.outputs.items())
    judged = ("what is left is noise" if proof.p_value >= dx.settings.adequate
              else "something else is left than noise")
    return ("<h2>The held-out recording, before and after</h2>"
            f"{drawn(figure, 'held-out outputs, predicted before and after')}"
            f"{tabled(Sheet(headers, rows))}<p>Of the extended model {judged} "
            f"(p = {proof.p_value:.2g}).</p>" if dx.hypotheses else
            "<h2>The held-out recording</h2>"
            f"{drawn(figure, 'held-out outputs, predicted')}{tabled(Sheet(headers, rows))}")


def _where(dx: Diagnosis) -> str:
    spans = dx.where.seconds or "spread over the recording"
    channel = " and ".join(f"the {c}" for c in dx.where.channels) or (
        "undecided between input, sensor and dynamics")
    region = f" It acts at {', '.join(map(str, dx.where.region))}." if dx.where.region else ""
    if dx.where.parameters:
        region += " With a free force there: " + ", ".join(
            f"{n} = {rounded(v.value, v.std)} {v.unit}".rstrip()
            for n, v in dx.where.parameters.items()) + "."
    depends = f"; depends on {', '.join(dx.where.depends_on)}" if dx.where.depends_on else ""
    return (f"<h2>Where</h2><p>Channel: {escape(channel)}{escape(depends)}.{escape(region)} "
            f"In time: {escape(spans)}.{_force(dx) if dx.where.time else ''}</p>")


def _force(dx: Diagnosis) -> str:
    force = dx.force_over_time
    if force is None or not force.resolved:
        return " There the residual is louder than noise."
    worth = (f" It leaves {force.left:.2g} of χ² per degree of freedom: no force explains "
             "everything." if (
                 force.left > dx.settings.beyond.unexplained
                 and dx.verdict not in ("named", "set")) else "")
    band = 100 * (1 - dx.settings.band)
    return (f" There the simultaneous {band:g} % band of the force that would explain it excludes "
            f"zero (means over {force.resolution:.2g} s). What a sensor or an input gets wrong can "
            f"look like a force too.{worth}")


def _surely(dx: Diagnosis) -> str:
    """What is there whatever is left, and what is left."""
    if dx.remainder is None:
        return ""
    sheet = Sheet(("family", "here as", "values, with errors that count the remainder",
                   "times as much left without it"), tuple((
                       p.family,
                       p.name + ("" if p.ids or not p.compared else
                                 f" (not sure; compared with {', '.join(p.compared)})"),
                       "; ".join(
                           f"{n} = {rounded(v.value, p.std_with_remainder[n])} {v.unit}".rstrip()
                           for n, v in p.parameters.items()),
                       "no other explains it" if p.dominance is None else f"{p.dominance:.2g}")
                       for p in dx.present))
    left = "".join(f"<li>{escape(line)}.</li>" for line in dx.remainder.lines())
    return (f"<h2>Surely there</h2>{tabled(sheet)}"
            f"<p>{escape(dx.remainder.sentence())}.</p><ul>{left}</ul>")


def _what(dx: Diagnosis) -> str:
    return "<h2>What</h2>" + "".join(
        _explanation(h, dx.odds(h)) for h in dx.hypotheses) if dx.hypotheses else ""


def _explanation(h: Explanation, odds: str) -> str:
    formulas = "".join(f"<li>{escape(e.name)} ({escape(' or '.join(e.ids))}): "
                       f"<code>{escape(e.expression)}</code></li>" for e in h.effects)
    values = Sheet(("parameter", "estimate ± std. error", "unit"), tuple(
        (n, rounded(v.value, v.std), v.unit or "-")
        for e in h.effects for n, v in e.parameters.items()))
    return (f"<p><b>{escape(h.title)}</b>{escape(odds)}</p><ul>{formulas}</ul>"
            f"{tabled(values) if values.rows else ''}")


def _parameters(dx: Diagnosis) -> str:
    """Of the model, before and after."""
    if not dx.hypotheses:
        return ""
    before, after = ({f.label: rounded(float(v), found.covariance[k, k] ** 0.5)
                      for k, (f, v) in enumerate(zip(found.free, found.theta, strict=True))}
                     for found in (dx.before, dx.after))
    return "<h2>The model's parameters</h2>" + tabled(Sheet(
        ("parameter", "before", "after", "unit"),
        tuple((f.label, before[f.label], after[f.label], f.unit or "-")
              for f in dx.after.free if f.label in before)))


def _shape(dx: Diagnosis) -> str:
    figure = plot_shape(dx)
    return "" if figure is None else drawn(figure, "the missing force over states and inputs")


def _lost(dx: Diagnosis) -> str:
    """What was tried and is not given: why, and the numbers."""
    if not dx.rejected:
        return ""
    rows = []
    for (title, why), h in zip(dx.not_given, dx.rejected, strict=True):
        behind = dx.behind(h)
        rows.append((title, why, "" if behind is None else f"{behind:+.0f}"))
    head = ("tried", "why it is not given", "χ² and penalty, from what is given")
    return "<h2>Tried and not given</h2>" + tabled(Sheet(head, tuple(rows)))


def _patch(dx: Diagnosis) -> str:
    if dx.patch is None:
        return ""
    unit = dx.held_out.unit if dx.held_out is not None else ""
    return f"<h2>Until it is understood</h2><p>Patch: {escape(dx.patch.sentence(unit))}.</p>"


def _next(dx: Diagnosis) -> str:
    return f"<h2>What to do next</h2><p>{escape(dx.next_experiment)}</p>" if (
        dx.next_experiment) else ""
