"""Is it the grid or the model that resists the physics?"""

from __future__ import annotations

from pikanid.optimise.gauss_newton import BandedSystem, Linearisation, gauss_newton

STIFF, STIFFEST = 1e10, 1e16  # numerical: λ that makes a trajectory solve its equations
# A handful do from the λ before, two dozen for a tank that runs empty; where rounding at such a λ
# promises decreases for ever, more of them find nothing.
ITERATIONS = 50  # limit: at one λ


def follows_physics(system: BandedSystem, at: Linearisation, lam: float) -> bool:
    """Whether the splines can solve the model's equations at the present θ, as λ asks.

    With θ held, a larger and larger λ moves the trajectory alone, until what is left of the physics
    is the splines' own; below one datum's share of what is then left of the data, it locks nothing.
    """
    stiff = max(lam, STIFF)
    while stiff <= STIFFEST:
        held = gauss_newton(system, at, stiff, at.point.theta, at.point.theta,
                            iterations=ITERATIONS)
        left = held.at.physics_cost * lam / stiff
        if left <= held.at.data_cost / system.functional.n_data:
            return True
        at, stiff = held.at, 100.0 * stiff
    return False
