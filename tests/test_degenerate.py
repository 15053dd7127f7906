"""Explanations that fit and say nothing: effects in a limit, and models explained away."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from opened import case, hypothesis

import pikanid as pk
from pikanid.formula.expressions import symbol
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.channels import LEFT
from pikanid.mismatch.catalogue.forces import slowest
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.fitting.descent import Start
from pikanid.mismatch.fitting.extended import extended
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.search import places
from pikanid.mismatch.search.leaders import siblings
from pikanid.model.parts import Parameter
from pikanid.optimise.levenberg_marquardt import Minimum

__all__ = ["case"]  # the fixture


def fit(names: tuple[str, ...], theta: np.ndarray, J: np.ndarray, effect: Any) -> Hypothesis:
    """Of a model's own parameters `a`, `b`, ... and those of an effect, with a Jacobian J."""
    free = [SimpleNamespace(name=n, label=n, recording=None) for n in names]
    problem = SimpleNamespace(free=free, lower=np.full(len(free), -np.inf),
                              upper=np.full(len(free), np.inf))
    whitened: Any = SimpleNamespace(rows=len(J), sizes=np.full(len(free), 1e3), problem=problem)
    minimum = Minimum(theta, np.ones(len(J)), J, True)
    return Hypothesis((effect,), pk.systems.sloshing(), whitened, minimum, 0.0)


def law(*names: str, exponent: str = "", scope: str = "shared") -> Any:
    return SimpleNamespace(key="law", parameters=tuple(
        Parameter(n, 0.0, scope=scope) for n in names),  # type: ignore[arg-type]  # of the two
                           exponent=Parameter(exponent, 0.0) if exponent else None)


@pytest.mark.parametrize(("angle", "known"), [(1e-4, False), (0.5, True)])
def test_what_is_known_only_together_is_not_determined(angle: float, known: bool) -> None:
    """A loop that never yields: of size and yield only the quotient moves anything."""
    rng = np.random.default_rng(0)
    x, y, z = np.linalg.qr(rng.normal(size=(200, 3)))[0].T
    # 9 standard errors each if the other one were known
    J = np.column_stack([30.0 * z, 9.0 * x, 9.0 * (np.cos(angle) * x + np.sin(angle) * y)])
    h = fit(("a", "size", "width"), np.array([1.0, 1.0, 1.0]), J, law("size", "width"))
    assert h.determines(h.effects[0]) == known
    # an exponent is no size: that of a law may be nothing
    assert fit(("a", "size", "n"), np.ones(3), J, law("size", "n", exponent="n")).determines(
        law("size", "n", exponent="n"))
    # of one parameter the correlation with the model's own is no ridge of its own
    assert fit(("a", "size"), np.ones(2), J[:, :2], law("size")).determines(law("size"))


@pytest.mark.parametrize("scope", ["shared", "recording"])
@pytest.mark.parametrize(("clear", "known"), [(20.0, False), (100.0, True)])
def test_one_parameter_of_several_has_to_be_three_standard_errors_from_nothing(
        clear: float, known: bool, scope: str) -> None:
    """Each is `clear` standard errors from it were the other one known, and a twentieth of that: a
    lag of no length, of an input that was far off before the recording, is a push.
    """
    x, y = np.linalg.qr(np.random.default_rng(1).normal(size=(200, 2)))[0].T
    J = clear * np.column_stack([x, np.cos(0.05) * x + np.sin(0.05) * y])
    h = fit(("size", "width"), np.ones(2), J, law("size", "width", scope=scope))
    assert h.determines(h.effects[0]) == known


def beside(angles: tuple[float, ...], errors: tuple[float, ...]) -> Hypothesis:
    """A model of parameters that are 1, each with an error of its own were the effect known, and at
    an angle to what the effect does to it.
    """
    n = len(errors)
    axes = np.linalg.qr(np.random.default_rng(0).normal(size=(200, 2 * n)))[0]
    J = [axes[:, 2 * k] / error for k, error in enumerate(errors)]
    J += [1e3 * (np.cos(angle) * axes[:, 2 * k] + np.sin(angle) * axes[:, 2 * k + 1])
          for k, angle in enumerate(angles)]
    own, sizes = ([f"{name}{k}" for k in range(n)] for name in ("own", "size"))
    return fit((*own, *sizes), np.ones(2 * n), np.column_stack(J), law(*sizes))


