"""What recordings say of hypotheses, for all who decide about them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pikanid.mismatch.detect.residual_tests import Detection
from pikanid.mismatch.fitting.decisions import below, in_order, smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.prediction import HeldOut
from pikanid.mismatch.settings.settings import Settings

Test = Callable[[Hypothesis], Detection]
Predict = Callable[[Hypothesis], HeldOut | None]
Jobs = Sequence[Callable[[], object]]


def not_ahead(jobs: Jobs) -> None:
    """Each job is done when it is needed."""


@dataclass(frozen=True)
class Evidence:
    """Hypotheses, how well they fit and what they predict.

    Attributes:
        ranked: All hypotheses, best first, the nominal model among them.
        scale: That divides χ².
        test: What is left in the train recordings.
        predict: What is left in the held-out recordings.
        checked: Whether anything is held out.
        proves: Whether that is a recording of its own.
        settings: What counts as evidence.
        ahead: Given work that is all needed, before it is: to do it side by side.
    """

    ranked: Sequence[Hypothesis]
    scale: float
    test: Test
    predict: Predict
    checked: bool
    proves: bool
    settings: Settings
    ahead: Callable[[Jobs], None] = not_ahead

    @cached_property
    def nominal(self) -> Hypothesis:
        """Without effects."""
        return next(h for h in self.ranked if not h.effects)

    @cached_property
    def tried(self) -> list[Hypothesis]:
        """With effects, best first."""
        return [h for h in self.ranked if h.effects]

    def adequate(self, p_value: float) -> bool:
        """Whether a test leaves nothing unexplained."""
        return not smaller(p_value, self.settings.adequate)

    def score(self, h: Hypothesis) -> float:
        """The criterion of the train recordings."""
        return h.score(self.scale)

    def handicap(self, h: Hypothesis) -> float:
        """Prior odds against its laws of no catalogue, in units of the criterion."""
        return self.settings.verdict.decoy_handicap * sum(not e.known for e in h.effects)

    def handicapped(self, h: Hypothesis) -> float:
        """The criterion of the train recordings with those odds."""
        return self.score(h) + self.handicap(h)

    def total(self, h: Hypothesis) -> float:
        """The criterion of all recordings; infinite where the held-out ones are not predicted."""
        if not self.checked:
            return self.handicapped(h)
        seen = self.predict(h)
        return np.inf if seen is None else self.handicapped(h) + seen.deviance / self.scale

    def gained(self, h: Hypothesis, over: Hypothesis) -> float:
        """χ² in all recordings that a hypothesis takes away from what another one leaves."""
        a, b = self.predict(h), self.predict(over)
        later = 0.0 if a is None or b is None else max(b.deviance - a.deviance, 0.0)
        return (over.minimum.chi2 - h.minimum.chi2 + later) / self.scale

    def speaks(self, one: Hypothesis, other: Hypothesis, margin: float = 0.0) -> bool:
        """Whether held-out recordings speak for one rather than another, by more than a margin."""
        a, b = self.predict(one), self.predict(other)
        return a is not None and b is not None and below(a.deviance, b.deviance - margin)

    def most_probable_first(self, given: Iterable[Hypothesis]) -> tuple[Hypothesis, ...]:
        """In the order of the criterion of all recordings."""
        return tuple(in_order(given, self.total, Hypothesis.place))
