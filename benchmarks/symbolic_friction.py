"""A law that a slosh model lacks: found by a KAN inside the ODE, then named."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from discrepancy_runs import LAWS, SIGMA, Case, coefficient, drive, extended

import pikanid as pk
from pikanid.symbolic import extract

SIZE = 100.0  # of the law, in Cramér-Rao bounds of its coefficient
ARGUMENTS = ("theta", "theta_dot")
GRID = (10, 20)
NAMES = {"Coulomb friction": "sign", "quadratic drag": "signed square"}


def run_friction(label: str, seed: int) -> dict[str, Any]:
    """One recording of 20 s at σ = 0.1°: discrepancy, naming by its edge, naming in the ODE."""
    law = next(one for one in LAWS if one.name == label)
    case = Case(law, SIZE, seed)
    value = coefficient(case)
    data = pk.simulate(extended(law, value), drive(seed), sigma=SIGMA, seed=seed)
    begun = time.process_time()
    found = pk.kan_discrepancy(pk.systems.sloshing(), data, "theta_dot", ARGUMENTS, grid=GRID)
    middle = time.process_time()
    by_edge = extract(found)
    in_ode = extract(found, recordings=data)
    wanted = {(0, ARGUMENTS.index(law.argument), 0): NAMES[label]}
    estimate = in_ode.values[0] if len(in_ode.values) else np.nan
    edge = found.edge(law.argument)
    picture = {} if seed else {
        "argument": edge.grid.tolist(), "values": edge.values.tolist(), "std": edge.std.tolist(),
        "truth": edge.fix_gauge(lambda a: -value * law.shape(a)).tolist()}
    return {"picture": picture, "edge_ok": by_edge.ok, "found": edge.significant,
            "probability": in_ode.probability, "edge": list(by_edge.forms.values()),
            "ode": list(in_ode.forms.values()),
            "edge_exact": dict(by_edge.forms) == wanted, "ode_exact": dict(in_ode.forms) == wanted,
            "ok": in_ode.ok, "coefficient": value, "estimate": -float(estimate),
            "std": float(in_ode.std[0]) if len(in_ode.std) else None,
            "seconds": middle - begun, "reading_seconds": time.process_time() - middle}
