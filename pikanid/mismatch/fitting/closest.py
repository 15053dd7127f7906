"""The closest fit so far, as another fit sees it: what was decided by it, and whether that stands.

Fits that run side by side begin before it is known how close the fits before them come.  One whose
every decision would have been the same is what it would have been, and need not be made again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from pikanid.mismatch.data.whitened import TOO_ROUGH, Whitened, allowance

Answer = TypeVar("Answer")


class Closest:
    """χ² of the closest fit so far, asked for nothing but decisions; these are remembered.

    >>> closest = Closest(100.0)
    >>> closest.ask(lambda chi2: 150.0 > chi2)
    True
    >>> closest.stands(120.0), closest.stands(90.0), Closest(100.0).stands(90.0)
    (False, True, True)
    """

    def __init__(self, chi2: float = np.inf):
        self.chi2 = chi2
        self.asked: list[tuple[Callable[[float], object], object]] = []

    def ask(self, question: Callable[[float], Answer]) -> Answer:
        """What `question` says of χ²."""
        answer = question(self.chi2)
        self.asked.append((question, answer))
        return answer

    def stands(self, chi2: float) -> bool:
        """Whether a closer fit would have changed nothing; one that is less close counts as a
        change.
        """
        return chi2 == self.chi2 or (np.isfinite(self.chi2) and chi2 < self.chi2 and all(
            question(chi2) == answer for question, answer in self.asked))

    def choose_steps(self, whitened: Whitened, theta: np.ndarray,
                     misfit: Callable[[float], float]) -> bool:
        """As that of `whitened`, for a misfit that never falls with χ².

        Errors that were too large stay so where less is allowed: those that were not are asked
        again.
        """
        good = whitened.choose_steps(theta, misfit=misfit(self.chi2))
        weighed, gross = tuple(whitened.weighed), whitened.settings.fits.gross

        def decided(chi2: float) -> object:
            loose = allowance(misfit(chi2))
            return misfit(chi2) < gross, [(error <= share * loose,
                                           error > TOO_ROUGH * (share * loose))
                                          for error, share in weighed]

        self.ask(decided)
        return good
