"""Single edges: which law is named, how often, how fast; pykan's own naming beside it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pikanid.symbolic import name_edge

POINTS = 1000
NOISES = (0.0, 0.01, 0.05, 0.10)
WITHIN = 9.0  # squared distance between two laws, in units of the noise, that nothing can see
NULLS = 200


@dataclass(frozen=True)
class Truth:
    """A law with the names that say exactly it, ours and pykan's (none where it has none)."""

    label: str
    law: Callable[[np.ndarray], np.ndarray]
    ours: str
    pykan: tuple[str, ...]


TRUTHS = (
    Truth("x³", lambda x: x**3, "cubic", ("x^3",)),
    Truth("x·|x|", lambda x: x * np.abs(x), "signed square", ()),
    Truth("tanh 20x", lambda x: np.tanh(20 * x), "tanh", ("tanh",)),
    Truth("sin 3x", lambda x: np.sin(3 * x), "sine", ("sin", "cos")),
    Truth("sgn x", np.sign, "sign", ("sgn",)),
    Truth("dead zone 0.3", lambda x: x - np.clip(x, -0.3, 0.3), "dead zone", ()),
    Truth("|x|^1.5 sgn x", lambda x: np.sign(x) * np.abs(x) ** 1.5, "signed power", ()),
)


def points(truth: Truth, noise: float, seed: int) -> tuple[np.ndarray, np.ndarray, float]:
    """x, y (1000,) on [-1, 1] and σ, a share of the law's standard deviation."""
    x = np.linspace(-1.0, 1.0, POINTS)
    clean = truth.law(x)
    sigma = noise * float(clean.std())
    return x, clean + sigma * np.random.default_rng(seed).normal(size=POINTS), sigma


def run_edge(label: str, noise: float, seed: int) -> dict[str, Any]:
    """One edge named by this package."""
    truth = next(t for t in TRUTHS if t.label == label)
    x, y, sigma = points(truth, noise, seed)
    begun = time.process_time()
    edge = name_edge(x, y)
    seconds = time.process_time() - begun
    clean = truth.law(x)
    floor = 1e-6 * float(clean.std())
    off = edge.best.fit.values - clean
    same = bool(np.sum(off**2) <= WITHIN * max(sigma, floor) ** 2)
    return {"name": edge.name, "exact": edge.name == truth.ours,
            "same": edge.name == truth.ours or (edge.name == edge.best.form.name and same),
            "probability": edge.probability, "seconds": seconds}


def run_null(seed: int) -> dict[str, Any]:
    """An edge of nothing but noise; every second one on random places."""
    generator = np.random.default_rng(10_000 + seed)
    x = np.sort(generator.uniform(-1, 1, POINTS)) if seed % 2 else np.linspace(-1, 1, POINTS)
    edge = name_edge(x, generator.normal(size=POINTS))
    return {"name": edge.name, "exact": edge.name == "nothing"}


def run_pykan(label: str, noise: float, seed: int) -> dict[str, Any]:
    """The same points, as the least-squares spline of a [1, 1] KAN with 20 intervals.

    pykan names what it saw last: 200 places on [-1, 1], as its time grows with their number.
    `auto_symbolic` is called as it comes; `suggest_symbolic` with its weight of simplicity at
    zero, which ranks by r² alone (as it comes, `auto_symbolic` asks it).
    """
    import torch

    from pikanid.approximators.kan import ShallowKAN, build_kan

    truth = next(t for t in TRUTHS if t.label == label)
    x, y, _ = points(truth, noise, seed)
    shallow = ShallowKAN(build_kan([1, 1], grid=20, k=3, grid_range=(-1.0, 1.0)))
    basis = shallow.basis(x).toarray()
    shallow.set_coefficients(np.linalg.lstsq(basis, y, rcond=None)[0])
    kan = shallow.kan
    kan.save_act = True
    kan(torch.linspace(-1.0, 1.0, 200, dtype=torch.float64)[:, None])
    begun = time.process_time()
    by_fit = kan.suggest_symbolic(0, 0, 0, verbose=False, weight_simple=0.0)[0]
    middle = time.process_time()
    kan.auto_symbolic(verbose=0)
    auto = kan.symbolic_fun[0].funs_name[0][0]
    return {"auto": auto, "suggest": by_fit, "auto_exact": auto in truth.pykan,
            "suggest_exact": by_fit in truth.pykan, "suggest_seconds": middle - begun,
            "auto_seconds": time.process_time() - middle}
