"""Tests of what a fit leaves, against everything that the catalogue and its guards would show."""

from __future__ import annotations

import numpy as np

from pikanid.mismatch.candidate import Candidate
from pikanid.mismatch.detect import Detection, detect, frequency_bands, past_inputs, unit_columns
from pikanid.mismatch.tangent import directions
from pikanid.mismatch.whitened import Whitened

MOST_ROWS = 6000  # of a residual that is tested as it is


def residual_tests(whitened: Whitened, theta: np.ndarray, r: np.ndarray, J: np.ndarray,
                   candidates: tuple[Candidate, ...], rate: float, seed: int = 0) -> Detection:
    """Test the residual of a fit against everything that the catalogue and its guards would show.

    r and J may have more rows than there are samples: those of a prior.
    """
    found = directions(whitened, theta, candidates)
    more = len(r) - whitened.rows
    D = np.vstack([found.D, np.zeros((more, found.D.shape[1]))])
    bands, inputs = lines(whitened, rate, more)
    count = -(-whitened.rows // MOST_ROWS)
    if count > 1:
        r, J, D, inputs, *bands = (
            condensed(part, whitened.rows, count) for part in (r, J, D, inputs, *bands))
    units, _ = unit_columns(D, J)
    return detect(-r, J, units, found.one_sided, bands, inputs, whitened.records.spread, seed)


def condensed(rows: np.ndarray, samples: int, count: int) -> np.ndarray:
    """Sums of `count` neighbouring rows over √count: white stays white, slow signs stay as clear.

    Rows behind the first `samples` are those of a prior and stay as they are.
    """
    ends = np.arange(0, samples, count)
    return np.concatenate([np.add.reduceat(rows[:samples], ends, axis=0) / np.sqrt(count),
                           rows[samples:]])


def lines(whitened: Whitened, rate: float, more: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Bands of frequency and the inputs' past, for all rows (and `more` rows of zeros)."""
    blocks: list[list[np.ndarray]] = []
    pasts: list[np.ndarray] = []
    for experiment in whitened.problem.experiments:
        held = [(h.time, h.values) for h in experiment.held if len(h.time) > 1]
        for s in experiment.samples:
            blocks.append(frequency_bands(s.t, rate))
            pasts.append(past_inputs(s.t, held, rate))
    count = min(len(b) for b in blocks)
    bands = [_stacked([b[k] for b in blocks], more) for k in range(count)]
    return bands, _stacked(pasts, more)


def _stacked(blocks: list[np.ndarray], more: int) -> np.ndarray:
    from scipy.linalg import block_diag

    whole = block_diag(*blocks)
    return np.vstack([whole, np.zeros((more, whole.shape[1]))])
