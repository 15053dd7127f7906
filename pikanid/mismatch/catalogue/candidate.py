"""What an entry of the catalogue becomes for one model: a term to add, and how it would show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from pikanid.mismatch.catalogue.site import Site
from pikanid.model import Model
from pikanid.model.parts import Parameter

Channel = Literal["dynamics", "input", "sensor"]
FAMILIES = ("dry friction", "drag", "restoring force", "constant force", "timing", "gain",
            "input curve", "sensor curve", "mode", "slow change", "other axis", "once")
Family = str  # one of these, or a kind of its own that a user names
Array = np.ndarray
Resistance = Callable[..., Array]  # (speed (N,), each parameter but the size) -> (N,)
Parts = Callable[[Sequence[float]], Sequence[Mapping[str, Sequence[float]]]]
# (values by name, states (L,) by name) -> values by name, from each of which a fit begins
Begin = Callable[[Mapping[str, float], Mapping[str, Array]], Sequence[Mapping[str, float]]]
# definition: families of laws of one channel, which have a slope: a scale error is one of them
CURVES = ("input curve", "sensor curve")
SYMBOLIC = "symbolic:"  # before the formula, in the id of a law that no catalogue holds


@dataclass(frozen=True)
class View:
    """The nominal motion in one recording, at the stops of its simulation: t (L,), and by name
    states, inputs and recorded channels (L,), the rates of the states, and the rows that are seen.

    `by_parameter` holds p ∂f_v/∂p (L,) by the names (v, p) of a rate and of a parameter that its
    equation holds: several equations may hold one.
    """

    t: Array
    x: Mapping[str, Array]
    rates: Mapping[str, Array]
    u: Mapping[str, Array]
    extra: Mapping[str, Array]
    y: Mapping[str, Array]
    y_rate: Mapping[str, Array]
    by_parameter: Mapping[tuple[str, str], Array]


@dataclass(frozen=True)
class TangentDirection:
    """How a small effect would show: as a force on q'', a change of inputs, or of what is seen.

    `start` holds parameter values from where a fit begins; the first parameter is the size: it
    starts at `null + amplitude * size`, with the amplitude that suits the residual best, and the
    parameter's own value as null unless given.
    `one_sided`: the amplitude must be positive.
    `push` holds changes of inputs over each step (L,), or at its ends and its middle (3, L).
    `forces` (L, n) are added to the rates of all states.
    """

    start: Mapping[str, float]
    force: Array | None = None
    push: Mapping[str, Array] = field(default_factory=dict)
    seen: Array | None = None
    forces: Array | None = None
    initial: Mapping[str, float] = field(default_factory=dict)
    one_sided: bool = False
    scales: bool = True
    null: float | None = None


@dataclass(frozen=True)
class Powers:
    """A force |q|^q |v|^v, against the motion or, if it `restores`, towards the rest."""

    q: int
    v: int
    restores: bool = False


@dataclass(frozen=True)
class Limit:
    """The law that an effect turns into as a length among its parameters goes to zero."""

    parameter: str
    ids: tuple[str, ...]


@dataclass(frozen=True)
class Candidate:
    """One effect in one model, and all that is special about it.

    Attributes:
        ids: Names in reports: one, or all of a group of exact twins.
        name: For people.
        expression: As it is added.
        channel: Where it acts.
        site: In the model.
        parameters: Added; the first is the effect's size, with its value at no effect.
        extend: Adds it to a model that holds the parameters already.
        directions: How it would show.
        variant: Distinguishes candidates of one id.
        families: Kinds of physics that it is an instance of.
        twin: Group of candidates that small motions cannot tell apart.
        per_recording: Whether another recording has its own instance (or none, if `absent`).
        absent: Whether another recording is not expected to show it.
        known: Whether the catalogue holds it; a decoy only keeps wrong names away.
        fits: Whether it can be added and refitted, not only looked for.
        covers: Keys of candidates that it contains as special cases, each with values of its own
            further parameters from where a fit in that one's place begins; none: from several.
        parts: From its parameter values to sums that are the same law: by key of each candidate in
            the sum, that one's values.
        pushes: Whether it is a force on its coordinate, which a lever would hand on to others.
        static: Whether it is a force that the state at the same instant determines.
        resistance: The force against the motion at size 1, where it is no more than that.
        exponent: Of the speed, where that force is a power of it: a number, or the parameter.
        powers: Of the states, where it is a product of powers.
        next_to: Key of the entry whose form is the next one to its own.
        starts: Where fits in its place begin, from its values and the motion (L,) by state.
        signs: How it would show in that one's place, where what that one leaves unexplained says
            where fits begin.
        shape_of: Ids of an entry whose law it is in a contact too brief for its course to show.
        brief: Whether values of its parameters make a contact so brief.
        limit: What it cannot be told from where it is narrow.
        form: Name in the library of `pikanid.symbolic` of its force over `argument`.
        argument: State that `form` is a function of; empty for a constant.
        other_minima: Factors of its first parameter by which χ² may have other minima, as where a
            motion comes to rest between two samples.
        levels: Values of its parameters, from the best of which a fit begins where the model is far
            off: no first step leads to them.
        other: Adds it in another reading, which makes a difference beside other effects only.
        instead_of: Ids of effects in whose place it is tried, once they are given.
        stops_like: Ids of effects whose first parameter may be the place where it stops the motion.
        beside: Ids of effects, one of which has to be there: without them it is a twin of another
            entry.
        probes: Values of its parameters but the size, at each of which its sign is derived from
            what it adds to the model; its `directions` then say no more than where a fit begins.
        undoes: Id of effects on the same channel that it is the contrary of.
        begins: Names of its parameters that only say how a recording begins; without them that is
            assumed.
    """

    ids: tuple[str, ...]
    name: str
    expression: str
    channel: Channel
    site: Site
    parameters: tuple[Parameter, ...]
    extend: Callable[[Model], Model]
    directions: Callable[[View], Sequence[TangentDirection]]
    variant: str = ""
    twin: str = ""
    families: tuple[Family, ...] = ()
    per_recording: bool = False
    pushes: bool = False
    absent: bool = False
    known: bool = True
    fits: bool = True
    covers: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    parts: Parts | None = None
    static: bool = False
    resistance: Resistance | None = None
    exponent: float | Parameter | None = None
    powers: Powers | None = None
    next_to: str = ""
    starts: Begin | None = None
    signs: Callable[[View], Sequence[TangentDirection]] | None = None
    shape_of: tuple[str, ...] = ()
    brief: Callable[[Mapping[str, float]], bool] | None = None
    limit: Limit | None = None
    form: str = ""
    argument: str = ""
    other_minima: tuple[float, ...] = ()
    levels: tuple[Mapping[str, float], ...] = ()
    instead_of: tuple[str, ...] = ()
    stops_like: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    other: Callable[[Model], Model] | None = None
    probes: tuple[Mapping[str, float], ...] = ()
    undoes: str = ""
    begins: tuple[str, ...] = ()

    def suits(self, others: Sequence[Candidate] = ()) -> bool:
        """Whether it is an explanation of its own beside these.  Of two that act once each may be
        what the shape of the other lacks.  Forces on a coordinate act through a lever or do not:
        some of each together would be any coupling.  One parameter is one quantity, and an effect
        that undoes another one is no company for it.
        """
        if any(a.undoes in b.ids and b.variant in ("", a.variant)
               for e in others for a, b in ((self, e), (e, self)) if a.undoes):
            return False
        own = {p.name: p.unit for p in self.parameters}
        if any(own.get(p.name, p.unit) != p.unit for e in others for p in e.parameters):
            return False
        if self.absent and any(e.absent and e.key != self.key for e in others):
            return False
        if self.pushes and any(e.pushes and e.site.v == self.site.v
                               and e.site.along != self.site.along for e in others):
            return False
        return not self.beside or any(i in self.beside for e in others for i in e.ids)

    @property
    def alike(self) -> str:
        """What it shares with those that small motions of its state cannot tell from it, if any."""
        return self.twin and f"{self.twin} of {self.site.v}"

    @property
    def lasts(self) -> bool:
        """Whether it is more than what happens once."""
        return "once" not in self.families

    @property
    def refines(self) -> bool:
        """Whether it is the law of an entry of the same name with its shape left open."""
        return self.ids[0] + self.site.suffix in self.covers

    @property
    def key(self) -> str:
        """Identifies it among the candidates of a model."""
        return self.ids[0] + (f"[{self.variant}]" if self.variant else "") + self.site.suffix

    @property
    def names(self) -> tuple[str, ...]:
        """Under which it is reported: a law that no catalogue holds is its formula."""
        return self.ids if self.known else (SYMBOLIC + self.expression,)

    @property
    def read(self) -> bool:
        """Whether it is a formula that was read, and no entry."""
        return self.ids[0].startswith(SYMBOLIC)

    def applied(self, model: Model) -> Model:
        """The model with this effect.

        Raises:
            BadUnit: If its formula has no meaning there, as a power of what a scale error has left
                of a temperature in degC.
            BadModel: If the model has what it adds, as a second play of an input.
        """
        return self.extend(model.with_parameters(*self.parameters))
