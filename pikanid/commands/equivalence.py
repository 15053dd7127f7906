"""`pikanid equivalence`: is a shallow KAN the spline that Eq. (5) says it is?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pikanid import errors
from pikanid.commands.options import Quiet, check_outputs

if TYPE_CHECKING:
    from rich.console import Console

    from pikanid.validation.equivalence import EquivalenceReport

EXIT_DIFFERENT = 3  # definition: exit code: the two forms differ
EXAMPLES = """Examples:

  pikanid equivalence --quick

  pikanid equivalence --json equivalence.json --report reports

Exit codes: 0 every comparison passed, 2 bad input, 3 at least one did not."""


def equivalence(
    json_: Annotated[str | None, typer.Option(
        "--json", metavar="FILE", show_default=False,
        help="write every comparison as JSON (- for standard output)")] = None,
    report: Annotated[str | None, typer.Option(
        metavar="FOLDER", show_default=False,
        help="write equivalence.md and its figure")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="a third of the settings")] = False,
    seed: Annotated[int, typer.Option(
        metavar="N", min=0, help="of coefficients, parameters and noise")] = 0,
    quiet: Quiet = False,
) -> int:
    """Compare the training loss of a pykan KAN with the objective of iPDA, term by term."""
    check_outputs({"--json": (None if json_ == "-" else json_, [".json"])}, [])
    folder = None if report is None else _folder(report)
    from pikanid.approximators.kan import build_kan
    from pikanid.reporting.console import console, working
    from pikanid.validation.equivalence import run_checks

    build_kan([1, 1])  # says what is missing where torch or pykan is not installed
    with working("equivalence", count_parts(quick), quiet) as step:
        found = run_checks(quick=quick, seed=seed, progress=step)
    page = _write(found, folder, json_)
    if not quiet and json_ != "-":
        screen = console()
        show(screen, found)
        for path in [page, json_]:
            if path is not None:
                screen.print(f"written: {path}", markup=False, soft_wrap=True)
    return 0 if found.passed else EXIT_DIFFERENT


def count_parts(quick: bool) -> int:
    """How many parts `run_checks` announces.

    >>> count_parts(quick=True) < count_parts(quick=False)
    True
    """
    from pikanid.validation.equivalence.checks import optimised, settings

    # Uniqueness, the KAN handed over, deep KANs, negative controls, degree 2 at the end.
    return len(list(settings(quick=quick))) + len(list(optimised())) + 5


def show(screen: Console, report: EquivalenceReport) -> None:
    """A row for every kind of comparison, the negative controls below, then the verdict."""
    from pikanid.reporting.tables import row, table

    made = table("comparison", "settings", "largest difference", "allowed", "passed",
                 numbers=("settings", "largest difference", "allowed"))
    controls = table("negative control", "settings", "smallest difference", "at least", "passed",
                     numbers=("settings", "smallest difference", "at least"))
    for differs, label in dict.fromkeys(
            (r.must_differ, f"{r.check}: {r.quantity}") for r in report.rows):
        own = [r for r in report.rows
               if r.must_differ == differs and f"{r.check}: {r.quantity}" == label]
        worst = (min if differs else max)(r.difference for r in own)
        row(controls if differs else made, label, str(len(own)), f"{worst:.1e}",
            f"{own[0].tolerance:.0e}", "yes" if all(r.passed for r in own) else "NO")
    for part in (made, controls):
        screen.print(part)
        screen.print()
    for failed in report.failures:
        screen.print(f"not passed: {failed.check}, {failed.quantity}, {failed.setting}: "
                     f"{failed.difference:.1e} against {failed.tolerance:.0e}",
                     markup=False, soft_wrap=True)
    total, lost = len(report.rows), len(report.failures)
    screen.print(f"All {total} comparisons passed." if report.passed else
                 f"{lost} of {total} comparisons did not pass.", markup=False)


def _write(report: EquivalenceReport, folder: Path | None, json_: str | None) -> Path | None:
    """The page with its figure, and JSON; the path of the page."""
    from importlib.metadata import version

    from pikanid.reporting.strict_json import text
    from pikanid.storage.outputs import together

    content = text({**report.to_dict(), "version": version("pikanid")})
    files = {} if folder is None else report.files(folder)
    if json_ is not None and json_ != "-":
        files[Path(json_)] = content.encode()
    together(files)
    if json_ == "-":
        print(content, end="")
    return None if folder is None else folder / "equivalence.md"


def _folder(text: str) -> Path:
    """The report's folder, made if need be, before any work is done."""
    folder = Path(text)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as failure:
        why = getattr(failure, "strerror", "") or "the system refuses"
        raise errors.BadSetting(errors.output_refused("--report", text, why)) from None
    return folder
