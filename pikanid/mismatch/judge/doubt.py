"""What keeps an explanation that predicts held-out data from being proved there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from statistics import NormalDist

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.noise_level import UNKNOWN
from pikanid.mismatch.fitting.decisions import below, smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.prediction import HeldOut

PROVEN = 4.0  # of the criterion: what each of several effects must gain on held-out recordings
# of χ² in all recordings, that one effect must gain, and each of two, of three, of four: 4.5
# standard deviations in each of two recordings; several together can take up most of anything
STRONG = (40.0, 45.0, 90.0, 135.0)
AT_MOST = 1.64  # standard errors by which the noise may be larger than it seems
FOUND = 12.0  # of χ² that it must gain in the recording it was found in: the other one is the proof
WORSE = 1.5  # times the nominal held-out RMSE: no proof, whatever errors of parameters forgive
POWER = 0.9  # probability with which held-out recordings must refute an effect that is not there
Predict = Callable[[Hypothesis], HeldOut | None]


def least_proof(alpha: float) -> float:
    """χ² that an effect must be worth in held-out recordings for these to prove anything.

    Of two predictions that lie √λ standard deviations apart, the wrong one is refused at the level
    α with a probability of Φ(√λ - z(1-α)) (J. Neyman and E. S. Pearson, Phil. Trans. A 231, 1933),
    which has to be `POWER`.

    Args:
        alpha: Rate of false alarms.

    >>> round(least_proof(0.01), 1)
    13.0
    """
    z = NormalDist().inv_cdf
    return max(z(POWER) - z(alpha), 0.0) ** 2


def why_not(h: Hypothesis, ranked: Sequence[Hypothesis], predict: Predict, scale: float,
            alpha: float) -> str:
    """Why a hypothesis is not proved on other data; empty where it is.

    Each effect has to be strong.  What is weak can be a facet of anything: laws that no catalogue
    holds leave nothing beside it that a test would find.  The held-out recording has to be one that
    could have refuted it.  And it has to speak for each of several: one is easily found that takes
    up what the others leave, whatever that is.

    Args:
        h: To prove.
        ranked: All hypotheses.
        predict: What they make of the held-out recordings.
        scale: That divides χ².
        alpha: Rate of false alarms.
    """
    fits = {o.key: o for o in ranked}
    nominal = predict(fits[frozenset()])
    proof = predict(h)
    if nominal and proof and smaller(WORSE * nominal.misfit, proof.misfit):
        return "as it stands it predicts the held-out recording far worse than the nominal model"
    louder = float(np.exp(AT_MOST * min(h.whitened.records.spread, UNKNOWN)))
    for e in h.effects:
        rest = h.key - {e.key}
        count = max(len(h.effects), len(e.covers) if h.symbolic else 1)
        asked = STRONG[count - 1] * louder
        # a formula that is the sum of two entries must need both
        for fewer in (rest, *(rest | {part} for part in e.covers if h.symbolic)):
            o = fits.get(fewer)
            if o is None:
                continue
            a, b = predict(h), predict(o)
            later = 0.0 if a is None or b is None else max(b.deviance - a.deviance, 0.0)
            first = (o.minimum.chi2 - h.minimum.chi2) / scale
            if below(first, FOUND):
                return f"the recording itself hardly shows {e.name}"
            power = _worth(e, a, b) / scale
            if below(power, least_proof(alpha)):
                return (f"the held-out recording could not have refuted {e.name} (it is worth "
                        f"{power:.1f} of chi-squared there, {least_proof(alpha):.0f} are asked)")
            gain = first + later / scale
            if below(gain, asked):
                return (f"{e.name} is too weak to be sure of (it lowers chi-squared by {gain:.0f}, "
                        f"{asked:.0f} are asked)")
            if len(h.effects) > 1 and not e.absent and not speaks(h, o, predict, PROVEN * scale):
                return f"the held-out recording does not need {e.name}"
    return ""


def speaks(one: Hypothesis, other: Hypothesis, predict: Predict, margin: float = 0.0) -> bool:
    """Whether held-out recordings speak for one hypothesis rather than another, by a `margin`."""
    a, b = predict(one), predict(other)
    return a is not None and b is not None and below(a.deviance, b.deviance - margin)


def _worth(effect: Candidate, with_it: HeldOut | None, without: HeldOut | None) -> float:
    """χ² that an effect is worth in held-out recordings, where it is there: how far apart the
    predictions with it and without it lie, each with its parameters moved within their errors.

    A limit that is not met there is worth nothing.  What happens once is not there at all: then the
    motion has to be seen, or any lasting effect in the place of what happened would go unnoticed.
    """
    if with_it is None or without is None:
        return 0.0
    if effect.absent:
        return with_it.motion
    if effect.parameters and {p.name for p in effect.parameters} <= with_it.inert:
        return 0.0
    return float(np.sum((with_it.rest - without.rest) ** 2))
