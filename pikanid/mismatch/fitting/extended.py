"""The nominal model with effects added, made once: a search asks for the same ones many times."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.model import Model

ORDER = ("dynamics", "input", "sensor")


def extended(nominal: Model, effects: Sequence[Candidate]) -> Model:
    """The nominal model with all effects: what inputs are mapped to acts in what is added to
    equations as well, and sensors show what acts.

    Raises:
        BadUnit: If an effect has no meaning beside the others.
        BadModel: If two effects give an input the same map.
    """
    ordered = sorted(effects, key=lambda e: ORDER.index(e.channel))
    return _made(_Itself(nominal), *map(_Itself, ordered))


@dataclass(frozen=True, eq=False)
class _Itself:
    """Stands for an object that is no other one, however alike."""

    own: Model | Candidate

    def __hash__(self) -> int:
        return id(self.own)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Itself) and self.own is other.own


@functools.lru_cache(maxsize=512)  # the hypotheses of a diagnosis
def _made(nominal: _Itself, *effects: _Itself) -> Model:
    model = nominal.own
    assert isinstance(model, Model)
    for effect in effects:
        assert isinstance(effect.own, Candidate)
        model = effect.own.applied(model)
    return model
