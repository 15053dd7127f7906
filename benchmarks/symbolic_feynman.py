"""Twelve formulas of the Feynman lectures, learned by small KANs and read.

Formulas and ranges: Udrescu & Tegmark, AI Feynman, Science Advances 6, eaay2631, 2020, table 4.
A formula counts as recovered when it holds where no point was: its error over a box half as wide
again on each side (within the formula's domain) is below 1 % of the truth's spread there.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pikanid.approximators.kan import build_kan
from pikanid.approximators.kan.train import PointFit, fit_points
from pikanid.symbolic import extract

SECONDS = 20  # of one thread, as long as genetic programming may search
POINTS, NOISE, RECOVERED, RESTARTS = 1000, 0.01, 0.01, 3


@dataclass(frozen=True)
class Formula:
    """A formula of n variables with the range of each."""

    number: str
    text: str
    law: Callable[..., np.ndarray]
    ranges: tuple[tuple[float, float], ...]


def box(n: int, low: float = 1.0, high: float = 5.0) -> tuple[tuple[float, float], ...]:
    """The same range for n variables."""
    return ((low, high),) * n


FORMULAS = (
    Formula("I.6.20a", "exp(-θ²/2)/√(2π)", lambda a: np.exp(-a**2 / 2) / np.sqrt(2 * np.pi),
            box(1, 1.0, 3.0)),
    Formula("I.6.20", "exp(-(θ/σ)²/2)/√(2πσ²)",
            lambda s, a: np.exp(-(a / s) ** 2 / 2) / (np.sqrt(2 * np.pi) * s), box(2, 1.0, 3.0)),
    Formula("I.12.1", "μN", lambda m, n: m * n, box(2)),
    Formula("I.14.4", "kx²/2", lambda k, x: k * x**2 / 2, box(2)),
    Formula("I.25.13", "q/C", lambda q, c: q / c, box(2)),
    Formula("I.26.2", "arcsin(n sin θ)", lambda n, t: np.arcsin(n * np.sin(t)),
            ((0.0, 1.0), (1.0, 5.0))),
    Formula("I.39.1", "3pV/2", lambda p, v: 1.5 * p * v, box(2)),
    Formula("I.47.23", "√(γp/ρ)", lambda g, p, r: np.sqrt(g * p / r), box(3)),
    Formula("II.3.24", "P/(4πr²)", lambda p, r: p / (4 * np.pi * r**2), box(2)),
    Formula("II.8.31", "εE²/2", lambda e, f: e * f**2 / 2, box(2)),
    Formula("II.11.28", "1 + nα/(1 - nα/3)", lambda n, a: 1 + n * a / (1 - n * a / 3),
            box(2, 0.0, 1.0)),
    Formula("II.38.14", "Y/(2(1 + σ))", lambda y, s: y / (2 * (1 + s)), box(2)),
)


def points(formula: Formula, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """x (1000, n) in the ranges, y with 1 % of noise."""
    generator = np.random.default_rng(seed)
    low, high = np.array(formula.ranges).T
    x = generator.uniform(low, high, (POINTS, len(low)))
    clean = formula.law(*x.T)
    return x, clean + NOISE * clean.std() * generator.normal(size=POINTS)


def beyond(formula: Formula) -> tuple[np.ndarray, np.ndarray]:
    """Points of a wider box on which the truth is finite, and the truth there."""
    low, high = np.array(formula.ranges).T
    reach = 0.25 * (high - low)
    generator = np.random.default_rng(1)
    x = generator.uniform(low - reach, high + reach, (2000, len(low)))
    with np.errstate(invalid="ignore", divide="ignore"):
        y = formula.law(*x.T)
    good = np.isfinite(y)
    return x[good], y[good]


def train(formula: Formula, x: np.ndarray, y: np.ndarray) -> PointFit:
    """One edge for one variable; else a product of sums of edges, and an edge behind it."""
    n = len(formula.ranges)
    low, high = float(np.min(formula.ranges)), float(np.max(formula.ranges))
    if n == 1:
        return fit_points(build_kan([1, 1], grid=8, grid_range=(low, high)), x, y)
    span = 3.0
    fits = [fit_points(build_kan([n, [0, 1], 1], grid=8, seed=seed, mult_arity=n, grid_range=[
        (low, high), (-span, span)]), x, y) for seed in range(RESTARTS)]
    return min(fits, key=lambda f: float(f.residual @ f.residual))


def off(value: np.ndarray, truth: np.ndarray) -> float:
    """Root mean square error as a share of the truth's spread; infinite where not finite."""
    good = np.isfinite(value).all()
    return float(np.sqrt(np.mean((value - truth) ** 2)) / truth.std()) if good else float("inf")


