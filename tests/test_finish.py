"""Every number of an estimate, against linear regression written out by hand."""

from __future__ import annotations

from dataclasses import dataclass, replace

import interpreted
import numpy as np
import pytest
from read_off_noise import p_value
from scipy.stats import t as student

import pikanid as pk
from pikanid.errors import SimulationFailed
from pikanid.estimate import Estimate
from pikanid.model import Model
from pikanid.objective.shooting import Shooting
from pikanid.problem.problem import Problem
from pikanid.recording import Recording
from pikanid.strategies.finish import finish
from pikanid.strategies.nls import NLS

SLOPE, CONSTANT = 0.7, -1.3
STARTS = (2.0, 3.5)  # of the two recordings
TIMES = (np.linspace(0.0, 2.0, 15), np.linspace(0.0, 1.0, 12))
WEIGHED = {"x": 0.05, "w": 4.0}  # noise of the outputs; w is in other units


@dataclass(frozen=True)
class Case:
    """Which outputs are measured, what is known of their noise, and how often.

    `sigma` says of each output "stated", "by sample" or "" (unknown).
    """

    sigma: dict[str, str]
    recordings: int = 1
    missing: bool = False

    @property
    def several(self) -> bool:
        return len(self.sigma) > 1


CASES = {
    "stated": Case({"x": "stated"}),
    "by sample": Case({"x": "by sample"}),
    "unknown": Case({"x": ""}),
    "missing": Case({"x": "stated"}, missing=True),
    "two recordings": Case({"x": "stated"}, 2),
    "two recordings, unknown": Case({"x": ""}, 2, missing=True),
    "two outputs": Case({"x": "stated", "w": "by sample"}, 2, missing=True),
    "two outputs, unknown": Case({"x": "", "w": ""}, 2),
    "two outputs, one unknown": Case({"x": "stated", "w": ""}),
}


def line(case: Case) -> Model:
    """x' = b from x(0) = a; w = 80·x + c: every residual is linear in θ."""
    outputs = {"x": {"expression": "x"}, "w": {"expression": "80*x + c"}}
    parameters = {"a": {"guess": 1.0}, "b": {"guess": 0.1}}
    if "w" in case.sigma:
        parameters["c"] = {"guess": 0.0}
    model = Model.from_dict({
        "states": {"x": {"initial": "a"}}, "parameters": parameters, "equations": {"x": "b"},
        "outputs": {o: outputs[o] for o in case.sigma}})
    return model.per_recording("a") if case.recordings > 1 else model


def measured(case: Case) -> list[Recording]:
    rng, made = np.random.default_rng(3), []
    for start, t in zip(STARTS[:case.recordings], TIMES, strict=False):
        x = start + SLOPE * t
        clean = {"x": x, "w": 80 * x + CONSTANT}
        channels, sigmas = {}, {}
        for output, how in case.sigma.items():
            sizes = WEIGHED[output] * np.where(how == "by sample", 0.5 + np.arange(t.size) % 3, 1.0)
            channels[output] = clean[output] + rng.normal(size=t.size) * sizes
            if case.missing:
                channels[output][[3, 7]] = np.nan
            if how:
                sigmas[output] = sizes if how == "by sample" else WEIGHED[output]
        made.append(Recording.from_arrays(t, channels, sigma=sigmas))
    return made


@dataclass(frozen=True)
class Regression:
    """What linear regression says: rows output by output, recording by recording."""

    theta: np.ndarray
    covariance: np.ndarray
    residual: np.ndarray
    value: float
    dof: int
    p_value: float


def visible(t: np.ndarray, y: np.ndarray) -> tuple[float, int]:
    """σ from what polynomials through four neighbours leave, where no wider than twice as usual,
    and how many tell it.
    """
    left, wide = [], []
    for k in range(2, len(t) - 2):
        near = [k - 2, k - 1, k + 1, k + 2]
        at = (t[near] - t[k]) / np.median(np.diff(t))
        weights = np.linalg.solve(np.vander(at, increasing=True).T, [1.0, 0.0, 0.0, 0.0])
        left.append((y[k] - weights @ y[near]) / np.sqrt(1 + weights @ weights))
        wide.append(at[-1] - at[0])
    use = np.array(wide) <= 2.0001 * np.median(wide)
    return float(np.median(np.abs(np.array(left)[use]))) / 0.6744897501960817, int(use.sum())


