"""Catalogue: what happens to inputs on their way in, and to outputs on their way out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pikanid.formula import units
from pikanid.mismatch.catalogue.begun import begun
from pikanid.mismatch.catalogue.candidate import Candidate, Channel, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site, may_be_under_way, out_of_reach
from pikanid.model import Model
from pikanid.model.parts import Parameter
from pikanid.problem.held import PIECES

INF = float("inf")
LEFT = 0.1  # limit: share of an input's range that passes through
# of a limit: on both sides alike, or on one; what it is called
SIDES = {"": "saturation of the", "above": "an upper limit of the", "below": "a lower limit of the"}


def _sensor(site: Site, identifier: str, name: str, size: Parameter, expression: str,
            shape: Callable[[View], np.ndarray], twin: str = "", **maps: object) -> Candidate:
    o = site.output.name

    def directions(view: View) -> list[TangentDirection]:
        return [TangentDirection({size.name: 1.0}, seen=shape(view))]

    return Candidate((identifier,), name, expression, "sensor", site, (size,),
                     lambda m: m.map_output(o, **maps), directions, twin=twin)  # type: ignore[arg-type]  # all text


def sensor_offset(site: Site) -> list[Candidate]:
    """The sensor's zero is off."""
    b = Parameter(site.name("offset"), 0.0, site.output.unit)
    return [_sensor(site, "sensor_offset", "an offset of the sensor", b,
                    f"{site.output.name} + {b.name}", lambda w: np.ones(len(w.t)), "offset",
                    offset=b.name)]


def sensor_drift(site: Site) -> list[Candidate]:
    """The sensor's zero drifts."""
    b = Parameter(site.name("beta"), 0.0, units.product((site.output.unit, 1), ("s", -1)))
    return [_sensor(site, "sensor_drift", "a drift of the sensor", b,
                    f"{site.output.name} + {b.name}*t", lambda w: w.t, drift=b.name)]


def sensor_fading(site: Site) -> list[Candidate]:
    """The sensor's scale drifts, as it ages; what swings undriven would be damped by that."""
    if not site.model.inputs:
        return []
    r = Parameter(site.name("r_scale"), 0.0, "1/s")
    o = site.output.name
    text = f"{o}*(1 + {r.name}*t)"
    return [_sensor(site, "sensor_fading", "a drift of the sensor's scale", r, text,
                    lambda w: w.t * w.y[o], function=text)]


def sensor_gain(site: Site) -> list[Candidate]:
    """The sensor's scale is off."""
    k = Parameter(site.name("k_out"), 1.0, "", (0.05, 20.0))
    o = site.output.name
    return [_sensor(site, "sensor_gain", "a scale error of the sensor", k, f"{k.name}*{o}",
                    lambda w: w.y[o], "gain", gain=k.name)]


def sensor_nonlinearity(site: Site) -> list[Candidate]:
    """The sensor bends: y + k y³; without a rest its zero is anywhere."""
    if not site.rate:
        return []
    k = Parameter(site.name("k_y3"), 0.0, f"1/({site.output.unit or '1'})^2")
    o = site.output.name
    return [_sensor(site, "sensor_nonlinearity", "a cubic error of the sensor", k,
                    f"{o} + {k.name}*{o}**3", lambda w: w.y[o] ** 3,
                    function=f"{o} + {k.name}*{o}**3")]


def sensor_saturation(site: Site) -> list[Candidate]:
    """The sensor clips, on both sides alike or on one."""
    limit = Parameter(site.name("limit"), out_of_reach(site.half_range), site.output.unit,
                      (1e-9, INF))
    o = site.output.name
    found = []
    for side, words in SIDES.items():

        def directions(view: View, side: str = side) -> list[TangentDirection]:
            return [TangentDirection({limit.name: level}, seen=cut - view.y[o], one_sided=True,
                                     scales=False)
                    for level, cut in _cut(view.y[o], side, (0.01, 0.04, 0.1, 0.2, 0.35, 0.5))]

        text = _clipped(o, limit.name, side)
        found.append(Candidate(
            ("sensor_saturation",), f"{words} sensor", text, "sensor", site,
            (replace(limit, bounds=(-INF, INF)) if side else limit,), _seen_through(o, text),
            directions, variant=side,
            twin="limit of the sensor"))
    return found


