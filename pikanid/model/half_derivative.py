"""A half-derivative D^½ z as ordinary states: memory with a fading tail.

The wall's boundary layer damps sloshing with -b D^½ θ' (Henderson & Miles, J. Fluid Mech. 275,
1994).  In the frequency domain D^½ is (iω)^½; over a band it is close to a sum of first-order
filters (the diffusive representation, Montseny 1998),

    (iω)^½ ≈ w_0 + Σ_k w_k iω/(iω + ω_k),      ω_k evenly spaced in log ω,

each of which is one state z_k' = ω_k (z - z_k) that enters as w_k (z - z_k).  The weights minimise
the relative error over the band.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import sympy as sp

from pikanid import errors
from pikanid.formula.expressions import symbol
from pikanid.model import units as model_units
from pikanid.model.operations import Operations
from pikanid.model.parts import Formula, State

M = TypeVar("M", bound=Operations)


@dataclass(frozen=True)
class HalfDerivative:
    """Rates ω_k (K,) [rad/s], weights w_k (K,) and w_0, and the largest relative error."""

    rates: np.ndarray
    weights: np.ndarray
    constant: float
    error: float


def design(band: tuple[float, float], order: int) -> HalfDerivative:
    """Fit `order` filters to (iω)^½ over band = (ω_low, ω_high) [rad/s].

    >>> design((1.0, 1000.0), 10).error < 2e-3
    True
    """
    low, high = band
    if not 0 < low < high or order < 2:
        raise errors.BadModel(errors.bad_value(
            "The band of a half-derivative", band, "two rising positive frequencies in rad/s, with "
            "an order of at least 2"))
    # a decade beyond the band at both ends: there the truncated tail would show first
    rates = np.geomspace(low / 10, high * 10, order)
    omega = np.geomspace(low, high, 40 * order)
    target = np.sqrt(1j * omega)
    columns = [np.ones(len(omega), complex), *(1j * omega / (1j * omega + r) for r in rates)]
    relative = np.stack(columns, axis=1) / target[:, None]
    rows = np.concatenate([relative.real, relative.imag])
    right = np.concatenate([np.ones(len(omega)), np.zeros(len(omega))])
    weights, *_ = np.linalg.lstsq(rows, right, rcond=None)
    error = float(np.max(np.abs(relative @ weights - 1)))
    return HalfDerivative(rates, weights[1:], float(weights[0]), error)


def with_half_derivative(model: M, of: Formula, name: str, band: tuple[float, float],
                         order: int = 10) -> tuple[M, sp.Expr]:
    """Add the states of D^½ of a formula; returns the new model and the formula of D^½.

    The filters start in equilibrium with the formula's initial value, as if it had always had it.

    Args:
        of: Formula of states, inputs and parameters, for example ``"theta_dot"``.
        name: Prefix of the new states ``<name>_0 ...``.
        band: Frequencies [rad/s] between which the approximation holds.
        order: Number of states.

    >>> from pikanid.model.systems import sloshing
    >>> model, half = with_half_derivative(sloshing(), "theta_dot", "memory", (1.0, 300.0), 6)
    >>> len(model.states)
    8
    """
    found = design(band, order)
    z = model.formula(of, f"the half-derivative '{name}'")
    start = z.xreplace({symbol(s.name): s.initial for s in model.states})
    unit = model_units.of_formula(model, z)
    expression: sp.Expr = found.constant * z
    for k, (rate, weight) in enumerate(zip(found.rates, found.weights, strict=True)):
        state = symbol(f"{name}_{k}")
        model = model.with_state(State(state.name, unit, start), float(rate) * (z - state))
        expression += float(weight) * (z - state)
    return model, expression
