"""One case: a rig, what it hides, two recordings of it, and the truth about them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid import errors
from pikanid.validation.concealed import excitations, files, remainder
from pikanid.validation.concealed import noise as noises
from pikanid.validation.concealed.candidate import nominal_fit
from pikanid.validation.concealed.deck import FLOW, Card, redealt
from pikanid.validation.concealed.effect import Effect, Scales
from pikanid.validation.concealed.effects import CATALOGUE
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.noise import Noise
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured
from pikanid.validation.concealed.sizing import STRONG, drawn_target, sized, strong
from pikanid.validation.concealed.tank import Tank, radius_for
from pikanid.validation.concealed.visibility import (
    FROM_NOMINAL,
    FROM_RIVAL,
    Visibility,
    visibility,
    without_each,
)

# Of one case; after so many, effects that are not strong enough beside a remainder are exchanged.
ATTEMPTS, PATIENCE = 40, 4  # definition: numbers of draws
PAPER_RADIUS, PAPER_DEPTH, PAPER_LENGTH = 0.033, 0.090, 0.045  # definition: [m], of the paper


@dataclass(frozen=True)
class Order:
    """What is to be made.

    Attributes:
        name: Number of the case, as in its files' names.
        seed: Of the set.
        index: Of the case in the set.
        card: What it hides.
        excitation: One of `excitations.CHOICES` but "mixed".
        sigma: Noise [rad].
    """

    name: str
    seed: int
    index: int
    card: Card
    excitation: str
    sigma: float


@dataclass(frozen=True, eq=False)
class Case:
    """What was made.

    Attributes:
        recordings: File name -> content.
        truth: Entry of the truth file.
    """

    recordings: Mapping[str, bytes]
    truth: Mapping[str, object]


@dataclass(frozen=True, eq=False)
class _Hidden:
    """The true rigs of both recordings and what the truth file says of them."""

    train: Rig | Tank
    held_out: Rig | Tank
    parts: tuple[Effect, ...]
    entries: list[dict[str, object]]
    sizes: Sequence[Mapping[str, float]] = ()
    left: _Left | None = None


@dataclass(frozen=True, eq=False)
class _Left:
    """Beside the hidden effects: entries of its laws, shares of the misfit that the effects cause,
    and the effects' own distances, each without the other.
    """

    entries: list[dict[str, object]]
    share: float
    after_refit: float
    effects: tuple[float, ...]


def make(order: Order) -> Case:
    """Draw, simulate, spoil and judge one case; a function of its order alone.

    >>> order = Order("001", 7, 0, Card("nothing", ()), "two_pulse", 0.0017)
    >>> made = make(order)
    >>> sorted(made.recordings), made.truth["nameable"]
    (['001_held_out.csv', '001_train.csv'], False)
    """
    for attempt in range(ATTEMPTS):
        # A separate stream for each attempt, so that a retry is as reproducible as a success.
        rng = np.random.default_rng([order.seed, order.index, attempt])
        if order.card.remainder and attempt >= PATIENCE:
            order = replace(order, card=redealt(order.card, rng))
        try:
            return _attempt(order, rng)
        except errors.SimulationFailed:
            continue
    raise errors.SimulationFailed(errors.conceal_diverged())


def _attempt(order: Order, rng: np.random.Generator) -> Case:
    tank = _tank(rng) if FLOW in order.card.effects else None
    base = _base(rng, tank)
    noise = noises.drawn(rng, order.sigma)
    swing = float(rng.uniform(0.10, 0.20) if tank else rng.uniform(0.15, 0.32))
    frequency = math.sqrt(base.gravity / base.length) / (2 * math.pi)
    train, held_out = excitations.pair(
        order.excitation, rng, frequency, lambda e: measured(base, e), swing)
    scales = _scales(base, train, held_out)
    hidden = (in_tank(tank) if tank
              else _in_rig(order.card, base, train, scales, noise, rng))
    if order.card.remainder:
        hidden = _with_remainder(order.card.remainder, hidden, base, train, scales, noise, rng)
    experiments = {"train": train, "held_out": held_out}
    clean = {"train": measured(hidden.train, train),
             "held_out": measured(hidden.held_out, held_out)}
    recordings = {
        f"{order.name}_{key}.csv": files.csv(experiments[key], noise.spoilt(clean[key], rng))
        for key in ("train", "held_out")}
    if hidden.left is None:
        seen = visibility(clean["train"], train, noise, base, hidden.parts, scales, hidden.sizes)
    else:
        # No explanation is the truth, and no rival decides anything: none is looked for.
        missed = nominal_fit(noise.whitened(clean["train"]), train, noise, base)
        seen = Visibility(missed.distance, (), missed.distance, hidden.left.effects,
                          float(missed.values[0]), float(missed.values[1]))
    later = nominal_fit(noise.whitened(clean["held_out"]), held_out, noise, base).distance
    return Case(recordings, {
        "id": order.name, "class": order.card.kind,
        "files": {key: f"{order.name}_{key}.csv" for key in experiments},
        "sha256": {name: hashlib.sha256(data).hexdigest() for name, data in recordings.items()},
        "excitation": {key: e.kind for key, e in experiments.items()},
        "base": _base_entry(base), "noise": noise.to_dict(), "effects": hidden.entries,
        "visibility": _visibility_entry(seen, later),
        "nameable": not order.card.remainder and _nameable(order.card.effects, seen),
        **_left_entry(hidden.left)})


def _nameable(effects: tuple[Effect, ...], seen: Visibility) -> bool:
    inside = bool(effects) and all(e.kind == "catalogue" or e.id == "power_drag" for e in effects)
    return inside and seen.nominal >= FROM_NOMINAL and seen.distance >= FROM_RIVAL


def _base(rng: np.random.Generator, tank: Tank | None) -> Rig:
    length = float(f"{math.exp(rng.uniform(math.log(0.032), math.log(0.062))):.4g}")
    damping = float(f"{rng.uniform(0.08, 0.35):.4g}")
    if tank is None:
        return Rig(length=length, damping=damping)
    rate = math.sqrt(9.81 / tank.length)
    return Rig(length=tank.length, damping=2 * tank.ratios[0] * rate * Rig().mass)


def _scales(base: Rig, *experiments: Experiment) -> Scales:
    # The smaller peak, so that a wall or a limit is met in both recordings.
    angle = min(float(np.max(measured(base, e))) for e in experiments)
    push = min(float(np.max(np.abs(e.u_x))) for e in experiments)
    return Scales(float(f"{angle:.4g}"), push, experiments[0].duration,
                  math.sqrt(base.gravity / base.length))


def _in_rig(card: Card, base: Rig, train: Experiment, scales: Scales, noise: Noise,
            rng: np.random.Generator) -> _Hidden:
    now, later, entries, sizes = base, base, [], []
    for effect in card.effects:
        shape = effect.drawn(rng, scales)
        values = (strong(shape, rng, base, train, noise) if card.remainder
                  else sized(shape, drawn_target(rng), base, train, noise))
        now = effect.applied(now, values)
        later, entry = _afterwards(effect, values, later, scales, rng)
        entries.append(entry)
        sizes.append(values)
    return _Hidden(now, later, card.effects, entries, sizes)


def _afterwards(effect: Effect, values: Mapping[str, float], later: Rig, scales: Scales,
                rng: np.random.Generator) -> tuple[Rig, dict[str, object]]:
    """The rig of the second recording with an effect, and the effect's entry."""
    afterwards = values
    if effect.held_out == "other":
        other = effect.drawn(rng, scales)
        share = float(rng.uniform(0.5, 1.5))
        size = effect.quantities[0].name
        # The same strength, roughly; another time, state or realisation.
        afterwards = {**other.sized(0.5), size: float(f"{values[size] * share:.5g}")}
    if effect.held_out != "absent":
        later = effect.applied(later, afterwards)
    return later, _effect_entry(effect, values, afterwards)


