"""Where fits of a force that swings begin, in the place of what explains a recording."""

from __future__ import annotations

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.detect.tangent import directions
from pikanid.mismatch.fitting.decisions import steady
from pikanid.mismatch.fitting.descent import Start
from pikanid.mismatch.fitting.extended import extended
from pikanid.mismatch.fitting.hypothesis import Hypothesis, unfitted

MOST = 4  # limit: frequencies from which fits begin


def swings(h: Hypothesis, effect: Candidate, law: Candidate) -> list[Start]:
    """Starts at the frequencies at which a law does most of what an effect of a hypothesis does,
    with the model's parameters as they are beside that: set free, these take up what any push does.

    Args:
        h: That explains a recording.
        effect: Of it.
        law: In its place; its directions come in twos, a quarter of a turn apart.
    """
    rest = [e for e in h.effects if e is not effect]
    about = unfitted(extended(effect.site.model, rest), h.whitened.records, h.point)
    if about is None:
        return []
    found = directions(about.whitened, about.minimum.theta, [law])
    if not found.directions:
        return []
    r = about.minimum.r
    pairs = np.split(found.D, len(found.directions) // 2, axis=1)
    fits = [np.linalg.lstsq(pair, -r)[0] for pair in pairs]
    left = steady(np.array([np.sum((r + pair @ sizes) ** 2)
                            for pair, sizes in zip(pairs, fits, strict=True)]))
    lowest = [n for n in range(len(left)) if left[n] == min(left[max(n - 1, 0):n + 2])]
    starts = []
    for n in sorted(lowest, key=lambda n: left[n])[:MOST]:
        signs = found.directions[2 * n:2 * n + 2]
        at = {**h.point, **signs[0].start, **signs[1].start}
        names = [next(iter(sign.start)) for sign in signs]
        starts.append(Start({**at, **dict(zip(names, steady(fits[n]).tolist(), strict=True))},
                            {**at, **dict.fromkeys(names, 0.0)}))
    return starts
