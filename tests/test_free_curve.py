"""How much of what an equation lacks a free curve of a state takes up, read off the motion."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import pikanid as pk
from pikanid.mismatch.beyond.free_curve import (
    _curve,
    state_curve,
    with_free_curve,
    with_free_input,
    with_free_sensor,
)
from pikanid.mismatch.beyond.patch import FreeCurve
from pikanid.mismatch.catalogue.channels import sensor_nonlinearity
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel

SIGMA = 0.002
MAGNET = "-20*(theta/0.06)/(1 + (theta/0.06)**2)**2"  # as strong as gravity, about the rest only


def base_of(term: str) -> tuple[Hypothesis, Site]:
    """The nominal fit to a recording of a rig with a further force."""
    return fitted_to(pk.systems.sloshing().with_term("theta_dot", term))


def fitted_to(rig: pk.Model) -> tuple[Hypothesis, Site]:
    """The nominal fit to a recording of a rig."""
    model = pk.systems.sloshing()
    run = pk.simulate(rig, pk.excitation.planar_moves(8, 10.0, seed=2), sigma=SIGMA, seed=2)
    records = Records((run,), ({"theta": NoiseModel(SIGMA, 0.0, 0.0, 0.01, "")},), DEFAULTS)
    base = fitted(model, (), records, [{}], 1)
    assert base is not None
    return base, sites(model, (run,))[0]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_curve_of_the_right_state_leaves_far_less_from_far_off() -> None:
    """Of a force as narrow as a piece of the curve."""
    base, site = base_of(MAGNET)
    assert base.far
    own, other = (with_free_curve(base.model, base, (), name, site)
                  for name in ("theta", "theta_dot"))
    assert own is not None and other is not None
    assert own.minimum.chi2 < 0.1 * min(base.minimum.chi2, other.minimum.chi2)


def test_a_curve_that_is_fitted_explains_a_force_of_its_state() -> None:
    base, site = base_of("-60*theta*abs(theta)")
    found = with_free_curve(base.model, base, (), "theta", site)
    assert found is not None and not base.whitened.rows > base.minimum.chi2
    assert found.minimum.chi2 == pytest.approx(found.whitened.rows, rel=0.1)


def test_a_curve_of_the_sensor_explains_what_no_cubic_does() -> None:
    base, site = fitted_to(pk.systems.sloshing().map_output(
        "theta", function="theta + 0.03*sin(13*theta + 0.4)"))
    cubic = fitted(base.model, sensor_nonlinearity(site), base.whitened.records, [base.point], 1)
    assert cubic is not None
    found = with_free_sensor(base.model, cubic, cubic.effects, site)
    assert found is not None and cubic.minimum.chi2 > 1.2 * cubic.whitened.rows
    assert found.minimum.chi2 == pytest.approx(found.whitened.rows, rel=0.1)


def test_a_curve_of_an_input_explains_how_it_saturates_softly() -> None:
    base, site = fitted_to(pk.systems.sloshing().map_input("u_x", function="3*tanh(u_x/3)"))
    found = with_free_input(base.model, base, (), "u_x", site)
    assert found is not None and base.minimum.chi2 > 1.5 * base.whitened.rows
    assert found.minimum.chi2 == pytest.approx(found.whitened.rows, rel=0.1)


def test_an_input_at_rest_has_no_curve() -> None:
    base, site = base_of("0")
    assert with_free_input(base.model, base, (), "u_z", site) is None


@pytest.mark.parametrize("zero_at_zero", [True, False])
def test_a_curve_that_is_zero_at_zero_holds_no_constant(zero_at_zero: bool) -> None:
    curve = FreeCurve("theta", -0.2, 0.5, pk.systems.sloshing(), 6, zero_at_zero=zero_at_zero)
    seen = curve.matrix(np.linspace(-0.2, 0.5, 8))
    weights = np.random.default_rng(1).standard_normal(len(curve.names))
    value = sp.lambdify(["theta", *curve.names], sp.sympify(curve.formula.replace("max", "Max")))
    assert value(0.0, *weights) == pytest.approx(0.0 if zero_at_zero else curve.matrix(
        np.zeros(1))[0] @ weights, abs=1e-12)
    assert value(0.3, *weights) == pytest.approx((seen @ weights)[5])
    constant = np.linalg.lstsq(seen, np.ones(8), rcond=None)[0]
    assert np.allclose(seen @ constant, 1.0) != zero_at_zero


def test_a_constant_force_is_no_curve_that_is_zero_at_zero() -> None:
    base, site = base_of("10")
    held, free = (fitted(base.model, [curve], base.whitened.records, [base.point], 1)
                  for zero in (True, False)
                  if (curve := state_curve(base, "theta", site, zero_at_zero=zero)))
    assert held is not None and free is not None
    assert free.minimum.chi2 < 0.3 * held.minimum.chi2


@pytest.mark.parametrize(("unit", "low", "high", "there"), [
    ("V", -1.0, 2.0, True), ("V", 0.0, 2.0, True), ("V", 0.5, 2.0, False), ("V", 0.0, 0.0, False),
    ("degC", -1.0, 2.0, False), ("K", 0.0, 2.0, True)])
def test_where_a_curve_can_be_zero_at_zero(unit: str, low: float, high: float, there: bool) -> None:
    base, _ = base_of("0")
    found = _curve(base, "theta", np.linspace(low, high, 9), unit, 3, True)
    assert (found is not None) == there
