"""One concealed case of a rig of one's own: its laws, two recordings, and the truth about them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.recording import Recording
from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.case import Case
from pikanid.validation.own_model.hidden import Hidden, Workbench, nameable
from pikanid.validation.own_model.law import Law
from pikanid.validation.own_model.rig import Rig

ATTEMPTS = 60  # definition: draws until a law can be seen and the motion stays finite
THE_SAME = 0.1  # definition: [σ] from an entry, within which a law of no catalogue is that entry
CLASSES = ("nothing", "single", "pair", "outside")


@dataclass(frozen=True, eq=False)
class Order:
    """What is to be made: number, seed of the set, index in it, class, and the rig."""

    name: str
    seed: int
    index: int
    kind: str
    rig: Rig


def make(order: Order) -> Case:
    """Draw, simulate, spoil and judge one case; a function of its order alone.

    Drawn anew is what cannot be seen, what diverges, and a law of no catalogue that is an entry in
    other words in these experiments.

    Raises:
        SimulationFailed: If no draw gives a finite motion.
    """
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([order.seed, order.index, attempt])
        try:
            return _attempt(order, rng)
        except errors.SimulationFailed:
            continue
    raise errors.SimulationFailed(errors.conceal_diverged())


def _attempt(order: Order, rng: np.random.Generator) -> Case:
    rig = order.rig
    values = rig.drawn(rng)
    scene = rig.scene(values)
    bench = Workbench(rig.nominal, values, scene)
    laws = rig.laws(values)
    hidden = [bench.sized(law, rng) for law in _chosen(order.kind, laws, rng)]
    truth = bench.seen(hidden)
    recordings, noisy = {}, np.random.default_rng(rng.integers(2**63))
    for key, experiment in (("train", rig.train), ("held_out", rig.held_out)):
        seen = bench.outputs(acting(hidden, key), experiment)
        spoilt = {n: y + scene.sigma[n] * noisy.standard_normal(len(y)) for n, y in seen.items()}
        recordings[f"{order.name}_{key}.csv"] = _csv(experiment, rig, spoilt)
    without = [bench.fitted(truth, [h for h in hidden if h is not one], sure=True)
               for one in hidden]
    alone = [fit.distance for fit in without]
    nominal = bench.fitted(truth, [], sure=True).distance if len(hidden) > 1 else sum(alone)
    rival: tuple[tuple[str, ...], float] = ((), np.inf)
    if hidden:
        rival = bench.nearest(truth, hidden, without, laws, rng)
    distance = min([rival[1], *alone]) if len(hidden) > 1 else rival[1]
    if order.kind == "outside" and distance < THE_SAME:
        # u + e |u| of an input that is never negative is a scale error: nothing else hides
        raise errors.SimulationFailed(errors.conceal_the_same())
    return Case(recordings, {
        "id": order.name, "class": order.kind,
        "files": {key: f"{order.name}_{key}.csv" for key in ("train", "held_out")},
        "sha256": {n: hashlib.sha256(data).hexdigest() for n, data in recordings.items()},
        "base": {n: {"value": v} for n, v in values.items()},
        "noise": dict(scene.sigma), "effects": [_entry(h) for h in hidden],
        "visibility": {"nominal": nominal, "effects": alone, "best_rival": list(rival[0]),
                       "best_rival_distance": _finite(distance)},
        "nameable": nameable(hidden, nominal, distance)})


def acting(hidden: Sequence[Hidden], part: str) -> list[Hidden]:
    """What acts in a part of a case, "train" or "held_out": what happens once does so in one."""
    return [h for h in hidden if part == "train" or "once" not in h.law.families]


def _chosen(kind: str, laws: Sequence[Law], rng: np.random.Generator) -> list[Law]:
    """Laws of a class: every id is as probable as any other, then every place where it can act."""
    known = kind != "outside"
    ids = sorted({law.id for law in laws if law.known is known})
    count = {"nothing": 0, "pair": 2}.get(kind, 1)
    return [_one(laws, str(i), rng) for i in rng.permutation(ids)[:count]]


def _one(laws: Sequence[Law], wanted: str, rng: np.random.Generator) -> Law:
    places = [law for law in laws if law.id == wanted]
    return places[int(rng.integers(len(places)))]


def _entry(hidden: Hidden) -> dict[str, object]:
    law, units = hidden.law, {p.name: p.unit for p in hidden.law.effect.parameters}
    return {"id": law.id, "twins": list(law.twins), "near": "", "families": sorted(law.families),
            "variant": law.effect.variant, "expression": law.effect.expression,
            "where": {"channel": law.channel, "place": law.where, "places": [*law.places]},
            "parameters": {n: {"value": v, "unit": units[n]} for n, v in hidden.values.items()}}


def _finite(distance: float) -> float:
    return min(float(distance), 1e9)


def _csv(experiment: Recording, rig: Rig, outputs: Mapping[str, Array]) -> bytes:
    """Channels with units; every recording of a set has the same header and length."""
    names = [n for n in experiment.names if n not in outputs]
    units = {**{n: experiment[n].unit for n in names},
             **{o.name: o.unit for o in rig.model.outputs}}
    columns = [experiment[names[0]].time, *(experiment[n].values for n in names), *outputs.values()]
    header = ",".join(["t [s]", *(f"{n} [{units[n] or '1'}]" for n in (*names, *outputs))])
    rows = (",".join(f"{v:.9g}" for v in row) for row in zip(*columns, strict=True))
    return ("\n".join([header, *rows]) + "\n").encode()
