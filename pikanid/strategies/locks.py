"""Is it the grid or the model that resists the physics?"""

from __future__ import annotations

from pikanid.optimise.gauss_newton import BandedSystem, Linearisation, gauss_newton

STIFF, STIFFEST = 1e10, 1e16  # numerical: λ that makes a trajectory solve its equations
# A handful do from the λ before, two dozen for a tank that runs empty.  Where rounding at such a λ
# promises decreases for ever, ten more of them gain a few thousandths of the cost.
ITERATIONS = 10  # limit: at a time
TIMES = 5  # limit: so often at one λ
RESISTS = 0.9  # numerical: of λ·P, that a stiff λ leaves where splines cannot follow
GAIN = 0.01  # numerical: of the cost, that so many iterations gain where they lead somewhere


def follows_physics(system: BandedSystem, at: Linearisation, lam: float) -> bool:
    """Whether the splines can solve the model's equations at the present θ, as λ asks.

    With θ held, a larger and larger λ moves the trajectory alone, until what is left of the physics
    is the splines' own; below one datum's share of what is then left of the data, it locks nothing.
    Splines that can follow leave little at the first such λ already, as P falls with its square.
    """
    stiff, resisting = max(lam, STIFF), RESISTS * at.physics_cost
    while stiff <= STIFFEST:
        at = _held(system, at, stiff)
        left = at.physics_cost * lam / stiff
        if left <= at.data_cost / system.functional.n_data:
            return True
        if left > resisting:
            return False
        stiff *= 100.0
    return False


def _held(system: BandedSystem, at: Linearisation, lam: float) -> Linearisation:
    """The trajectory at another λ and the same θ, as far as iterations lead somewhere."""
    theta = at.point.theta
    cost = at.cost + (lam / at.lam - 1.0) * at.physics_cost
    for _ in range(TIMES):
        found = gauss_newton(system, at, lam, theta, theta, iterations=ITERATIONS)
        at, before, cost = found.at, cost, found.at.cost
        if found.converged or before - cost < GAIN * before:
            break
    return at
