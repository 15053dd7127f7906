"""PINN: tanh networks and parameters fitted together to data and physics (Eq. 2).

The approximator of Table I is a multi-layer perceptron.  Table II's protocol descends gradients:
Adam with λ rising, then L-BFGS.  The default gives the network what it lacks (the initial state and
the kinks at input switches, exactly) and takes damped Gauss-Newton steps, λ climbing as far as the
network can follow.  Either way the result is held against a simulation, because a low loss says
little about the parameters; a network that it contradicts is started anew from other weights.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from pikanid.estimate import Estimate
from pikanid.model import Model
from pikanid.problem.problem import Problem
from pikanid.recording import Recording
from pikanid.strategies.pinn_fit import PinnFit, fit_network
from pikanid.strategies.pinn_settings import PinnSettings, check, uses_newton
from pikanid.strategies.relaxed_estimate import assemble
from pikanid.strategies.settings import recorded


@dataclass(frozen=True)
class PINN(PinnSettings):
    """Physics-informed neural network.

    Args:
        protocol: "default"; or "paper": Table II, joint gradient descent on plain networks.  None
            elsewhere leaves the choice to it.
        optimiser: "gauss_newton", or "gradient" (Adam, then L-BFGS).
        hidden: Units of the hidden layers.
        form: "second_order" or "state", as in `IPDA`.
        lam: The (final) λ; under "paper" the physics residual counts in the unit of the state (time
            in units of the fastest linearised motion), else λ is dimensionless as in `IPDA`.  None
            lets Gauss-Newton raise it as far as the network can follow.
        balance: "gradnorm" sets λ during Adam, and for L-BFGS, so that both losses pull equally
            hard.
        hard_initial: The initial state holds exactly; else nothing is known of it.
        exact_switches: Add the kinks of the trajectory at up to 32 input switches.
        collocation: Number of evenly spaced points for the physics; None: Gauss nodes.
        steps: Of Gauss-Newton in all, or of (Adam, L-BFGS).
        learning_rate: Of Adam.
        seed: Of the starting weights; where λ climbs and a simulation contradicts the network, the
            next seeds are tried (`settings.starts` in all) and the best of them is kept.
        device: "cpu", or "cuda" where present.
        progress: Called with step, lam, data and physics (the two parts of the loss).
        settings: When λ has climbed far enough, and when the curve misleads.

    Bounds of parameters hold exactly: Adam is put back onto them, L-BFGS-B and Gauss-Newton keep
    to them.

    >>> import numpy as np, pikanid as pk
    >>> model = pk.systems.sloshing()
    >>> rec = pk.simulate(model, pk.excitation.two_pulse(), sigma=0.1*np.pi/180, seed=0)
    >>> short = PINN(protocol="paper", steps=(5, 5))
    >>> est = short.fit(model.with_values(l_theta=0.06, d_theta=0.05), rec)
    >>> est.approximator.states(np.array([0.0, 1.0])).shape
    (2, 2)
    """

    name: ClassVar[str] = "pinn"
    slow: ClassVar[bool] = True

    def fit(self, model: Model, recordings: Recording | Sequence[Recording]) -> Estimate:
        """Estimate the model's free parameters from one recording, or from several jointly.

        `estimate.approximator` holds the networks and evaluates the fitted curve.

        Raises:
            BadRecording: A channel is missing or unusable.
            BadSetting: Options that cannot work, no torch, or a delay to be estimated.
        """
        begun = time.perf_counter()
        check(self)
        fit, curves, starts = self._best(Problem(model, recordings))
        return assemble(self.name, fit, {**recorded(self), **fit.settings, "starts": starts},
                        list(fit.history), begun, curves)

    def _best(self, problem: Problem) -> tuple[PinnFit, Any, int]:
        """Of networks from different weights the first that a simulation confirms, or the best; its
        curves, and how many were fitted.
        """
        climbs = uses_newton(self) and self.lam is None
        tried: list[tuple[PinnFit, Any]] = []
        for k in range(self.settings.starts if climbs else 1):
            tried.append(fit_network(problem, replace(self, seed=self.seed + k)))
            if tried[-1][0].excess <= self.settings.far**2:
                break
        return *min(tried, key=lambda one: one[0].excess), len(tried)
