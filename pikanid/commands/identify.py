"""`pikanid identify`: recordings and a model in, parameters out."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Annotated

import typer

from pikanid import errors
from pikanid.commands.grouped import grouped
from pikanid.commands.interrupts import became, interrupted_by_kill
from pikanid.commands.options import Json, ModelName, Quiet, Sigma, Values, adjusted
from pikanid.commands.outputs import STDOUT, check_outputs, written
from pikanid.commands.reading import Reading, every_source, files_read
from pikanid.figures import ENDINGS, image_for
from pikanid.recording.formats import readable
from pikanid.storage.version import __version__
from pikanid.strategies import STRATEGIES

if TYPE_CHECKING:
    from pikanid.estimate import Estimate
    from pikanid.model import Model
    from pikanid.recording import Recording
    from pikanid.reporting.console import Step
    from pikanid.strategies.strategy import Strategy

ALL = "all"
INTERRUPTED = "interrupted"  # definition: why a strategy has no estimate, in files
EXAMPLES = """Examples:

  pikanid identify run.csv --model sloshing --sigma 0.1deg

  pikanid identify run.csv --model my.toml --strategy all --json out.json

  pikanid identify a.csv b.csv --model sloshing --set l_theta=50mm --fix d_theta=0.15

  pikanid identify run.xlsx --sheet Run2 --column theta=angle --model pendulum --plot fit.png

  pikanid identify drive.csv+camera.mf4 --column theta=*/angle --model sloshing

Exit codes: 0 done, 2 bad input, 3 fitted, but the model does not explain the recording."""


@dataclass(frozen=True)
class _Targets:
    """Where results go, and what was read to make them."""

    json: str | None
    plot: str | None
    report: str | None
    save: str | None
    read: list[str]


@grouped
def identify(
    recordings: Annotated[list[str], typer.Argument(
        metavar="RECORDING...", help=f"{readable()}; several are fitted jointly, "
        "files joined by + are one recording",
        show_default=False)],
    model: ModelName,
    strategy: Annotated[str, typer.Option(
        "--strategy", "-s", metavar="|".join([*STRATEGIES, ALL]), help="how to fit")] = "nls",
    protocol: Annotated[str, typer.Option(
        metavar="default|paper",
        help="settings: the best known, or those of the paper")] = "default",
    sigma: Sigma = [],  # noqa: B006
    set_: Values = [],  # noqa: B006
    fix: Annotated[list[str], typer.Option(
        metavar="NAME[=VALUE]", help="do not estimate", show_default=False)] = [],  # noqa: B006
    free: Annotated[list[str], typer.Option(
        metavar="NAME", show_default=False,
        help="estimate a parameter, or the initial value of a state")] = [],  # noqa: B006
    *,
    files: Reading,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="of the starting points")] = 0,
    json_: Json = None,
    plot: Annotated[str | None, typer.Option(
        metavar="FILE", help="draw data, fit and residuals (.png, .svg, .pdf)")] = None,
    report: Annotated[str | None, typer.Option(
        metavar="FILE.html", help="write a page for people")] = None,
    save: Annotated[str | None, typer.Option(
        metavar="FILE",
        help="keep the whole estimate (.json, .json.gz), for Estimate.load")] = None,
    quiet: Quiet = False,
) -> int:
    """Estimate a model's parameters from recordings, with standard errors and a verdict."""
    _check_choice("--strategy", strategy, [*STRATEGIES, ALL])
    _check_choice("--protocol", protocol, ["default", "paper"])
    names = list(STRATEGIES) if strategy == ALL else [strategy]
    if save is not None and len(names) > 1:
        raise errors.BadSetting(errors.save_needs_one_strategy())
    check_outputs({"--json": (json_, [".json"]),
                   "--plot": (plot, ENDINGS), "--report": (report, [".html"]),
                   "--save": (save, [".json", ".json.gz"])}, every_source(*recordings, model))
    from pikanid.model import systems

    chosen = adjusted(systems.find(model), set_, fix, free)
    if not chosen.free_names:
        raise errors.BadModel(errors.nothing_free(chosen.name))
    given = [files.recording(text, chosen, sigma=sigma) for text in recordings]
    targets = _Targets(json_, plot, report, save, files_read(*recordings, model))
    return _fit_and_tell(chosen, given, names, protocol, seed, targets, quiet)


