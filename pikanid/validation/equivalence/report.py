"""What the comparison found: rows, tables and a figure."""

from __future__ import annotations

import io
import os
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pikanid.figures import new_figure
from pikanid.storage.outputs import together

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Check:
    """One comparison.

    Attributes:
        check: What is compared with what.
        setting: The case, in words.
        quantity: The number compared.
        difference: Relative difference, or the number itself (a condition number).
        tolerance: Bound of the difference: from above, or, where it must differ, from below.
        must_differ: Whether this is a negative control.
    """

    check: str
    setting: str
    quantity: str
    difference: float
    tolerance: float
    must_differ: bool = False

    @property
    def passed(self) -> bool:
        """Whether the difference is on its side of the bound; NaN never is."""
        if self.must_differ:
            return self.difference > self.tolerance
        return self.difference <= self.tolerance


@dataclass(frozen=True)
class EquivalenceReport:
    """All checks of one run.

    >>> report = EquivalenceReport((Check("shallow KAN", "k=3", "loss", 2e-15, 1e-12),))
    >>> report.passed, report.rows[0].passed
    (True, True)
    """

    rows: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        """Whether every check passed."""
        return all(row.passed for row in self.rows)

    @property
    def failures(self) -> tuple[Check, ...]:
        """The checks that did not pass."""
        return tuple(row for row in self.rows if not row.passed)

    def to_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {
            "schema_version": 1,
            "passed": self.passed,
            "rows": [asdict(row) | {"passed": row.passed} for row in self.rows],
        }

    def to_markdown(self) -> str:
        """Summary, negative controls and every setting, as Markdown tables."""
        equal = [row for row in self.rows if not row.must_differ]
        controls = [row for row in self.rows if row.must_differ]
        verdict = (
            f"All {len(self.rows)} checks pass."
            if self.passed
            else f"{len(self.failures)} of {len(self.rows)} checks fail."
        )
        parts = [
            "# Equivalence of the shallow KAN and iPDA (Eq. 5)",
            verdict,
            "## What must agree",
            "Largest relative difference over all settings.",
            _table(("check", "quantity", "settings", "largest difference", "tolerance", "passed"),
                   _summary(equal)),
            "## What must differ",
            "Negative controls: the comparison sees what it should.",
            _table(("control", "setting", "quantity", "difference", "at least", "passed"),
                   [_row(row) for row in controls]),
            "## Every comparison",
            _table(("check", "setting", "quantity", "difference", "tolerance", "passed"),
                   [_row(row) for row in equal]),
        ]
        return "\n\n".join(parts) + "\n"

    def write(self, folder: str | os.PathLike[str]) -> Path:
        """Write equivalence.md and its figure equivalence.png into ``folder``; the page's path."""
        Path(folder).mkdir(parents=True, exist_ok=True)
        together(self.files(folder))
        return Path(folder) / "equivalence.md"

    def files(self, folder: str | os.PathLike[str]) -> dict[Path, bytes]:
        """What `write` writes: path -> content."""
        picture = io.BytesIO()
        self.plot().savefig(picture, format="png", dpi=110)
        text = self.to_markdown().replace(
            "## What must differ", "![differences](equivalence.png)\n\n## What must differ", 1)
        return {
            Path(folder) / "equivalence.png": picture.getvalue(),
            Path(folder) / "equivalence.md": text.encode(),
        }

    def plot(self) -> Figure:
        """Every difference on a logarithmic axis: agreements, their bounds, and controls."""
        labels = list(dict.fromkeys((row.must_differ, _label(row)) for row in self.rows))
        figure = new_figure(10.0, 1.0 + 0.28 * len(labels))
        axes = figure.add_subplot()
        floor = 1e-17
        for height, (differs, label) in enumerate(labels):
            rows = [r for r in self.rows if (r.must_differ, _label(r)) == (differs, label)]
            found = np.maximum([row.difference for row in rows], floor)
            colour = "tab:orange" if differs else "tab:blue"
            axes.plot(found, np.full(found.size, height), "o", ms=4, alpha=0.5, color=colour)
            axes.plot([rows[0].tolerance], [height], "|", ms=12, color="black")
        axes.set_xscale("log")
        axes.set_yticks(range(len(labels)), [label for _, label in labels], fontsize=8)
        axes.invert_yaxis()
        axes.set_xlabel("relative difference")
        axes.set_title("bars: bounds; blue must lie to their left, orange to their right", size=9)
        axes.grid(axis="x", alpha=0.3)
        return figure


def _label(row: Check) -> str:
    return f"{row.check}: {row.quantity}"


def _summary(rows: Iterable[Check]) -> list[tuple[str, ...]]:
    groups: dict[tuple[str, str], list[Check]] = {}
    for row in rows:
        groups.setdefault((row.check, row.quantity), []).append(row)
    return [
        (
            check,
            quantity,
            str(len(found)),
            f"{max(row.difference for row in found):.1e}",
            f"{found[0].tolerance:.0e}",
            _tick(all(row.passed for row in found)),
        )
        for (check, quantity), found in groups.items()
    ]


def _row(row: Check) -> tuple[str, ...]:
    return (row.check, row.setting, row.quantity, f"{row.difference:.1e}", f"{row.tolerance:.0e}",
            _tick(row.passed))


def _tick(passed: bool) -> str:
    return "yes" if passed else "**no**"


def _table(header: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [header, tuple("---" for _ in header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
