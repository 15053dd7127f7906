"""Eq. (5) as iPDA writes it: SciPy's basis matrices, the chain rule by hand."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
from scipy.interpolate import BSpline

from pikanid.validation.equivalence.setting import Array, Setting


@dataclass(frozen=True, eq=False)
class Matrices:
    """B at the data, and B, Ḃ, B̈ at the collocation points, each (points, functions)."""

    data: Array
    values: Array
    rates: Array
    accelerations: Array


def design(setting: Setting, knots: Array) -> Matrices:
    """The matrices of Eq. (5) on a knot sequence, joined by the kink functions."""
    tau = setting.collocation_times
    data = BSpline.design_matrix(setting.data_times, knots, setting.degree).toarray()
    values = BSpline.design_matrix(tau, knots, setting.degree).toarray()
    every = BSpline(knots, np.eye(knots.size - setting.degree - 1), setting.degree)
    return Matrices(np.hstack([data, _kinks(setting, setting.data_times, 0)]),
                    np.hstack([values, _kinks(setting, tau, 0)]),
                    np.hstack([every.derivative(1)(tau), _kinks(setting, tau, 1)]),
                    np.hstack([every.derivative(2)(tau), _kinks(setting, tau, 2)]))


class IpdaObjective:
    """L(c, p) = ‖y - Bc‖² + λ‖Ḃc - F(B_τ c, p)‖², its gradient and Gauss-Newton matrix.

    Args:
        setting: The case.
        knots: Knots (G + 2k + 1,) that the KAN has, or others.
    """

    def __init__(self, setting: Setting, knots: Array) -> None:
        self.setting = setting
        self.matrices = design(setting, knots)
        self._excitation = setting.model.excitation(setting.collocation_times)

    def residuals_and_jacobian(self, unknowns: Array) -> tuple[Array, Array]:
        """Residuals (R,), ordered as the KAN's, and their Jacobian (R, unknowns)."""
        rows, outputs = self.setting.shape
        table = unknowns[: rows * outputs].reshape(rows, outputs)
        parameters = unknowns[rows * outputs :]
        m, root = self.matrices, np.sqrt(self.setting.weight)
        if self.setting.form == "state":
            x, v = m.values @ table[:, 0], m.values @ table[:, 1]
            physics = [m.rates @ table[:, 0] - v, m.rates @ table[:, 1]]
        else:
            x, v = m.values @ table[:, 0], m.rates @ table[:, 0]
            physics = [m.accelerations @ table[:, 0]]
        model = self.setting.model
        physics[-1] = physics[-1] - model.acceleration(x, v, self._excitation, parameters)
        by_x, by_v, by_p = model.slopes(x, v, self._excitation, parameters)
        none = np.zeros((x.size, parameters.size))
        if self.setting.form == "state":
            first, second = np.eye(2)
            blocks = [
                np.hstack([-np.kron(m.data, first), np.zeros((len(m.data), parameters.size))]),
                root * np.hstack([np.kron(m.rates, first) - np.kron(m.values, second), none]),
                root
                * np.hstack(
                    [
                        np.kron(m.rates - by_v[:, None] * m.values, second)
                        - np.kron(by_x[:, None] * m.values, first),
                        -by_p,
                    ]
                ),
            ]
        else:
            linear = m.accelerations - by_x[:, None] * m.values - by_v[:, None] * m.rates
            blocks = [
                np.hstack([-m.data, np.zeros((len(m.data), parameters.size))]),
                root * np.hstack([linear, -by_p]),
            ]
        misfit = self.setting.data - m.data @ table[:, 0]
        return np.concatenate([misfit, root * np.concatenate(physics)]), np.vstack(blocks)

    def value_and_gradient(self, unknowns: Array) -> tuple[float, Array]:
        """L and its gradient 2 Jᵀr."""
        residuals, jacobian = self.residuals_and_jacobian(unknowns)
        return float(residuals @ residuals), 2.0 * jacobian.T @ residuals


def _kinks(setting: Setting, t: Array, derivative: int) -> Array:
    columns = [
        np.where(t >= centre, np.abs(t - centre) ** (order - derivative), 0.0)
        / factorial(order - derivative)
        for centre in setting.kinks
        for order in (2, 3)
    ]
    return np.array(columns).reshape(-1, t.size).T
