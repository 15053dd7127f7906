"""Machine code of tapes, against the generated code of compiled models run by Python."""

from __future__ import annotations

import threading
from pathlib import Path

import interpreted
import numpy as np
import pytest
from llvmlite import binding
from numba.core import config
from test_translated import recorded, values

from pikanid.model import Model, Parameter, systems
from pikanid.problem.problem import bind
from pikanid.simulation.native_tape import native
from pikanid.simulation.simulator import Response, Simulator, Steps
from pikanid.simulation.structure import Structure
from pikanid.simulation.tape import tape
from pikanid.simulation.translated import Translated, machine

pytestmark = pytest.mark.compiled

STEPS, DURATION = Steps("explicit", 0.01), 2.5
CORNERED: dict[str, dict[str, float]] = {
    "-a*abs(theta_dot)*theta_dot": {"a": 0.3},
    "-a*signed_power(theta_dot, n)": {"a": 0.3, "n": 1.5},
    "-k*max(theta - w, 0)": {"k": 400.0, "w": 0.04},
    "-a*sign(theta_dot)": {"a": 2.0},
    "-a*sign(theta_dot) - b*theta*sign(theta_dot - w)": {"a": 2.0, "b": 3.0, "w": 0.1},
}
SMOOTH: dict[str, dict[str, float]] = {
    "-k*max(theta - w, 0)**3 + b*max(-theta - w, 0)**4": {"k": 2e5, "b": 5e6, "w": 0.02},
    "a*exp(-theta**2)*tanh(theta_dot) + a**3/(2 + theta**4)": {"a": 0.7},
    "a*log(2 + b*theta) + sqrt(a + theta**2)*atan(b*theta_dot)": {"a": 0.4, "b": 0.2},
    "a*asin(theta/3) + b*acos(theta/4)*atan2(theta, 2 + theta_dot**2)": {"a": 0.4, "b": 0.2},
    "a*tan(theta) + b*sinh(theta)*cosh(theta) + (b + 1)**theta - log_abs(b - 2)": {
        "a": 0.4, "b": 0.2},
}
LAWS = CORNERED | SMOOTH


def model_of(term: str) -> Model:
    return systems.sloshing().with_term(
        "theta_dot", term, [Parameter(n, v) for n, v in LAWS[term].items()])


def simulator_of(term: str, located: bool = False) -> Translated:
    model = model_of(term)
    return Translated(model, bind(model, recorded(model, DURATION)), located=located)


def run(simulator: Simulator, active: int | None = None, steps: Steps = STEPS) -> Response:
    p = values(simulator.model)
    return simulator.run(p, np.arange(len(p) if active is None else active), steps)


def by_python(term: str) -> Simulator:
    return interpreted.simulator(model_of(term), recorded(model_of(term), DURATION))


@pytest.mark.parametrize("term", SMOOTH)
def test_machine_code_gives_the_numbers_of_generated_code(term: str) -> None:
    fast, slow = run(simulator_of(term)), run(by_python(term))
    assert slow.finished
    size = np.abs(slow.sensitivity).max(axis=0)
    np.testing.assert_allclose(fast.y, slow.y, rtol=0, atol=1e-14)
    np.testing.assert_allclose(fast.sensitivity / size, slow.sensitivity / size, rtol=0, atol=1e-13)
    assert size[4:].min() > 0


@pytest.mark.parametrize("term", CORNERED)
def test_both_stop_at_corners(term: str) -> None:
    """Their steps about corners differ, so that they agree to the order of the method."""
    fast, slow = simulator_of(term, located=True), by_python(term)
    gaps, slopes = [], []
    for h in (0.01, 0.0025):
        a, b = run(fast, steps=Steps("explicit", h)), run(slow, steps=Steps("explicit", h))
        size = np.abs(b.sensitivity).max(axis=0)
        gaps.append(np.abs(a.y - b.y).max())
        slopes.append(np.abs((a.sensitivity - b.sensitivity) / size).max())
    order = 1.5 if "signed_power" in term else 3.5  # |v|^1.5 has no second derivative at rest
    assert gaps[1] < max(gaps[0] / 4**order, 1e-13) and gaps[0] < 1e-6
    assert slopes[1] < slopes[0] / 4**(order - 1) and slopes[0] < 1e-3


@pytest.mark.parametrize("active", [0, 1, 4])
def test_any_number_of_derivatives(active: int) -> None:
    simulator = simulator_of("-a*sign(theta_dot)")
    every, some = run(simulator), run(simulator, active)
    assert np.array_equal(every.y, some.y)
    assert np.array_equal(every.sensitivity[:, :active], some.sensitivity)


@pytest.mark.parametrize("term", ["-a*abs(theta_dot)*theta_dot", "-a*sign(theta_dot)"])
def test_runs_without_derivatives_need_no_code_of_their_own(
        term: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PIKANID_CACHE", str(tmp_path))
    own, simulator = simulator_of(term), simulator_of(term)
    simulator = Translated(simulator.model, simulator.experiment, estimated=(0, 1, 4))
    machine.cache_clear()
    native.cache_clear()
    alone = run(simulator, 0)
    p = values(simulator.model)
    beside = simulator.run(p, np.array([0, 1, 4]), STEPS)
    assert len([*(tmp_path / "compiled").glob("object_*")]) == 1
    assert np.array_equal(alone.y, run(own, 0).y) and np.array_equal(alone.y, beside.y)
    assert np.array_equal(beside.sensitivity, run(own).sensitivity[:, [0, 1, 4]])


def test_what_has_been_translated_is_kept(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PIKANID_CACHE", str(tmp_path))
    simulator = simulator_of("-a*abs(theta_dot)*theta_dot")
    program = tape(Structure(simulator.model))
    assert native(program, (0, 1), False) is native(program, (0, 1), False)
    native.cache_clear()
    native(program, (0, 1), False)
    (file,) = (tmp_path / "compiled").glob("object_*")
    content = file.read_bytes()
    monkeypatch.setattr(binding.TargetMachine, "emit_object", None)  # not translated once more
    native.cache_clear()
    native(program, (0, 1), False)
    assert file.read_bytes() == content


@pytest.mark.parametrize("content", [b"", b"no object code"])
def test_a_spoilt_file_is_written_anew(
        content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PIKANID_CACHE", str(tmp_path))
    program = tape(Structure(simulator_of("-a*abs(theta_dot)*theta_dot").model))
    native.cache_clear()
    native(program, (0, 1), False)
    (file,) = (tmp_path / "compiled").glob("object_*")
    file.write_bytes(content)
    native.cache_clear()
    assert native(program, (0, 1), False).addresses.all()
    assert len(file.read_bytes()) > len(content)


def test_it_is_made_for_the_processor_that_numba_is_told(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PIKANID_CACHE", str(tmp_path))
    program = tape(Structure(simulator_of("-a*abs(theta_dot)*theta_dot").model))
    asked = []
    create = binding.Target.create_target_machine

    def noted(target: binding.Target, **options: object) -> object:
        asked.append(options.get("cpu"))
        return create(target, **options)

    monkeypatch.setattr(binding.Target, "create_target_machine", noted)
    for name in (None, "generic"):
        monkeypatch.setattr(config, "CPU_NAME", name)
        native.cache_clear()
        native(program, (0, 1), False)
    native.cache_clear()
    assert [cpu for cpu in asked if cpu] == [binding.get_host_cpu_name(), "generic"]
    assert len(list((tmp_path / "compiled").glob("object_*"))) == 2


def test_threads_have_registers_of_their_own() -> None:
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
