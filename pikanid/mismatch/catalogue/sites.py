"""Where in a model physics can be missing: all sites, from its formulas and recordings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from pikanid import errors
from pikanid.formula.expanding import expanded
from pikanid.formula.expressions import TIME, symbol
from pikanid.mismatch.catalogue.lever import lever
from pikanid.mismatch.catalogue.site import Site, at_rest, estimates_a_start
from pikanid.model import Model
from pikanid.model.parts import Output
from pikanid.recording import Recording

MANY = 6  # limit: of unknown pasts, whose price is more than what any delay gains
NEAR_ZERO = 0.01  # numerical: of an input's largest value, from where on it does not begin at 0


def coordinates(model: Model) -> list[tuple[str, str]]:
    """States whose rate is another state, with that one."""
    return [(s.name, e.name) for s in model.states
            if (e := model.equations[s.name]).is_Symbol and e.name in model.state_names
            and e.name != s.name]


def sites(model: Model, recordings: tuple[Recording, ...]) -> tuple[Site, ...]:
    """The coordinates that an output shows, one site each, and after them those that reach one, the
    equations of all other states that do (a current beside a position, or all there are without any
    coordinate), and another site for each coordinate on which forces act through a lever.  The
    first one holds further outputs, whose sensors may be wrong as well.

    Raises:
        BadModel: If no state reaches an output.
    """
    first, *others = _of_equations(model, recordings)
    seen = {site.output.name for site in (first, *others)}
    sensors = tuple(_seen_in(o, (first, *others), recordings[0]) for o in model.outputs
                    if o.name not in seen and _shows(o, model.state_names))
    return (replace(first, sensors=sensors), *others)


def _seen_in(output: Output, found: Sequence[Site], recording: Recording) -> Site:
    """The site of a state that an output shows, as it is seen there."""
    site = next((s for s in found if _shows(output, s.moving)), found[0])
    return replace(site, output=output, inputs=(), operating=(), suffix=f"_{output.name}",
                   half_range=_swing(recording, output.name), lever={}, along="",
                   interval=_interval(recording, output.name))


def _shows(output: Output, states: Iterable[str]) -> bool:
    return any(output.expression.has(symbol(n)) for n in states)


def _of_equations(model: Model, recordings: tuple[Recording, ...]) -> tuple[Site, ...]:
    pairs = coordinates(model)
    seen = [(q, v, o) for q, v in pairs for o in model.outputs if o.expression.has(symbol(q))]
    chosen = {q: (q, v, o) for q, v, o in reversed(seen)}
    if not chosen:
        first = _of_first_order(model, recordings, model.state_names, alone=True)
        if not first:
            raise errors.BadModel(errors.nothing_seen(model.name))
        return first
    ordered = [chosen[q] for q, _ in pairs if q in chosen]
    ordered += [(q, v, o) for q, v in pairs
                if q not in chosen and (o := _reached(model, v)) is not None]
    found = [_site(model, recordings, q, v, o, f"_{q}" if len(ordered) > 1 else "")
             for q, v, o in ordered]
    others = [s.name for s in model.states if s.name not in {n for pair in pairs for n in pair}]
    found += _of_first_order(model, recordings, others, alone=False)
    rates = [*(v for _, v in pairs), *others]
    return (*found, *(_along_lever(site, *how) for site in found if (
        how := lever(model, site.v, rates)) is not None))


def _along_lever(site: Site, along: str, shares: Mapping[str, sp.Expr]) -> Site:
    # forces on others' rates leave no balance in this coordinate alone
    return replace(site, lever=shares, along=along, alone=False,
                   suffix=f"{site.suffix}_{along}")


def _of_first_order(model: Model, recordings: tuple[Recording, ...], states: Sequence[str],
                    alone: bool) -> tuple[Site, ...]:
    """One site for each of these states, in the output that it reaches through the fewest others;
    `alone`: there are no other sites.
    """
    found = [(v, o) for v in states if (o := _reached(model, v)) is not None]
    # what is seen itself comes first
    found.sort(key=lambda pair: not pair[1].expression.has(symbol(pair[0])))
    return tuple(_site(model, recordings, "", v, o, "" if alone and len(found) == 1 else f"_{v}")
                 for v, o in found)


def _reached(model: Model, state: str) -> Output | None:
    """The output that a state acts on, directly or through the equations of the fewest others."""
    reached = {state}
    for _ in model.states:
        for o in model.outputs:
            if any(o.expression.has(symbol(n)) for n in reached):
                return o
        reached |= {s.name for s in model.states
                    if any(model.equations[s.name].has(symbol(n)) for n in reached)}
    return None


def _site(model: Model, recordings: tuple[Recording, ...], q: str, v: str, output: Output,
          suffix: str) -> Site:
    a = model.equations[v]
    first = recordings[0]
    inputs = tuple(i.name for i in model.inputs
                   if i.name in first and a.has(symbol(i.name)) and _moves(first, i.name))
    used = {*model.input_names, *model.output_names, *model.state_names}
    extra = tuple(n for n in first.names
                  if n not in used and all(n in r and _moves(r, n) for r in recordings))
    at = {symbol(n): value for n, value in model.values.items()}
    slope = at_rest(model, a.diff(symbol(q))).subs(at) if q else sp.S.Zero
    k = -float(slope) if slope.is_finite and slope.is_number else 0.0  # infinite: u in 1/u is zero
    force = at_rest(model, a)
    starts = [s.initial for s in model.states if s.name in (q, v)]
    alone = all(at_rest(model, e.diff(symbol(q))).subs(at) == 0
                for n, e in model.equations.items() if n not in (q, v))
    return Site(model, q, v, output, inputs, extra, k**0.5 if k > 0 else 0.0,
                expanded(force) == 0 and all(e == 0 for e in starts), alone,
                all(_starts_still(model, r) for r in recordings),
                (first.start, first.stop), _swing(first, output.name),
                _interval(first, output.name), suffix,
                operating=tuple(n for n in inputs if _operating(n, recordings)),
                ranges={n: span_of(n, recordings) for n in inputs},
                pasts=_pasts(model, recordings),
                visited=span_of(output.name, recordings) if output.expression == symbol(q) and any(
                    output.name in r for r in recordings) else Site.visited)


def span_of(name: str, recordings: Sequence[Recording]) -> tuple[float, float]:
    """Lowest and highest finite value of a channel in recordings; 0 and 1 where it has none."""
    values = np.concatenate([r[name].values for r in recordings if name in r])
    seen = values[np.isfinite(values)]
    return (float(seen.min()), float(seen.max())) if len(seen) else (0.0, 1.0)


def _pasts(model: Model, recordings: tuple[Recording, ...]) -> dict[str, tuple[float, float]]:
    first = recordings[0]
    moving = [n for n in model.input_names if n in first and _moves(first, n)]
    # a model that begins in balance with an input says what was before
    if (any(s.initial.has(symbol(n)) for s in model.states for n in model.input_names)
            or not any(_operating(n, recordings) for n in moving)
            or len(moving) * len(recordings) > MANY):
        return {}
    found = {n: span_of(n, recordings) for n in moving}
    return {n: (2 * low - high, 2 * high - low) for n, (low, high) in found.items()}


def _operating(name: str, recordings: tuple[Recording, ...]) -> bool:
    return not all(name in r and _begins_at_zero(r[name].values) for r in recordings)


def _begins_at_zero(values: np.ndarray) -> bool:
    seen = values[np.isfinite(values)]
    return not seen.size or abs(float(seen[0])) <= NEAR_ZERO * float(np.abs(seen).max())


def _interval(recording: Recording, name: str) -> float:
    if name not in recording:
        name = recording.names[0]  # an experiment that is only planned
    return float(np.median(np.diff(recording[name].time)))


def _swing(recording: Recording, name: str) -> float:
    if name not in recording:
        return 0.0
    values = recording[name].values
    seen = values[np.isfinite(values)]
    return float(np.ptp(seen)) / 2 if len(seen) else 0.0


def _moves(recording: Recording, name: str) -> bool:
    values = recording[name].values
    return bool(np.all(np.isfinite(values)) and np.ptp(values) > 0)


def _starts_still(model: Model, recording: Recording) -> bool:
    if estimates_a_start(model):
        return False
    at = {symbol(n): value for n, value in model.values.items()}
    at |= {symbol(i.name): float(recording[i.name].values[0]) if i.name in recording
           else i.default or 0.0 for i in model.inputs}
    at |= {symbol(s.name): s.initial.subs(at) for s in model.states}
    return all(e.subs(at).subs(TIME, recording.start).doit() == 0 for e in model.equations.values())
