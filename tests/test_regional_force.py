"""A law that is local in a state is no constant force; rigs that SciPy simulates."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pikanid.formula.expressions import symbol
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.candidate import View
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.regional_force import is_everywhere
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.diagnose import diagnose
from pikanid.mismatch.judge.kinds import families_of
from pikanid.mismatch.search.in_its_place import in_its_place
from pikanid.mismatch.search.neighbours import with_other_form
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.model import Model
from pikanid.recording import Recording

SIZE, AT, WIDTH, NOISE = 6.0, 3.0, 1.2, 0.05


def axis() -> Model:
    return Model.from_dict({
        "name": "axis", "states": {"w": {"unit": "rad/s"}}, "inputs": {"u": {"unit": "V"}},
        "parameters": {"b": {"unit": "1/s", "guess": 1.3}, "g": {"unit": "rad/s^2/V", "guess": 2}},
        "equations": {"w": "-b*w + g*u"},
        "outputs": {"w": {"unit": "rad/s", "expression": "w"}}})


def turned(seed: int, size: float = SIZE, constant: float = 0.0) -> Recording:
    """By steps of voltage, with a torque about one speed."""
    rng, t = np.random.default_rng(seed), 0.02 * np.arange(1000)
    u, w = np.repeat(rng.uniform(-4, 6, 12), 84)[:1000], [0.0]
    for held in u[:-1]:
        w.append(solve_ivp(
            lambda s, x, by=held: -x + 2 * by + constant + size * np.exp(-((x - AT) / WIDTH)**2),
            (0, 0.02), w[-1:], "LSODA", rtol=1e-9, atol=1e-11).y[0, -1])
    return Recording.from_arrays(t, {"u": u, "w": w + NOISE * rng.standard_normal(1000)},
                                 units={"u": "V", "w": "rad/s"})


@pytest.fixture(scope="module")
def opened() -> Case:
    return open_case(axis(), (turned(1),), None, None, lambda text: None, DEFAULTS)


def test_it_explains_more_than_a_constant_force_and_finds_its_place(opened: Case) -> None:
    search = opened.begin_search()
    [bias] = [c for c in opened.candidates if c.key == "static_bias"]
    constant = search._fit([bias], [{}])
    search._fit_all([*with_other_form(constant, opened.candidates, search.fits)], always=True)
    local = search.fits[frozenset({"regional_force[w]"})]
    assert local.minimum.chi2 < 1.15 * local.whitened.rows < constant.minimum.chi2 - 1000
    for name, true in (("k_region_w", SIZE), ("h_region_w", AT), ("w_region_w", WIDTH)):
        assert abs(local.values[name] - true) < 4 * local.std[name] < 0.1 * true


def test_fits_begin_near_it_where_the_model_stays_as_it_is(opened: Case) -> None:
    search = opened.begin_search()
    by_key = {c.key: c for c in opened.candidates}
    law = by_key["regional_force[w]"]
    constant = search._fit([by_key["static_bias"]], [{}])
    starts = in_its_place(constant, by_key["static_bias"], replace(law, directions=law.signs))
    assert 1 <= len(starts) <= 4
    assert any(abs(s.values["h_region_w"] - AT) < WIDTH and s.values["k_region_w"] > 0
               for s in starts)
    assert all(s.origin["k_region_w"] == 0 for s in starts)


def test_what_it_would_show_is_what_it_does() -> None:
    [law] = [c for c in candidates(sites(axis(), (turned(1),))) if c.ids == ("regional_force",)]
    assert not law.known and law.next_to == "static_bias" and law.signs is not None
    w = np.linspace(-5.0, 8.0, 50)
    signs = law.signs(cast(View, SimpleNamespace(x={"w": w})))
    pushed = law.applied(axis()).equations["w"] - axis().equations["w"]
    for sign in signs[::5]:
        assert sign.force is not None and -5 < sign.start["h_region_w"] < 8
        at = [float(pushed.subs({symbol(n): v for n, v in {**sign.start, "w": x}.items()}))
              for x in w[20:23]]
        assert sign.force[20:23] == pytest.approx(at)
    assert not law.signs(cast(View, SimpleNamespace(x={"w": np.full(50, 2.0)})))


@pytest.mark.parametrize(("at", "wide", "everywhere"), [
    (1.0, 2.9, False), (1.0, 3.1, True), (-4.9, 1.0, False), (-5.1, 1.0, True), (5.1, 1.0, True)])
def test_where_the_motion_does_not_leave_its_region_it_is_constant(
        at: float, wide: float, everywhere: bool) -> None:
    [law] = [c for c in candidates(sites(axis(), (turned(1),))) if c.ids == ("regional_force",)]
    values = {"k_region_w": 1.0, "h_region_w": at, "w_region_w": wide}
    motion = {"w": np.linspace(-5.0, 5.0, 50)}
    h: Any = SimpleNamespace(values=values, blurred=frozenset(), minimum=SimpleNamespace(theta=0),
                             whitened=SimpleNamespace(motion=lambda theta: motion))
    assert is_everywhere(law, values, motion) == everywhere
    assert families_of(law, h, 0.3) == (("constant force",) if everywhere else ())


def test_no_place_of_a_coordinate_without_a_rest_is_special() -> None:
    """And on a spring one is."""
    def regions(spring: str, start: float = 0.1) -> set[str]:
        model = Model.from_dict({
            "name": "cart", "states": {"x": {"unit": "m", "initial": start}, "v": {"unit": "m/s"}},
            "parameters": {"b": {"unit": "1/s", "guess": 1.0}},
            "inputs": {"u": {"unit": "m/s^2"}},
            "equations": {"x": "v", "v": f"u - b*v {spring}"},
            "outputs": {"x": {"unit": "m", "expression": "x"}}})
        t = np.arange(100) * 0.01
        run = Recording.from_arrays(
            t, {"u": np.sin(t), "x": np.cos(t)}, units={"u": "m/s^2", "x": "m"})
        found = [c for c in candidates(sites(model, (run,))) if c.ids == ("regional_force",)]
        assert all(c.next_to == "static_bias" for c in found)
        return {c.variant for c in found}

    assert regions("") == {"v"}
    assert regions("- 2.0*x") == {"x", "v"}
    # one that starts where a constant force would hold it has that entry in two variants
    assert regions("- 2.0*x", 0.0) == {"x", "v"}


@pytest.mark.slow
def test_a_diagnosis_gives_its_formula_and_no_name() -> None:
    given = diagnose(axis(), turned(1), turned(51), workers=1)
    assert given.mismatch and not given.present
    ids = [i for h in given.hypotheses for e in h.effects for i in e.ids]
    assert ids and all("exp(" in i for i in ids)


def test_a_constant_force_keeps_its_name_beside_it() -> None:
    given = diagnose(axis(), turned(1, 0.0, 1.5), turned(51, 0.0, 1.5), workers=1)
    assert given.verdict == "named" and given.hypotheses[0].effects[0].ids == ("static_bias",)
    bias = given.hypotheses[0].effects[0].parameters["bias"]
    assert abs(bias.value - 1.5) < 4 * bias.std < 0.1
