"""Standardised residuals and their Jacobian, step sizes and verdicts, on closed-form solutions."""

from __future__ import annotations

import interpreted
import numpy as np
import pytest
from read_off_noise import p_value

from pikanid.model import Model
from pikanid.objective.shooting import HURRY, Shooting
from pikanid.problem.problem import Problem
from pikanid.recording import Channel, Recording

T = np.linspace(0.0, 3.0, 31)
TAU = np.linspace(0.5, 2.5, 17)


@pytest.fixture(autouse=True)
def by_python(monkeypatch: pytest.MonkeyPatch) -> None:
    interpreted.instead_of_compiled(monkeypatch)


def model() -> Model:
    """x = a·exp(-b·t), one a a recording; w = g·x²."""
    return Model.from_dict({
        "states": {"x": {"initial": "a"}}, "equations": {"x": "-b*x"},
        "parameters": {n: {"guess": 1.0} for n in "abg"},
        "outputs": {"x": {"expression": "x"}, "w": {"expression": "g*x**2"}}}).per_recording("a")


def recording(seed: int, known: bool) -> Recording:
    rng = np.random.default_rng(seed)
    return Recording({
        "x": Channel("x", T, 2 * np.exp(-T) + 0.1 * rng.normal(size=31), "",
                     np.linspace(0.05, 0.15, 31) if known else None),
        "w": Channel("w", TAU, 5 * np.exp(-2 * TAU) + 0.01 * rng.normal(size=17))})


def visible(y: np.ndarray) -> float:
    return float(np.median(np.abs(np.diff(y, 4)))) / 0.6744897501960817 / np.sqrt(70.0)


THETA = np.array([1.9, 2.1, 0.9, 1.2])  # a of each recording, b, g


def by_hand(data: list[Recording], stop: float = np.inf) -> tuple[np.ndarray, ...]:
    """Residuals, their Jacobian, and σ of every row."""
    rows, jacobian, sigmas = [], [], []
    for r, given in enumerate(data):
        a, b, g = THETA[r], THETA[2], THETA[3]
        own = np.eye(2)[r]
        x, z = np.exp(-b * T), np.exp(-2 * b * TAU)
        by_a, by_z = x[:, None] * own, 2 * g * a * z[:, None] * own
        rows += [a * x - given["x"].values, g * a**2 * z - given["w"].values]
        jacobian += [np.column_stack([by_a, -a * T * x, np.zeros(31)]),
                     np.column_stack([by_z, -2 * TAU * g * a**2 * z, a**2 * z])]
        stated = given["x"].sigma
        sigmas += [np.asarray(stated) if stated is not None
                   else np.full(31, visible(given["x"].values)),
                   np.full(17, visible(given["w"].values))]
    return np.concatenate(rows), np.vstack(jacobian), np.concatenate(sigmas)


def test_residual_jacobian_and_verdict_by_hand() -> None:
    data = [recording(0, True), recording(1, False)]
    problem = Problem(model(), data)
    assert [f.label for f in problem.free] == ["a[0]", "a[1]", "b", "g"]
    shooting = Shooting(problem)
    shooting.choose_steps(THETA, "fine")
    r, J, sigma = by_hand(data)
    np.testing.assert_allclose(shooting.residual(THETA), r / sigma, atol=1e-4)
    scaled = J / sigma[:, None]
    np.testing.assert_allclose(shooting.jacobian(THETA), scaled, atol=1e-4 * np.abs(scaled).max())
    found = shooting.adequacy(THETA)
    assert found.value == pytest.approx(np.sum((r / sigma) ** 2), rel=1e-4)
    assert (found.dof, found.source) == (96 - 4, "differences")
    parts = np.split((r / sigma) ** 2, np.cumsum([31, 17, 31]))
    by = (np.inf, 13, 27, 13)
    assert found.p_value == pytest.approx(
        p_value([(float(part.sum()), m) for part, m in zip(parts, by, strict=True)], 92), rel=1e-3)
    # what is kept belongs to its θ
    other = THETA * [1.0, 1.0, 1.0, 1.5]
    assert np.abs(shooting.residual(other) - r / sigma).max() > 1
    np.testing.assert_allclose(shooting.residual(THETA), r / sigma, atol=1e-4)