def _with_remainder(laws: tuple[Effect, ...], hidden: _Hidden, base: Rig, train: Experiment,
                    scales: Scales, noise: Noise, rng: np.random.Generator) -> _Hidden:
    assert isinstance(hidden.train, Rig)
    assert isinstance(hidden.held_out, Rig)
    seen = without_each(measured(hidden.train, train), train, noise, base, hidden.parts, scales,
                        hidden.sizes)
    if min(seen) < STRONG:
        # Two effects may cancel, or one be too weak in this experiment.
        raise errors.SimulationFailed(errors.conceal_faint())
    left = remainder.drawn(laws, hidden.train, base, hidden.parts, hidden.sizes, train, scales,
                           noise, rng)
    later, entries = hidden.held_out, []
    for law, values in zip(laws, left.values, strict=True):
        later, entry = _afterwards(law, values, later, scales, rng)
        entries.append(entry)
    return replace(hidden, train=left.rig, held_out=later,
                   left=_Left(entries, left.share, left.left, seen))


def _effect_entry(effect: Effect, values: Mapping[str, float],
                  later: Mapping[str, float]) -> dict[str, object]:
    units = {quantity.name: quantity.unit for quantity in effect.quantities}

    def listed(numbers: Mapping[str, float]) -> dict[str, object]:
        return {name: {"value": value, "unit": units[name]} for name, value in numbers.items()}

    return {"id": effect.id, "variant": effect.variant, "kind": effect.kind,
            "channel": effect.channel, "twins": list(effect.twins), "near": effect.near,
            "parameters": listed(values), "held_out": effect.held_out,
            "parameters_held_out": {} if effect.held_out == "absent" else listed(later)}


