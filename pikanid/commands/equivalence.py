"""`pikanid equivalence`: is a shallow KAN the spline that Eq. (5) says it is?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from pikanid.commands.options import Json, Quiet
from pikanid.commands.outputs import STDOUT, check_outputs, report_folder, written
from pikanid.storage.version import __version__

if TYPE_CHECKING:
    from rich.console import Console

    from pikanid.validation.equivalence import EquivalenceReport

EXIT_DIFFERENT = 3  # definition: exit code: the two forms differ
EXAMPLES = """Examples:

  pikanid equivalence --quick

  pikanid equivalence --json equivalence.json --report reports

Exit codes: 0 every comparison passed, 2 bad input, 3 at least one did not."""


def equivalence(
    json_: Json = None,
    report: Annotated[str | None, typer.Option(
        metavar="FOLDER", show_default=False,
        help="write equivalence.md and its figure")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="a third of the settings")] = False,
    seed: Annotated[int, typer.Option(
        metavar="N", min=0, help="of coefficients, parameters and noise")] = 0,
    quiet: Quiet = False,
) -> int:
    """Compare the training loss of a pykan KAN with the objective of iPDA, term by term."""
    check_outputs({"--json": (json_, [".json"])}, [])
    folder = None if report is None else report_folder("--report", report)
    from pikanid.approximators.kan import build_kan
    from pikanid.reporting.console import console, working
    from pikanid.validation.equivalence import run_checks

    build_kan([1, 1])  # says what is missing where torch or pykan is not installed
    with working("equivalence", count_parts(quick), quiet) as step:
        found = run_checks(quick=quick, seed=seed, progress=step)
    pages = {} if folder is None else {str(p): c for p, c in found.files(folder).items()}
    written(pages, json_, {**found.to_dict(), "version": __version__})
    if not quiet and json_ != STDOUT:
        screen = console()
        show(screen, found)
        for path in [folder and folder / "equivalence.md", json_]:
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
