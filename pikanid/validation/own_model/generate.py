"""A set of concealed recordings of a rig of one's own."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from pikanid import errors
from pikanid.recording import Recording
from pikanid.validation.concealed.deck import counts
from pikanid.validation.concealed.making import MOST_CASES, MadeSet, make_set
from pikanid.validation.concealed.seal import Secret
from pikanid.validation.own_model.case import CLASSES, Order, make
from pikanid.validation.own_model.rig import Rig

DEFAULT_MIX: Mapping[str, float] = {
    "nothing": 0.2, "single": 0.45, "pair": 0.15,
    "outside": 0.2}  # definition: shares of the classes


@dataclass(frozen=True)
class OwnSet:
    """What a set is made from; two runs with equal content and seed give equal bytes.

    Attributes:
        rig: Model, experiments, noise and effects.
        cases: How many.
        mix: Share of each class: nothing, single, pair, outside (a law of no catalogue).

    Raises:
        BadSetting: If a number cannot be.
    """

    rig: Rig
    cases: int = 20
    mix: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.cases <= MOST_CASES:
            raise errors.BadSetting(errors.conceal_cases(self.cases, MOST_CASES))
        if wrong := {*(self.mix or {})} - {*CLASSES}:
            raise errors.BadSetting(errors.conceal_mix(", ".join(sorted(wrong)), CLASSES))

    @property
    def content(self) -> dict[str, object]:
        """As it stands in the truth file."""
        rig = self.rig
        return {"cases": self.cases, "noise": rig.noise, "mix": dict(self.mix or DEFAULT_MIX),
                "model": rig.model.to_dict(), "effects": sorted({e.key for e in rig.own}),
                "experiments": [_digest(e) for e in (rig.train, rig.held_out)]}

    def orders(self, key: Secret) -> list[Order]:
        """What each case is to be, in the order of their numbers."""
        rng = np.random.default_rng([key.seed])
        kinds = [kind for kind, n in counts(self.cases, self.mix or DEFAULT_MIX).items()
                 for _ in range(n)]
        width = max(3, len(str(self.cases)))
        return [Order(f"{i + 1:0{width}}", key.seed, i, kinds[k], self.rig)
                for i, k in enumerate(rng.permutation(self.cases))]


def generate(out: str | Path, truth: str | Path, wanted: OwnSet, seed: int | None = None,
             workers: int | None = None,
             step: Callable[[str], None] = lambda text: None) -> MadeSet:
    """Write the recordings of a set to a folder and the truth about it to a file elsewhere.

    Args:
        out: Folder of the recordings and the seal.
        truth: File outside of it.
        wanted: The set.
        seed: Known seed of an open set; None for a sealed one.
        workers: Processes; as many as there are cores by default.
        step: Called with the number of a case before the next one is begun.

    Raises:
        BadSetting: If a place is taken, or an unfinished set there has other settings.
        SimulationFailed: If the model cannot be simulated in these experiments.
    """
    wanted.rig.scene(wanted.rig.nominal.values)
    return make_set(
        out, truth, wanted.content,
        lambda key: {order.name: partial(make, order) for order in wanted.orders(key)},
        seed, workers, step)


def _digest(experiment: Recording) -> str:
    known = hashlib.sha256()
    for name in experiment.names:
        known.update(name.encode())
        known.update(np.ascontiguousarray(experiment[name].time, dtype=float).tobytes())
        known.update(np.ascontiguousarray(experiment[name].values, dtype=float).tobytes())
    return known.hexdigest()
