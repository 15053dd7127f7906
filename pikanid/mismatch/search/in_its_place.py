"""Where fits of a law begin that stands in the place of what explains a recording."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection
from pikanid.mismatch.detect.tangent import directions
from pikanid.mismatch.fitting.decisions import steady
from pikanid.mismatch.fitting.descent import Start
from pikanid.mismatch.fitting.extended import extended
from pikanid.mismatch.fitting.hypothesis import Hypothesis, unfitted

MOST = 4  # limit: frequencies, or regions, from which fits begin


def in_its_place(h: Hypothesis, effect: Candidate, law: Candidate) -> list[Start]:
    """Starts at the frequencies, or in the regions, at which a law does most of what an effect of a
    hypothesis does, with the model's parameters as they are beside that: set free, these take up
    what any push does.

    Args:
        h: That explains a recording.
        effect: Of it.
        law: In its place; of its directions those that begin alike but for a size go together.
    """
    rest = [e for e in h.effects if e is not effect]
    about = unfitted(extended(effect.site.model, rest), h.whitened.records, h.point)
    if about is None:
        return []
    found = directions(about.whitened, about.minimum.theta, [law])
    if not found.directions:
        return []
    r, together = about.minimum.r, _alike(found.directions)
    groups = [found.D[:, own] for own in together]
    fits = [np.linalg.lstsq(group, -r)[0] for group in groups]
    left = steady(np.array([np.sum((r + group @ sizes) ** 2)
                            for group, sizes in zip(groups, fits, strict=True)]))
    lowest = [n for n in range(len(left)) if left[n] == min(left[max(n - 1, 0):n + 2])]
    starts = []
    for n in sorted(lowest, key=lambda n: left[n])[:MOST]:
        signs = [found.directions[k] for k in together[n]]
        at = {n: v for part in (h.point, *(sign.start for sign in signs)) for n, v in part.items()}
        names = [next(iter(sign.start)) for sign in signs]
        starts.append(Start({**at, **dict(zip(names, steady(fits[n]).tolist(), strict=True))},
                            {**at, **dict.fromkeys(names, 0.0)}))
    return starts


def _alike(signs: Sequence[TangentDirection]) -> list[list[int]]:
    """Numbers of neighbouring signs that begin alike but for their first parameter, a size."""
    return [[k for k, _ in group] for _, group in itertools.groupby(
        enumerate(signs), key=lambda one: tuple(one[1].start.items())[1:])]
