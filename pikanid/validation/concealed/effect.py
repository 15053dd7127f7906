"""What one hidden effect is: which settings of the rig it turns, by how much, and how it is drawn.

An effect has a *size*, its first quantity, which is chosen so that the effect is as visible as
wanted, and further quantities that give it its shape, drawn at random.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pikanid.validation.concealed.rig import Rig

Kind = Literal["catalogue", "near", "outside"]
Channel = Literal["dynamics", "input", "sensor"]
Reference = Literal["", "angle", "input", "duration", "rate"]


@dataclass(frozen=True)
class Scales:
    """What relative quantities refer to, in one case.

    Attributes:
        angle: Largest angle of the nominal rig in the train experiment [rad].
        input: Largest |u_x| there [m/s²].
        duration: Of the experiment [s].
        rate: Natural frequency [rad/s].
    """

    angle: float
    input: float
    duration: float
    rate: float

    def of(self, reference: Reference) -> float:
        """The scale named, 1 for none."""
        return 1.0 if not reference else float(getattr(self, reference))


@dataclass(frozen=True)
class Quantity:
    """One parameter of an effect.

    Attributes:
        name: As it is called in formulas.
        unit: Of the value in the truth file.
        sets: (field of the rig, factor) for every setting that it determines.
        draw: Intervals that it is drawn from; for a size, from hardly visible to gross.
        starts: From where a fit of this effect as a rival starts.
        bounds: Between which it is fitted.
        relative: Scale that `draw`, `starts` and `bounds` are shares of.
        signed: Whether either sign is drawn.
        log: Whether it is drawn evenly in its logarithm.
        neutral: Value at which nothing happens; the drawn number is added to it.
        tied: Whether the drawn number is a multiple of the size.
    """

    name: str
    unit: str
    sets: tuple[tuple[str, float], ...]
    draw: tuple[tuple[float, float], ...]
    starts: tuple[float, ...]
    bounds: tuple[float, float]
    relative: Reference = ""
    signed: bool = False
    log: bool = True
    neutral: float = 0.0
    tied: bool = False

    @property
    def grows(self) -> bool:
        """Whether its effect vanishes at the neutral value and grows with the distance from it."""
        return self.draw[0][0] < self.draw[0][1]

    @property
    def both_ways(self) -> bool:
        """Whether it may lie on either side of the neutral value."""
        return self.bounds[0] < self.neutral

    def between(self, share: float, interval: int = 0) -> float:
        """The drawable number at a share 0 to 1 of an interval.

        >>> q = Quantity("c", "rad/s^2", (("coulomb", 1),), ((0.01, 1.0),), (0.3,), (0, 30))
        >>> round(q.between(0.5), 6)
        0.1
        """
        low, high = self.draw[interval]
        if self.log:
            return float(low * (high / low) ** share)
        return low + (high - low) * share


@dataclass(frozen=True)
class Effect:
    """An entry of the list of what can hide.

    Attributes:
        id: As in the catalogue, in reports and in the truth file.
        kind: Of the catalogue, close to an entry of it, or outside.
        channel: Where it acts.
        quantities: The size first; empty for an effect that is there or not.
        fixed: (field of the rig, value) that is always set.
        variant: Distinguishes effects of one id.
        twins: Ids that no recording of this kind can tell from it.
        covers: Ids of laws that it contains as special cases: it is no rival of theirs.
        near: Id of the catalogue's entry that it resembles.
        held_out: Whether a second recording has the same, none, or another one of its kind.
    """

    id: str
    kind: Kind
    channel: Channel
    quantities: tuple[Quantity, ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()
    variant: str = ""
    twins: tuple[str, ...] = ()
    covers: tuple[str, ...] = ()
    near: str = ""
    held_out: Literal["same", "absent", "other"] = "same"

    def applied(self, rig: Rig, values: Mapping[str, float]) -> Rig:
        """The rig with this effect, at values by name of quantity in SI units."""
        settings = dict(self.fixed)
        for quantity in self.quantities:
            for field, factor in quantity.sets:
                settings[field] = factor * values[quantity.name]
        return rig._replace(**settings)

    def drawn(self, rng: np.random.Generator, scales: Scales) -> Shape:
        """Everything but the size, at random."""
        numbers, signs = {}, {}
        for quantity in self.quantities:
            signs[quantity.name] = float(rng.choice([-1.0, 1.0])) if quantity.signed else 1.0
            which = int(rng.integers(len(quantity.draw)))
            numbers[quantity.name] = quantity.between(float(rng.random()), which)
        return Shape(self, scales, numbers, signs)


@dataclass(frozen=True)
class Shape:
    """An effect whose size is still open."""

    effect: Effect
    scales: Scales
    numbers: Mapping[str, float]
    signs: Mapping[str, float]

    def sized(self, share: float) -> dict[str, float]:
        """Values of all quantities at a size between hardly visible (0) and gross (1).

        Rounded to five digits, so that they do not depend on the last bits of a computation.
        """
        values: dict[str, float] = {}
        size = 0.0
        for i, quantity in enumerate(self.effect.quantities):
            number = quantity.between(share) if i == 0 else self.numbers[quantity.name]
            number *= self.scales.of(quantity.relative) * self.signs[quantity.name]
            size = number if i == 0 else size
            value = quantity.neutral + (number * size if quantity.tied else number)
            values[quantity.name] = float(f"{value:.5g}")
        return values
