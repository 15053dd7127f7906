"""The settings of a PINN, and what they must keep to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pikanid import errors
from pikanid.problem.chains import Form
from pikanid.settings import of_kind
from pikanid.strategies.settings import CLIMB, ClimbSettings

Progress = Callable[[dict[str, float]], None]
PAPER_RATE = 3e-3  # definition: Adam's; Table II names none


@dataclass(frozen=True)
class PinnSettings:
    """See `pikanid.strategies.PINN`."""

    protocol: Literal["default", "paper"] = "default"
    optimiser: Literal["gauss_newton", "gradient"] | None = None
    hidden: tuple[int, ...] | None = None
    form: Form = "second_order"
    lam: float | None = None
    balance: Literal["none", "gradnorm"] = "none"
    hard_initial: bool | None = None
    exact_switches: bool | None = None
    collocation: int | None = None
    steps: int | tuple[int, int] | None = None
    learning_rate: float = PAPER_RATE
    seed: int = 0
    device: str = "cpu"
    progress: Progress | None = None
    settings: ClimbSettings = CLIMB


def uses_newton(settings: PinnSettings) -> bool:
    """Whether Gauss-Newton fits the network, rather than Adam and L-BFGS."""
    usual = "gradient" if settings.protocol == "paper" else "gauss_newton"
    return (settings.optimiser or usual) == "gauss_newton"


def check(settings: PinnSettings) -> None:
    """Raise `BadSetting` unless the settings can work."""
    of_kind(settings.settings, ClimbSettings)
    newton = uses_newton(settings)
    wanted = "a whole number" if newton else "two whole numbers, (Adam, L-BFGS)"
    steps = settings.steps
    if steps is not None and (isinstance(steps, int) is not newton or np.min(steps) < 1):
        raise errors.BadSetting(errors.bad_value("steps", steps, f"{wanted}, at least 1"))
    if settings.lam is not None and not settings.lam > 0.0:
        raise errors.BadSetting(errors.bad_value("lam", settings.lam, "positive"))
    if settings.hidden is not None and (not settings.hidden or min(settings.hidden) < 1):
        raise errors.BadSetting(errors.bad_value("hidden", settings.hidden, "units of each layer"))
    if settings.collocation is not None and settings.collocation < 2:
        raise errors.BadSetting(errors.bad_value("collocation", settings.collocation, "2 or more"))
    if not settings.learning_rate > 0.0:
        raise errors.BadSetting(
            errors.bad_value("learning_rate", settings.learning_rate, "positive"))
