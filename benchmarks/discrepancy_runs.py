"""One fit of a discrepancy KAN to slosh data with a missing law, kept in a file of its own.

The size of a law is chosen before any fit: so many times the Cramér-Rao bound of its coefficient,
at zero, beside l and d, on the very recording.
"""

from __future__ import annotations

import functools
import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import pikanid as pk
from pikanid import discrepancy
from pikanid.discrepancy import Discrepancy, Edge
from pikanid.model import systems
from pikanid.recording import Recording, excitation
from pikanid.storage.outputs import atomically
from pikanid.uncertainty import cramer_rao

SIGMA = 0.1 * np.pi / 180
DURATION = 20.0
ARGUMENTS = ("theta", "theta_dot", "u_x")
ALPHA = 0.01
STORE = Path("build/discrepancy")
# modules of the room that have no part in these outcomes
APART = ("__init__", "result", "drawing", "functional")
NORMAL_95 = 1.959963984540054


@dataclass(frozen=True)
class Law:
    """A missing term `-coefficient*shape(argument)` in the equation of θ'."""

    name: str
    formula: str
    argument: str
    shape: Callable[[np.ndarray], np.ndarray]


LAWS = (
    Law("Coulomb friction", "sign(theta_dot)", "theta_dot", np.sign),
    Law("quadratic drag", "abs(theta_dot)*theta_dot", "theta_dot", lambda a: np.abs(a) * a),
    Law("cubic spring", "theta**3", "theta", lambda a: a**3),
)


@dataclass(frozen=True)
class Case:
    """One recording and one way of fitting: law (None: clean data), size in bounds, seed."""

    law: Law | None
    size: float
    seed: int
    options: tuple[tuple[str, Any], ...] = ()

    @property
    def file(self) -> Path:
        """Where its outcome is kept: under a name that changes with the code."""
        name = f"{self.law.formula if self.law else ''} {self.size} {self.seed} {self.options}"
        return STORE / f"{hashlib.sha256((name + code_digest()).encode()).hexdigest()[:20]}.json"


@functools.cache
def code_digest() -> str:
    """Of everything in the room that decides about an outcome, and of this file."""
    room = sorted(Path(discrepancy.__file__).parent.glob("*.py"))
    files = [*(f for f in room if f.stem not in APART), Path(__file__)]
    return hashlib.sha256(b"".join(f.read_bytes() for f in files)).hexdigest()


def drive(seed: int) -> Recording:
    """Even seeds: ten random planar-motor moves; odd seeds: a random-phase multisine."""
    if seed % 2 == 0:
        return excitation.planar_moves(10, DURATION, acceleration=1.0, velocity=0.5, seed=seed)
    return excitation.multisine(np.arange(0.5, 4.01, 0.25), DURATION, amplitude=0.5, seed=seed)


def coefficient(case: Case) -> float:
    """The law's coefficient: `size` times its Cramér-Rao bound at zero."""
    if case.law is None:
        return 0.0
    model = extended(case.law, 0.0)
    return case.size * cramer_rao(model, drive(case.seed), sigma=SIGMA).std("coefficient")


def extended(law: Law, value: float) -> pk.Model:
    """The slosh pendulum with a law that the fit knows nothing of."""
    return systems.sloshing().with_term(
        "theta_dot", f"-coefficient*{law.formula}", [pk.Parameter("coefficient", value)])


def fit(case: Case) -> tuple[Discrepancy, float]:
    """The discrepancy, and the law's coefficient."""
    value = coefficient(case)
    truth = systems.sloshing() if case.law is None else extended(case.law, value)
    data = pk.simulate(truth, drive(case.seed), sigma=SIGMA, seed=case.seed)
    found = pk.kan_discrepancy(systems.sloshing(), data, "theta_dot", ARGUMENTS, alpha=ALPHA,
                               **dict(case.options))
    return found, value


def outcome(case: Case) -> dict[str, Any]:
    """What a fit found, from its file or anew."""
    if case.file.exists():
        return json.loads(case.file.read_text())
    begun = time.perf_counter()
    found, value = fit(case)
    seconds = time.perf_counter() - begun
    result = {"coefficient": value, "seconds": seconds, "verdict": found.estimate.adequacy.verdict,
              "nominal": found.nominal.adequacy.verdict,
              "intervals": found.estimate.settings["intervals"],
              "edges": [_edge(e, case, value) for e in found.edges]}
    STORE.mkdir(parents=True, exist_ok=True)
    atomically(case.file, json.dumps(result).encode())
    return result


def _edge(edge: Edge, case: Case, value: float) -> dict[str, Any]:
    law = case.law if case.law and edge.argument == case.law.argument else None

    def true(a: np.ndarray) -> np.ndarray:
        return np.zeros_like(a) if law is None else -value * law.shape(a)

    low, high = edge.simultaneous
    shown = edge.fix_gauge(true)
    inside = np.abs(edge.values - shown) <= NORMAL_95 * edge.std
    return {"argument": edge.argument, "unit": edge.unit, "p": edge.p_value,
            "significant": edge.significant, "share": float(np.mean(inside)),
            "whole": bool(np.all((shown >= low) & (shown <= high))),
            "step": None if edge.step is None else edge.step[0],
            "jump_probability": edge.jump_probability, "grid": edge.grid.tolist(),
            "values": edge.values.tolist(), "std": edge.std.tolist(), "truth": shown.tolist()}