def run_feynman(number: str, seed: int) -> dict[str, Any]:
    """Trained and read by this package, on y over its standard deviation."""
    formula = next(f for f in FORMULAS if f.number == number)
    x, y = points(formula, seed)
    size = float(y.std())
    y = y / size
    fit = train(formula, x, y)
    begun = time.process_time()
    reading = extract(fit.kan, x, y)
    there, truth = beyond(formula)
    error = off(size * reading(there), truth)
    return {"recovered": reading.ok and error < RECOVERED, "ok": reading.ok,
            "error": error if np.isfinite(error) else None,
            "formula": str(reading.expression), "seconds": time.process_time() - begun}


def run_feynman_pykan(number: str, seed: int) -> dict[str, Any]:
    """The same trained model through `auto_symbolic` and pykan's refit."""
    import torch

    formula = next(f for f in FORMULAS if f.number == number)
    x, y = points(formula, seed)
    size = float(y.std())
    y = y / size
    kan = train(formula, x, y).kan
    kan.save_act = True
    kan(torch.from_numpy(x[:200]))
    begun = time.process_time()
    kan.auto_symbolic(verbose=0)
    label = torch.from_numpy(y[:, None])
    kan.fit({"train_input": torch.from_numpy(x), "train_label": label,
             "test_input": torch.from_numpy(x), "test_label": label}, opt="LBFGS", steps=20,
            log=1000)
    there, truth = beyond(formula)
    with torch.no_grad():
        error = off(size * kan(torch.from_numpy(there)).numpy()[:, 0], truth)
    return {"recovered": error < RECOVERED, "error": error if np.isfinite(error) else None,
            "seconds": time.process_time() - begun}


def run_feynman_operon(number: str, seed: int) -> dict[str, Any]:
    """The same points, their noise told, through genetic programming with local search, pyoperon.

    Of the expressions between error and length the one of least description length counts.
    """
    from pyoperon.sklearn import SymbolicRegressor

    formula = next(f for f in FORMULAS if f.number == number)
    x, y = points(formula, seed)
    search = SymbolicRegressor(
        allowed_symbols="add,sub,mul,div,constant,variable,sin,cos,exp,log,sqrt,square,asin",
        optimizer_iterations=5, generations=10_000, max_evaluations=100_000_000, max_length=30,
        max_time=SECONDS, n_threads=1, random_state=seed, objectives=["r2", "length"],
        uncertainty=[NOISE * float(np.std(y))])
    return searched(search, formula, x, y)


def run_feynman_gplearn(number: str, seed: int) -> dict[str, Any]:
    """The same points through plain genetic programming, gplearn."""
    from gplearn.genetic import SymbolicRegressor

    formula = next(f for f in FORMULAS if f.number == number)
    x, y = points(formula, seed)
    search = SymbolicRegressor(
        population_size=1000, generations=40, parsimony_coefficient=0.001, random_state=seed,
        function_set=("add", "sub", "mul", "div", "sqrt", "log", "sin", "cos"))
    return searched(search, formula, x, y)


def searched(search: Any, formula: Formula, x: np.ndarray, y: np.ndarray) -> dict[str, Any]:
    """What a regressor of scikit-learn's manner makes of the points, beyond them."""
    begun = time.process_time()
    search.fit(x, y)
    seconds = time.process_time() - begun
    there, truth = beyond(formula)
    error = off(np.asarray(search.predict(there), float), truth)
    return {"recovered": error < RECOVERED, "error": error if np.isfinite(error) else None,
            "seconds": seconds}
