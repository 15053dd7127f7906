"""A set of concealed recordings of the slosh rig."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path

import numpy as np

from pikanid import errors
from pikanid.validation.concealed.case import Order, make
from pikanid.validation.concealed.deck import deal
from pikanid.validation.concealed.excitations import CHOICES
from pikanid.validation.concealed.making import MOST_CASES, MadeSet, make_set
from pikanid.validation.concealed.seal import Secret, Settings


def generate(out: str | Path, truth: str | Path, settings: Settings, seed: int | None = None,
             workers: int | None = None,
             step: Callable[[str], None] = lambda text: None) -> MadeSet:
    """Write the recordings of a set to a folder and the truth about it to a file elsewhere.

    Args:
        out: Folder of the recordings and the seal.
        truth: File outside of it.
        settings: Of the set.
        seed: Known seed of an open set; None for a sealed one.
        workers: Processes; as many as there are cores by default.
        step: Called with the number of a case before the next one is begun.

    Raises:
        BadSetting: If a setting cannot work, a place is taken, or an unfinished set there has
            other settings.
    """
    check(settings)
    return make_set(
        out, truth, asdict(settings),
        lambda key: {order.name: partial(make, order) for order in orders_of(settings, key)},
        seed, workers, step)


def check(settings: Settings) -> None:
    """Refuse settings that cannot work.

    Raises:
        BadSetting: In that case.
    """
    if not 1 <= settings.cases <= MOST_CASES:
        raise errors.BadSetting(errors.conceal_cases(settings.cases, MOST_CASES))
    if settings.excitation not in CHOICES:
        raise errors.BadSetting(errors.conceal_excitation(settings.excitation, CHOICES))
    if not 1e-6 <= settings.sigma <= 0.2:
        raise errors.BadSetting(errors.conceal_sigma(settings.sigma))


def orders_of(settings: Settings, key: Secret) -> list[Order]:
    """What each case is to be, in the order of their numbers.

    >>> from pikanid.validation.concealed.seal import secret
    >>> orders = orders_of(Settings(3, "mixed", 1e-3, {"nothing": 1.0}), secret(1))
    >>> [order.name for order in orders]
    ['001', '002', '003']
    """
    rng = np.random.default_rng([key.seed])
    cards = deal(settings.cases, settings.mix, rng)
    width = max(3, len(str(settings.cases)))
    kinds = [settings.excitation] * settings.cases
    if settings.excitation == "mixed":
        halves = ["rich", "two_pulse"] * (settings.cases // 2 + 1)
        kinds = [halves[k] for k in rng.permutation(settings.cases)]
    return [Order(f"{i + 1:0{width}}", key.seed, i, card, kind, settings.sigma)
            for i, (card, kind) in enumerate(zip(cards, kinds, strict=True))]
