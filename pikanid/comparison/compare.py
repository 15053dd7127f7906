"""`validate`: how well do models predict recordings, and is one better than another?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np

from pikanid import errors
from pikanid.comparison.analyse import LAGS, analyse
from pikanid.comparison.bootstrap import pairs, twins
from pikanid.comparison.contender import contenders
from pikanid.comparison.horizon import usual_window
from pikanid.comparison.predictions import (
    BASELINE,
    Baseline,
    Prediction,
    Protocol,
    least_noise,
    of_model,
)
from pikanid.comparison.residual_analysis import ResidualAnalysis
from pikanid.comparison.runs import Start, free_run
from pikanid.comparison.scores import Score, score
from pikanid.comparison.validation import ALPHA, NOISE, Validation
from pikanid.noise.level import difference_noise
from pikanid.problem.arguments import several
from pikanid.recording import Recording


def validate(models: Any, recordings: Recording | Sequence[Recording], *,
             training: Recording | Sequence[Recording] = (), first: int = 0,
             initial: Start = "model", horizon: int | None = None, window: int | None = None,
             origins: int = 5000, baseline: bool = True, lags: int = LAGS, alpha: float = ALPHA,
             seed: int = 0) -> Validation:
    """Compare models on recordings, with the best linear model and the noise beside them.

    By default every model is simulated freely from its initial state: nothing measured is used but
    the inputs.  With `horizon` it predicts so many samples ahead instead, from a state that is
    estimated of the samples before each origin (`pikanid.comparison.horizon`).

    Args:
        models: A `Model` (at its values), an `Estimate`, several of them, or a dictionary with
            their names.
        recordings: What to predict.
        training: What the linear baseline is fitted to; models that are no estimates count as
            fitted to it, too.  By default those of `recordings` that the first model was fitted
            to; else all of them, which is to the baseline's advantage.
        first: Samples of each output from which the initial state is estimated, and which are not
            scored, as nonlinearbenchmark.org has it; 0: none.
        initial: Where `first` is 0: "model", the initial state as the model has it (values that it
            leaves free are fitted to the recording), or "free", all of it fitted.
        horizon: Samples of the first output to predict ahead; None to simulate.
        window: Samples before each origin that its state is estimated of; by default as many as
            are predicted, and at least 10 a state.
        origins: Windows at most, evenly spread.
        baseline: Whether to add the best linear model.
        lags: Of the residual analysis of each model, in samples.
        alpha: Below which a difference between two models is called significant; rate of false
            alarms of the residual analysis.
        seed: Of the bootstrap that compares them.

    Raises:
        BadModel: A model is none, or they do not measure the same outputs.
        BadRecording: A channel is missing or unusable.
        BadSetting: A number is out of range, or a recording is too short for it.

    >>> import pikanid as pk
    >>> model = pk.systems.sloshing()
    >>> rec = pk.simulate(model, pk.excitation.two_pulse(), sigma=2e-3, seed=1)
    >>> off = model.with_values(l_theta=0.046)
    >>> found = validate({"right": model, "wrong": off}, rec, baseline=False)
    >>> found.ranking, [round(found.score(n).fit, 1) for n in found.ranking]
    (('right', 'wrong'), [96.6, 84.7])
    """
    records = several(recordings)
    trained = _given(training)
    _check(first, initial, horizon, window, origins, lags, alpha)
    found = contenders(models, trained)
    states = max(len(c.model.states) for c in found)
    protocol = Protocol(first, initial, horizon, 0 if horizon is None else (
        window or usual_window(horizon, states)), origins)
    named: dict[str, list[Prediction]] = {c.name: [] for c in found}
    residuals: dict[str, tuple[ResidualAnalysis, ...]] = {}
    for c in found:
        for recording in records:
            made, run = of_model(c, recording, protocol)
            named[c.name] += made
            if horizon is None:
                residuals[c.name] = (*residuals.get(c.name, ()),
                                     *analyse(c, run, lags, alpha, None, first))
    notes = [note for r in records for note in _diverged(named, r)]
    if baseline:
        learnt = trained or tuple(r for r in records if any(
            p.held_out is False for p in named[found[0].name] if p.recording == r.name))
        richest = max((c.model for c in found), key=lambda m: len(m.inputs))
        linear = Baseline(richest, learnt or records, protocol)
        notes += linear.notes
        own_predictions = [p for r in records for p in linear.predictions(r)]
        if len(own_predictions) == len(named[found[0].name]):
            named[BASELINE] = own_predictions
    notes += dict.fromkeys(w for own in residuals.values() for a in own
                           for w in a.warnings(alpha / len(own)))
    return assembled(named, residuals, protocol, alpha, seed, tuple(notes))


def resid(models: Any, recordings: Recording | Sequence[Recording], *,
          training: Recording | Sequence[Recording] = (), first: int = 0, initial: Start = "model",
          lags: int = LAGS, rho: float | None = None, alpha: float = ALPHA
          ) -> tuple[ResidualAnalysis, ...]:
    """Residual analysis of a free simulation: one for each model, recording and output.

    Is the residual white, and independent of the inputs at all lags?  Bands and joint tests count
    the noise model and what was fitted (`pikanid.comparison.whitened`).

    Args:
        models, recordings, training, first, initial: As in `validate`.
        lags: In samples.
        rho: Correlation of neighbours in the noise, if it is known; by default white or AR(1)
            noise, whichever BIC prefers.
        alpha: Rate of false alarms of every joint test; bands hold 1 - alpha.

    Raises:
        BadModel, BadRecording, BadSetting: As in `validate`.

    >>> import pikanid as pk
    >>> model = pk.systems.sloshing()
    >>> rec = pk.simulate(model, pk.excitation.multisine(duration=5), sigma=2e-3, seed=0)
    >>> (found,) = resid(pk.NLS().fit(model, rec), rec)
    >>> found.ok, found.test("whiteness").dof
    (True, 25)
    """
    trained = _given(training)
    _check(first, initial, None, None, 1, lags, alpha)
    if rho is not None and not -1 < rho < 1:
        raise errors.BadSetting(errors.bad_value("'rho'", rho, "a number between -1 and 1"))
    return tuple(
        analysis for c in contenders(models, trained) for r in several(recordings)
        for analysis in analyse(c, free_run(c, r, first, initial), lags, alpha, rho, first))


def _given(training: Recording | Sequence[Recording]) -> tuple[Recording, ...]:
    return several(training) if isinstance(training, Recording) or len(training) else ()


def assembled(named: dict[str, list[Prediction]],
              residuals: dict[str, tuple[ResidualAnalysis, ...]], protocol: Protocol, alpha: float,
              seed: int, notes: tuple[str, ...]) -> Validation:
    """Scores, ranking and pairs of predictions by name, all on the samples that every model has."""
    there = [_common(same) for same in zip(*named.values(), strict=True)]
    named = _quieter(named, there)
    lists = list(named.values())
    scores: list[Score] = []
    squares: dict[str, list[np.ndarray]] = {}
    losses: dict[str, float] = {}
    for name, own in named.items():
        made = [_scored(p, m) for p, m in zip(own, there, strict=True)]
        scores += made
        # in units of the noise, of which all models have the same: a quiet output counts fully
        squares[name] = [p.residual[m] ** 2 / float(np.mean(q.sigma[m] ** 2))
                         for p, q, m in zip(own, lists[0], there, strict=True)]
        loss = float(np.mean(np.concatenate(squares[name])))
        losses[name] = loss if np.isfinite(loss) else np.inf
    sound = {n: e for n, e in squares.items() if all(np.all(np.isfinite(x)) for x in e)}
    for p, m in zip(lists[0], there, strict=True):
        scores.append(_noise(p, m))
    alike = twins(sound)
    notes += tuple(errors.predict_alike(group) for group in alike)
    return Validation(tuple(scores), tuple(sorted(losses, key=losses.__getitem__)),
                      pairs(sound, seed), {n: tuple(own) for n, own in named.items()},
                      residuals, protocol, alpha, notes, alike)


def _quieter(named: dict[str, list[Prediction]], there: list[np.ndarray]
             ) -> dict[str, list[Prediction]]:
    """The same with estimates of the noise that no residual contradicts: a signal that reaches the
    highest frequencies looks noisier than it is, and what a model leaves there is noise or less.
    """
    found: dict[str, list[Prediction]] = {name: [] for name in named}
    for same, m in zip(zip(*named.values(), strict=True), there, strict=True):
        left = [difference_noise(p.residual[m], p.t[m]) for p in same
                if np.isfinite(p.residual[m]).all()]
        least = least_noise(same[0].measured)
        for name, p in zip(named, same, strict=True):
            sigma = p.sigma if p.sigma_source == "given" else np.minimum(
                p.sigma, max(min(left, default=np.inf), least))
            found[name].append(replace(p, sigma=sigma))
    return found


def _check(first: int, initial: str, horizon: int | None, window: int | None, origins: int,
           lags: int, alpha: float) -> None:
    for name, value, least in (("first", first, 0), ("horizon", horizon, 1),
                               ("window", window, 1), ("origins", origins, 1),
                               ("lags", lags, 1)):
        if value is not None and (isinstance(value, bool) or not isinstance(value, int)
                                  or value < least):
            raise errors.BadSetting(errors.bad_value(
                f"'{name}'", value, f"a whole number, {least} or more"))
    if initial not in get_args(Start):
        raise errors.BadSetting(errors.bad_value("'initial'", initial, '"model" or "free"'))
    if not 0 < alpha < 1:
        raise errors.BadSetting(errors.bad_value("'alpha'", alpha, "a number between 0 and 1"))


def _diverged(named: dict[str, list[Prediction]], recording: Recording) -> list[str]:
    return [errors.prediction_diverged(name, recording.name) for name, own in named.items()
            if any(p.recording == recording.name and not np.isfinite(p.predicted).any()
                   for p in own)]


def _common(same: tuple[Prediction, ...]) -> np.ndarray:
    """Which samples (N,) every model predicts, but those that predict none."""
    masks = [np.isfinite(p.predicted) for p in same]
    return np.all([m for m in masks if m.any()] or [np.ones(len(masks[0]), bool)], axis=0)


def _scored(p: Prediction, there: np.ndarray) -> Score:
    return score(p.model, p.recording, p.output, p.unit, p.held_out, p.measured[there],
                 p.predicted[there], p.sigma[there], p.sigma_source, p.parameters, p.fitted_here)


def _noise(p: Prediction, there: np.ndarray) -> Score:
    """What a perfect model leaves: the noise."""
    sigma, n = p.sigma[there], int(there.sum())
    rmse = float(np.sqrt(np.mean(sigma**2)))
    about = float(np.std(p.measured[there]))
    fit = 100.0 * (1.0 - rmse / about) if about > 0 else float("nan")
    r2 = 1.0 - (rmse / about) ** 2 if about > 0 else float("nan")
    nothing = float("nan")
    return Score(NOISE, p.recording, p.output, p.unit, None, n, rmse, fit, r2, float(n), n, nothing,
                 rmse, p.sigma_source, 0, nothing, nothing)
