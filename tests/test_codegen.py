"""Generated sources: what outputs owe to the signs that a simulation switches."""

from __future__ import annotations

import pytest

from pikanid.model import Parameter, systems
from pikanid.simulation.codegen import generate


@pytest.mark.parametrize(("function", "gain"), [("theta", ""), ("theta + 0.125*sign(theta_dot)",
                                                                "0.125")])
def test_outputs_that_show_a_sign_say_how_much(function: str, gain: str) -> None:
    model = systems.sloshing().with_term(
        "theta_dot", "-c*sign(theta_dot)", [Parameter("c", 1.0)]).map_output(
        "theta", function=function)
    source, lowered = generate(model)
    assert lowered.n_dynamic == 1
    assert f"SHOWS_SIGNS = {bool(gain)}" in source
    body = source.partition("def observe_gain")[2].partition("def ")[0]
    assert ("Hs[0, 0] = " in body) == bool(gain) and gain in body
