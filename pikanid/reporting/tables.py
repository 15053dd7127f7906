"""Tables of estimates and models, for a terminal or a pipe."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal

from pikanid.pieces.sheet import Sheet, sentence

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from pikanid.estimate import Estimate
    from pikanid.model import Model

VERDICTS = {"fits": "fits", "misfit": "MISFIT", "unknown": "not judged"}


def table(*headers: str, numbers: Iterable[str] = ()) -> Table:
    """An empty table; columns named in `numbers` are set to the right."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    made = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    right = set(numbers)
    for header in headers:
        side: Literal["right", "left"] = "right" if header in right else "left"
        made.add_column(Text(header), justify=side, overflow="fold")
    return made


def shown(sheet: Sheet) -> Table:
    """A table for a screen."""
    made = table(*sheet.headers, numbers=sheet.numbers)
    for cells in sheet.rows:
        row(made, *cells)
    return made


def row(made: Table, *cells: str, style: str | None = None) -> None:
    """Add a row of plain text: brackets in a unit are no markup."""
    from rich.text import Text

    made.add_row(*(Text(sentence(cell)) for cell in cells), style=style)


def verdict(estimate: Estimate) -> str:
    """The verdict in a word or two."""
    return VERDICTS[estimate.adequacy.verdict] if estimate.converged else "not converged"


def parameters(estimates: Sequence[Estimate]) -> Table:
    """Every parameter with its standard error; with its 95 % interval too if there is one fit."""
    from pikanid.estimate.rounding import rounded

    several = len(estimates) > 1
    made = (table("strategy", "parameter", "estimate ± std. error", "unit", "verdict", "time")
            if several else
            table("parameter", "estimate ± std. error", "95 % interval", "unit"))
    for estimate in estimates:
        style = None if estimate.ok else "yellow"
        for k, f in enumerate(estimate.free):
            value = rounded(estimate.value(f.name, f.recording), estimate.std(f.name, f.recording))
            if several:
                name, *ends = ((estimate.strategy, verdict(estimate), f"{estimate.seconds:.3g} s")
                               if k == 0 else ("", "", ""))
                row(made, name, f.label, value, f.unit, *ends, style=style)
            else:
                interval = between(*estimate.interval(f.name, recording=f.recording))
                row(made, f.label, value, interval, f.unit, style=style)
    return made


def between(low: float, high: float) -> str:
    """An interval, with three digits of its width.

    >>> between(0.04499268, 0.04503131), between(float("nan"), float("nan"))
    ('0.0449927 … 0.0450313', 'unknown')
    """
    if not (math.isfinite(low) and math.isfinite(high)) or low >= high:
        return "unknown"
    digits = 2 - math.floor(math.log10(high - low))
    if not 0 <= digits <= 10 or max(abs(low), abs(high)) >= 1e6:
        return f"{low:.6g} … {high:.6g}"
    return f"{low:.{digits}f} … {high:.{digits}f}"


def show_estimates(out: Console, estimates: Sequence[Estimate], failed: Mapping[str, str]) -> None:
    """The table, the verdicts as sentences, and every warning once."""
    head = estimates[0]
    title = f"{head.model.name}: {head.n} samples"
    if len(estimates) == 1:
        title = f"{head.strategy} estimate of {title}, {head.seconds:.3g} s"
    _say(out, title, "bold")
    out.print()
    out.print(parameters(estimates))
    out.print()
    for estimate in estimates:
        prefix = f"{estimate.strategy}: " if len(estimates) > 1 else ""
        _say(out, prefix + estimate.sentence(), "green" if estimate.ok else "bold red")
    for text, owners in _shared_warnings(estimates).items():
        who = "" if len(owners) == len(estimates) else f" ({', '.join(owners)})"
        _say(out, f"Warning{who}: {text}", "yellow")
    for name, why in failed.items():
        _say(out, f"{name} could not be used: {why}", "yellow")


def show_model(out: Console, model: Model, toml: str) -> None:
    """Equations, parameters and the model file."""
    from pikanid.formula.expressions import to_text

    _say(out, model.name, "bold")
    out.print()
    for name, equation in model.equations.items():
        _say(out, f"  d({name})/dt = {to_text(equation)}")
    for output in model.outputs:
        _say(out, f"  measured {output.name} = {to_text(output.expression)}")
    out.print()
    signals = table("signal", "kind", "unit", "remark")
    for state in model.states:
        row(signals, state.name, "state", state.unit, f"starts at {to_text(state.initial)}")
    for item in model.inputs:
        given = item.default
        missing = "must be recorded" if given is None else f"{given:g} if not recorded"
        row(signals, item.name, "input", item.unit, f"{item.hold}-order hold, {missing}")
    for output in model.outputs:
        row(signals, output.name, "output", output.unit,
            "" if output.sigma is None else f"sigma = {output.sigma:g}")
    out.print(signals)
    out.print()
    values = table("parameter", "value", "unit", "role", "bounds", "description", numbers=["value"])
    for p in model.parameters:
        bounds = f"{p.bounds[0]:g} … {p.bounds[1]:g}"
        row(values, p.name, f"{p.value:g}", p.unit, "estimated" if p.free else "fixed",
            bounds if p.free else "", p.description)
    out.print(values)
    out.print()
    for told in model.unit_disagreements:
        _say(out, f"Units: {told}", "yellow")
        out.print()
    _say(out, "# the same as a model file", "dim")
    _say(out, toml)


def _say(out: Console, text: str, style: str | None = None) -> None:
    out.print(text, style=style, markup=False, soft_wrap=True)


def _shared_warnings(estimates: Sequence[Estimate]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for estimate in estimates:
        for text in estimate.warnings:
            found.setdefault(sentence(text), []).append(estimate.strategy)
    return found
