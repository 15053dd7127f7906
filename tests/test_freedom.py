"""Few samples: no fit without a degree of freedom, no verdict that they cannot bear."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pikanid as pk
from pikanid.cli import main
from pikanid.errors import BadRecording, BadSetting
from pikanid.estimate import Estimate
from pikanid.problem.problem import FreeParameter, Problem
from pikanid.strategies import STRATEGIES, strategy_class
from pikanid.uncertainty.information import undetermined_warnings

FULL = pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse())


def few(count: int, sigma: float | None = 0.002) -> pk.Recording:
    """So many samples of two free parameters' motion, with all of its input."""
    channel = FULL["theta"]
    at = np.linspace(110, 300, count).astype(int)
    noise = 0.002 * np.random.default_rng(1).standard_normal(count)
    return FULL.with_channels(replace(
        channel, time=channel.time[at], values=channel.values[at] + noise, sigma=sigma))


def fit(name: str, recording: pk.Recording) -> Estimate:
    found = strategy_class(name)().fit(pk.systems.sloshing(), recording)
    assert isinstance(found, Estimate)
    return found


@pytest.mark.parametrize("name", [
    pytest.param(name, marks=[pytest.mark.kan] * (name in ("pinn", "pikan")))
    for name in STRATEGIES])
def test_as_many_samples_as_parameters_are_refused(name: str) -> None:
    with pytest.raises(BadRecording, match=r"2 usable samples for 2 free .* needs 3 or more"):
        fit(name, few(2))


@pytest.mark.parametrize("sigma", [None, 0.002])
@pytest.mark.parametrize("name", ["nls", "ipda"])
def test_a_few_more_are_fitted_but_judge_nothing(name: str, sigma: float | None) -> None:
    found = fit(name, few(4, sigma))
    assert found.adequacy.verdict == "unknown" and found.ok
    assert "cannot be judged: 4 samples for 2 free parameters are too few" in found.sentence()


def test_splines_that_a_few_samples_do_not_determine_are_refused() -> None:
    with pytest.raises(BadSetting):
        fit("pda", few(3, None))


def test_enough_of_them_are_judged() -> None:
    assert fit("nls", few(9)).adequacy.verdict == "fits"
    assert fit("nls", few(8)).adequacy.verdict == "unknown"
    assert fit("nls", few(14, None)).adequacy.verdict == "fits"
    wrong = few(5).with_channels(replace(few(5)["theta"], values=[0.2, -0.2, 0.2, -0.2, 0.2]))
    assert fit("nls", wrong).adequacy.verdict == "misfit"  # what is refuted is refuted


def test_missing_samples_and_each_recording_s_own_parameters_count() -> None:
    gaps = few(8)["theta"].values.copy()
    gaps[2:] = np.nan
    holed = few(8).with_channels(replace(few(8)["theta"], values=gaps))
    with pytest.raises(BadRecording, match="2 usable samples for 2 free"):
        Problem(pk.systems.sloshing(), holed)
    pendulum = pk.systems.pendulum()
    swings = [pk.Recording.from_arrays(np.arange(n) * 0.05, {"theta": np.cos(np.arange(n) * 0.3)},
                                       {"theta": "rad"}) for n in (4, 2)]
    own = pendulum.per_recording("theta_0", "theta_dot_0")
    with pytest.raises(BadRecording, match=r"6 usable samples for 6 free .* needs 7 or more"):
        Problem(own, swings)
    longer = pk.Recording.from_arrays(np.arange(40) * 0.05, {"theta": np.cos(np.arange(40) * 0.3)},
                                      {"theta": "rad"}, name="long")
    three = own.with_parameters(pk.Parameter("offset", 0.0, free=True, scope="recording"))
    with pytest.raises(BadRecording, match="2 usable samples for 3 parameters of its own"):
        Problem(three.map_output("theta", offset="offset"), [longer, swings[1]])


def test_a_parameter_that_could_be_anything_is_told_of() -> None:
    """A stiffness of which a millionth acts, beside one that is fixed."""
    model = pk.Model.from_dict({
        "name": "weak", "states": {"x": {"unit": "m", "initial": "0.1"}, "v": {"unit": "m/s"}},
        "parameters": {"K": {"unit": "1/s^2", "guess": 32.0}, "c": {"unit": "1/s", "guess": 0.4}},
        "equations": {"x": "v", "v": "-100*x - 1e-6*K*x - c*v"},
        "outputs": {"x": {"unit": "m", "expression": "x"}}})
    recording = pk.simulate(model, pk.Recording.from_arrays(
        np.arange(200) * 0.01, {"unused": np.zeros(200)})).with_sigma(x=0.001)
    found = pk.NLS().fit(model, recording)
    assert found.std("K") > 100 * found.value("K")
    [warning] = [w for w in found.warnings if "does not determine" in w]
    assert "'K'" in warning and "far larger than its value" in warning


def test_what_is_zero_has_no_size_to_be_far_from() -> None:
    """An offset of 0.1 ± 1 may well be zero; a gain of 0.1 ± 1, guessed to be 0.05, is unknown."""
    def told(guess: float, value: float, std: float) -> bool:
        free = FreeParameter("p", None, guess, (-np.inf, np.inf))
        return bool(undetermined_warnings([free], np.array([value]), np.array([[std**2]])))

    assert not told(0.0, 0.1, 1.0) and told(0.0, 0.001, 1.0)
    assert told(0.05, 0.09, 1.0) and not told(0.05, 0.2, 1.0)
    assert not told(0.05, 0.05, np.nan) and not told(0.05, 0.05, np.inf)


def test_the_command_line_refuses_two_samples(tmp_path: Path,
                                              capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "two.csv"
    file.write_text("t [s],x [m],u [N]\n0,0.1,1\n0.1,0.2,0\n")
    assert main(["identify", str(file), "--model", "linear_oscillator"]) == 2
    assert "2 usable samples for 3 free parameters" in capsys.readouterr().err
