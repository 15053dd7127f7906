"""Catalogue: laws between two coordinates, which act on one as they act back on the other.

Where a parameter b of the model damps a relative speed w, or is a stiffness against a relative
place d, ∂f/∂b is the same w (or d) in every equation, times what a force between the two does to
that rate: so the model itself says how any other force between them acts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from pikanid.formula import units
from pikanid.formula.expanding import expanded, is_short
from pikanid.formula.expressions import TIME, symbol, to_text
from pikanid.formula.names import free_name
from pikanid.model import Effect, Model
from pikanid.model.parts import Parameter

Motion = Mapping[str, np.ndarray]  # values (L,) of each state along the recordings
INF = float("inf")
PLAY = 0.1  # numerical: share of a swing at which play is looked for first
STOPS, HARD = 0.7, 3.0  # numerical: the same of stops, and their stiffness in springs there
NEAREST = 0.05  # limit: share of a swing at which stops are no longer a spring about the rest


@dataclass(frozen=True)
class _Between:
    """Two coordinates x and y that act on each other by x - ratio*y."""

    x: str
    y: str
    ratio: sp.Expr
    shares: tuple[tuple[str, sp.Expr], ...]  # what a force adds to each rate

    def of(self, x: str, y: str) -> str:
        """The difference of two places, or of two speeds, as text."""
        return to_text(symbol(x) - self.ratio * symbol(y))


def effects_between(model: Model, coordinates: Sequence[tuple[str, str]],
                    motion: Callable[[], Motion], taken: Iterable[str] = ()) -> Iterator[Effect]:
    """Dry friction, drag, damping that is harder one way, play, stops on both sides and on one,
    and a cubic spring between coordinates (place, speed).

    The motion tells how large each may be; `taken` are names, beside the model's own, that their
    parameters must not have.  A spring or a damper must have a parameter of its own, that of no
    other pair.

    >>> from pikanid.model import systems
    >>> drive = systems.two_mass_drive()
    >>> pairs = [("phi_m", "omega_m"), ("phi_l", "omega_l")]
    >>> motion = lambda: dict.fromkeys(drive.state_names, np.linspace(-1.0, 1.0))
    >>> [e.key.removesuffix("_between") for e in effects_between(drive, pairs, motion)]
    ['friction', 'drag', 'damping_one_way', 'spring', 'play', 'stops', 'stop', 'stop']
    """
    speed = dict(coordinates)
    found: dict[_Between, dict[bool, str]] = {}
    for name in model.parameter_names:
        for places in (True, False):
            one = _between(model, name, coordinates, places)
            if one is not None:
                found.setdefault(one, {}).setdefault(places, name)
    seen = motion() if found else {}
    used, pairs = {*model.symbols, *taken}, set[tuple[str, str]]()
    for one, by in found.items():
        x, y, v, w = one.x, one.y, speed[one.x], speed[one.y]
        # of two ways in which the same coordinates act on each other, the parameter tells which
        which = (x, y, *by.values()) if (x, y) in pairs else (x, y)
        pairs.add((x, y))
        place, rate = one.of(x, y), one.of(v, w)
        far, fast = _reach(seen, one, model, x, y), _reach(seen, one, model, v, w)
        length, across = model.state(x).unit, model.state(v).unit
        sizes = {p: (model.parameter(name), far if p else fast, length if p else across)
                 for p, name in by.items()}
        push = max(abs(p.value) * reach for p, reach, _ in sizes.values()) or 1.0
        force = next(units.product((p.unit, 1), (unit, 1)) for p, _, unit in sizes.values())

        def named(wanted: str, which: tuple[str, ...] = which) -> str:
            name = free_name("_".join((wanted, *which)), used)
            used.add(name)
            return name

        def law(key: str, words: str, family: str, shape: str, size: Parameter,
                *more: Parameter, factor: sp.Expr | None = None, one: _Between = one,
                variant: str = ",".join(which)) -> Effect:
            factor = symbol(size.name) if factor is None else factor
            return Effect(
                f"{key}_between", f"{words} between {one.x} and {one.y}", (size, *more),
                (size.name, 0.0), family=family, variant=variant,
                add={r: f"{to_text(share * factor)}*{shape}" for r, share in one.shares})

        yield law("friction", "dry friction", "dry friction", f"sign({rate})",
                  Parameter(named("F"), push, force, (0.0, INF)))
        yield law("drag", "quadratic drag", "drag", f"abs({rate})*({rate})", Parameter(
            named("D"), push / fast**2, units.product((force, 1), (across, -2)), (0.0, INF)))
        yield law("damping_one_way", "damping that is harder one way", "drag", f"max({rate}, 0)",
                  Parameter(named("d_one_way"), push / fast,
                            units.product((force, 1), (across, -1))))
        if True not in by:
            continue
        yield law("spring", "a cubic spring", "restoring force", f"({place})**3", Parameter(
            named("K"), push / far**3, units.product((force, 1), (length, -3))))
        gap = Parameter(named("gap"), PLAY * far, length, (0.0, INF))
        yield law("play", "play", "restoring force", f"clip({place}, -{gap.name}, {gap.name})",
                  gap, factor=-symbol(by[True]))
        for key, words, shape, side in (
                ("stops", "stops", "({0} - clip({0}, -{1}, {1}))", ()),
                ("stop", "a stop on one side (above)", "max({0} - {1}, 0)", ("above",)),
                ("stop", "a stop on one side (below)", "min({0} + {1}, 0)", ("below",))):
            k = Parameter(named("_".join(("k_stop", *side))), HARD * push / far,
                          units.product((force, 1), (length, -1)), (0.0, INF))
            stop = Parameter(named("_".join(("stop", *side))), STOPS * far, length,
                             (NEAREST * far, far))
            yield law(key, words, "restoring force", shape.format(place, stop.name), k, stop,
                      variant=",".join((*which, *side)))


def _between(model: Model, name: str, coordinates: Sequence[tuple[str, str]], places: bool
             ) -> _Between | None:
    """Which two coordinates act on each other in proportion to a parameter and the difference of
    their places, or of their speeds; None where none do.
    """
    b = symbol(name)
    slopes = {v: s for _, v in coordinates if (s := model.equations[v].diff(b)) != 0}
    moving = {TIME, b, *map(symbol, (*model.state_names, *model.input_names))}
    # an inertia or a length stays in its own slope: refused before anything is simplified
    if len(slopes) < 2 or any(s.has(b) for s in slopes.values()):
        return None
    own = {q if places else v: q for q, v in coordinates}
    first = next(iter(slopes.values()))
    used = [n for n in own if first.has(symbol(n))]
    if len(used) != 2:
        return None
    x, y = (symbol(n) for n in used)

    def share(slope: sp.Expr, ratio: sp.Expr) -> sp.Expr | None:
        """What the slope is times x - ratio*y, if that does not move."""
        found = slope.diff(x)
        if found.free_symbols & moving:
            return None
        return found if expanded(slope - found * (x - ratio * y)) == 0 else None

    by_x, by_y = first.diff(x), first.diff(y)
    if by_x == 0 or (by_x.free_symbols | by_y.free_symbols) & moving or not (
            is_short(by_x) and is_short(by_y)):
        return None
    ratio = sp.cancel(-by_y / by_x)
    shares = {v: share(s, ratio) for v, s in slopes.items()}
    if ratio == 0 or any(found is None for found in shares.values()):
        return None
    return _Between(own[used[0]], own[used[1]], ratio, tuple(shares.items()))


def _reach(seen: Motion, one: _Between, model: Model, x: str, y: str) -> float:
    """The largest difference of two places, or of two speeds."""
    at = {symbol(n): value for n, value in model.values.items()}
    ratio = sp.S(one.ratio).subs(at)
    if not ratio.is_finite:  # a parameter that divides is guessed zero
        return 1.0
    return float(np.abs(seen[x] - float(ratio) * seen[y]).max(initial=0.0)) or 1.0
