"""What is said of a recording, in terms of hypotheses."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from pikanid.mismatch.catalogue.candidate import Channel
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.partial import Part
from pikanid.mismatch.judge.same_law import Names

Verdict = Literal["none", "named", "set", "partial", "unconfirmed", "unnamed"]


@dataclass(frozen=True)
class Answer:
    """Verdict, hypotheses given (most probable first) and the closest ones not given.

    `twins` lists, for a hypothesis given, the effects that stand for each other in it; `reasons`
    why others are not given, and `doubt` what keeps the first one from being confirmed or, where
    nothing explains what is missing, that it may be noise.  `rivals` are laws outside the catalogue
    that explain all as well, but are not likely enough to be given.
    `part` is what is surely there although something is left, `closest` what comes closest where
    nothing is, and `channels` are those in which something is, whatever it is.
    """

    verdict: Verdict
    given: tuple[Hypothesis, ...]
    others: tuple[Hypothesis, ...]
    twins: dict[frozenset[str], dict[str, Names]] = field(default_factory=dict)
    reasons: dict[frozenset[str], str] = field(default_factory=dict)
    doubt: str = ""
    rivals: tuple[Hypothesis, ...] = ()
    part: Part | None = None
    closest: Part | None = None
    channels: tuple[Channel, ...] = ()
