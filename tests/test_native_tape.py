"""Machine code of tapes: the same numbers as the interpreter's, bit by bit."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from test_interpreted import recorded, values

from pikanid import systems
from pikanid.model import Parameter
from pikanid.problem import bind
from pikanid.simulation import interpreted
from pikanid.simulation.interpreted import Interpreted
from pikanid.simulation.native_tape import native
from pikanid.simulation.simulator import Response, Steps
from pikanid.simulation.structure import Structure
from pikanid.simulation.tape import tape

pytestmark = pytest.mark.compiled

STEPS = Steps("explicit", 0.005)
LAWS: dict[str, dict[str, float]] = {
    "-a*abs(theta_dot)*theta_dot": {"a": 0.3},
    "-a*signed_power(theta_dot, n)": {"a": 0.3, "n": 1.5},
    "-k*max(theta - w, 0)": {"k": 400.0, "w": 0.04},
    "a*exp(-theta**2)*tanh(theta_dot) + a**3/(2 + theta**4)": {"a": 0.7},
    "a*log(2 + b*theta) + sqrt(a + theta**2)*atan(b*theta_dot)": {"a": 0.4, "b": 0.2},
    "a*asin(theta/3) + b*acos(theta/4)*atan2(theta, 2 + theta_dot**2)": {"a": 0.4, "b": 0.2},
    "a*tan(theta) + b*sinh(theta)*cosh(theta) + (b + 1)**theta": {"a": 0.4, "b": 0.2},
    "-a*sign(theta_dot)": {"a": 2.0},
    "-a*sign(theta_dot) - b*theta*sign(theta_dot - w)": {"a": 2.0, "b": 3.0, "w": 0.1},
}


def simulator_of(term: str) -> Interpreted:
    model = systems.sloshing().with_term(
        "theta_dot", term, [Parameter(n, v) for n, v in LAWS[term].items()])
    return Interpreted(model, bind(model, recorded(model)))


def run(simulator: Interpreted, often: int, monkeypatch: pytest.MonkeyPatch,
        active: int | None = None) -> Response:
    monkeypatch.setattr(interpreted, "OFTEN", often)
    p = values(simulator.model)
    return simulator.run(p, np.arange(len(p) if active is None else active), STEPS)


@pytest.mark.parametrize("term", LAWS)
def test_machine_code_gives_the_interpreters_numbers(
        term: str, monkeypatch: pytest.MonkeyPatch) -> None:
    slow = run(simulator_of(term), 10**9, monkeypatch)
    fast = run(simulator_of(term), 0, monkeypatch)
    assert slow.finished
    assert np.array_equal(slow.y, fast.y)
    assert np.array_equal(slow.sensitivity, fast.sensitivity)
    assert np.abs(fast.sensitivity[:, 4:]).max(axis=0).min() > 0


@pytest.mark.parametrize("active", [0, 1, 4, 5])
def test_any_number_of_derivatives(active: int, monkeypatch: pytest.MonkeyPatch) -> None:
    term = "-a*sign(theta_dot)"
    slow = run(simulator_of(term), 10**9, monkeypatch, active)
    fast = run(simulator_of(term), 0, monkeypatch, active)
    assert np.array_equal(slow.y, fast.y)
    assert np.array_equal(slow.sensitivity, fast.sensitivity)


def test_what_is_run_often_is_translated_once() -> None:
    simulator = simulator_of("-a*abs(theta_dot)*theta_dot")
    program = tape(Structure(simulator.model))
    assert native(program, (0, 1), False) is native(program, (0, 1), False)
    before = native.cache_info().currsize
    interpreted.machine.cache_clear()  # simulators of one tape count their runs together
    few = Interpreted(simulator.model, simulator.experiment)
    few.run(values(simulator.model), np.arange(3), STEPS)
    assert native.cache_info().currsize == before


def test_threads_have_registers_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interpreted, "OFTEN", 0)
    simulator = simulator_of("-a*sign(theta_dot)")
    points = [values(simulator.model) * (1 + 0.01 * k) for k in range(4)]
    alone = [simulator.run(p, np.arange(5), STEPS).y for p in points]
    found: dict[int, list[np.ndarray]] = {k: [] for k in range(len(points))}

    def work(k: int) -> None:
        for _ in range(10):
            found[k].append(simulator.run(points[k], np.arange(5), STEPS).y)

    threads = [threading.Thread(target=work, args=(k,)) for k in found]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(y, alone[k]) for k, ys in found.items() for y in ys)
