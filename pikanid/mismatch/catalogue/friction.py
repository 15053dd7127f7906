"""Catalogue: what resists a motion: dry friction, drag, damping, and friction with a memory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.candidate import (
    Candidate,
    Limit,
    Powers,
    TangentDirection,
    View,
)
from pikanid.mismatch.catalogue.forces import INF, term
from pikanid.mismatch.catalogue.site import Site
from pikanid.model import Model
from pikanid.model.parts import Parameter, State

# of the size of dry friction, about which a motion comes to rest elsewhere
STICKING = (0.6, 0.8, 1.25, 1.6)  # numerical: where fits begin
# of the usual speed, over which a reversal is rounded where a fit begins, and at least
ROUNDED, SHARP = 0.05, 0.001  # numerical: narrower than between two samples, it is sharp


def sense(view: View, v: str) -> np.ndarray:
    """The sign (L,) of a rate, averaged over a step where it changes inside."""
    near = 0.5 * np.abs(view.rates[v]) * np.gradient(view.t)
    speed = view.x[v]
    return np.asarray(np.clip(speed / np.maximum(near, 1e-300), -1.0, 1.0))


def coulomb_friction(site: Site) -> list[Candidate]:
    """Dry friction: the same force at every speed, against the motion; where a contact creeps, as
    -c tanh(v/w), rounded over speeds of w (S. Andersson, A. Söderberg and S. Björklund, Tribol.
    Int. 40, 2007).
    """
    c = Parameter(site.name("c"), 0.0, site.force_unit, (0.0, INF))
    law = term(site, "coulomb_friction", "Coulomb friction", f"-{c.name}*sign({site.v})", c,
               lambda w: -sense(w, site.v), one_sided=True, other_minima=STICKING, twin="coulomb")
    sharp = replace(law, static=True, resistance=np.ones_like, exponent=0.0, form="sign",
                    argument=site.v, powers=Powers(0, 0))
    usual = site.usual_speed
    width = Parameter(site.name("w_c"), max(ROUNDED * usual, 1e-6), site.speed_unit,
                      (max(SHARP * usual, 1e-9), INF))
    text = f"-{c.name}*tanh({site.v}/{width.name})"
    rounded = Candidate(
        sharp.ids, "Coulomb friction with a rounded reversal", text, "dynamics", site, (c, width),
        lambda m: site.pushed(m, text), lambda view: [], "rounded", sharp.twin,
        covers={sharp.key: {}}, static=True, resistance=lambda v, w: np.asarray(np.tanh(v / w)))
    return [sharp, rounded]


def linear_drag(site: Site) -> list[Candidate]:
    """Resistance in proportion to the speed, or a loss to a quantity, where the model has none."""
    if site.resisted:
        return []
    k = Parameter(site.name("k_1"), 0.0, "1/s", (0.0, INF))
    law = term(site, "linear_drag", "viscous damping", f"-{k.name}*{site.v}", k,
               lambda w: -w.x[site.v], one_sided=True)
    return [replace(law, static=True, resistance=np.abs, exponent=1.0, argument=site.v,
                    powers=Powers(0, 1))]


def quadratic_drag(site: Site) -> list[Candidate]:
    """Drag that grows with the square of the speed."""
    q = Parameter(site.name("q2"), 0.0, f"1/({site.unit})", (0.0, INF))
    law = term(site, "quadratic_drag", "quadratic drag", f"-{q.name}*abs({site.v})*{site.v}", q,
               lambda w: -np.abs(w.x[site.v]) * w.x[site.v], one_sided=True)
    return [replace(law, static=True, resistance=np.square, exponent=2.0, form="signed square",
                    argument=site.v, powers=Powers(0, 2))]


def power_drag(site: Site) -> list[Candidate]:
    """Drag with an exponent of its own, other than 0, 1 and 2."""
    c = Parameter(site.name("c_n"), 0.0, site.force_unit, (0.0, INF))
    n = Parameter(site.name("n"), 1.5, "", (0.2, 4.0))
    text = f"-{c.name}*signed_power({site.v}, {n.name})"

    def directions(view: View) -> list[TangentDirection]:
        v = view.x[site.v]
        return [TangentDirection({c.name: 1.0, n.name: e},
                                 force=-sense(view, site.v) * np.abs(v) ** e,
                                 one_sided=True)
                for e in (0.2, 0.35, 0.5, 0.7, 1.3, 1.5, 1.75, 2.3, 2.7, 3.2)]

    return [Candidate(("power_drag",), "drag with an exponent of its own", text, "dynamics", site,
                      (c, n), lambda m: site.pushed(m, text), directions,
                      covers={"coulomb_friction" + site.suffix: {n.name: 0.3},
                              **{e.key: {n.name: 1.05} for e in linear_drag(site)},
                              "quadratic_drag" + site.suffix: {n.name: 1.8}},
                      static=True, resistance=np.power, exponent=n, form="signed power",
                      argument=site.v)]


def amplitude_damping(site: Site) -> list[Candidate]:
    """Viscous damping that grows with the square of the distance from zero."""
    if not site.placed:
        return []
    c = Parameter(site.name("c2"), 0.0, f"1/(s*({site.unit})^2)", (0.0, INF))
    law = term(site, "amplitude_damping", "damping that grows with amplitude",
               f"-{c.name}*{site.q}**2*{site.v}", c,
               lambda w: -w.x[site.q] ** 2 * w.x[site.v], one_sided=True)
    return [replace(law, static=True, powers=Powers(2, 1))]


def hysteresis(site: Site) -> list[Candidate]:
    """A force with memory: Bouc-Wen."""
    if not site.q:
        return []
    b = Parameter(site.name("b_z"), 0.0, site.force_unit, (0.0, INF))
    # a loop narrower than that is dry friction, and as hard to simulate as a wall
    least = max(0.01 * site.half_range, 1e-4)
    d = Parameter(site.name("z_yield"), max(0.01, least), site.unit, (least, INF))
    z = site.name("z")

    def extend(model: Model) -> Model:
        loop = f"({site.v} - (abs({site.v})*{z} + {site.v}*abs({z}))/2)/{d.name}"
        return site.pushed(model.with_state(State(z), loop), f"-{b.name}*{z}")

    def directions(view: View) -> list[TangentDirection]:
        from pikanid.mismatch.catalogue.recurrences import bouc_wen

        v = view.x[site.v]
        if np.all(v >= 0) or np.all(v <= 0):
            return []  # without a return there is no loop
        top = float(np.abs(view.x[site.q]).max(initial=1e-9))
        found = []
        for share in (0.02, 0.06, 0.15, 0.4):
            path = bouc_wen(view.x[site.q] / (share * top))
            found.append(TangentDirection(
                {b.name: 1.0, d.name: share * top}, force=-path, one_sided=True))
        return found

    return [Candidate(("hysteresis",), "hysteresis (Bouc-Wen)", f"-{b.name}*{z}", "dynamics", site,
                      (b, d), extend, directions, variant="bouc_wen",
                      # a narrow loop is dry friction that gives before it slips (P. Dahl, AIAA J.
                      # 14, 1976)
                      limit=Limit(d.name, ("coulomb_friction",)))]


def boundary_layer(site: Site) -> list[Candidate]:
    """The wall's oscillating boundary layer: damping by the half-derivative of the rate."""
    if not site.rate:
        return []
    b = Parameter(site.name("b_layer"), 0.0, "1/s^0.5", (0.0, INF))
    # beyond three times the natural rate little moves; faster states would need shorter steps
    band = (site.rate / 20, site.rate * 3)

    def extend(model: Model) -> Model:
        model, half = model.with_half_derivative(site.v, site.name("layer"), band, 6)
        return site.pushed(model, -symbol(b.name) * half)

    def directions(view: View) -> list[TangentDirection]:
        return [TangentDirection({b.name: 1.0}, force=-_half_derivative(view.t, view.x[site.v]),
                                 one_sided=True)]

    return [Candidate(("boundary_layer",), "boundary layer at the wall",
                      f"-{b.name}*D^(1/2) {site.v}", "dynamics", site, (b,), extend, directions)]


def _half_derivative(t: np.ndarray, z: np.ndarray) -> np.ndarray:
    """D^½ z by Grünwald and Letnikov on an even grid."""
    from scipy.signal import fftconvolve

    h = (t[-1] - t[0]) / (len(t) - 1)
    even = np.interp(t[0] + h * np.arange(len(t)), t, z - z[0])
    k = np.arange(1, len(t))
    weights = np.concatenate([[1.0], np.cumprod((k - 1.5) / k)])
    return np.asarray(fftconvolve(even, weights)[:len(t)] / np.sqrt(h))
