"""Products of an input, or of another state, and a state; rigs that SciPy simulates."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.diagnose import diagnose
from pikanid.mismatch.search import neighbours
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.model import Model
from pikanid.recording import Recording

PRODUCT, NOISE = -0.012, 0.01


def tanks() -> Model:
    return Model.from_dict({
        "name": "two tanks",
        "states": {"a": {"unit": "m", "initial": 0.5}, "h": {"unit": "m", "initial": 0.5}},
        "parameters": {"p": {"unit": "1/s", "guess": 0.12}, "q": {"unit": "1/s", "guess": 0.07},
                       "g": {"unit": "m/s/V", "guess": 0.02}},
        "inputs": {"u": {"unit": "V"}}, "equations": {"a": "g*u - p*a", "h": "p*a - q*h"},
        "outputs": {"h": {"unit": "m", "expression": "h"}}})


def filled(seed: int) -> Recording:
    """By steps of the pump, which stirs the second tank."""
    rng, t = np.random.default_rng(seed), np.arange(600.0)
    u, x = np.repeat(rng.uniform(1, 5, 12), 50), [np.array([0.5, 0.5])]
    for held in u[:-1]:
        x.append(solve_ivp(lambda s, x, by=held: [
            0.02 * by - 0.1 * x[0], 0.1 * x[0] - 0.08 * x[1] + PRODUCT * by * x[1]],
            (0, 1), x[-1], "LSODA", rtol=1e-9, atol=1e-11).y[:, -1])
    seen = np.array(x)[:, 1] + NOISE * rng.standard_normal(600)
    return Recording.from_arrays(t, {"u": u, "h": seen}, units={"u": "V", "h": "m"})


def test_every_input_may_act_so_in_every_equation() -> None:
    found = {c.key: c for c in candidates(sites(tanks(), (filled(1),)))
             if c.ids == ("velocity_coupled_drive",)}
    assert {c.site.v for c in found.values()} == {"a", "h"} and len(found) == 2
    assert len({p.name for c in found.values() for p in c.parameters}) == 2
    assert all(not c.known for c in found.values())
    assert {c.name for c in found.values()} == {"a drive that depends on a",
                                                "u acting in proportion to h"}


def test_it_explains_all_and_is_found_where_it_acts() -> None:
    case = open_case(tanks(), (filled(1),), None, None, lambda text: None, DEFAULTS)
    search = case.begin_search()
    [law] = [c for c in case.candidates
             if c.ids == ("velocity_coupled_drive",) and c.site.v == "h"]
    fit = search._fit([law], [{}])
    size = law.parameters[0].name
    assert fit.minimum.chi2 < 1.15 * fit.whitened.rows < search.base().minimum.chi2 - 100
    assert abs(fit.values[size] - PRODUCT) < 4 * fit.std[size] < abs(PRODUCT)


def test_a_linear_coupling_is_compared_with_one_in_proportion_to_both_states() -> None:
    """Two substances are fed, and one takes up the other."""
    model = Model.from_dict({
        "name": "two substances", "states": {"a": {"unit": "mol"}, "h": {"unit": "mol"}},
        "parameters": {"p": {"unit": "1/s", "guess": 0.12}, "q": {"unit": "1/s", "guess": 0.07}},
        "inputs": {"u": {"unit": "mol/s"}}, "equations": {"a": "u - p*a", "h": "u - q*h"},
        "outputs": {n: {"unit": "mol", "expression": n} for n in "ah"}})
    rng, u = np.random.default_rng(2), np.repeat(np.random.default_rng(1).uniform(0, 0.4, 12), 50)
    x = [np.zeros(2)]
    for held in u[:-1]:
        x.append(solve_ivp(lambda s, x, by=held: [
            by - 0.1 * x[0], by - 0.08 * x[1] - 0.02 * x[0] * x[1]],
            (0, 1), x[-1], "LSODA", rtol=1e-9, atol=1e-11).y[:, -1])
    a, h = np.array(x).T + NOISE * rng.standard_normal((2, 600))
    run = Recording.from_arrays(np.arange(600.0), {"u": u, "a": a, "h": h},
                                units={"u": "mol/s", "a": "mol", "h": "mol"})
    case = open_case(model, (run,), None, None, lambda text: None, DEFAULTS)
    search = case.begin_search()
    [linear] = [c for c in case.candidates if c.ids == ("coupled_state",) and c.site.v == "h"]
    begun = search._fit([linear], [{}])
    [job] = neighbours.with_next_form(begun, case.candidates)
    product = search._fit(*job)
    assert [e.next_to for e in product.effects] == [linear.key] and not product.known
    assert product.minimum.chi2 < 1.15 * product.whitened.rows < begun.minimum.chi2 - 1000
    size = product.effects[0].parameters[0].name
    assert abs(product.values[size] + 0.02) < 4 * product.std[size] < 0.002


@pytest.mark.slow
def test_no_sum_of_entries_is_named_in_its_place() -> None:
    given = diagnose(tanks(), filled(1), filled(51), workers=1)
    assert given.mismatch and given.verdict in ("unnamed", "unconfirmed")
    assert not given.present
