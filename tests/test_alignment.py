"""A signal and the motion that causes it, brought to one clock by their energies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pikanid.errors import BadRecording
from pikanid.recording import Recording
from pikanid.recording.alignment import energy_delay, moving
from pikanid.recording.channel import Channel

T = np.arange(0, 4, 0.002)
WINDOW = np.clip(np.sin(np.pi * (T - 0.5) / 3), 0, None) ** 4 * ((T > 0.5) & (T < 3.5))
PUSH = np.sin(7 * T) * WINDOW
LEAN = np.sin(3 * T + 1) * WINDOW
FILM = np.arange(0, 20, 1 / 60)


def run(heard: np.ndarray, late: float, seed: int = 0) -> Recording:
    """A motion of two unlike parts, and a film in which |heard| (at `T`) comes late."""
    rng = np.random.default_rng(seed)
    seen = np.abs(np.interp(FILM - late, T, heard, 0.0, 0.0))
    noisy = 2.0 + seen + 0.03 * rng.standard_normal(len(FILM))
    return Recording.from_arrays(T, {"push": PUSH, "lean": LEAN}).with_channels(
        Channel("h", FILM, noisy, "mm"))


@pytest.mark.parametrize("late", [6.0, 8.7654, 15.99])
def test_the_delay_of_what_answers_to_all_that_moves(late: float) -> None:
    shares = [np.sqrt(np.sum(u**2)) for u in (PUSH, LEAN)]
    heard = 50 * np.hypot(PUSH / shares[0], LEAN / shares[1])
    found = energy_delay(run(heard, late), "h", [["push"], ["lean"]])
    assert found == pytest.approx(late, abs=0.01)


@pytest.mark.parametrize("heard", [PUSH, LEAN], ids=["push", "lean"])
def test_what_answers_to_one_of_two_motions_is_off_by_a_part_of_a_lobe(heard: np.ndarray) -> None:
    # lobes of the energy of `push` are 0.45 s long
    assert energy_delay(run(heard, 8.0), "h", [["push"], ["lean"]]) == pytest.approx(8.0, abs=0.1)


def test_units_and_signs_of_the_motion_do_not_matter() -> None:
    rec = run(PUSH - LEAN, 9.1)
    turned = rec.with_channels(replace(rec["lean"], values=-57.3 * rec["lean"].values))
    motion = [["push"], ["lean"]]
    assert energy_delay(rec, "h", motion) == energy_delay(turned, "h", motion)


def test_gaps_in_the_film_and_motions_that_are_none_do_no_harm() -> None:
    rec = run(PUSH, 7.0)
    values = rec["h"].values.copy()
    values[::7] = np.nan
    still = Channel("still", T, 0 * T)
    rec = rec.with_channels(replace(rec["h"], values=values), still)
    assert energy_delay(rec, "h", [["push"], ["still"]]) == pytest.approx(7.0, abs=0.01)


def test_what_cannot_be_aligned_is_said() -> None:
    rec = run(PUSH, 7.0)
    with pytest.raises(BadRecording, match="nothing moves in still"):
        energy_delay(rec.with_channels(Channel("still", T, 0 * T)), "h", [["still"]])
    with pytest.raises(BadRecording, match="must cover the whole motion"):
        energy_delay(rec.with_channels(rec.window(7, 9)["h"]), "h", [["push"]])
    with pytest.raises(BadRecording, match="nothing moves"):
        moving(rec.with_channels(Channel("still", T, 0 * T)), ["still"])


def test_the_span_of_a_motion() -> None:
    begin, end = moving(run(PUSH, 7.0), ["push", "lean"])
    assert begin == pytest.approx(0.75, abs=0.25)
    assert end == pytest.approx(3.25, abs=0.25)
    assert np.all(np.abs(PUSH[(begin > T) | (end < T)]) < 1e-3)
