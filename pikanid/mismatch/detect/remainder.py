"""Tests of what a fit leaves, against everything that the catalogue and its decoys would show."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.detect.residual_tests import (
    Detection,
    detect,
    frequency_bands,
    past_inputs,
    unit_columns,
)
from pikanid.mismatch.detect.tangent import directions


def residual_tests(whitened: Whitened, theta: np.ndarray, r: np.ndarray, J: np.ndarray,
                   candidates: tuple[Candidate, ...], rate: float, seed: int = 0) -> Detection:
    """Test the residual of a fit against everything that the catalogue and its decoys would show.

    r and J may have more rows than there are samples: those of a prior.
    """
    more = len(r) - whitened.rows
    count = -(-whitened.rows // whitened.settings.budget.rows_tested)

    def short(rows: np.ndarray) -> np.ndarray:
        return rows if count == 1 else condensed(rows, whitened.rows, count)

    found = directions(whitened, theta, candidates)
    D, one_sided = short(_above(found.D, more)), found.one_sided
    del found  # of a long recording there is no room for all at once
    bands, inputs = lines(whitened, rate, more, short)
    units, _ = unit_columns(D, short(J))
    return detect(-short(r), short(J), units, one_sided, bands, inputs, whitened.records.allowed,
                  whitened.settings, seed)


def condensed(rows: np.ndarray, samples: int, count: int) -> np.ndarray:
    """Sums of `count` neighbouring rows over √count: white stays white, slow signs stay as clear.

    Rows behind the first `samples` are those of a prior and stay as they are.
    """
    ends = np.arange(0, samples, count)
    return np.concatenate([np.add.reduceat(rows[:samples], ends, axis=0) / np.sqrt(count),
                           rows[samples:]])


def lines(whitened: Whitened, rate: float, more: int,
          short: Callable[[np.ndarray], np.ndarray] = lambda rows: rows
          ) -> tuple[list[np.ndarray], np.ndarray]:
    """Bands of frequency and the inputs' past, for all rows (and `more` rows of zeros), each made
    `short` at once.
    """
    asks = whitened.settings.detection
    blocks: list[list[np.ndarray]] = []
    pasts: list[np.ndarray] = []
    for experiment in whitened.problem.experiments:
        held = [(h.time, h.values) for h in experiment.held if len(h.time) > 1]
        for s in experiment.samples:
            blocks.append(frequency_bands(s.t, rate, asks))
            pasts.append(past_inputs(s.t, held, rate, asks))
    count = min(len(b) for b in blocks)
    bands = [short(_stacked([b[k] for b in blocks], more)) for k in range(count)]
    return bands, short(_stacked(pasts, more))


def _stacked(blocks: list[np.ndarray], more: int) -> np.ndarray:
    from scipy.linalg import block_diag

    return _above(block_diag(*blocks), more)


def _above(rows: np.ndarray, more: int) -> np.ndarray:
    """Rows (N, k) with `more` rows of zeros below them."""
    return rows if more == 0 else np.vstack([rows, np.zeros((more, rows.shape[1]))])
