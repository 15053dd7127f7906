"""Every strategy on every ready-made problem, by the list that the package and commands read."""

from __future__ import annotations

import ast
import inspect
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path

import pytest
from ready_made import EXPERIMENTS

import pikanid as pk
from pikanid.estimate import Estimate
from pikanid.model import Model, systems
from pikanid.strategies import STRATEGIES, strategy_class

DURATION = 4.0
SIGMA = 0.005
# What standard errors do not say of: smoothing before the regression, and how far a network follows
# the physics (12 % of the linear oscillator's damping).
BIAS = {"pda": 0.02, "pinn": 0.15}
WIDE = {"pendulum": {"theta_0": 1.2}}  # what swings by itself has to swing well above the noise
# What moves by itself or by moves of a few seconds; the others have experiments of their own.
MOVED = ("sloshing", "sloshing_2d", "pendulum", "linear_oscillator", "duffing_oscillator")
EXACT = ("nls", "ipda", "pikan")  # PDA needs every state measured, PINN minutes where it is stiff


def marks(name: str) -> list[pytest.MarkDecorator]:
    """torch and pykan, and strategies that take their time by nature."""
    return [pytest.mark.kan] * (name in ("pinn", "pikan")) + [
        pytest.mark.slow] * strategy_class(name).slow


ALL = [pytest.param(name, marks=marks(name)) for name in STRATEGIES]


def recorded(model: Model) -> pk.Recording:
    """A move of all inputs, or the free motion of a model without any."""
    driven = [i for i in model.inputs if i.default is None]
    drive = pk.excitation.free_decay(DURATION, channels=[i.name for i in driven] or ["u"])
    if driven:
        drive = pk.excitation.planar_moves(2, DURATION, channels=[i.name for i in driven])
    for i in driven:
        drive = drive.with_unit(i.name, i.unit)
    return pk.simulate(model, drive, sigma=dict.fromkeys(model.output_names, SIGMA), seed=1)


@pytest.mark.parametrize("system", MOVED)
@pytest.mark.parametrize("name", ALL)
def test_every_strategy_fits_what_moves(name: str, system: str) -> None:
    truth = systems.SYSTEMS[system]().with_values(WIDE.get(system, {}))
    guess = truth.with_values({n: 1.1 * truth.values[n] for n in truth.free_names})
    found = strategy_class(name)().fit(guess, recorded(truth))
    assert isinstance(found, Estimate)
    assert found.strategy == name
    physics = [f.name for f in found.free if truth.parameter(f.name).scope == "shared"]
    assert physics
    for p in physics:
        near = 5 * found.std(p) + BIAS.get(name, 0.0) * abs(truth.values[p])
        assert abs(found.value(p) - truth.values[p]) < near, p
    assert found.adequacy.verdict == "fits" or name == "pda"


@pytest.mark.parametrize(("name", "system"), [
    pytest.param(name, system, marks=[
        *marks(name), *[pytest.mark.slow] * ((name, system) == ("pikan", "double_pendulum"))])
    for name in EXACT for system in systems.SYSTEMS if system not in MOVED])
def test_exact_strategies_fit_what_flows_heats_reacts_or_lives(name: str, system: str) -> None:
    """Hidden states, several outputs, and time constants from milliseconds to years."""
    experiment = EXPERIMENTS[system]
    truth = experiment.model(system)
    found = strategy_class(name)().fit(experiment.guess(system), experiment.recording(system, 3))
    for f in found.free:
        assert abs(found.value(f.name) - truth.values[f.name]) < 4 * found.std(f.name), f.name
    assert found.adequacy.verdict == "fits"


@pytest.mark.parametrize("name", ALL)
def test_only_shooting_estimates_a_delay(name: str) -> None:
    model = systems.sloshing().with_parameters(pk.Parameter("late", 0.02, "s", (0.0, 0.5)))
    model = model.map_output("theta", delay="late").fix(d_theta=0.15)
    if name == "nls":
        found = strategy_class(name)().fit(model, recorded(model))
        assert abs(found.value("late") - 0.02) < 5 * found.std("late")
    else:
        with pytest.raises(pk.errors.BadSetting, match="delay"):
            strategy_class(name)().fit(model, recorded(model))


@pytest.mark.parametrize("name", STRATEGIES)
def test_a_strategy_is_a_file_and_a_frozen_dataclass(name: str) -> None:
    kind = strategy_class(name)
    assert kind is getattr(pk, STRATEGIES[name])
    assert kind is getattr(import_module(f"pikanid.strategies.{name}"), STRATEGIES[name])
    assert kind.name == name and isinstance(kind.slow, bool)
    assert is_dataclass(kind) and kind.__dataclass_params__.frozen
    assert list(inspect.signature(kind.fit).parameters) == ["self", "model", "recordings"]
    options = {f.name: f.default for f in fields(kind)}
    assert options.get("protocol", "default") == "default" and options.get("seed", 0) == 0


def test_no_list_of_strategies_elsewhere() -> None:
    """What names three of them keeps a list; the paper's own figures are data."""
    root = Path(pk.__file__).parent
    listed = []
    names = {*STRATEGIES, *STRATEGIES.values()}
    for path in root.rglob("*.py"):
        text = path.read_text()
        for node in ast.walk(ast.parse(text)) if sum(n in text for n in names) > 2 else ():
            if isinstance(node, ast.Dict | ast.List | ast.Tuple | ast.Set):
                texts = {n.value for n in ast.walk(node)
                         if isinstance(n, ast.Constant) and isinstance(n.value, str)}
                if len(texts & names) > 2:
                    listed.append(str(path.relative_to(root)))
    assert set(listed) == {"strategies/__init__.py", "reporting/study_sheets.py"}
