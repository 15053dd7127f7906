"""From a case to ranked hypotheses: on part of the recordings, on all, with the noise read anew."""

from __future__ import annotations

from collections.abc import Callable

from pikanid.mismatch.case import Case
from pikanid.mismatch.fitting.hypothesis import Hypothesis


def searched(case: Case, tell: Callable[[str], None]) -> list[Hypothesis]:
    """Hypotheses that explain the recordings best, the closest first."""
    search = case.begin_search()
    ranked = search.run(case.adequate)
    case.base = search.base()
    if search.records is case.records:
        return ranked
    tell("whole recordings")
    explained = not ranked[0].far
    search = case.resumed(search)
    # what nothing explained in part is not explained in whole
    return search.grow(case.adequate) if explained else search.ranked()


def with_noise_of_the_rest(case: Case, ranked: list[Hypothesis], quiet: tuple[float, float] | None,
                           tell: Callable[[str], None]) -> list[Hypothesis]:
    """The same, with the noise read from what the best one leaves where the inputs are known.

    The first reading was made through the mismatch itself, which is out of the way by now.
    """
    if case.uncovered(ranked[0]):
        tell("without what came after the inputs")
        ranked = case.search.grow(case.adequate)
    for _ in range(case.settings.budget.relevelled):
        if not case.relevelled(ranked[0], quiet):
            break
        tell("noise again")
        ranked = case.search.grow(case.adequate)
    return ranked
