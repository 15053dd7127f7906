"""Which case hides what: dealt so that every id of the catalogue occurs equally often."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.validation.concealed.effect import Effect
from pikanid.validation.concealed.effects import (
    IDS,
    NEAR,
    OUTSIDE,
    POTENTIAL_FLOW,
    UNFORESEEN,
    variants,
)
from pikanid.validation.concealed.families import families_of

CLASSES = ("nothing", "single", "pair", "near", "outside", "unforeseen", "remainder")
# What is not named here has no share: sets of before those classes stay byte for byte the same.
DEFAULT_MIX: Mapping[str, float] = {
    "nothing": 0.10, "single": 0.45, "pair": 0.20, "near": 0.12,
    "outside": 0.13}  # definition: shares of the classes
FLOW = Effect(POTENTIAL_FLOW, "outside", "dynamics")
# Laws that stand for each other or contain each other do not make a pair.
_OVERLAP = (
    {"coulomb_friction", "quadratic_drag", "power_drag", "amplitude_damping"},
    {"input_delay", "sensor_delay", "actuator_lag", "sensor_lag"},
    {"input_gain", "sensor_gain"}, {"static_bias", "sensor_offset"},
    {"sensor_saturation", "wall_impact"}, {"input_saturation", "input_dead_zone", "hysteresis"})
# What may be left beside hidden effects, and how many laws at a time.
LAWS = (*NEAR, *OUTSIDE, *UNFORESEEN)
MOST_LAWS = 3  # definition: of a remainder
# Hidden beside a remainder: what a second recording can confirm, and strong enough; the boundary
# layer nowhere reaches a third of what is wanted.
STEADY = tuple(identifier for identifier in IDS if identifier != "boundary_layer" and all(
    effect.quantities and effect.held_out == "same" for effect in variants(identifier)))


@dataclass(frozen=True)
class Card:
    """What one case hides.

    Attributes:
        kind: One of CLASSES.
        effects: None, one or two.
        remainder: What is left beside them: laws that no catalogue holds.
    """

    kind: str
    effects: tuple[Effect, ...]
    remainder: tuple[Effect, ...] = ()


def parse_mix(text: str, classes: Sequence[str] = CLASSES) -> dict[str, float]:
    """Shares of the classes, summing to 1.

    Raises:
        BadSetting: If a class is unknown, a share no number ≥ 0, or all are 0.

    >>> parse_mix("single=3,nothing=1")
    {'nothing': 0.25, 'single': 0.75, 'pair': 0.0, 'near': 0.0, 'outside': 0.0}
    """
    shares = dict.fromkeys([c for c in DEFAULT_MIX if c in classes], 0.0)
    for part in text.split(","):
        name, _, number = part.partition("=")
        try:
            share = float(number)
        except ValueError:
            share = -1.0
        if name.strip() not in classes or not 0.0 <= share < 1e6:
            raise errors.BadSetting(errors.conceal_mix(text, classes))
        shares[name.strip()] = share
    total = sum(shares.values())
    if total <= 0.0:
        raise errors.BadSetting(errors.conceal_mix(text, classes))
    return {name: share / total for name, share in shares.items()}


def deal(cases: int, mix: Mapping[str, float], rng: np.random.Generator) -> list[Card]:
    """Cards in random order.

    >>> cards = deal(200, DEFAULT_MIX, np.random.default_rng(0))
    >>> met = [effect.id for card in cards for effect in card.effects]
    >>> len(cards), min(met.count(identifier) for identifier in IDS) >= 5
    (200, True)
    """
    ids = _endless(IDS, rng)
    near = _endless(tuple(range(len(NEAR))), rng)
    # The flow is the outsider that matters most: every second one.
    outside = _endless((*OUTSIDE, *[FLOW] * len(OUTSIDE)), rng)
    unforeseen, steady, hand = _endless(UNFORESEEN, rng), _endless(STEADY, rng), _Hand(LAWS, rng)
    cards = []
    for kind, number in counts(cases, mix).items():
        for _ in range(number):
            if kind == "single":
                cards.append(Card(kind, (_variant(next(ids), rng),)))
            elif kind == "pair":
                cards.append(Card(kind, _two(ids, rng)))
            elif kind == "near":
                cards.append(Card(kind, (NEAR[next(near)],)))
            elif kind == "outside":
                cards.append(Card(kind, (next(outside),)))
            elif kind == "unforeseen":
                cards.append(Card(kind, (next(unforeseen),)))
            elif kind == "remainder":
                hidden = (_two(steady, rng) if rng.random() < 0.5
                          else (_variant(next(steady), rng),))
                cards.append(Card(kind, hidden, hand.dealt(
                    int(rng.integers(1, MOST_LAWS + 1)), hidden)))
            else:
                cards.append(Card(kind, ()))
    return [cards[k] for k in rng.permutation(len(cards))]


def counts(cases: int, mix: Mapping[str, float]) -> dict[str, int]:
    """Whole numbers of each class that sum to `cases`, by largest remainders."""
    exact = {kind: cases * mix.get(kind, 0.0) for kind in CLASSES}
    found = {kind: int(number) for kind, number in exact.items()}
    order = sorted(CLASSES, key=lambda kind: found[kind] - exact[kind])
    for kind in order[: cases - sum(found.values())]:
        found[kind] += 1
    return found


def _endless(things: tuple, rng: np.random.Generator) -> Iterator:
    """All of them, again and again, each time in another order."""
    while True:
        for k in rng.permutation(len(things)):
            yield things[k]


def redealt(card: Card, rng: np.random.Generator) -> Card:
    """As many other hidden effects beside the same laws."""
    ids = _endless(STEADY, rng)
    while True:
        hidden = _two(ids, rng) if len(card.effects) == 2 else (_variant(next(ids), rng),)
        if all(apart(law, effect) for law in card.remainder for effect in hidden):
            return Card(card.kind, hidden, card.remainder)


class _Hand:
    """Laws to be dealt as often as each other, although not every one goes with every effect."""

    def __init__(self, laws: tuple[Effect, ...], rng: np.random.Generator):
        self.laws, self.rng = laws, rng
        self.left: list[Effect] = []

    def dealt(self, number: int, hidden: tuple[Effect, ...]) -> tuple[Effect, ...]:
        """So many laws that stand apart from the hidden effects and from each other."""
        chosen: list[Effect] = []
        while len(chosen) < number:
            fitting = [law for law in self.left
                       if all(apart(law, other) for other in (*hidden, *chosen))]
            if fitting:
                chosen.append(fitting[0])
                self.left.remove(fitting[0])
            else:
                self.left += [self.laws[k] for k in self.rng.permutation(len(self.laws))]
        return tuple(chosen)


def apart(law: Effect, other: Effect) -> bool:
    """Whether a law beside another effect leaves no doubt what each of them is.

    Not where they are of one family, one stands for the other, or both set the same.

    >>> [apart(law, variants("coulomb_friction")[0]) for law in UNFORESEEN[:4]]
    [False, False, False, True]
    """
    names, others = ({e.id, e.near, *e.twins} - {""} for e in (law, other))
    groups = (group for group in _OVERLAP if names & group)
    return not (names & others or any(others & group for group in groups)
                or families_of(law.id, law.variant) & families_of(other.id, other.variant)
                or _settings(law) & _settings(other))


def _settings(effect: Effect) -> set[str]:
    return {field for quantity in effect.quantities for field, _ in quantity.sets} | {
        field for field, _ in effect.fixed}


def _variant(identifier: str, rng: np.random.Generator) -> Effect:
    choices = variants(identifier)
    return choices[int(rng.integers(len(choices)))]


def _two(ids: Iterator[str], rng: np.random.Generator) -> tuple[Effect, Effect]:
    first = next(ids)
    second = next(ids)
    while second == first or any({first, second} <= group for group in _OVERLAP):
        # Put back at the end of nothing: a skipped id is made up for by the next round.
        second = next(ids)
    return _variant(first, rng), _variant(second, rng)