def _seen_through(o: str, text: str) -> Callable[[Model], Model]:
    return lambda m: m.map_output(o, function=text)


def _lowest_limit(low: float, high: float, side: str) -> float:
    """Of an input between two values: one that leaves less of it is a switch, and no limit."""
    if not side:
        return LEFT * max(-low, high)
    return low + LEFT * (high - low) if side == "above" else -high + LEFT * (high - low)


def _clipped(x: str, limit: str, side: str) -> str:
    """The formula of a channel that is cut off at ±limit, or on one side."""
    return {"above": f"min({x}, {limit})", "below": f"max({x}, -{limit})"}.get(
        side, f"clip({x}, -{limit}, {limit})")


def _cut(x: np.ndarray, side: str, shares: Sequence[float]) -> list[tuple[float, np.ndarray]]:
    """Levels of a limit, and a channel (L,) cut off there: by shares of its amplitude, or on one
    side of its range; none where it rests.  On one side it has to go there and come back: what
    happens where a motion begins or ends could be anything.
    """
    low, high = float(x.min(initial=0.0)), float(x.max(initial=0.0))
    if not side:
        top = max(-low, high)
        return [((1 - s) * top, np.clip(x, -(1 - s) * top, (1 - s) * top)) for s in shares] if (
            top) else []
    sign = 1.0 if side == "above" else -1.0
    top, span = float((sign * x).max(initial=-INF)), float(np.ptp(x)) if len(x) else 0.0
    levels = [top - s * span for s in shares] if span else []
    return [(level, sign * np.minimum(sign * x, level)) for level in levels
            if _returns(sign * x > level)]


def _returns(there: np.ndarray) -> bool:
    """Whether some stretch of a truth (L,) begins and ends inside.

    >>> _returns(np.array([True, False, True, False])), _returns(np.array([True, False, True]))
    (True, False)
    """
    turns = np.diff(there.astype(int))
    left, entered = np.flatnonzero(turns < 0), np.flatnonzero(turns > 0)
    return len(entered) > 0 and bool(np.any(left > entered[0]))


LAGS = (0.075, 0.25, 0.75, 2.5)  # numerical: samples, from where fits begin
SHORTEST, LONGEST = 0.01, 250.0  # numerical: lags [samples] that make a difference


def lags(site: Site) -> list[Candidate]:
    """First-order lags of sensor and actuator."""
    o = site.output.name
    step = site.interval
    within = (SHORTEST * step, LONGEST * step)
    tau = Parameter(site.name("tau_s"), 0.5 * step, "s", within)

    def seen(view: View) -> list[TangentDirection]:
        # a first guess of the right size matters: far shorter lags are stiff
        from pikanid.mismatch.catalogue.recurrences import lagged

        return [TangentDirection(
            {tau.name: float(s)}, seen=lagged(view.t, view.y[o], view.y_rate[o], s) - view.y[o],
            one_sided=True, null=0.0) for s in step * np.array(LAGS)]

    found = [Candidate(("sensor_lag",), "a lag of the sensor", f"{o} behind a lag {tau.name}",
                       "sensor", site, (tau,), lambda m: m.map_output(o, lag=tau.name), seen,
                       twin="lag")]
    if may_be_under_way(site.model):  # of a motion under way the sensor is behind at first
        found.append(begun(found[0], site.name("d_lag_s"), site.output.unit))
    for u in site.inputs:
        t_u = Parameter(site.name("tau_a", site.variant(u)), 0.5 * step, "s", within)

        def pushed(view: View, u: str = u, t_u: Parameter = t_u) -> list[TangentDirection]:
            from pikanid.mismatch.catalogue.recurrences import lag_of_held

            return [TangentDirection(
                {t_u.name: float(s)}, push={u: lag_of_held(view.t, view.u[u], s)},
                one_sided=True, null=0.0) for s in step * np.array(LAGS)]

        lag = _input(site, u, "actuator_lag", "a lag of the actuator", (t_u,),
                     f"{u} behind a lag {t_u.name}", pushed, "lag", lag=t_u.name)
        found.append(lag)
        if u in site.operating:
            # an actuator need not be in balance with what it is told at first
            found.append(begun(lag, site.name("d_lag", site.variant(u)), site.model.input(u).unit))
    return found


