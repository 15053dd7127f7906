"""A push as loud as all the rest is found beside a lasting effect; a rig that SciPy simulates."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pikanid.mismatch.case import Case
from pikanid.mismatch.search import neighbours
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.model import Model
from pikanid.recording import Recording

LAG, STEP, NOISE = 2.0, 0.25, 0.05


def room() -> Model:
    return Model.from_dict({
        "name": "room", "states": {"T": {"unit": "K", "initial": 0.0}},
        "inputs": {"P": {"unit": "kW"}},
        "parameters": {"R": {"unit": "K/kW", "guess": 2.5}, "C": {"unit": "kJ/K", "guess": 8.0}},
        "equations": {"T": "(P - T/R)/C"}, "outputs": {"T": {"unit": "K", "expression": "T"}}})


def opened_for(t: float) -> float:
    """A raised cosine of 20 s about 90 s."""
    return float(0.5 + 0.5 * np.cos(2 * np.pi * np.clip((t - 90) / 20, -0.5, 0.5)))


def heated(seed: int, push: float) -> Recording:
    """By a radiator that warms up late; a window stands open once."""
    rng, t = np.random.default_rng(seed), STEP * np.arange(800)
    P = np.repeat(rng.uniform(0, 6, 40), 20)
    x = [np.array([0.0, P[0]])]
    for k, held in enumerate(P[:-1]):
        x.append(solve_ivp(lambda s, x, by=held, at=t[k]: [
            (x[1] - x[0] / 2) / 10 - push * opened_for(at + s), (by - x[1]) / LAG],
            (0, STEP), x[-1], "LSODA", rtol=1e-8, atol=1e-10).y[:, -1])
    seen = np.array(x)[:, 0] + NOISE * rng.standard_normal(800)
    return Recording.from_arrays(t, {"P": P, "T": seen}, units={"P": "kW", "T": "K"})


@pytest.fixture(scope="module")
def opened() -> Case:
    return open_case(room(), (heated(1, 1.0),), None, None, lambda text: None, DEFAULTS)


def test_it_is_tried_beside_an_effect_that_leaves_much_and_in_the_place_of_another(
        opened: Case) -> None:
    search = opened.begin_search()
    by_key = {c.key: c for c in opened.candidates}
    lag, store = by_key["actuator_lag"], by_key["fading_memory"]
    about, both = search._fit([lag], [{}]), search._fit([lag, store], [{}])
    assert about.far and not any(c.absent for c in neighbours.beside(about, opened.candidates))
    for begun in (about, both):
        jobs = [job for job in neighbours.with_events(begun, opened.candidates, search.fits)
                if {e.key for e in job[0]} == {"actuator_lag", "disturbance"}]
        assert len(jobs) == 1
        found = search._fit(*jobs[0], again=True)
        assert found.minimum.chi2 < 1.2 * found.whitened.rows < about.minimum.chi2 / 4
        assert abs(found.values["tau_a"] - LAG) < 4 * found.std["tau_a"] < 0.1 * LAG


def test_where_little_is_left_it_is_one_of_all_that_may_be_there(opened: Case) -> None:
    search = opened.begin_search()
    by_key = {c.key: c for c in opened.candidates}
    pair = search._fit([by_key["actuator_lag"], by_key["disturbance"]], [
        {"tau_a": LAG, "peak": -1.0, "t_peak": 90.0, "width": 19.0}])
    assert not pair.far
    assert not [*neighbours.with_events(pair, opened.candidates, {pair.key: pair})]


def test_what_has_happened_is_not_added_once_more(opened: Case) -> None:
    search = opened.begin_search()
    [event] = [c for c in opened.candidates if c.key == "disturbance"]
    late = search._fit([event], [{"peak": 1.0, "t_peak": 20.0, "width": 2.0}])
    assert late.far and not [*neighbours.with_events(late, opened.candidates, search.fits)]
