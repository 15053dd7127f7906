"""Estimates of a model's parameters as one self-contained page of HTML."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from pikanid.estimate.estimate import rounded
from pikanid.estimate.plots import plot_strategies
from pikanid.reporting.document import document, drawn, tabled
from pikanid.reporting.sheet import Sheet
from pikanid.reporting.tables import between, verdict

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pikanid.estimate import Estimate


def page(estimates: Sequence[Estimate], failed: Mapping[str, str], title: str) -> str:
    """The page: the answer, parameters with errors, the fit of every output, warnings.

    Args:
        estimates: At least one, all of one model and the same recordings.
        failed: Strategies that could not be used, and why.
        title: Such as the names of the recordings.
    """
    head = estimates[0]
    several = len(estimates) > 1
    said = "".join(
        f'<p class="verdict {"named" if e.ok else "misfit"}">'
        f"{escape(f'{e.strategy}: ' if several else '')}{escape(e.sentence())}</p>"
        for e in estimates)
    figure = (plot_strategies({e.strategy: e.fits for e in estimates}, head.model.name)
              if several else head.plot())
    warned = dict.fromkeys(w for e in estimates for w in e.warnings)
    notes = [*warned, *(f"{name} could not be used: {why}" for name, why in failed.items())]
    return document(title, [
        f"<h1>Which parameters? {escape(title)}</h1>", said,
        drawn(figure, "measured and fitted, and what is left"),
        "<h2>Parameters</h2>" + tabled(parameters(estimates)),
        "<h2>What every fit leaves</h2>" + tabled(left(estimates)),
        "<h2>Notes</h2><ul>" + "".join(f"<li>{escape(n)}</li>" for n in notes) + "</ul>"
        if notes else ""], {head.model.name: head.model}, [f.recording for f in head.fits])


def parameters(estimates: Sequence[Estimate]) -> Sheet:
    """Every free parameter, with two digits of its standard error, and its 95 % interval."""
    return Sheet(("strategy", "parameter", "estimate ± std. error", "95 % interval", "unit",
                  "verdict"),
                 tuple((e.strategy, f.label,
                        rounded(e.value(f.name, f.recording), e.std(f.name, f.recording)),
                        between(*e.interval(f.name, recording=f.recording)), f.unit, verdict(e))
                       for e in estimates for f in e.free))


def left(estimates: Sequence[Estimate]) -> Sheet:
    """Root mean square of the residual of every output of every recording, in its own unit."""
    return Sheet(("strategy", "recording", "output", "samples", "RMSE", "unit"), tuple(
        (e.strategy, f.recording, f.output, str(len(f.t)), f"{f.rmse:.3g}", f.unit)
        for e in estimates for f in e.fits))
