"""What χ² counts for: between degrees of freedom and independent rows."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pikanid.mismatch.search.overdispersion import overdispersion, repeated


def left(r: np.ndarray) -> Any:
    minimum = SimpleNamespace(r=r, chi2=float(r @ r), theta=np.zeros(2))
    return SimpleNamespace(minimum=minimum, whitened=SimpleNamespace(rows=len(r)),
                           effects=(), key=frozenset())


def test_the_more_is_misfit_the_more_neighbours_count_as_one() -> None:
    shape = np.repeat(np.random.default_rng(0).normal(size=100), 10)
    same = repeated(shape)
    assert 4.0 < same < 12.0
    for level in (1.5, 4.0, 100.0):
        r = shape * np.sqrt(level * (len(shape) - 2) / (shape @ shape))
        assert overdispersion([left(2 * r), left(r)]) == pytest.approx(
            level * same ** (1 - 1 / level), rel=1e-9)
    assert overdispersion([left(0.1 * shape)]) == 1.0
