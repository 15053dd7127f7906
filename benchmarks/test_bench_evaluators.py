"""Why a model's formulas have more than one evaluator.

Compiled by numba a simulation is the fastest, once compiled; from a tape it begins at once, which
is what a search through a hundred models needs.  A whole trajectory at once is `VectorField`'s, by
NumPy, with derivatives for Gauss-Newton and for torch: a simulator looks at one instant after the
other.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import pikanid as pk
from pikanid.problem.problem import bind
from pikanid.simulation.simulator import Simulator, Steps
from pikanid.simulation.translated import Translated
from pikanid.simulation.vectorfield import VectorField

RUN = "One simulation with two sensitivities, 10 s of slosh in steps of 5 ms"
FIRST = "First simulation of a model that nobody has simulated before"
P, ACTIVE, STEPS = np.array([0.045, 0.15, 0.3, 9.81]), np.array([0, 1]), Steps("explicit", 0.005)
fresh = itertools.count(1)


def simulator(model: pk.Model, kind: str) -> Simulator:
    of = {"tape": Translated, "compiled": Simulator}[kind]
    return of(model, bind(model, pk.excitation.planar_moves(6, 10.0, seed=1), need_outputs=False))


@pytest.mark.parametrize("kind", ["tape", "compiled"])
def test_run(benchmark, kind: str) -> None:
    benchmark.group = RUN
    benchmark.extra_info["reference"] = kind == "compiled"
    made = simulator(pk.systems.sloshing(), kind)
    found = benchmark.pedantic(made.run, (P, ACTIVE, STEPS, True), warmup_rounds=3, rounds=200)
    assert found.finished


@pytest.mark.parametrize("kind", ["tape", "compiled"])
def test_first(benchmark, kind: str) -> None:
    benchmark.group = FIRST
    benchmark.extra_info["reference"] = kind == "compiled"
    simulator(pk.systems.sloshing(), kind).run(P, ACTIVE, STEPS)  # the kernels of all models
    # no two processes draw the same constant, so that nothing of it is on disk
    start = np.random.default_rng().uniform(1.0, 2.0)

    def first() -> bool:
        model = pk.systems.sloshing().with_term("theta_dot", f"{start + next(fresh)}e-6*theta**3")
        return simulator(model, kind).run(P, ACTIVE, STEPS).finished

    assert benchmark.pedantic(first, rounds=1)


@pytest.mark.parametrize("kind", ["VectorField", "TorchField, with its gradient"])
def test_whole_trajectory(benchmark, kind: str) -> None:
    """The formulas with their derivatives, and what torch adds to that."""
    benchmark.group = "Right-hand side and derivatives along 501 samples"
    benchmark.extra_info["reference"] = kind == "VectorField"
    torch = pytest.importorskip("torch")
    from pikanid.simulation.torch_field import TorchField

    model, rng = pk.systems.sloshing(), np.random.default_rng(0)
    t, x, u = np.zeros(501), rng.normal(size=(501, 2)), rng.normal(size=(501, 2))
    if kind == "VectorField":
        linearised = VectorField(model).linearised_rhs((0, 1), range(4))
        benchmark.pedantic(linearised, (t, x, u, P), warmup_rounds=3, rounds=200)
        return
    field, p = TorchField(model), torch.tensor(P, requires_grad=True)
    at, state, inputs = torch.tensor(t), torch.tensor(x, requires_grad=True), torch.tensor(u)

    def gradient() -> None:
        field.rhs(at, state, inputs, p).square().sum().backward()

    benchmark.pedantic(gradient, warmup_rounds=3, rounds=200)
