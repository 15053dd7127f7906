"""Spectral bias: how well a network of the paper's kind learns a sine of a given frequency."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from pikanid.approximators.bspline import BSpline, knots_from_breakpoints
from pikanid.approximators.mlp import MLP
from pikanid.optimise import gradient
from pikanid.strategies.pinn_fit import PAPER_HIDDEN, PAPER_SPREAD

FREQUENCIES = (0.5, 1.0, 2.0, 4.0, 8.0)  # [Hz] over 5 s
STEPS = (2000, 200)  # of Adam and L-BFGS, on data alone
HORIZON, SAMPLES, INTERVALS = 5.0, 501, 80


def left_over(seeds: int) -> dict[str, np.ndarray]:
    """RMSE of fits to sines of size one: network (frequency, seed), cubic spline (frequency,)."""
    t = np.linspace(0.0, HORIZON, SAMPLES)
    net = MLP(0.0, HORIZON, 0, PAPER_HIDDEN)
    table = net.at(t, 0)
    knots = knots_from_breakpoints(np.linspace(0.0, HORIZON, INTERVALS + 1), 3)
    matrix = BSpline(3, knots).basis(t).toarray()
    network, spline = np.empty((len(FREQUENCIES), seeds)), np.empty(len(FREQUENCIES))
    for i, frequency in enumerate(FREQUENCIES):
        y = np.sin(2 * np.pi * frequency * t)
        spline[i] = np.sqrt(np.mean((matrix @ np.linalg.lstsq(matrix, y)[0] - y) ** 2))
        wanted = torch.tensor(y)

        def loss(z: Tensor, wanted: Tensor = wanted) -> tuple[Tensor, Tensor]:
            return (table.jet(z)[0] - wanted).square().mean(), z.new_zeros(()) * z.sum()

        for seed in range(seeds):
            start = net.initial(seed, PAPER_SPREAD)
            with gradient.one_thread():
                first = gradient.adam(loss, start, steps=STEPS[0], goal=0.0,
                                      weight=gradient.Ramp(0.0, 0.0, STEPS[0]))
                second = gradient.lbfgs(loss, first.z, steps=STEPS[1], lam=0.0)
            network[i, seed] = np.sqrt(min(first.data, second.data))
    return {"network": network, "spline": spline}
