"""The cache of compiled models: found again by other processes, keyed by what matters."""

from __future__ import annotations

import json
import linecache
import os
import subprocess
import sys
from pathlib import Path

import pytest

from pikanid.model import Model, Parameter, Spline, systems
from pikanid.simulation import compiled as compiler

pytestmark = pytest.mark.compiled

PROCESS = """
import json, sys
from pikanid import excitation, systems
from pikanid.simulation import simulate
from pikanid.simulation.compiled import compiled
model = systems.sloshing().with_values(l_theta=float(sys.argv[1]))
peak = float(abs(simulate(model, excitation.two_pulse(1.0, 0.02))["theta"].values).max())
module = compiled(model)
stats = module.integrate.stats
print(json.dumps({"peak": peak, "name": module.__name__, "hits": sum(stats.cache_hits.values()),
                  "misses": sum(stats.cache_misses.values())}))
"""


def run(folder: Path, length: float) -> dict[str, object]:
    """One process of its own, with another hash seed, as a user's next call would be."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", PROCESS, str(length)], text=True, check=True,
        capture_output=True,
        env={**os.environ, "PIKANID_CACHE": str(folder), "PYTHONHASHSEED": str(int(length * 1e3))})
    return json.loads(done.stdout)


@pytest.mark.slow
def test_second_process_compiles_nothing(tmp_path: Path) -> None:
    first = run(tmp_path, 0.045)
    assert first["misses"] == 1
    second = run(tmp_path, 0.060)
    assert (second["hits"], second["misses"]) == (1, 0)
    assert second["name"] == first["name"]  # another parameter value is no other model
    assert second["peak"] != first["peak"]
    for path in (tmp_path / "compiled").iterdir():  # whatever is loaded: none is believed
        path.write_bytes(path.read_bytes()[:-1])
    assert run(tmp_path, 0.060) == {**second, "hits": 0, "misses": 1}


def key(model: Model, method: compiler.Method = "explicit") -> str:
    return compiler._name(model, method)


def test_key_depends_on_formulas_and_on_nothing_else() -> None:
    model = systems.sloshing()
    same = [model.with_values(m=0.4), model.fix("l_theta"), model.per_recording("d_theta"),
            model.replace(name="other"), model.map_input("u_x", hold="first", delay=0.01),
            model.with_initial(theta=0.3), Model.from_dict(model.to_dict())]
    assert {key(m) for m in same} == {key(model)}
    other = [model.map_input("u_x", delay="m"), model.with_term("theta_dot", 1.0),
             model.with_parameters(Parameter("a", 1.0)),
             model.map_input("u_x", gain="m"), model.map_output("theta", gain="m"),
             model.replace(inputs=model.inputs[::-1]), systems.pendulum()]
    assert len({key(m) for m in (model, *other)} | {key(model, "implicit")}) == len(other) + 2


def test_key_depends_on_the_spline_functions() -> None:
    def model(degree: int, *inner: float, name: str = "c") -> Model:
        spline = Spline(name, degree, (-1.0,) * (degree + 1) + inner + (1.0,) * (degree + 1))
        return systems.sloshing().replace(splines=(spline,))

    models = [model(2, 0.1), model(2, 0.1 + 1e-18), model(2, 0.1 + 1e-15), model(2, 0.1, 0.2),
              model(3, 0.1), model(2, 0.1, name="d")]
    assert key(models[0]) == key(models[1])  # the same number
    assert len(set(map(key, models))) == len(models) - 1


def test_tracebacks_show_generated_source() -> None:
    module = compiler.generated("shown", "def fails():\n    raise ValueError\n")
    file = module.fails.__code__.co_filename
    assert linecache.getline(file, 2, module.__dict__) == "    raise ValueError\n"


def test_one_module_a_structure_in_a_process() -> None:
    model = systems.sloshing()
    module = compiler.compiled(model)
    assert compiler.compiled(model.with_values(l_theta=0.05)) is module
    assert compiler.compiled(systems.sloshing()) is module
