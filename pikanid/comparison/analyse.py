"""From a free simulation to the analysis of its residual."""

from __future__ import annotations

import numpy as np

from pikanid.comparison.contender import Contender
from pikanid.comparison.correlations import (
    Correlation,
    Joint,
    autocorrelation,
    jointly,
    with_columns,
)
from pikanid.comparison.dependence import binned
from pikanid.comparison.residual_analysis import ResidualAnalysis
from pikanid.comparison.runs import Run
from pikanid.comparison.spectrum import spectrum
from pikanid.comparison.whitened import White, whitened
from pikanid.noise.autoregressive import fit as fitted_ar
from pikanid.noise.projection import orthonormal, project
from pikanid.problem.problem import Experiment, Samples

LAGS = 25  # definition: as MATLAB's resid, unless it is said
FEW = 20  # numerical: samples of a residual, at least, for an analysis
EXACT = 1e-9  # numerical: of an output's range: a smaller residual is rounding, not noise
COLOUR = 15  # numerical: order of the noise, at most, in the test of feedback


def analyse(contender: Contender, run: Run, lags: int, alpha: float, rho: float | None,
            first: int = 0) -> list[ResidualAnalysis]:
    """Analyse the residual of a free simulation, output by output.

    Args:
        contender, run: The model and its simulation.
        lags: K.
        alpha: Probability outside of each band, and of each false alarm.
        rho: Correlation of neighbours in the noise; None to find out.
        first: Samples at the beginning of each output that do not count.
    """
    found = []
    ends = np.cumsum([0, *(len(s.t) for s in run.experiment.samples)])
    for s, a, b in zip(run.experiment.samples, ends[:-1], ends[1:], strict=True):
        rows = slice(a + first, b)
        if not run.finished or b - a - first < max(FEW, 3 * len(run.own)):
            continue
        cut = s.part(slice(first, None))
        J, own = run.response.sensitivity[rows], len(run.own)
        seen = contender.held_out(s.t, s.y, contender.model.outputs[s.output].name) is False
        here = J if seen else J[:, :own]
        away = J[:, :0] if seen else J[:, own:]
        covariance = np.zeros((0, 0)) if seen else contender.covariance
        sigma = np.ones(len(cut.t)) if cut.sigma is None else cut.sigma
        residual = cut.y - run.response.y[rows]
        white = whitened(cut.t, residual, sigma, here, away, covariance, rho)
        if np.std(residual) > EXACT * np.ptp(s.y):
            found.append(_of_output(contender, run, cut, residual, white, lags, alpha))
    return found


def _of_output(contender: Contender, run: Run, s: Samples, residual: np.ndarray, white: White,
               lags: int, alpha: float) -> ResidualAnalysis:
    model, experiment = contender.model, run.experiment
    output = model.outputs[s.output]
    correlation, test = autocorrelation(white, lags)
    tests = [test, jointly(white, np.ones((len(s.t), 1)), "mean", "")]
    cross, moving = {}, []
    for k, item in enumerate(model.inputs):
        every = np.arange(-lags, lags + 1)
        U = _lagged(experiment, k, s.t, every, white.interval)
        if not np.any(np.ptp(U, axis=0) > 0):
            continue
        moving.append(k)
        U -= U.mean(axis=0)
        values, std = with_columns(white, U)
        cross[item.name] = Correlation(every, values, np.zeros(len(every)), std)
        tests.append(jointly(white, U[:, lags:], "independence", item.name))
        tests.append(_feedback(white, U[:, lags:], U[:, :lags], item.name))
    dependences = []
    states = [np.interp(s.t, run.response.t, column) for column in run.response.states.T]
    inputs = experiment.inputs(s.t)
    listed = [(q.name, q.unit, x) for q, x in zip(model.states, states, strict=True)]
    listed += [(model.inputs[k].name, model.inputs[k].unit, inputs[:, k]) for k in moving]
    for name, unit, x in listed:
        dependence, columns = binned(white, name, unit, x)
        if dependence is not None:
            dependences.append(dependence)
            tests.append(jointly(white, columns, "dependence", name))
    tests.append(_normality(white))
    grid = np.zeros(int(white.places[-1]) + 1)
    grid[white.places] = residual
    t = s.t[0] + white.interval * np.arange(len(grid))
    on_grid = experiment.inputs(t)
    power = spectrum(grid, white.interval, white.rho,
                     {model.inputs[k].name: on_grid[:, k] for k in moving}, alpha)
    return ResidualAnalysis(contender.name, experiment.name, output.name, output.unit, white,
                            residual, correlation, cross, power, tuple(dependences),
                            tuple(t for t in tests if t is not None), alpha)


def _lagged(experiment: Experiment, k: int, t: np.ndarray, lags: np.ndarray, interval: float
            ) -> np.ndarray:
    """Input k at times t (N,), some samples earlier: (N, lags); beyond its record its end values.
    """
    return np.stack([experiment.inputs(t - lag * interval)[:, k] for lag in lags], axis=1)


def _feedback(white: White, past: np.ndarray, future: np.ndarray, name: str) -> Joint | None:
    """Does the residual say anything of the input's future that its past does not (C. A. Sims, Am.
    Econ. Rev. 62, 1972)?  A misfit is correlated over long times, so both are filtered first.
    """
    ar = fitted_ar(white.r - white.r.mean(), COLOUR).coefficients
    p = len(ar)
    taps = np.concatenate([[1.0], -ar])

    def filtered(rows: np.ndarray) -> np.ndarray:
        return np.stack([np.convolve(column, taps, "valid") for column in rows.T], axis=1)

    r = filtered(white.r[:, None])[:, 0]
    X, Y = filtered(past), filtered(future)
    Q = orthonormal(np.concatenate([X, np.ones((len(X), 1))], axis=1))
    left = project(Q, Y)
    strong = np.linalg.norm(left, axis=0) > 1e-6 * np.linalg.norm(Y, axis=0)
    rest = project(Q, r)
    even = White(white.t[p:], np.arange(len(r)), white.interval, rest, white.scale, Q,
                 -np.ones(Q.shape[1]), 0.0, False)
    return jointly(even, left[:, strong], "feedback", name)


def _normality(white: White) -> Joint:
    """D'Agostino and Pearson's test of skewness and kurtosis (Biometrika 60, 1973)."""
    from scipy.stats import normaltest

    statistic, p = normaltest(white.r)
    return Joint("normality", "", float(statistic), 2, float(p))
