"""In which channels effects act: the dynamics, an input, a sensor."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import get_args

from pikanid.mismatch.catalogue.candidate import Candidate, Channel
from pikanid.mismatch.fitting.hypothesis import Hypothesis


def acts_in(e: Candidate) -> frozenset[Channel]:
    """Channels in which an effect may act: of exact twins, as a delay of input or sensor, any."""
    if len(e.ids) > 1:
        return frozenset(get_args(Channel))
    formula = not e.known or e.read
    if e.channel != "dynamics" or not formula:
        return frozenset({e.channel})
    # a force of inputs alone is what an input's curve makes; one of inputs and states is either's
    if not _holds(e, e.site.inputs):
        return frozenset({"dynamics"})
    return frozenset({"dynamics", "input"} if _holds(e, e.site.model.state_names) else {"input"})


def needed(h: Hypothesis) -> frozenset[Channel]:
    """Channels in which an explanation cannot do without something."""
    return frozenset(c for e in h.effects if len(own := acts_in(e)) == 1 for c in own)


def _holds(e: Candidate, names: Sequence[str]) -> bool:
    return any(re.search(rf"\b{n}\b", e.expression) for n in names)
