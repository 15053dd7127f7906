"""A state that remembers where it was, and what is left of that where an entry is the store."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tanks import tank

import pikanid as pk
from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.model import Effect, NewState
from pikanid.model.parts import Parameter


def run(seed: int, k: float, r: float = 0.2) -> pk.Recording:
    """x' = u - x/2 + k (w - x), w' = r (x - w), both at rest: a linear system, by DOP853."""
    rng = np.random.default_rng(seed)
    u, x = np.repeat(rng.uniform(0.2, 2.0, 20), 40), np.zeros((800, 2))
    for i in range(799):
        x[i + 1] = solve_ivp(lambda _, y, push=u[i]: [
            push - 0.5 * y[0] + k * (y[1] - y[0]), r * (y[0] - y[1])], (0, 0.1), x[i], "DOP853",
            rtol=1e-9, atol=1e-11).y[:, -1]
    return pk.Recording.from_arrays(
        0.1 * np.arange(800), {"u": u, "x": x[:, 0] + rng.normal(0, 0.02, 800)},
        {"u": "m/s", "x": "m"}, {"x": 0.02}, {"u": "zero"})


def memory(*effects: Effect) -> Candidate:
    model = tank()
    [found] = [c for c in candidates(sites(model, (run(1, 0.0),)), effects)
               if c.ids == ("fading_memory",)]
    return found


def test_it_exchanges_with_a_state_of_its_own() -> None:
    model, law = tank(), memory()
    made, x, w, k, r = law.applied(model), *map(symbol, ("x", "wake", "k_wake", "r_wake"))
    assert (made.equations["x"] - model.equations["x"] - k * (w - x)).expand() == 0
    assert (made.equations["wake"] - r * (x - w)).expand() == 0
    assert not law.known and law.families == ("storage",)


def test_where_an_entry_is_the_store_the_rest_drives_away() -> None:
    own = Effect("store", "a store", (Parameter("k_s", 0.1, "1/s", (0.0, np.inf)),), ("k_s", 0.0),
                 add={"x": "k_s*(z_s - x)"}, states={"z_s": NewState("m", "0", "0.2*(x - z_s)")})
    assert memory(own).parameters[0].bounds == (-np.inf, 0.0)
    assert memory().parameters[0].bounds == (-np.inf, np.inf)


@pytest.mark.slow
@pytest.mark.parametrize("k", [0.4, -0.15])
def test_an_unknown_memory_is_given_no_name(k: float) -> None:
    """Of entries together some explain most of it: none of them acts."""
    answer = pk.diagnose(tank(), run(1, k), run(2, k))
    assert answer.mismatch and answer.verdict not in ("named", "partial")
    assert answer.verdict != "set" or all(
        i.startswith("symbolic:") for h in answer.hypotheses for e in h.effects for i in e.ids)


def rolling() -> pk.Model:
    """A cart that nothing holds."""
    return pk.Model.from_dict({
        "name": "cart", "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}},
        "inputs": {"F": {"unit": "N"}},
        "parameters": {"m": {"unit": "kg", "guess": 1.2, "bounds": [0.01, 100.0]},
                       "b": {"unit": "N*s/m", "guess": 0.4, "bounds": [0.0, 100.0]}},
        "equations": {"x": "v", "v": "(F - b*v)/m"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})


def rolled(seed: int) -> pk.Recording:
    """v' = F - v/2 + (w - v)/2, w' = 4 (v - w), at rest at first, by DOP853."""
    rng = np.random.default_rng(seed)
    F, x = np.repeat(rng.uniform(-2.0, 2.0, 20), 30), np.zeros((600, 3))
    for i in range(599):
        x[i + 1] = solve_ivp(lambda _, y, push=F[i]: [
            y[1], push - 0.5 * y[1] + 0.5 * (y[2] - y[1]), 4.0 * (y[1] - y[2])], (0, 0.02), x[i],
            "DOP853", rtol=1e-9, atol=1e-11).y[:, -1]
    return pk.Recording.from_arrays(
        0.02 * np.arange(600), {"F": F, "x": x[:, 0] + rng.normal(0, 0.003, 600)},
        {"F": "N", "x": "m"}, {"x": 0.003}, {"F": "zero"})


def test_a_rate_remembers_where_nothing_swings() -> None:
    model, run = rolling(), rolled(1)
    case = open_case(model, (run,), None, None, lambda text: None, DEFAULTS)
    [law] = [c for c in case.candidates if c.ids == ("fading_memory",)]
    found = fitted(model, [law], case.records, [{**case.base.point, "k_wake": 0.1}], 1)
    assert found is not None and case.base.minimum.chi2 > 2 * found.whitened.rows
    assert found.minimum.chi2 == pytest.approx(found.whitened.rows, rel=0.15)
    assert found.values["k_wake"] == pytest.approx(0.5, abs=4 * found.std["k_wake"])
    swinging = candidates(sites(pk.systems.sloshing(), (pk.excitation.two_pulse(),)))
    assert not any("wake" in p.name for c in swinging for p in c.parameters)


@pytest.mark.slow
def test_an_unknown_memory_of_a_rate_is_given_no_name() -> None:
    answer = pk.diagnose(rolling(), rolled(1), rolled(2))
    assert answer.mismatch and answer.verdict == "unnamed"
    title, why_not = answer.not_given[0]
    assert title == "a memory that fades" and "a law of no catalogue" in why_not