def regression(case: Case, columns: list[int] | None = None,
               known: np.ndarray | None = None) -> Regression:
    """Of the parameters `columns` (by default all) with the others `known`.

    θ is a, or one a recording, then b, then c.
    """
    rows, y, weights, noise, told = [], [], [], [], []  # told: of each part, by how many
    for r, recording in enumerate(measured(case)):
        for output, how in case.sigma.items():
            channel = recording[output]
            seen = np.isfinite(channel.values)
            t, own = channel.time[seen], np.eye(case.recordings)[r]
            factor = 80.0 if output == "w" else 1.0
            design = np.column_stack([np.tile(factor * own, (t.size, 1)), factor * t])
            if "w" in case.sigma:
                design = np.column_stack([design, np.full(t.size, float(output == "w"))])
            values = channel.values[seen]
            unknown, by = visible(t, values)
            told.append((t.size, np.inf if how else by))
            spread = np.full(t.size, unknown)
            if how:
                spread = np.broadcast_to(np.asarray(channel.sigma), channel.values.shape)[seen]
            rows.append(design)
            y.append(values)
            noise.append(spread)
            weights.append(1 / spread if how or case.several else np.ones(t.size))
    X, Y, W, S = np.vstack(rows), *map(np.concatenate, (y, weights, noise))
    theta = np.zeros(X.shape[1]) if known is None else known.copy()
    free = list(range(X.shape[1])) if columns is None else columns
    theta[free] = 0.0
    A, b = X[:, free] * W[:, None], (Y - X @ theta) * W
    theta[free] = np.linalg.lstsq(A, b, rcond=None)[0]
    residual = Y - X @ theta
    dof = len(Y) - X.shape[1]
    covariance = np.full((len(theta),) * 2, np.nan)
    covariance[np.ix_(free, free)] = np.linalg.inv(A.T @ A)
    if not all(case.sigma.values()):
        covariance *= np.sum((W * residual) ** 2) / dof
    squares = (residual / S) ** 2
    parts = np.split(squares, np.cumsum([n for n, _ in told])[:-1])
    p = p_value([(float(part.sum()), by) for part, (_, by) in zip(parts, told, strict=True)], dof)
    return Regression(theta, covariance, residual, float(np.sum(squares)), dof, p)


@pytest.fixture
def by_python(monkeypatch: pytest.MonkeyPatch) -> None:
    interpreted.instead_of_compiled(monkeypatch)


def fitted(case: Case, **bounds: tuple[float, float]) -> Estimate:
    model = line(case).with_values(**{n: sum(ends) / 2 for n, ends in bounds.items()})
    return pk.NLS(starts=1).fit(model.with_bounds(**bounds), measured(case))


@pytest.mark.usefixtures("by_python")
@pytest.mark.parametrize("name", CASES)
def test_every_number_is_that_of_linear_regression(name: str) -> None:
    case, known = CASES[name], regression(CASES[name])
    found = fitted(case)
    std = np.sqrt(np.diag(known.covariance))
    np.testing.assert_allclose(found.theta, known.theta, atol=1e-5 * std.min())
    np.testing.assert_allclose(found.covariance / np.outer(std, std),
                               known.covariance / np.outer(std, std), atol=1e-6)
    np.testing.assert_allclose(found.correlation, known.covariance / np.outer(std, std), atol=1e-6)
    assert found.n == len(known.residual)
    ours = np.concatenate([f.residual for f in found.fits])
    np.testing.assert_allclose(ours, known.residual, atol=1e-6)
    assert found.cost == pytest.approx(0.5 * np.sum(known.residual**2))
    assert found.adequacy.value == pytest.approx(known.value)
    assert found.adequacy.dof == known.dof
    assert found.adequacy.p_value == pytest.approx(known.p_value, rel=1e-4)
    stated = all(case.sigma.values())
    assert found.adequacy.source == ("given" if stated else "differences")
    assert found.converged and found.adequacy.verdict == "fits"
    half = student.ppf(0.95, known.dof) * std[found.index("b")]
    assert found.interval("b", 0.9) == pytest.approx(
        (found.value("b") - half, found.value("b") + half))


@pytest.mark.usefixtures("by_python")
@pytest.mark.parametrize("name", ["stated", "two outputs"])
@pytest.mark.parametrize("beyond", [-8.0, -1.0, -0.1, 0.1, 1.0, 8.0])
def test_a_parameter_at_its_bound_may_lie_inside_it(name: str, beyond: float) -> None:
    """Of the others the mean square about the estimate, by quadrature over what b may be."""
    case = CASES[name]
    k, usual = line(case).parameter_names.index("b") + case.recordings - 1, regression(case)
    std = float(np.sqrt(usual.covariance[k, k]))
    at, side = usual.theta[k] + beyond * std, -np.sign(beyond)
    free = [j for j in range(len(usual.theta)) if j != k]
    found = fitted(case, b=(at, at + 9.0) if beyond > 0 else (at - 9.0, at))
    assert found.index("b") == k and found.value("b") == pytest.approx(at, abs=1e-6)
    assert np.isnan(found.std("b"))
    assert any("'b' ended at its " + ("lower" if beyond > 0 else "upper") in w
               for w in found.warnings)
    known = [regression(case, free, np.where(np.arange(len(found.theta)) == k, at - side * d, 0.0))
             for d in np.linspace(0.0, 8.0 * std, 161)]
    weights = np.exp([-0.5 * (one.value - known[0].value) for one in known])
    moved = np.array([one.theta[free] - known[0].theta[free] for one in known])
    expected = known[0].covariance[np.ix_(free, free)] + np.trapezoid(
        weights * (moved[:, :, None] * moved[:, None, :]).T) / np.trapezoid(weights)
    np.testing.assert_allclose(found.covariance[np.ix_(free, free)], expected, rtol=1e-3)
    np.testing.assert_allclose(found.theta[free], known[0].theta[free], rtol=1e-5)


