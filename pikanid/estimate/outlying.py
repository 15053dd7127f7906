"""Samples that lie far off a fit by themselves: an encoder that slipped once, a frame misread.

Least squares follow one such sample as far as a thousand ordinary ones would lead.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

from pikanid.estimate.data import Fit
from pikanid.noise.level import EFFICIENCY, NORMAL
from pikanid.problem.held import HeldInput
from pikanid.problem.inputs_past import explained

RATE = 1e-3  # limit: probability that normal noise has such a sample anywhere in a recording
MOST = 0.01  # limit: share of samples; of more, the noise or the model is what is different
FEWEST = 20  # limit: samples that tell how large the noise is
LAGS = 12  # limit: samples after which a rig that is as fast as its sampling has answered
CHANCE = 1e-6  # limit: that noise alone counts as what the inputs' past explains
LOOSE = 0.2  # limit: of a stated σ; of 20 samples right noise leaves so little once in 10^11
CLEAN = 1e-4  # limit: of a signal's range: less is left of simulations without noise
SHOWN = 3  # layout: times that are listed


def outlying(fit: Fit, inputs: Sequence[HeldInput] = ()) -> np.ndarray:
    """Which samples lie off a fit by themselves, farther than normal noise would go, and than what
    the inputs' past explains: a late sensor leaves a sample alone after each step of an input.

    The noise is what the median absolute residual says, which a few samples do not move (P. J.
    Rousseeuw and C. Croux, J. Am. Stat. Assoc. 88, 1993).  A sample counts that is as far off both
    its neighbours as well: what lasts is a matter of the model.  None counts where they are
    more than one in a hundred.

    Returns:
        Indices (K,).

    >>> t = np.arange(50.0)
    >>> fit = Fit("run", "y", "", t, np.sin(7 * t * t) + 40 * (t == 17), np.zeros(50))
    >>> outlying(fit)
    array([17])
    """
    r = fit.residual if fit.sigma is None else fit.residual / fit.sigma
    if len(r) < FEWEST:
        return np.array([], int)
    r = r - np.median(r)
    noise = float(np.median(np.abs(r))) / NORMAL
    # what few samples say of the noise is as uncertain as Student's t says
    far = -float(stdtrit(EFFICIENCY * len(r), 0.5 * RATE / len(r))) * noise
    found = (np.abs(r) > far) & (_alone(r) > far) if noise > 0.0 else np.zeros(len(r), bool)
    if found.any() and inputs:
        # of slow parts the explanation knows little: only how neighbours differ counts
        part = explained(fit.t, r, inputs, LAGS, CHANCE)
        left, told = _alone(r - part), _alone(part)
        # one step alone would explain any sample after it: the same must follow another one
        again = np.flatnonzero((told > 0.5 * far) & (left < 0.5 * told))
        for k in np.flatnonzero(found & (left <= far)):
            found[k] = not np.any(np.abs(again - k) > LAGS)
    at = np.flatnonzero(found)
    apart = (np.diff(at, prepend=-2) > 1) & (np.diff(at, append=len(r) + 1) > 1)
    return at[apart] if len(at) <= max(MOST * len(r), 1) else np.array([], int)


def _alone(r: np.ndarray) -> np.ndarray:
    """How far each sample (N,) is from the nearer one of its neighbours."""
    beside = np.pad(r, 1, mode="reflect")
    return np.minimum(np.abs(r - beside[:-2]), np.abs(r - beside[2:]))


def loose_warning(fit: Fit) -> str:
    """What to do about a stated σ far above what a fit leaves; empty where it is not: two outputs,
    one of them in another unit, would look fine together.
    """
    if fit.sigma is None or len(fit.residual) < FEWEST:
        return ""
    ratio = float(np.sqrt(np.mean((fit.residual / fit.sigma) ** 2)))
    if ratio >= LOOSE or fit.rmse <= CLEAN * np.ptp(fit.measured):
        return ""
    stated = f"{float(np.median(fit.sigma)):.3g} {fit.unit}".rstrip()
    return (f"Recording '{fit.recording}', '{fit.output}': the fit leaves {ratio:.2g} times the "
            f"stated noise ({stated}), which hardly counts so: is that sigma in another unit?")


def outlying_warning(fit: Fit, inputs: Sequence[HeldInput]) -> str:
    """What to do about samples that lie off a fit by themselves; empty where there are none."""
    found = outlying(fit, inputs)
    if len(found) == 0:
        return ""
    times = ", ".join(f"{t:.6g}" for t in fit.t[found][:SHOWN])
    more = ", ..." if len(found) > SHOWN else ""
    what = "1 sample lies" if len(found) == 1 else f"{len(found)} samples lie"
    return (f"Recording '{fit.recording}', '{fit.output}': {what} far off all others "
            f"(t = {times}{more} s). A wrong reading can move every estimate: if it is one, leave "
            "it empty in the file, or NaN.")
