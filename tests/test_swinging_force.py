"""What rings because it is pushed on is no other initial state; a rig that SciPy simulates."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import cont2discrete

from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.candidate import View
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.diagnose import diagnose
from pikanid.mismatch.search.in_its_place import in_its_place
from pikanid.mismatch.search.neighbours import with_other_form
from pikanid.mismatch.search.screen import Screen
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.model import Model
from pikanid.recording import Recording

RATE, DAMPING, NOISE = 6.0, 0.36, 0.002
TIME = np.linspace(0.0, 10.0, 801)


def model(k: float = 30.0) -> Model:
    return Model.from_dict({
        "name": "cart on a spring",
        "states": {"x": {"unit": "m", "initial": 0.0}, "v": {"unit": "m/s", "initial": 0.0}},
        "parameters": {"k": {"unit": "1/s^2", "guess": k, "bounds": [0.0, 400.0]},
                       "c": {"unit": "1/s", "guess": 0.3, "bounds": [0.0, 20.0]}},
        "inputs": {"u": {"unit": "m/s^2"}},
        "equations": {"x": "v", "v": "u - k*x - c*v"},
        "outputs": {"y": {"unit": "m", "expression": "x"}}})


def recorded(seed: int, start: tuple[float, float] = (0.0, 0.0), size: float = 0.0,
             rate: float = RATE, phase: float = 0.0) -> Recording:
    """Answers to pushes, exact for a held input, and to a force that swings, which add up."""
    rng = np.random.default_rng(seed)
    u = np.zeros(len(TIME))
    for begin in rng.uniform(0, 8, 4):
        u[(begin <= TIME) & (begin + 0.6 > TIME)] += rng.choice([-1, 1]) * rng.uniform(1, 3)
    A, b = np.array([[0, 1.0], [-RATE**2, -DAMPING]]), np.array([[0.0], [1.0]])
    Ad, bd, *_ = cont2discrete((A, b, np.eye(2), np.zeros((2, 1))), TIME[1])
    states = [np.zeros(2)]
    for held in u[:-1]:
        states.append(Ad @ states[-1] + bd[:, 0] * held)
    swing = solve_ivp(lambda t, s: A @ s + b[:, 0] * size * np.sin(rate * t + phase),
                      (0, TIME[-1]), start, "DOP853", TIME, rtol=1e-10, atol=1e-12)
    y = np.array(states)[:, 0] + swing.y[0] + NOISE * rng.standard_normal(len(TIME))
    return Recording.from_arrays(TIME, {"u": u, "y": y}, units={"u": "m/s^2", "y": "m"})


def test_a_force_that_keeps_a_rig_ringing_explains_more_than_another_initial_state() -> None:
    """It is tried where that is the best explanation, from the frequencies that show."""
    case = open_case(model(), (recorded(3, size=0.05, rate=5.9, phase=0.5),),
                     None, None, lambda text: None, DEFAULTS)
    search = case.begin_search()
    [start] = [c for c in case.candidates if c.key == "initial_state"]
    begun = search._fit([start], [{}])
    search._fit_all([*with_other_form(begun, case.candidates, search.fits)], always=True)
    swinging = search.fits[frozenset({"swinging_force"})]
    assert swinging.minimum.chi2 < begun.minimum.chi2 - 40
    assert swinging.values["swing_rate"] == pytest.approx(5.9, abs=0.1)
    # no first look for what is missing asks for it
    listed = Screen(search.base(), [c for c in case.candidates if c.fits]).singles(99)
    assert listed and all(c.key != "swinging_force" for c, _ in listed)


def test_its_frequency_is_found_where_what_shows_is_the_push_that_it_begins_with() -> None:
    """Of a mass on a rail any frequency gives that push: the true one differs by little."""
    rail = Model.from_dict({
        "name": "mass on a rail",
        "states": {"x": {"unit": "m", "initial": 0.0}, "v": {"unit": "m/s", "initial": 0.0}},
        "parameters": {"c": {"unit": "1/s", "guess": 1.0, "bounds": [0.0, 20.0]}},
        "inputs": {"u": {"unit": "m/s^2"}},
        "equations": {"x": "v", "v": "u - c*v"},
        "outputs": {"y": {"unit": "m", "expression": "x"}}})
    drag, rate, rng = 0.4, 7.0, np.random.default_rng(6)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], 9), 89)

    def slope(t: float, s: np.ndarray) -> list[float]:
        held = u[min(int(t / TIME[1] + 1e-9), 800)]
        return [s[1], held + 2.0 * np.sin(rate * t) - drag * s[1]]

    run = solve_ivp(slope, (0, TIME[-1]), (0.0, 0.0), "DOP853", TIME, rtol=1e-8, atol=1e-10,
                    max_step=TIME[1])
    seen = run.y[0] + 0.15 * rng.standard_normal(len(TIME))
    recording = Recording.from_arrays(TIME, {"u": u, "y": seen}, units={"u": "m/s^2", "y": "m"},
                                      hold={"u": "zero"})
    case = open_case(rail, (recording,), None, None, lambda text: None, DEFAULTS)
    search = case.begin_search()
    [start] = [c for c in case.candidates if c.key == "initial_state"]
    begun = search._fit([start], [{}])
    assert begun.values["d_v"] == pytest.approx(2.0 / rate, abs=0.05)
    search._fit_all([*with_other_form(begun, case.candidates, search.fits)], again=True,
                    always=True)
    swinging = search.fits[frozenset({"swinging_force"})]
    assert swinging.minimum.chi2 < begun.minimum.chi2 - 10
    assert swinging.values["swing_rate"] == pytest.approx(rate, abs=0.2)


def test_another_initial_state_is_told_from_a_force_that_swings() -> None:
    answer = diagnose(model(), recorded(3, (0.01, 0.0)), recorded(4, (-0.006, 0.05)), workers=1)
    assert answer.verdict == "named"
    assert answer.hypotheses[0].effects[0].ids == ("initial_state",)


def test_what_it_would_show_is_what_it_does() -> None:
    """Forces at frequencies about the natural one, within what the samples can show."""
    [law] = [c for c in candidates(sites(model(), (recorded(3),))) if c.ids == ("swinging_force",)]
    assert not law.known and law.next_to == "initial_state" and law.signs is not None
    signs = law.signs(cast(View, SimpleNamespace(t=TIME)))
    rates = [sign.start["swing_rate"] for sign in signs]
    assert min(rates) < 0.5 * RATE < 2 * RATE < max(rates) < np.pi / TIME[1]
    pushed = law.applied(model()).equations["v"] - model().equations["v"]
    for sign in (signs[6], signs[7]):
        values = {"swing_a": 0.0, "swing_b": 0.0, **sign.start}
        at = [float(pushed.subs({symbol(n): v for n, v in {**values, "t": t}.items()}))
              for t in TIME[24:27]]
        assert sign.force is not None
        assert sign.force[24:27] == pytest.approx(at)


def test_of_what_hardly_turns_in_a_recording_all_frequencies_are_looked_at() -> None:
    slow = model(0.01)
    [site] = [s for s in sites(slow, (recorded(3),)) if s.v == "v"]
    turn = 2 * np.pi / TIME[-1]
    assert 0 < 3 * site.rate < turn
    [law] = [c for c in candidates([site]) if c.ids == ("swinging_force",)]
    assert law.signs is not None
    rates = [s.start["swing_rate"] for s in law.signs(cast(View, SimpleNamespace(t=TIME)))]
    assert min(rates) == pytest.approx(turn) and max(rates) > 20 * turn


def test_where_nothing_tells_how_it_swings_no_fit_begins() -> None:
    case = open_case(model(), (recorded(3, (0.02, 0.0)),), None, None, lambda text: None, DEFAULTS)
    search = case.begin_search()
    [start] = [c for c in case.candidates if c.key == "initial_state"]
    [law] = [c for c in case.candidates if c.key == "swinging_force"]
    silent = replace(law, directions=lambda view: [])
    assert in_its_place(search._fit([start], [{}]), start, silent) == []
