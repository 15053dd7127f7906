"""Covariance and bands of an estimate by refitting resampled recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pikanid import errors
from pikanid.comparison.bootstrap import block_length
from pikanid.estimate import Estimate
from pikanid.estimate.data import Fit
from pikanid.recording import Channel, Recording
from pikanid.recording.acceleration import acceleration
from pikanid.strategies.nls import NLS


def bootstrap(estimate: Estimate, recordings: Recording | Sequence[Recording],
              resamples: int = 100, seed: int = 0,
              positions: Mapping[str, str] | None = None) -> Estimate:
    """The estimate with covariance and bands by the residual bootstrap.

    Every resample is the fitted output with residuals drawn in circular blocks, as long as their
    own correlation asks for (see `pikanid.comparison.bootstrap`), and is fitted by least squares
    from the estimate on.  Nothing is linearised, and noise need be neither normal nor white; what a
    wrong model leaves is resampled as if it were noise.

    Args:
        estimate: Whose parameters, covariance (n_free, n_free) and `Fit.spread` (N,) are meant.
        recordings: Those that it was fitted to, in their order.
        resamples: How many; the relative error of a standard error is 1/√(2 resamples).
        seed: Of the draws.
        positions: Acceleration among the inputs -> channel of the position, with a sigma, that it
            was derived from by `pikanid.recording.acceleration`: every resample has another one
            that the position's errors allow.  Other covariances leave errors of inputs out.

    Raises:
        BadSetting: Fewer than two resamples.
        BadRecording: The recordings are not those of the fit.

    >>> import pikanid as pk
    >>> model = pk.systems.sloshing()
    >>> run = pk.simulate(model, pk.excitation.two_pulse(), sigma=2e-3, seed=0)
    >>> fit = pk.NLS().fit(model, run)
    >>> ratio = pk.bootstrap(fit, run, resamples=20).std("l_theta") / fit.std("l_theta")
    >>> 0.5 < ratio < 1.5
    True
    """
    if resamples < 2:
        raise errors.BadSetting(errors.bad_value("resamples", resamples, "two or more"))
    given = [recordings] if isinstance(recordings, Recording) else list(recordings)
    outputs = len(estimate.model.outputs)
    if len(estimate.fits) != outputs * len(given):
        raise errors.BadRecording(errors.bad_value(
            "recordings", len(given), "those of the fit, in their order"))
    moved = [{new: acceleration(r[old], new) for new, old in (positions or {}).items()}
             for r in given]
    rng = np.random.default_rng(seed)
    start = estimate.fitted_model
    thetas, curves = [], []
    for _ in range(resamples):
        drawn = [recording.with_channels(*(
            _resampled(fit, recording[fit.output], rng)
            for fit in estimate.fits[k * outputs:(k + 1) * outputs]),
            *(found.draw(rng) for found in moved[k].values()))
            for k, recording in enumerate(given)]
        again = NLS().fit(start, drawn)
        thetas.append(again.theta)
        curves.append([fit.fitted for fit in again.fits])
    spreads = [np.std(own, axis=0, ddof=1) for own in zip(*curves, strict=True)]
    return replace(
        estimate, covariance=np.atleast_2d(np.cov(np.array(thetas), rowvar=False)),
        fits=tuple(replace(f, spread=s) for f, s in zip(estimate.fits, spreads, strict=True)))


def _resampled(fit: Fit, channel: Channel, rng: np.random.Generator) -> Channel:
    """The fitted output with residuals in another order."""
    left = fit.residual - np.mean(fit.residual)
    n = len(left)
    length = block_length(left)
    starts = rng.integers(0, n, -(-n // length))
    order = (starts[:, None] + np.arange(length)).ravel()[:n] % n
    return Channel(fit.output, fit.t, fit.fitted + left[order], fit.unit, fit.sigma, channel.hold)
