"""Starting points: where they lie, that they fill the space, and that the seed decides."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.model import Model
from pikanid.objective.shooting import Shooting
from pikanid.problem.problem import Problem
from pikanid.recording import Recording
from pikanid.strategies.nls import NLS
from pikanid.strategies.starts import starting_points

BOUNDS = {"narrow": (0.9, 1.2), "wide": (1e-3, 1e3), "tiny": (0.05, 1e9), "signed": (-40.0, 2.0),
          "open": (-np.inf, np.inf)}
GUESS = {"narrow": 1.0, "wide": 1.0, "tiny": 0.1, "signed": -3.0, "open": 0.0}
# a decade about a positive guess, five times its size about another one; within the bounds
RANGE = {"narrow": (0.9, 1.2), "wide": (0.1, 10.0), "tiny": (0.05, 1.0), "signed": (-18.0, 2.0),
         "open": (-0.005, 0.005)}


def problem() -> Problem:
    model = Model.from_dict({
        "states": {"x": {}}, "equations": {"x": " + ".join(GUESS)},
        "parameters": {n: {"guess": GUESS[n], "bounds": list(BOUNDS[n])} for n in GUESS},
        "outputs": {"x": {"expression": "x"}}})
    t = np.linspace(0.0, 1.0, 21)
    return Problem(model, Recording.from_arrays(t, {"x": np.sin(t)}))


def points(starts: int | str, seed: int = 0, protocol: str = "default") -> np.ndarray:
    return np.array(list(starting_points(problem(), starts, protocol, seed)))  # type: ignore[arg-type]


@pytest.mark.parametrize(("starts", "count"), [("auto", NLS().extra + 1), (1, 1), (2, 2), (40, 40)])
def test_the_guess_is_first_and_their_number_is_as_asked(starts: int | str, count: int) -> None:
    found = points(starts)
    assert found.shape == (count, len(GUESS))
    np.testing.assert_array_equal(found[0], list(GUESS.values()))


def test_every_parameter_fills_its_range_evenly() -> None:
    """A Latin hypercube: each of n equal cells, in logarithms over more than a decade, holds one.
    """
    found, n = points(31)[1:], 30
    for k, name in enumerate(GUESS):
        low, high = RANGE[name]
        shares = (found[:, k] - low) / (high - low)
        if low > 0 and high / low > 10:
            shares = np.log(found[:, k] / low) / np.log(high / low)
        np.testing.assert_array_equal(np.sort(np.floor(n * shares).astype(int)), np.arange(n))


def test_the_protocol_of_the_paper_is_five_within_a_fifth() -> None:
    found = points("auto", protocol="paper")
    guess = np.array(list(GUESS.values()))
    assert found.shape == (5, len(GUESS))
    np.testing.assert_array_equal(found[0], guess)
    ratios = found[1:, :4] / guess[:4]
    assert np.all((ratios >= 0.8) & (ratios <= 1.2)) and np.ptp(ratios) > 0.2
    assert found[:, 0].min() >= 0.9  # the bound is nearer than a fifth


@pytest.mark.parametrize("protocol", ["default", "paper"])
def test_the_seed_decides(protocol: str) -> None:
    np.testing.assert_array_equal(points(6, 3, protocol), points(6, 3, protocol))
    assert np.all(points(6, 3, protocol)[1:, 0] != points(6, 4, protocol)[1:, 0])


@pytest.mark.parametrize("seed", [0, 5])
def test_the_fit_starts_from_the_points_of_its_own_seed(
        seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[np.ndarray] = []

    def noted(self: pk.NLS, shooting: Shooting, start: np.ndarray) -> None:
        begun.append(start)

    monkeypatch.setattr(pk.NLS, "one_start", noted)
    model = pk.systems.sloshing()
    recording = pk.simulate(model, pk.excitation.two_pulse(), sigma=0.01, seed=0)
    with pytest.raises(pk.errors.SimulationFailed):
        pk.NLS(starts=4, seed=seed).fit(model, recording)
    expected = starting_points(Problem(model, recording), 4, "default", seed)
    np.testing.assert_array_equal(begun, list(expected))
