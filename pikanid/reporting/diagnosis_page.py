"""A diagnosis as one self-contained page of HTML."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from pikanid.estimate.estimate import rounded
from pikanid.reporting.document import document, drawn

if TYPE_CHECKING:
    from pikanid.mismatch.report.diagnosis import Diagnosis
    from pikanid.mismatch.report.findings import Explanation


def page(dx: Diagnosis, title: str) -> str:
    """The page: verdict, where, what, proof, what next; figures inside.

    Args:
        dx: To show.
        title: Such as the name of the recording.
    """
    parts = [
        f"<h1>What is missing? {escape(title)}</h1>",
        f'<p class="verdict {dx.verdict}">{escape(dx.sentence())}</p>',
        _where(dx) if dx.mismatch else "",
        _surely(dx), _what(dx), _figure(dx), _proof(dx), _patch(dx), _next(dx),
        "<h2>Noise and notes</h2><ul>" + "".join(
            f"<li>{escape(note)}</li>" for note in (*dx.noise, *dx.notes)) + "</ul>",
        f'<p class="small">p = {dx.p_value:.2g} at a false-alarm rate of {dx.alpha:g}; '
        f"{dx.seconds:.1f} s. {escape(str(dx.settings))}</p>"]
    return document(title, parts, dx.before.model, [f.recording for f in dx.before.fits])


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
    rows = []
    for p in dx.present:
        values = "<br>".join(
            f"{escape(n)} = {rounded(v.value, p.std_with_remainder[n])} {escape(v.unit)}"
            for n, v in p.parameters.items())
        here = escape(p.name) if p.ids else (
            f"{escape(p.name)}<br><span class=small>its form is not sure: compared with "
            f"{escape(', '.join(p.compared))}</span>" if p.compared else escape(p.name))
        rows.append(f"<tr><td><b>{escape(p.family)}</b></td><td>{here}</td><td>{values}</td>"
                    f"<td>{'no other explains it' if p.dominance is None else f'{p.dominance:.2g}'}"
                    "</td></tr>")
    left = "".join(f"<li>{escape(line)}.</li>" for line in dx.remainder.lines())
    return ("<h2>Surely there</h2><div class=wide><table><tr><th>family</th><th>here as</th>"
            "<th>values, with standard errors that count the remainder</th>"
            "<th>times as much left without it</th>"
            f"</tr>{''.join(rows)}</table></div><p>{escape(dx.remainder.sentence())}.</p>"
            f"<ul>{left}</ul>")


def _what(dx: Diagnosis) -> str:
    if not dx.hypotheses and not dx.rejected:
        return ""
    text = "<h2>What</h2>" + "".join(_explanation(h, dx.odds(h)) for h in dx.hypotheses)
    if dx.hypotheses:
        text += _parameters(dx)
    if dx.rejected:
        rows = "".join(f"<tr><td>{escape(title)}</td><td>{escape(why)}</td></tr>"
                       for title, why in dx.not_given)
        text += f"<p>Tried and not given:</p><div class=wide><table>{rows}</table></div>"
    return text


def _explanation(h: Explanation, odds: str) -> str:
    rows = "".join(
        f"<tr><td>{escape(n)}</td><td>{rounded(v.value, v.std)}</td>"
        f"<td>{escape(v.unit)}</td></tr>"
        for e in h.effects for n, v in e.parameters.items())
    formulas = "".join(f"<li>{escape(e.name)} ({escape(' or '.join(e.ids))}): "
                       f"<code>{escape(e.expression)}</code></li>" for e in h.effects)
    return (f"<p><b>{escape(h.title)}</b>{escape(odds)}</p>"
            f"<ul>{formulas}</ul>"
            f"<div class=wide><table>{rows}</table></div>")


def _parameters(dx: Diagnosis) -> str:
    before, after = ({f.label: rounded(float(v), found.covariance[k, k] ** 0.5)
                      for k, (f, v) in enumerate(zip(found.free, found.theta, strict=True))}
                     for found in (dx.before, dx.after))
    rows = "".join(
        f"<tr><td>{escape(f.label)}</td><td>{before[f.label]}</td>"
        f"<td>{after[f.label]}</td><td>{escape(f.unit)}</td></tr>"
        for f in dx.after.free if f.label in before)
    return ("<div class=wide><table><tr><th>parameter</th><th>before</th><th>after</th><th></th>"
            f"</tr>{rows}</table></div>")


def _figure(dx: Diagnosis) -> str:
    return f"<h2>Proof</h2>{drawn(dx.plot(), 'residuals before and after')}"


def _proof(dx: Diagnosis) -> str:
    proof = dx.held_out
    if proof is None:
        why = dx.doubt or "there is no held-out recording"
        return f"<p>Nothing is proved: {escape(why)}.</p>"
    told = []
    for name, e in proof.outputs.items():
        moved = (f"{e.moved:.3g} with the parameters moved within their errors, "
                 if proof.sensitive(dx.settings) and dx.hypotheses else "")
        whose = f" of {escape(name)}" if len(proof.outputs) > 1 else ""
        told.append(f"Held-out RMSE{whose}: {e.before:.3g} before, {e.after:.3g} after, "
                    f"{moved}noise {e.noise:.3g} {escape(e.unit)}".rstrip())
    return f"<p>{'; '.join(told)}; p = {proof.p_value:.2g}.</p>"


def _patch(dx: Diagnosis) -> str:
    if dx.patch is None:
        return ""
    unit = dx.held_out.unit if dx.held_out is not None else ""
    return f"<h2>Until it is understood</h2><p>Patch: {escape(dx.patch.sentence(unit))}.</p>"


def _next(dx: Diagnosis) -> str:
    return f"<h2>What to do next</h2><p>{escape(dx.next_experiment)}</p>" if (
        dx.next_experiment) else ""
