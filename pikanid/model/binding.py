"""Forms of effects bound to a model: names, units and ranges put in the place of placeholders."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from pikanid import errors
from pikanid.formula import units
from pikanid.formula.expressions import parse, symbol, to_text
from pikanid.formula.names import free_name
from pikanid.model.effect import Effect
from pikanid.model.effect_form import EffectForm
from pikanid.model.effect_table import effect_of
from pikanid.model.lookup import Lookup
from pikanid.storage.entries import Entry

_NUMBERS = ("guess", "value", "bounds")  # definition: what is a number, or a formula of one
_OWN = ("name", "parameters", "states", "family", "twins")  # not formulas in their first place


@dataclass(frozen=True)
class Surroundings:
    """What placeholders can stand for, in one model with its recordings.

    Attributes:
        model: Nominal.
        states: Whose equations may lack something.
        ranges: Lowest and highest value of each state along the motion.
        seen: The same of each output, as recorded.
        sizes: Largest size of each input and channel.
        channels: Recorded, and not used by the model; with units.
        duration: Of the recordings [s].
        interval: Between samples of an output, the usual one [s].
        taken: Names that parameters and states of effects must not have.
        unseen: States that no output shows: where they go the nominal model guesses.
    """

    model: Lookup
    states: tuple[str, ...]
    ranges: Mapping[str, tuple[float, float]]
    seen: Mapping[str, tuple[float, float]]
    sizes: Mapping[str, float]
    channels: Mapping[str, str]
    duration: float
    interval: float
    taken: frozenset[str] = frozenset()
    unseen: frozenset[str] = frozenset()

    def choices(self, kind: str, bound: Mapping[str, str]) -> list[str]:
        """What a placeholder of this kind may stand for beside those that are bound."""
        first = next(iter(bound.values()), "")
        rates = self.rates
        inputs = [n for n in self.model.input_names if n in self.sizes]
        like = [n for n in (*inputs, *self.channels)
                if units.convertible(self.unit(n), self.unit(first))]
        level = [p.name for p in self.model.parameters
                 if not p.free and p.unit and units.convertible(p.unit, self.unit(first))]
        return {
            "state": [*self.states],
            "other state": [n for n in self.model.state_names if n not in bound.values()],
            "coordinate": [q for q, v in rates.items() if v in self.states],
            "angle": [q for q, v in rates.items() if v in self.states
                      and self.unit(q) and units.convertible(self.unit(q), "rad")],
            "current": self._measured_in("A", self.states),
            "voltage": self._measured_in("V", self.states),
            "voltage output": self._measured_in("V", self.seen),
            "current input": self._measured_in("A", inputs),
            "its rate": [rates[first]] if first in rates else [],
            "output": [n for n in self.model.output_names if n in self.seen],
            "input": inputs,
            "channel": [*self.channels],
            "channel like it": [n for n in like if n in self.channels],
            "signal like it": [*like, *level],
            "parameter": [p for p in self.model.free_names if first in self.model.equations
                          and symbol(p) in self.model.equations[first].free_symbols]}[kind]

    def _measured_in(self, unit: str, names: Iterable[str]) -> list[str]:
        return [x for x in names if self.unit(x) and units.convertible(self.unit(x), unit)]

    @property
    def rates(self) -> dict[str, str]:
        """Of each state that is a coordinate, the state that is its rate."""
        rights = {s.name: self.model.equations[s.name] for s in self.model.states}
        return {q: e.name for q, e in rights.items()
                if e.is_Symbol and e.name in rights and e.name != q}

    def range_of(self, name: str, kind: str) -> tuple[float, float]:
        """Lowest and highest value of a state, or of an output."""
        own = self.seen if kind.endswith("output") else self.ranges
        return own.get(name, (0.0, 1.0))

    def reach_of(self, name: str, kind: str) -> tuple[float, float]:
        """How low and how high it may be: of a state that is not seen as far again beyond its
        range, without another sign.
        """
        low, high = self.range_of(name, kind)
        if name not in self.unseen or kind.endswith("output"):
            return low, high
        lowest, highest = 2 * low - high, 2 * high - low
        return max(lowest, 0.0) if low >= 0 else lowest, min(highest, 0.0) if high <= 0 else highest

    def unit(self, name: str) -> str:
        """Of a state, input, output, parameter or channel; empty where it says none."""
        own = {**{o.name: o.unit for o in self.model.outputs},
               **{s.name: s.unit for s in self.model.states},
               **{i.name: i.unit for i in self.model.inputs},
               **{p.name: p.unit for p in self.model.parameters}}
        return own.get(name, self.channels.get(name, ""))


def bound(form: EffectForm, around: Surroundings) -> Iterator[Effect]:
    """One effect for each way in which the placeholders can be bound.

    Raises:
        BadModel: The table says something that no effect can.
    """
    bindings: list[dict[str, str]] = [{}]
    for name, kind in form.places.items():
        bindings = [{**b, name: n} for b in bindings for n in around.choices(kind, b)
                    if form.within is None or n in form.within or n not in around.model.state_names]
    for binding in bindings:
        try:
            made = _with(form, binding, around, alone=len(bindings) == 1)
        except errors.BadModel:
            # a state that stays where it is has no size that a guess could follow from
            if any(low == high for low, high in map(
                    around.range_of, binding.values(), form.places.values())):
                continue
            raise
        yield made


def _with(form: EffectForm, binding: Mapping[str, str], around: Surroundings,
          alone: bool) -> Effect:
    values = {"duration": around.duration, "interval": around.interval}
    within: dict[str, float] = {}
    for name, wanted in binding.items():
        low, high = around.range_of(wanted, form.places[name])
        values |= {f"{name}_low": low, f"{name}_high": high,
                   f"{name}_size": around.sizes.get(wanted, 1.0),
                   f"{name}_value": around.model.values.get(wanted, 1.0),
                   f"{name}_zero": units.absolute_zero(around.unit(wanted))}
        low, high = around.reach_of(wanted, form.places[name])
        within |= {f"{name}_low": low, f"{name}_high": high}
    where = f"'{form.source}': effect '{form.key}'"
    own = Entry(form.content, where, errors.BadModel).table(optional=None)
    parameters = own["parameters"].table(optional=None)
    states = form.content.get("states", {})
    taken = around.taken | around.model.symbols
    renamed = {n: _fresh(n if alone else "_".join((n, *binding.values())), form.key, taken)
               for n in [*parameters, *states]}
    swap = {**binding, **renamed, **{
        f"{n}_start": f"({to_text(around.model.state(wanted).initial)})"
        for n, wanted in binding.items() if wanted in around.ranges}}
    content = {k: _renamed(v, swap) for k, v in form.content.items() if k not in _OWN}
    content |= {k: v for k, v in form.content.items() if k in ("family", "twins")}
    content["name"] = _filled(str(form.content.get("name", form.key)), binding)
    written = {n: around.unit(wanted) or "1" for n, wanted in binding.items()}
    content["parameters"] = {
        renamed[n]: {k: _number(v, values | within if k == "bounds" else values,
                                f"{where}: {k} of '{n}'") if k in _NUMBERS
                     else _unit(v, written) if k == "unit" else v
                     for k, v in e.table(optional=None).items() for v in [v.value]}
        for n, e in parameters.items()}
    content["states"] = {
        renamed[n]: {k: _unit(v, written) if k == "unit" else _renamed(v, swap)
                     for k, v in entry.items()} for n, entry in states.items()}
    content["channels"] = {n: around.channels[n] for n in binding.values() if n in around.channels}
    made = effect_of(form.key, Entry(content, where, errors.BadModel))
    return replace(made, variant="" if alone else ",".join(binding.values()))


def _fresh(name: str, key: str, taken: frozenset[str]) -> str:
    """The name, where it is free; else with that of the effect."""
    return free_name(f"{name}_{key}" if name in taken else name, taken)


def _renamed(value: Any, swap: Mapping[str, str]) -> Any:
    """Names in keys and formulas replaced; all at once, so that none is replaced twice."""
    if isinstance(value, Mapping):
        return {_renamed(k, swap): _renamed(v, swap) for k, v in value.items()}
    if isinstance(value, list):
        return [_renamed(v, swap) for v in value]
    if not isinstance(value, str):
        return value
    return re.sub(r"[A-Za-z]\w*", lambda found: swap.get(found.group(), found.group()), value)


def _filled(text: str, words: Mapping[str, str]) -> str:
    for name, word in words.items():
        text = text.replace(f"{{{name}}}", word)
    return text


def _unit(text: Any, words: Mapping[str, str]) -> Any:
    """A unit with those of placeholders put in, simplified; what is none stays as it is."""
    if not isinstance(text, str) or "{" not in text:
        return text
    filled = _filled(text, words)
    return units.product((filled, 1)) if units.is_unit(filled) else filled


def _number(value: Any, values: Mapping[str, float], where: str) -> Any:
    """A number from a formula of `values`; lists entry by entry, anything else as it is."""
    if isinstance(value, list):
        return [_number(v, values, where) for v in value]
    if not isinstance(value, str):
        return value
    found = parse(value, {*values}, where).subs({symbol(n): v for n, v in values.items()})
    if not found.is_number or not found.is_finite:
        raise errors.BadModel(errors.bad_value(where, value, "a formula with a finite value"))
    return float(found)