def _check_choice(option: str, value: str, known: Sequence[str]) -> None:
    if value not in known:
        raise errors.BadSetting(errors.bad_value(option, value, f"one of {', '.join(known)}"))


def _make(name: str, protocol: str, seed: int, step: Step) -> Strategy:
    from pikanid.strategies import strategy_class

    kind: Callable[..., Strategy] = strategy_class(name)
    known = {f.name for f in fields(strategy_class(name))}

    def tell(entry: Mapping[str, float]) -> None:
        step(", ".join([name, *(f"{key} {entry[key]:.3g}" for key in ("step", "grid", "lam")
                                if key in entry)]), within=True)

    options = {"protocol": protocol, "seed": seed, "progress": tell}
    return kind(**{key: value for key, value in options.items() if key in known})


def _fit_and_tell(model: Model, given: Sequence[Recording], names: Sequence[str], protocol: str,
                  seed: int, targets: _Targets, quiet: bool) -> int:
    from pikanid.reporting.console import complain, console, working

    begun = time.perf_counter()
    estimates: list[Estimate] = []
    failed: dict[str, str] = {}
    stopped: BaseException | None = None
    with working("fitting", len(names), quiet) as step, interrupted_by_kill():
        for k, name in enumerate(names):
            step(name)
            try:
                found = _make(name, protocol, seed, step).fit(model, given)
            except BaseException as problem:
                if became(problem) and estimates:
                    stopped = problem
                    failed |= dict.fromkeys(names[k:], INTERRUPTED)
                    break
                if not isinstance(problem, errors.PikanidError) or len(names) == 1:
                    raise
                failed[name] = str(problem)
                continue
            notes = [f"Recording '{r.name}': {note}" for r in given for note in r.notes]
            estimates.append(replace(found, warnings=(*found.warnings, *notes)))
    if not estimates:
        complain(next(iter(failed.values())))
        return errors.PikanidError.exit_code
    seconds = time.perf_counter() - begun
    _write(model, given, estimates, failed, len(names) > 1, seconds, targets)
    if not quiet and targets.json != STDOUT:
        from pikanid.reporting.tables import show_estimates

        show_estimates(console(), estimates, failed)
    if stopped is not None:
        raise stopped
    # With several strategies the question is whether the model explains the recording at all.
    return 0 if any(estimate.ok for estimate in estimates) else errors.EXIT_MISFIT


def _write(model: Model, given: Sequence[Recording], estimates: Sequence[Estimate],
           failed: dict[str, str], several: bool, seconds: float, targets: _Targets) -> None:
    from pikanid.reporting import strict_json

    files: dict[str, bytes] = {}
    labels = [r.name for r in given]
    content = (strict_json.of_several(estimates, failed, model.name, labels, __version__, seconds)
               if several else strict_json.of_one(estimates[0], labels))
    if targets.plot is not None:
        from pikanid.estimate.plots import plot_strategies
        figure = (plot_strategies({e.strategy: e.fits for e in estimates}, model.name)
                  if len(estimates) > 1 else estimates[0].plot())
        files[targets.plot] = image_for(figure, targets.plot)
    if targets.report is not None:
        from pikanid.reporting.estimate_page import page

        files[targets.report] = page(estimates, failed, ", ".join(labels), targets.read).encode()
    if targets.save is not None:
        from pikanid.estimate import file as estimate_file

        files[targets.save] = estimate_file.content(estimates[0], targets.save)
    written(files, targets.json, content)
