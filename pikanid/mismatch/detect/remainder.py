"""Tests of what a fit leaves, against everything that the catalogue and its decoys would show."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.stretches import once
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
    where: list[np.ndarray] = []
    for t, rows, held in _seen_at_once(whitened):
        blocks.append(frequency_bands(t, rate, asks))
        pasts.append(past_inputs(t, held, rate, asks))
        where.append(rows)
    count, total = min(len(b) for b in blocks), whitened.rows + more
    bands = [short(_scattered([b[k] for b in blocks], where, total)) for k in range(count)]
    return bands, short(_scattered(pasts, where, total))


def _seen_at_once(whitened: Whitened) -> Iterator[
        tuple[np.ndarray, np.ndarray, list[tuple[np.ndarray, np.ndarray]]]]:
    """Times of each output in each recording, of whose segments together, its rows, and times and
    values of the inputs.
    """
    problem = whitened.problem
    firsts = np.cumsum([0, *(len(s.t) for e in problem.experiments for s in e.samples)])
    at = iter(firsts.tolist())
    begin = [[next(at) for _ in e.samples] for e in problem.experiments]
    for own in whitened.records.stretches:
        pieces = [problem.experiments[r] for r in own]
        inputs = [(np.concatenate([h.time for h in same]), np.concatenate([h.values for h in same]))
                  for same in zip(*(e.held for e in pieces), strict=True)]
        held = [(t[once(t)], u[once(t)]) for t, u in inputs if len(t) > 1]
        for k in range(len(pieces[0].samples)):
            times = [e.samples[k].t for e in pieces]
            rows = [np.arange(begin[r][k], begin[r][k] + len(t))
                    for r, t in zip(own, times, strict=True)]
            yield np.concatenate(times), np.concatenate(rows), held


def _scattered(blocks: list[np.ndarray], where: list[np.ndarray], rows: int) -> np.ndarray:
    """Columns (rows, K) of blocks (N, k) that stand in rows (N,) of their own."""
    placed = np.zeros((rows, sum(b.shape[1] for b in blocks)))
    column = 0
    for block, own in zip(blocks, where, strict=True):
        placed[own, column:column + block.shape[1]] = block
        column += block.shape[1]
    return placed


def _above(rows: np.ndarray, more: int) -> np.ndarray:
    """Rows (N, k) with `more` rows of zeros below them."""
    return rows if more == 0 else np.vstack([rows, np.zeros((more, rows.shape[1]))])