@pytest.mark.parametrize(("angles", "errors", "away"), [
    ((1.0, 1.0, 1.0), (0.01, 0.01, 0.01), False),
    ((0.01, 1.0, 1.0), (0.01, 0.01, 0.01), False), ((0.01, 0.01, 1.0), (0.01, 0.01, 0.01), True),
    # what would not be known were the effect known is not lost by it
    ((1.0, 1.0, 1.0), (0.9, 0.9, 0.9), False),
    # an error that is many times as large, and small all the same
    ((0.01, 0.01, 0.01), (1e-4, 1e-4, 1e-4), False)])
def test_a_model_of_which_effects_take_away_what_is_known_is_explained_away(
        angles: tuple[float, ...], errors: tuple[float, ...], away: bool) -> None:
    h = beside(angles, errors)
    assert h.explained_away() == away
    assert not replace(h, effects=()).explained_away()


def test_a_remainder_counts_in_what_is_not_known() -> None:
    h = beside((0.05, 0.05, 0.05), (0.005, 0.005, 0.005))
    assert not h.explained_away()
    assert h.explained_away(overdispersion=20.0)


def test_siblings_have_another_effect_of_one_family(case: Case) -> None:
    cubic, quintic = (hypothesis(case, key, "sensor_offset")
                      for key in ("cubic_stiffness", "quintic_stiffness"))
    others = [hypothesis(case, *keys) for keys in (
        ("sensor_offset",), ("quadratic_drag", "sensor_offset"))]
    assert siblings(cubic, [*others, quintic, cubic]) == [quintic]


def test_what_inputs_are_mapped_to_acts_in_what_is_added(case: Case) -> None:
    """Whatever the order in which they were found."""
    listed = {c.key: c for c in case.candidates}
    gain, drive = listed["input_gain"], listed["velocity_coupled_drive"]
    models = [extended(case.model, effects) for effects in ((gain, drive), (drive, gain))]
    rates = [m.equations["theta_dot"] for m in models]
    assert rates[0] == rates[1]
    u, k = symbol("u_x"), symbol(gain.parameters[0].name)
    scaled = extended(case.model, (drive,)).equations["theta_dot"].xreplace({u: k * u})
    assert (rates[0] - scaled).expand() == 0


@pytest.mark.parametrize("low", [-2.0, 3.0])
def test_an_input_keeps_a_tenth_of_its_range_where_it_is_limited(low: float) -> None:
    t = np.arange(300) * 0.02
    u = low + (5.0 - low) * (1 + np.sin(3 * t)) / 2
    recording = pk.Recording.from_arrays(t, {"u_x": u, "theta": np.sin(t)},
                                         {"u_x": "m/s^2", "theta": "rad"})
    found = {c.key: c.parameters[0].bounds[0] for c in candidates(sites(
        pk.systems.sloshing(), (recording,))) if c.ids == ("input_saturation",)}
    assert found["input_saturation"] == pytest.approx(LEFT * 5.0, rel=1e-3)
    assert found["input_saturation[above]"] == pytest.approx(low + LEFT * (5.0 - low), rel=1e-2)
    assert found["input_saturation[below]"] == pytest.approx(-5.0 + LEFT * (5.0 - low), rel=1e-2)


def test_a_parameter_that_cannot_be_negative_does_not_drift_through_nothing(case: Case) -> None:
    drifts = [c for c in case.candidates if c.ids == ("parameter_drift",)]
    ends = case.records.recordings[0].stop
    assert {c.variant: c.parameters[0].bounds[0] for c in drifts} == {
        "l_theta": -1 / ends, "d_theta": -1 / ends}
    free = replace(case.model, parameters=tuple(
        replace(p, bounds=(-1.0, p.bounds[1])) for p in case.model.parameters))
    site = replace(drifts[0].site, model=free)
    assert slowest(site, "d_theta") == -np.inf


def test_a_law_that_is_too_large_to_be_squared_has_other_places(
        case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    """As of a coordinate that runs away."""
    h = hypothesis(case, "cubic_stiffness")
    (effect,) = h.effects
    other = replace(effect, site=replace(effect.site, suffix="_2"))

    def begun(times: float) -> float:
        real = places.directions
        with monkeypatch.context() as patched:
            patched.setattr(places, "directions", lambda w, theta, same: (
                found := real(w, theta, [effect])) and replace(found, D=times * found.D))
            ((_, (start,)),) = places.elsewhere(h, [other])
        assert isinstance(start, Start)
        return start.values["k3"]

    assert begun(1e200) * 1e200 == pytest.approx(begun(1.0))
    assert begun(1.0) == pytest.approx(h.values["k3"], rel=0.2)