@pytest.mark.usefixtures("by_python")
def test_what_was_measured_comes_back_with_its_noise_and_unit() -> None:
    case = CASES["two outputs"]
    found, recordings = fitted(case), measured(case)
    assert [(f.output, len(f.t)) for f in found.fits] == [
        ("x", 13), ("w", 13), ("x", 10), ("w", 10)]
    for k, fit in enumerate(found.fits):
        channel = recordings[k // 2][fit.output]
        seen = np.isfinite(channel.values)
        np.testing.assert_array_equal(fit.t, channel.time[seen])
        np.testing.assert_array_equal(fit.measured, channel.values[seen])
        sigma = np.broadcast_to(np.asarray(channel.sigma), seen.shape)[seen]
        np.testing.assert_array_equal(fit.sigma, sigma)
        assert fit.rmse == pytest.approx(np.sqrt(np.mean((fit.fitted - fit.measured) ** 2)))


def test_the_band_of_the_fit_covers_the_true_output_as_often_as_it_says() -> None:
    """Over many fits, at every sample; with noise added, new samples, too."""
    model = pk.systems.sloshing()
    clean = pk.simulate(model, pk.excitation.two_pulse())
    truth, inside, new = clean["theta"].values, [], []
    for seed in range(120):
        noise = np.random.default_rng(seed).normal(0.0, 0.01, (2, len(truth)))
        rec = clean.with_channels(replace(clean["theta"], values=truth + noise[0], sigma=0.01))
        (fit,) = pk.NLS(starts=1).fit(model, rec).fits
        assert fit.spread is not None
        moving = fit.spread > 0  # at rest before the first pulse: no parameter matters
        inside.append(np.mean(np.abs(fit.fitted - truth)[moving] < 1.96 * fit.spread[moving]))
        wide = 1.96 * np.hypot(fit.spread, 0.01)
        new.append(np.mean(np.abs(truth + noise[1] - fit.fitted) < wide))
    # samples of one fit go together: the spread over fits says how sure the mean is
    for found in (inside, new):
        assert abs(np.mean(found) - 0.95) < 3.5 * np.std(found) / np.sqrt(len(found))


def test_errors_of_an_input_are_said_to_be_left_out() -> None:
    model = pk.systems.sloshing()
    run = pk.simulate(model, pk.excitation.two_pulse(), sigma=2e-3, seed=0)
    rough = run.with_channels(replace(run["u_x"], sigma=0.1))
    told = [any("u_x" in w and "positions" in w for w in pk.NLS().fit(model, given).warnings)
            for given in (run, rough)]
    assert told == [False, True]


def test_what_bounds_hold_is_still_undetermined() -> None:
    """Only a product shows; one factor at its bound had made the other look sharp."""
    model = Model.from_dict({
        "states": {"x": {"initial": 0.0}}, "equations": {"x": "a*b - x"},
        "parameters": {"a": {"guess": 1.9, "bounds": [0.0, 2.0]}, "b": {"guess": 3.0}},
        "outputs": {"x": {"expression": "x"}}})
    t = np.linspace(0.0, 3.0, 60)
    seen = 6 * (1 - np.exp(-t)) + 0.01 * np.random.default_rng(1).normal(size=60)
    recording = Recording.from_arrays(t, {"x": seen}, sigma={"x": 0.01})
    shooting = Shooting(Problem(model, [recording]))
    theta = np.array([2.0, 3.0])
    shooting.choose_steps(theta, "fine")
    found = finish("nls", shooting.problem, shooting, theta, converged=True, history=[],
                   settings={}, seed=None, begun=0.0)
    assert np.isnan(found.std("a")) and np.isfinite(found.std("b"))
    assert any("do not determine the combination" in w for w in found.warnings)


def test_a_rate_that_is_no_number_at_the_start_is_told() -> None:
    model = Model.from_dict({
        "states": {"x": {"initial": 0.0}, "v": {"initial": 1.0}},
        "equations": {"x": "-a*log(x)", "v": "-v"}, "parameters": {"a": {"guess": 1.0}},
        "outputs": {"x": {"expression": "x"}}})
    recording = Recording.from_arrays(np.linspace(0.0, 1.0, 30), {"x": np.linspace(0.0, 1.0, 30)})
    with pytest.raises(SimulationFailed, match=r"rate of x is no finite number .*\(x = 0, v = 1\)"):
        NLS().fit(model, recording)
