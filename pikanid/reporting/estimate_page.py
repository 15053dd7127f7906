"""Estimates of a model's parameters as one self-contained page of HTML."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pikanid.estimate.plots import plot_strategies
from pikanid.estimate.rounding import rounded
from pikanid.figures import unit_text
from pikanid.pieces.html import drawn, tabled, text
from pikanid.pieces.sheet import Sheet
from pikanid.reporting.document import document
from pikanid.reporting.tables import between, verdict

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pikanid.estimate import Estimate


def page(estimates: Sequence[Estimate], failed: Mapping[str, str], title: str,
         files: Sequence[str] = ()) -> str:
    """The page: the answer, parameters with errors, the fit of every output, warnings.

    Args:
        estimates: At least one, all of one model and the same recordings.
        failed: Strategies that could not be used, and why.
        title: Such as the names of the recordings.
        files: What was read, as it was named.
    """
    head = estimates[0]
    several = len(estimates) > 1
    wide, narrow = ((plot_strategies({e.strategy: e.fits for e in estimates}, head.model.name, n)
                     if several else head.plot(n)) for n in (False, True))
    warned = dict.fromkeys(w for e in estimates for w in e.warnings)
    notes = [*warned, *(f"{name} could not be used: {why}" for name, why in failed.items())]
    return document(title, [
        f"<h1>Which parameters? {text(title)}</h1>",
        f'<p class="verdict {"named" if any(e.ok for e in estimates) else "misfit"}">'
        f"{text(answer(estimates))}</p>",
        drawn(wide, "measured and fitted, and what is left", narrow),
        "<h2>Parameters</h2>" + tabled(parameters(estimates)),
        "<h2>What every fit leaves</h2>" + tabled(left(estimates)),
        "<ul>" + "".join(f"<li>{text(f'{e.strategy}: {e.sentence()}')}</li>" for e in estimates)
        + "</ul>" if several else "",
        "<h2>Notes</h2><ul>" + "".join(f"<li>{text(n)}</li>" for n in notes) + "</ul>"
        if notes else "", f"<h2>What to do next</h2><p>{text(_next(estimates))}</p>"],
        {head.model.name: head.model}, [f.recording for f in head.fits], files)


def answer(estimates: Sequence[Estimate]) -> str:
    """The verdict in a sentence, of several strategies which of them explain the recording."""
    if len(estimates) == 1:
        return estimates[0].sentence()
    good, bad = ([e.strategy for e in estimates if e.ok is ok] for ok in (True, False))
    if not good:
        return "No strategy explains the recording with this model."
    return (f"Explained by {', '.join(good)}" + (f"; not by {', '.join(bad)}" if bad else "")
            + f". {min((e for e in estimates if e.ok), key=lambda e: e.cost).sentence()}")


def _next(estimates: Sequence[Estimate]) -> str:
    return ("Predict a recording that was not fitted, moved in another way: 'pikanid validate'."
            if any(e.ok for e in estimates) else
            "Ask which physics the model leaves out: 'pikanid diagnose'.")


def parameters(estimates: Sequence[Estimate]) -> Sheet:
    """Every free parameter, with two digits of its standard error, and its 95 % interval."""
    return Sheet(("strategy", "parameter", "estimate ± std. error", "95 % interval", "unit",
                  "verdict"),
                 tuple((e.strategy, f.label,
                        rounded(e.value(f.name, f.recording), e.std(f.name, f.recording)),
                        between(*e.interval(f.name, recording=f.recording)),
                        unit_text(f.unit) or "-", verdict(e))
                       for e in estimates for f in e.free)).without_constant("strategy", "verdict")


def left(estimates: Sequence[Estimate]) -> Sheet:
    """Root mean square of the residual of every output of every recording, in its own unit."""
    return Sheet(("strategy", "recording", "output", "samples", "RMSE", "unit"), tuple(
        (e.strategy, f.recording, f.output, str(len(f.t)), f"{f.rmse:.3g}",
         unit_text(f.unit) or "-")
        for e in estimates for f in e.fits), ("samples", "RMSE")).without_constant("strategy")