def test_a_single_output_without_sigma_is_not_weighted() -> None:
    single = model().replace(outputs=model().outputs[:1])
    data = [recording(0, False), recording(1, False)]
    shooting = Shooting(Problem(single, data))
    shooting.choose_steps(THETA, "fine")
    expected = np.concatenate([THETA[r] * np.exp(-THETA[2] * T) - data[r]["x"].values
                               for r in (0, 1)])
    np.testing.assert_allclose(shooting.residual(THETA), expected, atol=1e-8)


@pytest.mark.parametrize("accuracy", ["coarse", "fine"])
def test_integration_errors_are_a_stated_share_of_the_noise(accuracy: str) -> None:
    """0.01·σ/√N, the least one counts; ten times that where coarse steps will do."""
    single = model().replace(outputs=model().outputs[:1])
    data = [recording(0, True), recording(1, True)]
    shooting = Shooting(Problem(single, data))
    stiff = THETA * [1.0, 1.0, 8.0, 1.0]
    shooting.choose_steps(stiff, accuracy)  # type: ignore[arg-type]
    allowed = 0.01 * 0.05 / np.sqrt(31) * (1 if accuracy == "fine" else 10)
    for r, response in enumerate(shooting.responses(stiff)):
        error = np.abs(response.y - stiff[r] * np.exp(-stiff[2] * T)).max()
        # not a thousand times better either: that would be paid for in every fit
        assert allowed / 1000 < error < 1.5 * allowed


def test_what_cannot_be_simulated_is_a_bad_step() -> None:
    burst = Model.from_dict({
        "states": {"x": {"initial": 1.0}}, "equations": {"x": "b*x**3"},
        "parameters": {"b": {"guess": -1.0}}, "outputs": {"x": {"expression": "x"}}})
    shooting = Shooting(Problem(burst, Recording.from_arrays(T, {"x": np.exp(-T)})))
    shooting.choose_steps(np.array([-1.0]), "fine")
    assert np.all(shooting.residual(np.array([2.0])) == 1e10)
    assert not shooting.jacobian(np.array([2.0])).any()
    assert np.all(np.abs(shooting.residual(np.array([-1.0]))) < 1)
    assert not shooting.explains(np.array([-1.0]))


def test_other_starts_may_not_ask_for_far_shorter_steps() -> None:
    single = model().replace(outputs=model().outputs[:1])
    shooting = Shooting(Problem(single, [recording(0, True), recording(1, True)]))
    shooting.choose_steps(THETA, "fine")
    usual = [s.longest for s in shooting.steps]
    shooting.hurry()
    assert shooting.choose_steps(THETA * [1, 1, 300.0, 1], "fine")
    assert all(s.longest >= u / HURRY / 2 for s, u in zip(shooting.steps, usual, strict=True))


def test_steps_that_are_fine_stay_as_they_are_when_asked_for_again() -> None:
    """Where they are checked once more, as after a fit, nothing is gained by shorter ones."""
    shooting = Shooting(Problem(model(), [recording(0, True)]))
    theta = shooting.problem.guess
    shooting.choose_steps(theta, "coarse")
    assert shooting.choose_steps(theta, "fine")
    fine = shooting.steps[0].longest
    for _ in range(3):
        assert not shooting.choose_steps(theta, "fine")
    assert shooting.steps[0].longest == fine


def test_the_last_residual_leaves_its_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
    """States and sensitivities at the optimum are those of the residual there, not run again."""
    shooting = Shooting(Problem(model(), recording(0, True)))
    theta = shooting.problem.guess
    shooting.choose_steps(theta, "fine")
    residual = shooting.residual(theta)
    monkeypatch.setattr(type(shooting.simulators[0]), "run", None)
    (response,) = shooting.responses(theta)
    np.testing.assert_array_equal((response.y - shooting.y) * shooting.weights, residual)
    np.testing.assert_allclose(response.states[:, 0], np.exp(-response.t), rtol=1e-3)
