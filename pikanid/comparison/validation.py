"""`Validation`: what `validate` finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pikanid.comparison.bootstrap import Pair
from pikanid.comparison.predictions import BASELINE, Prediction, Protocol
from pikanid.comparison.residual_analysis import ResidualAnalysis
from pikanid.comparison.scores import Score
from pikanid.figures import unit_text
from pikanid.pieces.sentences import enumerated

if TYPE_CHECKING:
    import matplotlib.figure
    import pandas as pd

NOISE = "noise"
NUMBERS = ("N", "RMSE", "fit %", "R²", "χ²/dof", "parameters", "AIC", "BIC")
ALPHA = 0.01  # definition: of a difference that is called significant, unless it is said


@dataclass(frozen=True, eq=False)
class Validation:
    """Models compared on recordings: best first, with a linear baseline and the noise beside them.

    Attributes:
        scores: One for every model, recording and output; the baseline's and the noise's too.
        ranking: Names of models and baseline, best first: by mean squared error, every output in
            units of its noise.
        pairs: Which of two models has the smaller squared error, and how sure that is.
        predictions: What was scored, by model.
        residuals: Analysis of what each model leaves, by model; empty for predictions ahead.
        protocol: How predictions were made.
        alpha: Below which a p-value is called significant.
        notes: What could not be done, and which models are none of their own, one sentence each.
        alike: Names of models that predict the same, in groups.
    """

    scores: tuple[Score, ...]
    ranking: tuple[str, ...]
    pairs: tuple[Pair, ...]
    predictions: Mapping[str, tuple[Prediction, ...]]
    residuals: Mapping[str, tuple[ResidualAnalysis, ...]]
    protocol: Protocol
    alpha: float = ALPHA
    notes: tuple[str, ...] = ()
    alike: tuple[tuple[str, ...], ...] = ()

    @property
    def best(self) -> str:
        """Name of the best model, or of the baseline if that is better."""
        return self.ranking[0]

    def score(self, model: str, output: str | None = None, recording: str | None = None) -> Score:
        """The first score of a model, of an output and a recording if they are named.

        Raises:
            KeyError: There is none.
        """
        for s in self.scores:
            if s.model == model and output in (None, s.output) and recording in (
                    None, s.recording):
                return s
        raise KeyError((model, output, recording))

    def significant(self) -> tuple[Pair, ...]:
        """The pairs whose difference is more than chance."""
        return tuple(p for p in self.pairs if p.p_value < self.alpha)

    def sentence(self) -> str:
        """Which model is best, and what it is surely better than."""
        first = self.best
        beaten = [p.worse for p in self.significant() if p.better == first]
        group = next((g for g in self.alike if first in g), (first,))
        equal = [n for n in self.ranking[1:] if n not in (*beaten, *group)]
        if len(self.ranking) == 1:
            mean = np.mean([s.fit for s in self.scores if s.model == first])
            return f"'{first}' fits by {mean:.4g} % (NRMSE)."
        words = f"Best is '{first}'"
        if len(group) > 1:
            words = f"Best are {_quoted([*group])}, which predict the same"
        if first == BASELINE:
            words = f"No model beats the linear baseline: best is '{first}'"
        tied = len(group) > 1
        if beaten:
            words += f"{', and are' if tied else ','} significantly better than {_quoted(beaten)}"
        if equal:
            least = min((p.p_value for p in self.pairs if p.better == first and p.worse in equal),
                        default=1.0)
            words += (f"{';' if beaten or tied else ','} {'their' if tied else 'its'} lead over "
                      f"{_quoted(equal)} is not significant (p {'=' if len(equal) == 1 else '>='} "
                      f"{least:.2g}, below {self.alpha:g} would be)")
        return words + "."

    def left(self) -> tuple[tuple[str, bool], ...]:
        """What every model leaves, in sentences, and whether that is noise; where all of several
        outputs and recordings are, in one.
        """
        found: list[tuple[str, bool]] = []
        for name, own in self.residuals.items():
            good = [a for a in own if a.ok]
            if len(good) > 2:
                share = "all" if len(good) == len(own) else f"{len(good)} of {len(own)}"
                found.append((f"What '{name}' leaves of {share} outputs is noise, independent of "
                              "the inputs.", True))
            found += [(a.sentence(), a.ok) for a in own if not a.ok or len(good) <= 2]
        return tuple(found)

    def to_frame(self) -> pd.DataFrame:
        """One row a score."""
        import pandas as pd

        return pd.DataFrame([s.to_dict() for s in self.scores])

    def to_dict(self) -> dict[str, Any]:
        """The content of the JSON that `pikanid validate --json` writes."""
        return {
            "schema_version": 1, "sentence": self.sentence(), "ranking": list(self.ranking),
            "protocol": {**asdict(self.protocol), "text": str(self.protocol)},
            "alpha": self.alpha, "scores": [s.to_dict() for s in self.scores],
            "pairs": [asdict(p) for p in self.pairs],
            "residuals": [a.to_dict() for own in self.residuals.values() for a in own],
            "alike": [list(group) for group in self.alike], "notes": list(self.notes)}

    def rows(self) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
        """Headers and cells of the table, best model first, the noise last."""
        headers = ("model", "recording", "output", "held out", "N", "RMSE", "unit", "fit %", "R²",
                   "χ²/dof", "parameters", "AIC", "BIC")
        place = {name: k for k, name in enumerate((*self.ranking, NOISE))}
        cells = []
        for s in sorted(self.scores, key=lambda s: place[s.model]):
            counts = ("", "", "") if s.model == NOISE else (
                str(s.parameters), f"{s.aic:.6g}", f"{s.bic:.6g}")
            cells.append((
                s.model, s.recording, s.output, {True: "yes", False: "no", None: "?"}[s.held_out]
                if s.model != NOISE else "", str(s.n), f"{s.rmse:.4g}", unit_text(s.unit) or "-",
                f"{s.fit:.2f}", f"{s.r2:.5g}", f"{s.chi2 / s.dof:.4g}", *counts))
        return headers, tuple(cells)

    def plot(self, narrow: bool = False) -> matplotlib.figure.Figure:
        """Measured against predicted and the errors, a row of axes an output and recording;
        `narrow`: for a phone.
        """
        from pikanid.comparison.drawing import plot_validation

        return plot_validation({name: self.predictions[name] for name in self.ranking}, narrow)

    def __str__(self) -> str:
        headers, cells = self.rows()
        widths = [max(len(row[k]) for row in (headers, *cells)) for k in range(len(headers))]
        lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
                 for row in (headers, *cells)]
        left = [sentence for sentence, _ in self.left()]
        return "\n".join([self.sentence(), str(self.protocol), "", *lines, "", *left,
                          *(f"note: {n}" for n in self.notes)])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        from pikanid.pieces.html import tabled, text
        from pikanid.pieces.sheet import Sheet

        notes = "".join(f"<p>{text(n)}</p>" for n in self.notes)
        return (f"<p>{text(self.sentence())} {text(str(self.protocol))}</p>"
                f"{tabled(Sheet(*self.rows(), NUMBERS))}{notes}")


def _quoted(names: list[str]) -> str:
    return enumerated([f"'{name}'" for name in names])
