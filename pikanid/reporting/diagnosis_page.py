"""A diagnosis as one self-contained page of HTML."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from pikanid.estimate.rounding import rounded
from pikanid.figures import unit_text
from pikanid.mismatch.report.drawing import plot_proof, plot_shape, plot_where
from pikanid.mismatch.report.sheets import held_out, parameters
from pikanid.mismatch.report.text_report import places
from pikanid.pieces.html import drawn, tabled, text
from pikanid.pieces.sentences import p_text
from pikanid.pieces.sheet import Sheet
from pikanid.pieces.time_unit import duration
from pikanid.reporting.document import document

if TYPE_CHECKING:
    from pikanid.mismatch.report.diagnosis import Diagnosis
    from pikanid.mismatch.report.findings import Explanation


def page(dx: Diagnosis, title: str, files: Sequence[str] = ()) -> str:
    """The page: the verdict, the picture that proves it, what, where, what lost, what next.

    Args:
        dx: To show.
        title: Such as the name of the recording.
        files: What was read, as it was named.
    """
    notes = "".join(f"<li>{text(note)}</li>" for note in (*dx.noise, *dx.notes))
    return document(title, [
        f"<h1>What is missing? {text(title)}</h1>",
        f'<p class="verdict {dx.verdict}">{text(dx.sentence())}</p>',
        _proof(dx), _surely(dx), _closest(dx), _what(dx), _parameters(dx), _shape(dx),
        _where(dx) if dx.mismatch else "<h2>What the model leaves of the recording</h2>",
        drawn(plot_where(dx), "what is left over time, and the force that would explain it",
              plot_where(dx, narrow=True)),
        _lost(dx), _patch(dx), _next(dx),
        f"<h2>Noise and notes</h2><ul>{notes}</ul>",
        f'<p class="small">{text(p_text(dx.p_value))} at a false-alarm rate of '
        f"{dx.alpha:g}; {dx.seconds:.1f} s. {text(str(dx.settings))}</p>"],
        {f"Nominal model: {dx.before.model.name}": dx.before.model},
        [*(f.recording for f in dx.before.fits), *(() if dx.held_out is None else (
            f"{name} (held out)" for name in dx.held_out.recordings))], files)


def _proof(dx: Diagnosis) -> str:
    """The held-out recording, before and after."""
    proof, figure = dx.held_out, plot_proof(dx)
    if proof is None or figure is None:
        why = dx.doubt or "there is no held-out recording"
        return f"<p>Nothing is proved: {text(why)}.</p>"
    judged = ("what is left is noise" if proof.p_value >= dx.settings.adequate
              else "something else is left than noise")
    head, shows, said = (("The held-out recording, before and after", " before and after",
                          f"<p>Of the extended model {judged} "
                          f"({text(p_text(proof.p_value))}).</p>") if dx.hypotheses
                         else ("The held-out recording", "", ""))
    picture = drawn(figure, f"held-out outputs, predicted{shows}", plot_proof(dx, narrow=True))
    return f"<h2>{head}</h2>{picture}{tabled(held_out(dx))}{said}"


def _where(dx: Diagnosis) -> str:
    spans = dx.where.times or "spread over the recording"
    channel = " and ".join(f"the {c}" for c in places(dx)) or (
        "undecided between input, sensor and dynamics")
    region = f" It acts at {', '.join(map(str, dx.where.region))}." if dx.where.region else ""
    if dx.where.parameters:
        region += " With a free force there: " + ", ".join(
            f"{n} = {rounded(v.value, v.std)} {unit_text(v.unit)}".rstrip()
            for n, v in dx.where.parameters.items()) + "."
    depends = f"; depends on {', '.join(dx.where.depends_on)}" if dx.where.depends_on else ""
    return (f"<h2>Where</h2><p>Channel: {text(channel)}{text(depends)}.{text(region)} "
            f"In time: {text(spans)}.{_force(dx) if dx.where.time else ''}</p>")


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
            f"zero (means over {duration(force.resolution)}). What a sensor or an input gets wrong "
            f"can look like a force too.{worth}")


def _surely(dx: Diagnosis) -> str:
    """What is there whatever is left, and what is left."""
    if dx.remainder is None:
        return ""
    sheet = Sheet(("family", "here as", "values, with errors that count the remainder",
                   "times as much left without it"), tuple((
                       p.title if p.or_family else p.family,
                       p.name + ("" if p.ids or not p.compared else
                                 f" (not sure; compared with {', '.join(p.compared)})"),
                       "; ".join(
                           f"{n} = {rounded(v.value, p.std_with_remainder[n])} "
                           f"{unit_text(v.unit)}".rstrip()
                           for n, v in p.parameters.items()),
                       "no other explains it" if p.dominance is None else f"{p.dominance:.2g}")
                       for p in dx.present))
    left = "".join(f"<li>{text(line)}.</li>" for line in dx.remainder.lines())
    return (f"<h2>Surely there</h2>{tabled(sheet)}"
            f"<p>{text(dx.remainder.sentence())}.</p><ul>{left}</ul>")


def _closest(dx: Diagnosis) -> str:
    """What would be next where nothing is sure."""
    if dx.closest is None:
        return ""
    first, *doubts = (f"{text(line)}." for line in dx.closest.lines())
    return (f"<h2>What comes closest</h2><p>{first}</p>"
            f"<ul>{''.join(f'<li>{doubt}</li>' for doubt in doubts)}</ul>")


def _what(dx: Diagnosis) -> str:
    return "<h2>What</h2>" + "".join(
        _explanation(h, dx.odds(h)) for h in dx.hypotheses) if dx.hypotheses else ""


def _explanation(h: Explanation, odds: str) -> str:
    formulas = "".join(f"<li>{text(e.name)} ({text(' or '.join(e.ids))}): "
                       f"<code>{escape(e.expression)}</code></li>" for e in h.effects)
    values = Sheet(("parameter", "estimate ± std. error", "unit"), tuple(
        (n, rounded(v.value, v.std), unit_text(v.unit) or "-")
        for e in h.effects for n, v in e.parameters.items()))
    return (f"<p><b>{text(h.title)}</b>{text(odds)}</p><ul>{formulas}</ul>"
            f"{tabled(values) if values.rows else ''}")


def _parameters(dx: Diagnosis) -> str:
    """Of the model, before and after, or where nothing is missing."""
    if dx.mismatch and not dx.hypotheses:
        return ""
    return "<h2>The model's parameters</h2>" + tabled(parameters(dx))


def _shape(dx: Diagnosis) -> str:
    figure = plot_shape(dx)
    return "" if figure is None else drawn(
        figure, "the missing force over states and inputs", plot_shape(dx, narrow=True))


def _lost(dx: Diagnosis) -> str:
    """What was tried and is not given: why, and the numbers."""
    if not dx.rejected:
        return ""
    rows = []
    for (title, why), h in zip(dx.not_given, dx.rejected, strict=True):
        more = dx.behind(h)
        rows.append((title, why, "" if more is None else f"{round(more):+d}"))
    told = "<h2>Tried and not given</h2>"
    if not dx.hypotheses:
        return told + tabled(Sheet(("tried", "why it is not given"), tuple(r[:2] for r in rows)))
    behind = "χ² and penalty, from what is given"
    return told + tabled(Sheet(("tried", "why it is not given", behind), tuple(rows), (behind,)))


def _patch(dx: Diagnosis) -> str:
    if dx.patch is None:
        return ""
    return f"<h2>Until it is understood</h2><p>Patch: {text(dx.patch.sentence())}.</p>"


def _next(dx: Diagnosis) -> str:
    last = ("Trust the model as far as it was excited: predict a recording that is moved in "
            "another way, 'pikanid validate'." if not dx.mismatch else
            "Use the extended model from here on ('pikanid diagnose --extended' writes it), and "
            "predict a recording that is moved in another way with it: 'pikanid validate'.")
    return f"<h2>What to do next</h2><p>{text(dx.next_experiment or last)}</p>"
