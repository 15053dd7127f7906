"""Tests of what a fit leaves, against everything that the catalogue and its decoys would show."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

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
from pikanid.noise.autoregressive import fit, innovations
from pikanid.problem.held import HeldInput
from pikanid.problem.inputs_past import ROWS, rests

AHEAD = 3  # numerical: samples, from its own one on, at which an input may know a sample's noise


def residual_tests(whitened: Whitened, theta: np.ndarray, r: np.ndarray, J: np.ndarray,
                   candidates: tuple[Candidate, ...], rate: float, seed: int = 0) -> Detection:
    """Test the residual of a fit against everything that the catalogue and its decoys would show,
    but for what follows an input that may follow the noise.

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
    J = short(np.concatenate([J, echoes(whitened, more)], axis=1))
    units, _ = unit_columns(D, J)
    return detect(-short(r), J, units, one_sided, bands, inputs, whitened.records.allowed,
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


def echoes(whitened: Whitened, more: int) -> np.ndarray:
    """Columns (rows, K) of what is new in each input that does not rest, at each sample and at the
    next ones, and the first of them times the time.

    A controller answers the noise of a sample at once, and in a closed loop whatever looks ahead
    (an input that comes too late, a clock that loses) shows where there is nothing but that noise
    (L. Ljung, System Identification, 1999, section 13.4).
    """
    blocks, where = [np.empty((0, 0))], [np.empty(0, int)]
    for t, rows, held in _seen_at_once(whitened):
        moving = [u for u in held if not rests(u)]
        if len(t) < ROWS * (AHEAD + 1) * len(moving):
            continue
        for values in (u.at(t) for u in moving):
            change = values - values.mean()
            new = innovations(change, fit(change))
            new = np.append(np.zeros(len(t) - len(new)), new)
            ahead = [np.append(new[k:], np.zeros(k)) for k in range(AHEAD)]
            blocks.append(np.stack([*ahead, new * (t - t[0])], axis=1))
            where.append(rows)
    return _scattered(blocks, where, whitened.rows + more)


def _seen_at_once(whitened: Whitened) -> Iterator[
        tuple[np.ndarray, np.ndarray, list[HeldInput]]]:
    """Times of each output in each recording, of whose segments together, its rows, and the inputs.
    """
    problem = whitened.problem
    firsts = np.cumsum([0, *(len(s.t) for e in problem.experiments for s in e.samples)])
    at = iter(firsts.tolist())
    begin = [[next(at) for _ in e.samples] for e in problem.experiments]
    for own in whitened.records.stretches:
        pieces = [problem.experiments[r] for r in own]
        held = [u for u in (_together(same) for same in zip(*(e.held for e in pieces), strict=True))
                if len(u.time) > 1]
        for k in range(len(pieces[0].samples)):
            times = [e.samples[k].t for e in pieces]
            rows = [np.arange(begin[r][k], begin[r][k] + len(t))
                    for r, t in zip(own, times, strict=True)]
            yield np.concatenate(times), np.concatenate(rows), held


def _together(pieces: Sequence[HeldInput]) -> HeldInput:
    """One input of all segments of a recording."""
    t, u = (np.concatenate([getattr(h, name) for h in pieces]) for name in ("time", "values"))
    return replace(pieces[0], time=t[once(t)], values=u[once(t)])


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
