"""The comparison of both derivations, and the list of settings it is made for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from pikanid.validation.equivalence.agreement import GRADIENTS, MATRICES, difference
from pikanid.validation.equivalence.ipda import IpdaObjective
from pikanid.validation.equivalence.optimisers import Path, adam, lbfgs, levenberg_marquardt
from pikanid.validation.equivalence.report import Check, EquivalenceReport
from pikanid.validation.equivalence.setting import Array, Form, Setting

MINIMISERS = 1e-8  # numerical: rounding, enlarged by the condition of the problem
_STEPS = 20  # definition: iterates that are compared

_SHALLOW = "shallow KAN = Eq. (5)"


def run_checks(*, quick: bool = False, seed: int = 0,
               progress: Callable[[str], None] | None = None) -> EquivalenceReport:
    """Every check of the equivalence.

    Args:
        quick: A third of the settings, which hold every value of each option, and 20
            Levenberg-Marquardt steps instead of all (most minimisers are then left out).
        seed: Of coefficients, parameters, noise and random grids.
        progress: Called with a few words before every part; the whole takes about a minute,
            `quick` a third of it.
    """
    from pikanid.validation.equivalence.controls import controls, quadratic_at_the_end, uniqueness
    from pikanid.validation.equivalence.deep import tangent_step
    from pikanid.validation.equivalence.delivery import delivered_curve

    parts: list[tuple[str, Callable[[], tuple[Check, ...]]]] = [
        *((s.describe(), partial(compare, s)) for s in settings(seed, quick=quick)),
        *(
            (f"optimisers: {setting.describe()}", partial(compare_paths, setting, quick=quick))
            for setting in optimised(seed)
        ),
        ("uniqueness", partial(uniqueness, seed)),
        ("KAN handed over", partial(delivered_curve, seed)),
        ("deep KANs", partial(tangent_step, seed, quick=quick)),
        ("negative controls", partial(controls, seed)),
        ("degree 2 at the end", partial(quadratic_at_the_end, seed)),
    ]
    rows: list[Check] = []
    for name, part in parts:
        if progress is not None:
            progress(name)
        rows += part()
    return EquivalenceReport(tuple(rows))


def settings(seed: int = 0, *, quick: bool = False) -> Iterator[Setting]:
    """Degrees 2-5 (second-order form 3-5), both systems and forms, varied grids, T and λ.

    ``quick`` takes one grid for each degree, another one for the next, so that all come up in
    both systems and forms, kinks too.
    """
    grids = ((5, 2.0, 1e-4), (40, 5.0, 1.0), (17, 8.0, 10.0))
    points = ((41, 81, True), (51, 121, False), (201, 161, True))
    number = 0
    forms: tuple[Form, ...] = ("state", "second-order")
    for system in ("sloshing", "duffing"):
        for form in forms:
            for degree in range(2 if form == "state" else 3, 6):
                turn = (number // len(grids) + 1) % len(grids)
                for place, ((grid, horizon, weight), (n, m, even)) in enumerate(
                    zip(grids, points, strict=True)):
                    kinks = (0.2, 0.6, 1.2, 1.6) if degree > 3 and grid == 40 else ()
                    if not quick or place == turn:
                        yield Setting(system, form, degree, grid, horizon, weight, samples=n,
                                      collocation=m, even=even, kinks=kinks, seed=seed + number)
                    number += 1


def optimised(seed: int = 0) -> Iterator[Setting]:
    """Settings whose optimisation is followed: minimisers that are finite, and one that is not."""
    yield Setting("duffing", "state", 3, 12, 5.0, 1e-1, seed=seed)
    yield Setting("duffing", "second-order", 4, 12, 5.0, 1e-1, even=False, seed=seed)
    yield Setting("sloshing", "state", 4, 30, 5.0, 1e-3, seed=seed)
    yield Setting("sloshing", "second-order", 5, 30, 5.0, 1e-5, seed=seed)
    yield Setting("sloshing", "second-order", 5, 30, 5.0, 1e-4, kinks=(0.2, 0.6, 1.2, 1.6),
                  seed=seed)
    # λ and grid of the paper's last stage: here the minimiser has l beyond all bounds.
    yield Setting("sloshing", "second-order", 3, 40, 5.0, 1.0, 151, 151, seed=seed)


def compare(setting: Setting) -> tuple[Check, ...]:
    """Value, gradients and Gauss-Newton matrix at one random point."""
    from pikanid.validation.equivalence.network import NetworkLoss

    network = NetworkLoss(setting)
    objective = IpdaObjective(setting, network.knots)
    unknowns = setting.unknowns()
    value_a, gradient_a = network.value_and_gradient(unknowns)
    value_b, gradient_b = objective.value_and_gradient(unknowns)
    _, jacobian_a = network.residuals_and_jacobian(unknowns)
    _, jacobian_b = objective.residuals_and_jacobian(unknowns)
    split = setting.shape[0] * setting.shape[1]
    return tuple(
        Check(_SHALLOW, setting.describe(), quantity, difference(a, b), tolerance)
        for quantity, a, b, tolerance in (
            ("loss", np.array(value_a), np.array(value_b), MATRICES),
            ("gradient in c", gradient_a[:split], gradient_b[:split], GRADIENTS),
            ("gradient in p", gradient_a[split:], gradient_b[split:], GRADIENTS),
            ("Jacobian", jacobian_a, jacobian_b, MATRICES),
            (
                "Gauss-Newton matrix",
                jacobian_a.T @ jacobian_a,
                jacobian_b.T @ jacobian_b,
                MATRICES,
            ),
        )
    )


def compare_paths(setting: Setting, *, quick: bool = False) -> tuple[Check, ...]:
    """The same optimisers from the same start: 20 iterates of each, and the minimiser if finite."""
    from pikanid.validation.equivalence.network import NetworkLoss

    network = NetworkLoss(setting)
    objective = IpdaObjective(setting, network.knots)
    start = setting.unknowns(0.01)
    basis, outputs = objective.matrices.values, setting.outputs
    losses = (network.value_and_gradient, objective.value_and_gradient)
    residuals = (network.residuals_and_jacobian, objective.residuals_and_jacobian)
    # From λ = 1 on the minimiser is at infinity: more steps only follow it there.
    most = _STEPS if quick or setting.weight >= 1.0 else 160
    paths = {
        "L-BFGS": tuple(lbfgs(loss, start, _STEPS) for loss in losses),
        "Adam": tuple(adam(loss, start, _STEPS) for loss in losses),
        "Levenberg-Marquardt": tuple(levenberg_marquardt(r, start, most) for r in residuals),
    }
    rows = []
    for name, (a, b) in paths.items():
        found = apart(a.first(_STEPS), b.first(_STEPS), basis, outputs)
        quantity = f"{_STEPS} iterates of {name}"
        rows.append(Check(_SHALLOW, setting.describe(), quantity, found, MINIMISERS))
        if a.converged and b.converged:
            found = apart(a.last(), b.last(), basis, outputs)
            rows.append(Check(_SHALLOW, setting.describe(), "minimiser", found, MINIMISERS))
    return tuple(rows)


def apart(a: Path, b: Path, basis: Array, outputs: int) -> float:
    """Largest relative difference of curve or parameters over two paths; infinite if one is longer.

    Curves, not coefficients, are compared: beside kinks, whose functions grow over the whole
    record, coefficients are known only to the condition of the basis.  A path that ends by
    convergence may end a step earlier than the other.
    """
    shared = min(len(a.iterates), len(b.iterates))
    if len(a.iterates) != len(b.iterates) and not (a.converged and b.converged):
        return float("inf")
    worst = 0.0
    split = basis.shape[1] * outputs
    for x, y in zip(a.iterates[:shared], b.iterates[:shared], strict=True):
        curves = (basis @ z[:split].reshape(-1, outputs) for z in (x, y))
        worst = max(worst, difference(*curves), difference(x[split:], y[split:]))
    return worst
