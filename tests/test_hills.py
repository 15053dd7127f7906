"""How long the minima beyond hills are looked for."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pikanid.mismatch.fitting import descent
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.optimise.levenberg_marquardt import Minimum

ROWS = 1000


def at(chi2: float) -> Minimum:
    return Minimum(np.ones(1), np.array([np.sqrt(chi2)]), np.zeros((1, 1)), True)


def hopped(chi2: list[float], monkeypatch: pytest.MonkeyPatch) -> tuple[float, int]:
    """Where hops end that each lead to the next of these χ², and how many there were."""
    begun, *found = chi2
    left = iter(found)
    monkeypatch.setattr(descent, "lowest", lambda *args: at(next(left)))
    whitened: Any = SimpleNamespace(rows=ROWS, settings=DEFAULTS, problem=SimpleNamespace(
        free=[SimpleNamespace(name="k")]))
    wall: Any = SimpleNamespace(parameters=[SimpleNamespace(name="k")], other_minima=(2.0,),
                                absent=False)
    best = descent.basin_hopping(whitened, at(begun), wall, 30)
    return best.chi2, len(found) - len(list(left))


@pytest.mark.parametrize(("chi2", "end", "hops"), [
    # it crawls along a valley far above an explanation: 1 % of what is left
    ([5000.0, 4960.0, 4920.0, 4880.0], 4960.0, 1),
    # each hop explains a part
    ([5000.0, 4500.0, 4000.0, 3600.0, 3300.0, 3000.0], 3300.0, 4),
    # nothing lower than by one of chi-squared
    ([5000.0, 4999.5, 4000.0], 5000.0, 1),
    # as low as noise is: every one that is lower counts
    ([990.0, 985.0, 980.0, 979.5], 980.0, 3)])
def test_hills_are_looked_for_as_long_as_that_explains_a_part(
        chi2: list[float], end: float, hops: int, monkeypatch: pytest.MonkeyPatch) -> None:
    found, tried = hopped(chi2, monkeypatch)
    assert found == pytest.approx(end) and tried == hops
