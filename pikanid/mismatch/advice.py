"""What to record next, in a sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pikanid import errors
from pikanid.mismatch.experiments import next_experiment
from pikanid.mismatch.profiles import profiles
from pikanid.mismatch.result import Explanation, Verdict
from pikanid.mismatch.whitened import Records

LONGEST = 20.0  # [s] of a profile that is proposed
COMPARED = 2  # of the hypotheses in a set, the most probable
PROVE = ("Record the system once more, driven differently and over another range of amplitudes, "
         "and give that recording as held-out: it decides what is confirmed.")
EXPLORE = ("No law in the catalogue holds. Record (1) a free decay over a three-fold range of "
           "amplitude, (2) a slow sweep through the resonance at two input levels, and (3) two "
           "seconds at rest before each: they tell laws of the state, of the input and of the "
           "sensor apart.")


def advice(verdict: Verdict, given: Sequence[Explanation], records: Records, rate: float,
           proves: bool, workers: int = 1) -> str:
    """The next experiment for a verdict; empty where none is needed.

    Args:
        verdict: Of the diagnosis.
        given: Its hypotheses.
        records: That it was made from.
        rate: Natural frequency [rad/s].
        proves: Whether a held-out recording was there.
        workers: Threads.
    """
    if verdict in ("none", "named"):
        return ""
    if verdict == "set":
        return _separating(given[:COMPARED], records, rate, workers)
    if not given:
        return EXPLORE
    return EXPLORE if proves else PROVE


def _separating(given: Sequence[Explanation], records: Records, rate: float, workers: int) -> str:
    """The profile that best tells the most probable hypotheses apart."""
    model = given[0].model
    driven = [i for i in model.inputs if i.default is None]
    sigma = {o: level.sigma for o, level in records.levels[0].items()}
    names = [e.title for e in given]
    text = f"To tell {' from '.join(names)}: "
    if len(driven) != 1 or not rate > 0:
        return text + "let it swing freely from amplitudes at least three times apart, and long."
    try:
        offered = profiles(
            min(rate / (2 * np.pi), 5.0), duration=LONGEST, channel=driven[0].name,
            unit=driven[0].unit, draws=1)
        found = next_experiment({e.title: e.model for e in given}, records.recordings, sigma,
                                offered, workers=workers)
    except errors.PikanidError:
        return text + "no profile within the bounds of the drive could be planned."
    outcome = (f"expected to set them {found.value:.2g} standard deviations apart (now "
               f"{found.before:.2g}; repeating the last experiment, {found.repeated:.2g})")
    return text + f"run {found.profile.name}, {outcome}. `pikanid design` writes the profile."
