"""Generated sources: what outputs owe to the signs that a simulation switches."""

from __future__ import annotations

import interpreted
import numpy as np
import pytest

import pikanid as pk
from pikanid.model import Parameter, systems
from pikanid.simulation import compiled
from pikanid.simulation.codegen import generate
from pikanid.simulation.simulator import Method, Steps


@pytest.mark.parametrize(("function", "gain"), [("theta", ""), ("theta + 0.125*sign(theta_dot)",
                                                                "0.125")])
def test_outputs_that_show_a_sign_say_how_much(function: str, gain: str) -> None:
    model = systems.sloshing().with_term(
        "theta_dot", "-c*sign(theta_dot)", [Parameter("c", 1.0)]).map_output(
        "theta", function=function)
    source, writer = generate(model)
    assert writer.lowered.n_dynamic == 1
    assert f"SHOWS_SIGNS = {bool(gain)}" in source
    body = source.partition("def observe_gain")[2].partition("def ")[0]
    assert ("Hs[0, 0] = " in body) == bool(gain) and gain in body


@pytest.mark.parametrize(("power", "stops"), [(1, 1), (2, 1), (3, 0), (4, 0)])
def test_what_is_bent_little_enough_is_no_reason_to_stop(power: int, stops: int) -> None:
    model = systems.sloshing().with_term("theta_dot", f"-c*max(theta - 0.1, 0)**{power}",
                                         [Parameter("c", 1.0)])
    assert generate(model)[1].lowered.n_dynamic == stops


@pytest.mark.parametrize("method", ["explicit", "implicit"])
@pytest.mark.parametrize("switching", [False, True])
def test_what_parameters_alone_decide_is_evaluated_once_a_run(
        method: Method, switching: bool) -> None:
    model = systems.sloshing()
    if switching:
        model = model.with_term("theta_dot", "-c*sign(theta_dot)/m**2", [Parameter("c", 1.0)])
    source = compiled._source(model, method)
    formulas, _, constants = source.partition("def evaluate_constants")
    assert "/q_" not in formulas and "**(-" not in formulas
    assert "1/q_l_theta" in constants
    simulator = interpreted.simulator(model, pk.excitation.two_pulse(duration=0.3))
    values = [0.0 if p.name == "m" else p.value for p in model.parameters]
    steps = Steps(method, 0.01)
    assert not simulator.run(np.array(values), steps=steps, states=True).finished
    values[model.parameter_names.index("m")] = 0.3
    assert simulator.run(np.array(values), steps=steps, states=True).finished
