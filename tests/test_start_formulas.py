"""Initial values as formulas of parameters and inputs: values and slopes."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.problem.evaluated import initial_state


@pytest.mark.parametrize("u", [-1.0, 0.3, 2.5])
def test_a_start_in_balance_beside_a_curve_of_many_pieces(u: float) -> None:
    """Steps of a quotient of cubic pieces: SymPy solves for where such steps are, for minutes."""
    pieces = " + ".join(f"c_{k}*max(u - {0.4 * k - 2}, 0)**3" for k in range(12))
    model = pk.Model.from_dict({
        "name": "curved", "inputs": {"u": {}},
        "states": {"q": {"initial": f"max((b + {pieces})/(k + ({pieces})**2), -0.5)"}},
        "parameters": {"b": {"guess": 0.2}, "k": {"guess": 3.0},
                       **{f"c_{k}": {"guess": 0.01 * (k - 6)} for k in range(12)}},
        "equations": {"q": "-q"}, "outputs": {"y": {"expression": "q"}}})
    start = initial_state(model)
    p = np.array(list(model.values.values()))
    held = np.array([u])
    slopes = start.jacobian(p, held)[0]
    for j, step in enumerate(1e-6 * np.eye(len(p))):
        moved = (start.value(p + step, held) - start.value(p - step, held))[0] / 2e-6
        assert slopes[j] == pytest.approx(moved, rel=1e-5, abs=1e-9)
    curve = sum(0.01 * (k - 6) * max(u - (0.4 * k - 2), 0.0) ** 3 for k in range(12))
    assert start.value(p, held)[0] == pytest.approx(
        max((0.2 + curve) / (3.0 + curve**2), -0.5), rel=1e-12)
