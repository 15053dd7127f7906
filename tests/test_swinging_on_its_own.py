"""A force that swings by itself where no entry of the catalogue explains a recording."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.candidate import View
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.catalogue.swinging_force import swinging_on_their_own
from pikanid.mismatch.steps import confirming
from pikanid.model import Model

RATE, DT = 1.234, 0.05


def oscillator() -> Model:
    return Model.from_dict({
        "name": "oscillator",
        "states": {"x": {"unit": "m", "initial": "x0"}, "v": {"unit": "m/s"}},
        "inputs": {"u": {"unit": "m/s^2", "hold": "first"}},
        "parameters": {"x0": {"unit": "m", "guess": 0.0, "scope": "recording"},
                       "w2": {"unit": "1/s^2", "guess": 8.0, "bounds": [0, 100]},
                       "d": {"unit": "1/s", "guess": 0.3, "bounds": [0, 10]},
                       "g": {"unit": "1", "guess": 0.9, "bounds": [0, 10]}},
        "equations": {"x": "v", "v": "-w2*x - d*v + g*u"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})


def driven(which: int, law: str) -> pk.Recording:
    """By twelve sines, while another force acts; SciPy's."""
    rng = np.random.default_rng([3, which])
    rates, starts = rng.uniform(0.2, 3, 12), rng.uniform(0, 2 * np.pi, 12)
    t = np.arange(0, 90, DT)
    u = np.sin(rates * t[:, None] + starts).sum(axis=1) / 3

    def f(s: float, y: np.ndarray) -> list[float]:
        by = float(np.interp(s, t, u))
        more = {"swings": 0.15 * np.sin(RATE * s + which),
                "pumps": -1.5 * np.sin(RATE * s) * y[0],
                "scales": 0.2 * np.sin(0.8 * s) * by,
                "fades": 0.3 * np.exp(-s / 25) * np.sin(1.5 * s),
                "quickens": 0.15 * np.sin((0.8 + 0.01 * s) * s)}[law]
        return [y[1], -9 * y[0] - 0.25 * y[1] + by + more]
    x = solve_ivp(f, (0, t[-1]), [0.1, 0.0], "DOP853", t, rtol=1e-8, atol=1e-10, max_step=DT).y[0]
    return pk.Recording.from_arrays(
        t, {"u": u, "x": x + 0.002 * rng.standard_normal(len(t))}, {"u": "m/s^2", "x": "m"},
        hold={"u": "first"})


@pytest.mark.slow
def test_it_is_named_with_its_frequency() -> None:
    dx = pk.diagnose(oscillator(), driven(0, "swings"), driven(1, "swings"))
    assert dx.verdict == "named" and dx.where.equation == "v"
    effect, = dx.hypotheses[0].effects
    assert effect.ids == ("symbolic:swing_a*sin(swing_rate*t) + swing_b*cos(swing_rate*t)",)
    found = effect.parameters["swing_rate"]
    assert abs(found.value - RATE) < 4 * found.std < 0.01 * RATE
    size = np.hypot(*(effect.parameters[n].value for n in ("swing_a", "swing_b")))
    assert size == pytest.approx(0.15, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(("law", "p", "size", "rate"), [
    ("pumps", "w2", 1.5 / 9, RATE), ("scales", "g", 0.2, 0.8)])
def test_a_parameter_that_swings_is_told_from_a_force(law: str, p: str, size: float, rate: float
                                                      ) -> None:
    dx = pk.diagnose(oscillator(), driven(0, law), driven(1, law))
    assert dx.verdict == "named"
    effect, = dx.hypotheses[0].effects
    assert effect.ids[0].startswith(f"symbolic:{p} -> {p}*(1 + ")
    found = effect.parameters[f"{p}_swing_rate"]
    assert abs(found.value - rate) < 4 * found.std < 0.01 * rate
    sizes = [effect.parameters[f"{p}_swing_{part}"].value for part in "ab"]
    assert np.hypot(*sizes) == pytest.approx(size, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["quickens", "fades"])
def test_what_swings_otherwise_is_not_called_that(law: str) -> None:
    dx = pk.diagnose(oscillator(), driven(0, law), driven(1, law))
    assert dx.mismatch and dx.verdict not in ("named", "set")


def test_the_frequency_of_an_input_is_left_to_what_follows_it() -> None:
    t = np.arange(0, 90, DT)
    found = sites(oscillator(), (pk.Recording.from_arrays(t, {"u": t, "x": t}),))
    law, *_ = swinging_on_their_own(found)

    def rates(u: np.ndarray) -> np.ndarray:
        view = View(t, {"x": t, "v": t}, {"x": t, "v": t}, {"u": u}, {}, {"x": t}, {"x": t}, {})
        return np.array([s.start["swing_rate"] for s in law.directions(view)])

    free, alone = rates(np.random.default_rng(1).standard_normal(len(t))), rates(np.sin(RATE * t))
    assert np.abs(free - RATE).min() < 0.02
    assert 0.02 < np.abs(alone - RATE).min() < 0.2 and len(alone) > 0.9 * len(free)


@pytest.mark.parametrize("all_of_it", [True, False])
def test_it_stays_where_it_explains_all(all_of_it: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a size and a phase in every recording it takes up a part of anything: no rival then."""
    law, drag = (SimpleNamespace(key=key) for key in ("swing", "drag"))
    nominal, fit = (SimpleNamespace(key=frozenset(k), point={}) for k in ([], ["swing"]))
    search = SimpleNamespace(
        fits={nominal.key: nominal}, candidates=(drag,), base=lambda: nominal, ranked=list)

    def offer(jobs: Sequence[tuple[tuple[SimpleNamespace], list[object]]]) -> None:
        for (one,), _ in jobs:
            search.candidates += (one,)
            search.fits[frozenset({one.key})] = fit

    search.offer = offer
    case = SimpleNamespace(search=search, candidates=(drag,), sites=(), settings=None,
                           adequate=lambda h: all_of_it, evidence=lambda ranked: ranked)
    monkeypatch.setattr(confirming, "symbolic_candidates", lambda *_: [])
    monkeypatch.setattr(confirming, "swinging_on_their_own", lambda sites: [law])
    monkeypatch.setattr(confirming, "Screen", lambda base, laws: SimpleNamespace(
        singles=lambda count: [(laws[0], [{}])]))
    monkeypatch.setattr(confirming, "with_formulas", lambda answer, evidence: answer)
    nothing: Any = None
    confirming.with_laws_outside(cast(Case, case), nothing, nothing, nothing)
    assert (fit.key in search.fits) is all_of_it and nominal.key in search.fits
    assert search.candidates == ((drag, law) if all_of_it else (drag,))
