"""What can go wrong while a model is simulated and fitted."""

from __future__ import annotations

from collections.abc import Sequence

from pikanid.errors.wording import listed


def not_finite(time: float, values: str) -> str:
    return (f"The simulation leaves the finite numbers near t = {time:g} s at {values}: "
            "start from other parameter values, or tighten the bounds.")


def too_many_events(time: float) -> str:
    return (f"The model switches without end near t = {time:g} s (over 1000 events in one step): "
            "a non-smooth term chatters; check its sign.")


def degree_too_low(degree: int, order: int) -> str:
    return (f"Splines of degree {degree} have no derivative of order {order} to compare with the "
            f"model: choose degree >= {order + 1}, or form='state'.")


def relaxation_cannot_see(names: Sequence[str], why: str) -> str:
    return (f"A relaxation cannot estimate {listed(names)} ({why}): fix it, or fit with the "
            "strategy NLS, which simulates the model.")


def smoothing_undetermined(names: Sequence[str]) -> str:
    return ("PDA fits splines to the data alone, but the outputs do not determine "
            f"{listed(names)}: use the strategy iPDA or NLS, which also use the physics there.")


def relaxation_locked(lam: float, kept: float) -> str:
    return (f"λ stays at {kept:.3g}: at {lam:.3g} these splines could no longer follow the "
            "physics. For less bias use more intervals (or IPDA, whose default knots do not lock).")


def curve_follows_data(effective: float, count: int, lam: float) -> str:
    return (f"The curve uses {effective:.0f} degrees of freedom for {count} parameters, even at λ "
            f"= {lam:.3g}: it follows the data rather than the equations, which do not fit them. "
            "Estimates differ from those of NLS, and standard errors are too small; compare with "
            "NLS.")


def relaxation_smears() -> str:
    return ("The model is not smooth (sign, abs, clip ...): splines smear its switches, which "
            "biases the parameters. Compare with the strategy NLS.")


def relaxation_stuck(lam: float, kept: float) -> str:
    return (f"λ stays at {kept:.3g}: at {lam:.3g} the fit got no further. The estimate may still "
            "be biased towards the splines; compare it with the strategy NLS.")


def grid_not_settled(gap: float, intervals: int) -> str:
    return (f"With {intervals} intervals, the last halving still moved a parameter by {gap:.2g} "
            "standard errors: the discretisation bias is not negligible. Set more intervals.")


def estimate_not_simulated() -> str:
    return ("The model cannot be simulated at the estimate, so that residuals are those of the "
            "fitted splines: the parameters are not to be trusted.")


def not_converged(lam: float) -> str:
    return (f"Gauss-Newton stopped before it converged at λ = {lam:.3g}: start nearer, or tighten "
            "the bounds.")



def no_such_device(device: str) -> str:
    return f"There is no device '{device}' here: choose device='cpu'."


def descent_diverged(steps: int) -> str:
    return (f"The loss left the finite numbers after {steps} steps: the best iterate until then is "
            "kept. Lower the learning rate, or tighten the bounds.")


def newton_stopped(iterations: int, move: float) -> str:
    return (f"The fit still moved a parameter by {move:.2g} standard errors when its {iterations} "
            "iterations were used up: allow more, or another seed.")


def network_smears_switches(count: int, most: int) -> str:
    return (f"The inputs switch {count} times, more than the {most} kinks that a network is given: "
            "it smears them, which biases the parameters. Compare with the strategy NLS.")


def covariance_unknown() -> str:
    return ("The network can follow the data whatever the parameters are, so that standard errors "
            "are not known: use fewer units, or more data.")


def curve_misleads(name: str, value: float, reference: float, std: float, residual: float,
                   unit: str) -> str:
    share = abs(value - reference) / max(abs(reference), 1e-300)
    errors_apart = abs(value - reference) / std if std > 0 else float("inf")
    # On clean data every difference is any number of standard errors.
    how = (f"{errors_apart:.2g} standard errors" if errors_apart < 1e4 else f"{100 * share:.2g} %")
    return (
        f"The loss is low (the curve is within {residual:.2g} of the data) but '{name}' is not "
        f"where the data want it: {value:.5g} {unit}".rstrip()
        + f" here, {reference:.5g} by simulation from here (NLS), {how} apart. The curve has "
        "absorbed the difference: trust NLS."
    )


def bad_start(undefined: str = "") -> str:
    if undefined:
        return (f"The model cannot be simulated: {undefined}. A logarithm, a root or a quotient in "
                "its equation must have a value there, or another one begin.")
    return ("The model cannot be simulated from any starting point: give other guesses or narrower "
            "bounds.")


def fit_diverged(where: str) -> str:
    return (f"The fit broke down {where}, where the model's right-hand side or its cost was not "
            "finite: the best iterate before that is kept. Try other guesses or bounds, or a "
            "larger first grid.")


def lbfgs_stopped(steps: int, gradient: float) -> str:
    return (f"L-BFGS stopped after {steps} steps with a gradient of norm {gradient:.2g}: it is not "
            "at a minimum, and the estimate depends on where it stopped.")