def _tank(rng: np.random.Generator) -> Tank:
    """The paper's rig, or a vessel that swings like the paper's pendulum."""
    radius = PAPER_RADIUS if rng.random() < 0.5 else radius_for(PAPER_LENGTH, PAPER_DEPTH)
    ratios = tuple(float(f"{rng.uniform(low, high):.3g}") for low, high in
                   ((0.005, 0.02), (0.008, 0.03), (0.01, 0.04), (0.01, 0.03), (0.01, 0.03)))
    contact = float(f"{rng.uniform(0.0, 2e-4):.3g}") if rng.random() < 0.7 else 0.0
    tilt = float(f"{rng.uniform(-0.01, 0.01):.3g}") if rng.random() < 0.5 else 0.0
    return Tank(float(f"{radius:.5g}"), PAPER_DEPTH, ratios, contact, tilt)


def in_tank(tank: Tank) -> _Hidden:
    """A held contact line is dry friction, and a tilt a static bias: effects of their own."""
    flow = {"radius": (tank.radius, "m"), "depth": (tank.depth, "m"),
            **{f"zeta_{k + 1}": (ratio, "") for k, ratio in enumerate(tank.ratios)}}
    found = [(FLOW, flow)]
    if tank.contact_line:
        found.append((_entry_of("coulomb_friction"), {"contact_line": (tank.contact_line, "m")}))
    if tank.tilt:
        found.append((_entry_of("static_bias"), {"tilt": (tank.tilt, "rad")}))
    entries = []
    for effect, numbers in found:
        listed = {name: {"value": value, "unit": unit} for name, (value, unit) in numbers.items()}
        entries.append({**_effect_entry(effect, {}, {}), "parameters": listed,
                        "parameters_held_out": listed})
    return _Hidden(tank, tank, tuple(effect for effect, _ in found), entries)


def _entry_of(identifier: str) -> Effect:
    return next(e for e in CATALOGUE if e.id == identifier)


def _base_entry(base: Rig) -> dict[str, object]:
    return {"l_theta": {"value": base.length, "unit": "m"},
            "d_theta": {"value": base.damping, "unit": "N*s/m"},
            "m": {"value": base.mass, "unit": "kg"}, "g": {"value": base.gravity, "unit": "m/s^2"}}


def _left_entry(left: _Left | None) -> dict[str, object]:
    if left is None:
        return {}
    return {"remainder": left.entries, "remainder_share": float(f"{left.share:.4g}"),
            "remainder_share_after_refit": float(f"{left.after_refit:.4g}")}


def _visibility_entry(seen: Visibility, later: float) -> dict[str, object]:
    def rounded(x: float) -> float:
        return float(f"{x:.4g}")

    return {"unit": "sigma", "nominal": rounded(seen.nominal), "best_rival": list(seen.rival),
            "best_rival_distance": rounded(seen.distance),
            "effects": [rounded(x) for x in seen.effects],
            "nominal_held_out": rounded(later),
            "nominal_l_theta": rounded(seen.length), "nominal_d_theta": rounded(seen.damping)}
