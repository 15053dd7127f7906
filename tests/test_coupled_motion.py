"""What pulls at one coordinate in proportion to another one, and does not act back; a rig that
SciPy simulates.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.diagnose import diagnose
from pikanid.model import Model
from pikanid.recording import Recording

TIME = np.linspace(0.0, 15.0, 601)
NOISE = 0.002


def axes() -> Model:
    """Two driven axes on springs of their own, which do not know of each other."""
    free = {"bounds": [0.0, 500.0]}
    return Model.from_dict({
        "name": "two axes",
        "states": {"a": {"unit": "rad", "initial": 0.0}, "va": {"unit": "rad/s", "initial": 0.0},
                   "b": {"unit": "rad", "initial": 0.0}, "vb": {"unit": "rad/s", "initial": 0.0}},
        "parameters": {"ka": {"unit": "1/s^2", "guess": 20.0, **free},
                       "ca": {"unit": "1/s", "guess": 1.0, **free},
                       "kb": {"unit": "1/s^2", "guess": 10.0, **free},
                       "cb": {"unit": "1/s", "guess": 1.0, **free}},
        "inputs": {"ua": {"unit": "rad/s^2", "hold": "zero"},
                   "ub": {"unit": "rad/s^2", "hold": "zero"}},
        "equations": {"a": "va", "va": "ua - ka*a - ca*va", "b": "vb", "vb": "ub - kb*b - cb*vb"},
        "outputs": {"ya": {"unit": "rad", "expression": "a"},
                    "yb": {"unit": "rad", "expression": "b"}}})


def recorded(seed: int, of_rate: float = 0.0, of_place: float = 0.0) -> Recording:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-5.0, 5.0, (31, 2)), 20, axis=0)[:len(TIME)]

    def slope(t: float, s: np.ndarray) -> list[float]:
        ua, ub = u[min(int(t / TIME[1] + 1e-9), len(u) - 1)]
        a, va, b, vb = s
        return [va, ua - 25.0 * a - 0.7 * va + of_rate * vb, vb,
                ub - 12.0 * b - 0.9 * vb + of_place * a]

    run = solve_ivp(slope, (0, TIME[-1]), np.zeros(4), "DOP853", TIME, rtol=1e-8, atol=1e-10,
                    max_step=TIME[1])
    noise = NOISE * rng.standard_normal((2, len(TIME)))
    channels = {"ua": u[:, 0], "ub": u[:, 1], "ya": run.y[0] + noise[0], "yb": run.y[2] + noise[1]}
    return Recording.from_arrays(TIME, channels, units={
        "ua": "rad/s^2", "ub": "rad/s^2", "ya": "rad", "yb": "rad"},
        hold={"ua": "zero", "ub": "zero"})


@pytest.mark.parametrize(("hidden", "at", "of", "size"), [
    ({"of_rate": 0.3}, "va", "vb", 0.3), ({"of_place": -2.0}, "vb", "a", -2.0)])
def test_it_is_named_where_it_acts(hidden: dict[str, float], at: str, of: str, size: float
                                   ) -> None:
    answer = diagnose(axes(), recorded(1, **hidden), recorded(2, **hidden), workers=1)
    assert answer.verdict == "named"
    [effect] = answer.hypotheses[0].effects
    assert effect.ids == ("coupled_state",) and effect.name.startswith(f"a part of {at}'")
    assert effect.name.endswith(f"to {of}")
    [k] = effect.parameters.values()
    assert abs(k.value - size) < 4 * k.std < 0.2 * abs(size)


def test_a_coordinate_is_not_coupled_to_itself() -> None:
    found = [c for c in candidates(sites(axes(), (recorded(1),))) if c.ids == ("coupled_state",)]
    assert sorted((c.site.v, c.variant) for c in found) == [
        ("va", "b"), ("va", "vb"), ("vb", "a"), ("vb", "va")]