def _input(site: Site, u: str, identifier: str, name: str, parameters: tuple[Parameter, ...],
           expression: str, directions: Callable[[View], Sequence[TangentDirection]],
           twin: str = "",
           channel: Channel = "input", variant: str = "", **maps: object) -> Candidate:
    return Candidate((identifier,), name, expression, channel, site, parameters,
                     lambda m: m.map_input(u, **maps), directions,  # type: ignore[arg-type]  # all text
                     ",".join(filter(None, (variant, site.variant(u)))), twin)


def input_gain(site: Site) -> list[Candidate]:
    """An input acts more or less than recorded."""
    found = []
    for u in site.inputs:
        k = Parameter(site.name("k_in", site.variant(u)), 1.0, "", (0.05, 20.0))

        def directions(view: View, u: str = u, k: Parameter = k) -> list[TangentDirection]:
            return [TangentDirection({k.name: 1.0}, push={u: view.u[u]})]

        found.append(_input(site, u, "input_gain", "a scale error of the input", (k,),
                            f"{k.name}*{u}", directions, "gain", gain=k.name))
    return found


def input_limits(site: Site) -> list[Candidate]:
    """Saturation, on both sides alike or on one, and dead zone."""
    found = []
    for u in site.inputs:
        unit = site.model.input(u).unit
        width = Parameter(site.name("u_dead", site.variant(u)), 0.0, unit, (0.0, INF))
        for side, words in SIDES.items():
            lowest = _lowest_limit(*site.ranges[u], side)
            limit = Parameter(site.name("u_max", site.variant(u)), out_of_reach(lowest), unit,
                              (lowest, INF))

            def clipped(view: View, u: str = u, p: Parameter = limit, side: str = side
                        ) -> list[TangentDirection]:
                return [TangentDirection({p.name: level}, push={u: cut - view.u[u]},
                                         one_sided=True, scales=False)
                        for level, cut in _cut(view.u[u], side,
                                               (0.015, 0.05, 0.12, 0.22, 0.35, 0.5))]

            text = _clipped(u, limit.name, side)
            found.append(_input(site, u, "input_saturation", f"{words} input",
                                (limit,), text, clipped, f"limit of {u}",
                                variant=side, function=text))

        def dead(view: View, u: str = u, p: Parameter = width) -> list[TangentDirection]:
            d, top = view.u[u], float(np.abs(view.u[u]).max())
            return [TangentDirection({p.name: s * top}, push={u: -np.clip(d, -s * top, s * top)},
                                     one_sided=True, scales=False)
                    for s in (0.003, 0.01, 0.03, 0.08, 0.2, 0.4)]

        found.append(
            _input(site, u, "input_dead_zone", "a dead zone of the input", (width,),
                   f"dead_zone({u}, {width.name})", dead, dead_zone=width.name))
    return found


def input_hold(site: Site) -> list[Candidate]:
    """The input runs between samples otherwise than the model takes it to.

    Over an interval h from a sample on, a smooth input has the mean u + h u'/2 + h² u''/6.  Held to
    order one it has h² u''/12 more, and held to order zero h u'/2 + h² u''/6 less.
    """
    found = []
    for u in site.inputs:
        now = site.model.input(u).hold
        for other, words, order in (("zero", "steps", "zero"), ("first", "straight lines", "one"),
                                    ("cubic", "a smooth curve", "three")):
            if other == now:
                continue

            def directions(view: View, u: str = u, now: str = now, other: str = other
                           ) -> list[TangentDirection]:
                step = PIECES if now == "cubic" else 1  # stops between two samples
                rise = step * np.diff(view.u[u], append=view.u[u][-1])
                bend = step * np.diff(rise, prepend=rise[0])
                lead = {"zero": -rise / 2 + bend / 12, "first": bend / 12, "cubic": 0 * rise}
                return [TangentDirection({}, push={u: lead[other] - lead[now]}, one_sided=True,
                                         scales=False)]

            found.append(_input(
                site, u, "input_hold", f"the input runs in {words} between samples", (),
                f"{u} held to order {order}", directions, f"hold {u}",
                variant="smooth" if other == "cubic" else
                "steps" if now == "cubic" and other == "zero" else "", hold=other))
    return found
