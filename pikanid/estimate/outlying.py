"""Samples that lie far off a fit by themselves: an encoder that slipped once, a frame misread.

Least squares follow one such sample as far as a thousand ordinary ones would lead.
"""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from pikanid.estimate.data import Fit

RATE = 1e-3  # limit: probability that normal noise has such a sample anywhere in a recording
EFFICIENCY = 0.37  # definition: of the median absolute deviation, normal noise
MOST = 0.01  # limit: share of samples; of more, the noise or the model is what is different
FEWEST = 20  # limit: samples that tell how large the noise is
SHOWN = 3  # layout: times that are listed
MAD = 1.4826  # definition: median absolute deviation to standard deviation, normal noise


def outlying(fit: Fit) -> np.ndarray:
    """Which samples lie off a fit by themselves, farther than normal noise would go.

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
    noise = MAD * float(np.median(np.abs(r)))
    # what few samples say of the noise is as uncertain as Student's t says
    far = -float(stdtrit(EFFICIENCY * len(r), 0.5 * RATE / len(r))) * noise
    inner = np.pad(r, 1, mode="reflect")
    off = np.minimum(np.abs(r - inner[:-2]), np.abs(r - inner[2:]))
    found = np.flatnonzero((np.abs(r) > far) & (off > far)) if noise > 0.0 else np.array([], int)
    alone = (np.diff(found, prepend=-2) > 1) & (np.diff(found, append=len(r) + 1) > 1)
    return found[alone] if len(found) <= max(MOST * len(r), 1) else np.array([], int)


def outlying_warning(fit: Fit) -> str:
    """What to do about samples that lie off a fit by themselves; empty where there are none."""
    found = outlying(fit)
    if len(found) == 0:
        return ""
    times = ", ".join(f"{t:.6g}" for t in fit.t[found][:SHOWN])
    more = ", ..." if len(found) > SHOWN else ""
    what = "1 sample lies" if len(found) == 1 else f"{len(found)} samples lie"
    return (f"Recording '{fit.recording}', '{fit.output}': {what} far off all others "
            f"(t = {times}{more} s). A wrong reading can move every estimate: if it is one, leave "
            "it empty in the file, or NaN.")
