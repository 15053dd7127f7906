"""Liquid in an upright cylinder by multimodal potential flow: a slosh truth that is no pendulum.

The surface elevation is η(r, φ, t) = Σ η_n(t) ψ_n(r, φ) with the natural modes of the cylinder,
radial wave numbers k_n = ξ_n/R.  Planar modes ψ = N J₁(k r) cos φ have J₁'(ξ) = 0, ξ = 1.841,
5.331, 8.536.  With orthonormal modes (mean square 1 over the surface) and per unit of ρS,

    T = ½ Σ a_n η_n'² + ½ Σ a_lmn η_l η_m' η_n',     V = ½ g Σ η_n² + a_x Σ x_n η_n,
    a_n = 1/(k_n tanh k_n h),    a_lmn = <ψ_l ψ_m ψ_n> - a_m a_n <ψ_l ∇ψ_m·∇ψ_n>,

the Lagrangian of J. W. Miles (J. Fluid Mech. 75, 1976) up to third order in the amplitudes.  The
first planar mode is coupled to the axisymmetric mode J₀ (ξ = 3.832) and to the mode J₂ cos 2φ
(ξ = 3.054), which it drives at second order and which bend its frequency; the second and the third
planar mode stay linear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import jnp_zeros, jv

from pikanid.validation.concealed.arrays import Array

GRAVITY = 9.81  # definition: of the earth [m/s²]
# Azimuthal order, and which zero of its Bessel function's derivative: three planar modes, then
# the two that the first one drives.
MODES = ((1, 1), (1, 2), (1, 3), (0, 1), (2, 1))  # definition: of the sloshing liquid
PLANAR = 3  # definition: number of the first of them


@dataclass(frozen=True)
class Tank:
    """An upright cylinder partly filled with liquid.

    Attributes:
        radius: R [m].
        depth: h of the liquid at rest [m].
        ratios: Damping ratios of the five modes.
        contact_line: Dry friction of the contact line on the first mode, as the elevation at the
            wall that it can hold [m].
        tilt: Of the container about y [rad].

    >>> paper = Tank(0.033, 0.090)
    >>> round(float(paper.frequencies[0]), 2), round(paper.length, 4)
    (3.72, 0.0179)
    """

    radius: float
    depth: float
    ratios: tuple[float, ...] = (0.01, 0.015, 0.02, 0.02, 0.02)
    contact_line: float = 0.0
    tilt: float = 0.0

    @property
    def inertias(self) -> Array:
        """(5,) a_n [m]."""
        k = np.array([zero(*mode) for mode in MODES]) / self.radius
        return 1.0 / (k * np.tanh(k * self.depth))

    @property
    def frequencies(self) -> Array:
        """(5,) natural frequencies √(g k_n tanh k_n h)/2π [Hz]."""
        return np.sqrt(GRAVITY / self.inertias) / (2 * math.pi)

    @property
    def length(self) -> float:
        """Length of the pendulum that swings like the first mode [m]."""
        return float(self.inertias[0])

    @property
    def offsets(self) -> Array:
        """(3,) x_n = <x ψ_n> of the planar modes [m]: how much a push along x drives each.

        From the expansion r = Σ 2R/(ξ² - 1) J₁(ξ r/R)/J₁(ξ).
        """
        return np.array([
            2 * self.radius / (zero(*mode) ** 2 - 1) / shape(*mode, 1.0)
            for mode in MODES[:PLANAR]])

    @property
    def couplings(self) -> Array:
        """(2, 2) a_s11 and a_11s of the J₀ and the J₂ mode [-].

        Green's identity leaves one integral: <ψ_1 ∇ψ_1·∇ψ_s> = ½ k_s² C and
        <ψ_s ∇ψ_1·∇ψ_1> = (k_1² - ½ k_s²) C with C = <ψ_1 ψ_1 ψ_s>.
        """
        a, k = self.inertias, [zero(*mode) / self.radius for mode in MODES]
        return np.array([
            [_triple(s) * (1 - a[0] * a[0] * (k[0] ** 2 - k[s] ** 2 / 2)),
             _triple(s) * (1 - a[0] * a[s] * k[s] ** 2 / 2)]
            for s in (3, 4)])

    def settings(self) -> Array:
        """(20,) what the compiled equations need, in their order."""
        a = self.inertias
        held = GRAVITY * self.contact_line / shape(1, 1, 1.0)
        return np.concatenate([
            [GRAVITY, held, GRAVITY * math.sin(self.tilt)], a,
            2 * np.array(self.ratios) * np.sqrt(GRAVITY / a), self.offsets,
            self.couplings.ravel()])

    def rest(self) -> Array:
        """(10,) the state at rest: the surface is level, the container may be tilted."""
        x = np.zeros(2 * len(MODES))
        x[0 : 2 * PLANAR : 2] = -math.sin(self.tilt) * self.offsets
        return x


def radius_for(length: float, depth: float) -> float:
    """R [m] of the cylinder whose first mode swings like a pendulum of that length [m].

    >>> round(radius_for(0.045, 0.090), 4)
    0.0802
    """
    return float(brentq(lambda r: Tank(r, depth).length - length, 0.1 * length, 20 * length,
                        xtol=1e-14))


@cache
def zero(order: int, number: int) -> float:
    """The zero ξ of J_order' that belongs to a mode; the trivial one of J₀' is no mode.

    >>> [round(zero(1, n), 3) for n in (1, 2, 3)]
    [1.841, 5.331, 8.536]
    """
    return float(jnp_zeros(order, number)[-1])


@cache
def _norm(order: int, number: int) -> float:
    xi = zero(order, number)
    # ∫₀¹ J_m(ξr)² r dr = ½ (1 - m²/ξ²) J_m(ξ)² at a zero of J_m'.
    square = 0.5 * (1 - (order / xi) ** 2) * float(jv(order, xi)) ** 2
    return 1 / math.sqrt(square * (2 if order == 0 else 1))


def shape(order: int, number: int, r: float) -> float:
    """Radial part of ψ at r, a share of the radius."""
    return _norm(order, number) * float(jv(order, zero(order, number) * r))


@cache
def _triple(s: int) -> float:
    """C = <ψ_1 ψ_1 ψ_s>."""
    found, _ = quad(lambda r: shape(1, 1, r) ** 2 * shape(*MODES[s], r) * r, 0, 1,
                    epsabs=1e-13, epsrel=1e-13)
    # The mean of cos²φ over the circle, and that of cos²φ cos 2φ: π and π/2 over π.
    return float(found) * (1.0 if MODES[s][0] == 0 else 0.5)
