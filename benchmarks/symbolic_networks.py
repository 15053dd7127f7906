"""Whole networks: trained on noisy points, then read; pykan's `auto_symbolic` on the same model."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from pikanid.approximators.kan import build_kan
from pikanid.approximators.kan.train import PointFit, fit_points
from pikanid.formula.expressions import parse, symbol
from pikanid.symbolic import extract
from pikanid.symbolic.reading import Reading

POINTS = 1000
NOISE = 0.02
RESTARTS = 3
INPUTS = ("theta", "omega")


@dataclass(frozen=True)
class Network:
    """A law, the width of the KAN that learns it, and its form with every constant at one."""

    label: str
    law: Callable[[np.ndarray, np.ndarray], np.ndarray]
    width: tuple[Any, ...]
    form: str


NETWORKS = (
    Network("sin 3θ + ω³", lambda a, b: np.sin(3 * a) + b**3, (2, 1), "sin(theta) + omega**3"),
    Network("exp(sin πθ + ω²)", lambda a, b: np.exp(np.sin(np.pi * a) + b**2), (2, 1, 1),
            "exp(sin(theta) + omega**2)"),
    Network("θ²·ω", lambda a, b: a**2 * b, (2, (0, 1), 1), "theta**2*omega"),
)


def train(width: tuple[Any, ...], x: np.ndarray, y: np.ndarray, grid: int = 8,
          restarts: int = RESTARTS) -> PointFit:
    """The best of a few starts."""
    low, high = float(x.min()), float(x.max())
    ranges = [(low, high)] + [(-3.0, 3.0)] * (len(width) - 2)
    fits = [fit_points(build_kan([list(w) if isinstance(w, tuple) else w for w in width], grid=grid,
                                 grid_range=ranges, seed=seed), x, y) for seed in range(restarts)]
    return min(fits, key=lambda f: float(f.residual @ f.residual))


def bare(expression: sp.Expr, constants: tuple[str, ...]) -> sp.Expr:
    """A formula with its offsets at zero and its other constants at one."""
    numbers = {symbol(n): sp.Integer(0 if n.split("_")[0] == "d" else 1) for n in constants}
    return sp.expand_power_base(sp.simplify(expression.xreplace(numbers)))


def same_form(reading: Reading, form: str) -> bool:
    """Whether a reading has this form, whatever its constants."""
    wanted = parse(form, set(reading.inputs), "the truth")
    return bool(reading.ok and sp.simplify(bare(reading.expression, reading.names) - wanted) == 0)


def data(label: str, seed: int) -> tuple[Network, np.ndarray, np.ndarray, np.ndarray]:
    """The law, x (1000, 2) on [-1, 1]², clean y and noisy y."""
    network = next(n for n in NETWORKS if n.label == label)
    generator = np.random.default_rng(seed)
    x = generator.uniform(-1.0, 1.0, (POINTS, 2))
    clean = network.law(*x.T)
    return network, x, clean, clean + NOISE * clean.std() * generator.normal(size=POINTS)


def run_network(label: str, seed: int) -> dict[str, Any]:
    """Trained and read."""
    network, x, clean, y = data(label, seed)
    fit = train(network.width, x, y)
    begun = time.process_time()
    reading = extract(fit.kan, x, y, inputs=INPUTS)
    return {"exact": same_form(reading, network.form), "ok": reading.ok,
            "formula": str(reading.expression), "seconds": time.process_time() - begun,
            "error": float(np.sqrt(np.mean((reading(x) - clean) ** 2)) / clean.std()),
            "probability": reading.probability}


def run_pykan_network(label: str, seed: int) -> dict[str, Any]:
    """`auto_symbolic` as it comes, on the same trained model, then pykan's own refit."""
    import torch

    network, x, clean, y = data(label, seed)
    kan = train(network.width, x, y).kan
    kan.save_act = True
    kan(torch.from_numpy(x[:200]))
    begun = time.process_time()
    kan.auto_symbolic(verbose=0)
    points = {"train_input": torch.from_numpy(x), "train_label": torch.from_numpy(y[:, None]),
              "test_input": torch.from_numpy(x), "test_label": torch.from_numpy(y[:, None])}
    kan.fit(points, opt="LBFGS", steps=20, log=1000)
    with torch.no_grad():
        value = kan(torch.from_numpy(x)).numpy()[:, 0]
    names = [[str(f) for row in layer.funs_name for f in row] for layer in kan.symbolic_fun]
    error = float(np.sqrt(np.mean((value - clean) ** 2)) / clean.std())
    return {"names": names, "error": error, "seconds": time.process_time() - begun}
