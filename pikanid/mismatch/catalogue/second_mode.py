"""Catalogue: another mode that the output shows beside the coordinate."""

from __future__ import annotations

import functools

import numpy as np

from pikanid.formula import units
from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site
from pikanid.model import Model
from pikanid.model.parts import Parameter, State


def second_mode(site: Site) -> list[Candidate]:
    """Another mode, driven by the input and seen beside the coordinate; slower than half the
    sampling rate: what is faster follows the input at once, and nothing tells it from that.
    """
    slowest, fastest = 0.3 * site.rate, min(12 * site.rate, np.pi / site.interval)
    if not site.inputs or not slowest < fastest:
        return []
    u = site.inputs[0]
    drive, shown = site.model.input(u).unit, site.output.unit
    gain = units.product((shown, 1), ("s", -2), (drive, -1)) if drive and shown else ""
    a = Parameter(site.name("a_2"), 0.0, gain)
    w2 = Parameter(site.name("omega_2"), min(2 * site.rate, fastest), "rad/s", (slowest, fastest))
    z2 = Parameter(site.name("zeta_2"), 0.02, "", (0.0, 1.0))
    q, r = site.name("q_2"), site.name("q_2_dot")

    def extend(model: Model) -> Model:
        o = model.output(site.output.name)
        model = model.replace(
            states=(*model.states, State(q, o.unit), State(r, f"{o.unit or '1'}/s")),
            equations={**model.equations, q: symbol(r), r: 0})
        model = model.with_term(
            r, f"{a.name}*{u} - 2*{z2.name}*{w2.name}*{r} - {w2.name}**2*{q}")
        return model.map_output(o.name, function=f"{o.name} + {q}")

    def directions(view: View) -> list[TangentDirection]:
        rates = site.rate * np.concatenate([np.geomspace(0.5, 0.85, 4), np.geomspace(1.15, 6, 26)])
        rates = rates[rates < 0.8 * np.pi / np.median(np.diff(view.t))]
        return [TangentDirection({a.name: 1.0, w2.name: float(w), z2.name: 0.02},
                                 seen=y) for w, y in zip(rates, _oscillators(
                         view.t.tobytes(), view.u[u].tobytes(), rates.tobytes()), strict=True)]

    return [Candidate(("second_mode",), "a second mode",
                      f"{q}'' + 2*{z2.name}*{w2.name}*{q}' + {w2.name}^2*{q} = {a.name}*{u}",
                      "dynamics", site, (a, w2, z2), extend, directions)]


@functools.lru_cache(maxsize=8)
def _oscillators(times: bytes, values: bytes, rates: bytes, z: float = 0.02) -> list[np.ndarray]:
    """q (L,) of q'' + 2 z w q' + w² q = u, held on an even grid, from rest; one for every rate."""
    from scipy.signal import lfilter

    t, u = np.frombuffer(times), np.frombuffer(values)
    h = (t[-1] - t[0]) / (len(t) - 1)
    even = t[0] + h * np.arange(len(t))
    held = u[np.clip(np.searchsorted(t, even + 1e-9 * h, "right") - 1, 0, len(u) - 1)]
    found = []
    for w in np.frombuffer(rates):
        wd, decay = w * np.sqrt(1 - z * z), np.exp(-z * w * h)
        c, s = decay * np.cos(wd * h), decay * np.sin(wd * h) * z * w / wd
        # zero-order hold, exact (Åström & Wittenmark, Computer-Controlled Systems, 1997, table 2.1)
        b = [0.0, (1 - c - s) / w**2, (decay**2 - c + s) / w**2]
        found.append(np.interp(t, even, lfilter(b, [1.0, -2 * c, decay**2], held)))
    return found
