"""A force that goes on swinging: what a rig does that was pushed once, where it is pushed on; and a
parameter that does, which may be taken for one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pikanid.mismatch.catalogue.candidate import SYMBOLIC, Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.forces import changing
from pikanid.mismatch.catalogue.site import Site
from pikanid.model import Model
from pikanid.model.parts import Parameter

FASTEST = 3.0  # numerical: times the natural frequency, up to which it is looked for
TURNS = 24.0  # numerical: in a recording, of what has no natural frequency
MOST = 300  # limit: frequencies that are looked at
LINE = 0.5  # numerical: of an input's variance, at a frequency: from there on that may be its doing


def swinging_force(site: Site, next_to: str) -> Candidate:
    """a sin ωt + b cos ωt, in place of another initial state: near a resonance it rings as that
    does, and does not decay.
    """
    def push(m: Model, text: str) -> Model:
        return site.pushed(m, text)

    return replace(_swinging(site, "swing", "a force that swings", site.force_unit, "{}", push,
                             lambda view: np.ones_like(view.t)),
                   ids=("swinging_force",), next_to=next_to)


def swinging_on_their_own(sites: Sequence[Site]) -> list[Candidate]:
    """The same in nothing's place, in each equation, as formulas that were read: what waves, wind
    and shafts that turn do; and beside them each parameter that may swing instead.
    """
    laws = [swinging_force(site, "") for site in sites]
    held = {p: site for site in reversed(sites) for p in site.free_in_force}
    laws += [_swinging_parameter(site, p) for p, site in held.items()]
    return [replace(law, ids=(SYMBOLIC + law.expression,), known=True, directions=_undriven(law),
                    signs=None) for law in laws]


def _swinging_parameter(site: Site, p: str) -> Candidate:
    """p (1 + a sin ωt + b cos ωt) in all equations that hold it."""
    def change(m: Model, text: str) -> Model:
        return changing(m, p, text)

    law = _swinging(site, f"{p}_swing", f"a swing of {p}", "1", f"{p}*(1 + {{}})", change,
                    lambda view: view.by_parameter[site.v, p])
    return replace(law, expression=f"{p} -> {law.expression}")


def _swinging(site: Site, key: str, name: str, unit: str, written: str,
              extend: Callable[[Model, str], Model], lever: Callable[[View], np.ndarray]
              ) -> Candidate:
    """What swings: `written` around a sin ωt + b cos ωt, put into a model by `extend`, whose push
    along a motion is `lever`.
    """
    a, b = (Parameter(site.name(f"{key}_{part}"), 0.0, unit, scope="recording") for part in "ab")
    first, last = site.span
    turn = 2 * np.pi / (last - first)
    fastest = np.pi / site.interval
    natural = FASTEST * site.rate  # of what hardly turns in a recording none shows
    high = min(natural if natural > turn else TURNS * turn, fastest)
    w = Parameter(site.name(f"{key}_rate"), min(site.rate or turn, fastest), "rad/s",
                  (0.0, fastest))
    text = written.format(f"{a.name}*sin({w.name}*t) + {b.name}*cos({w.name}*t)")

    def signs(view: View) -> list[TangentDirection]:
        # two swings can be told apart that differ by half a turn in a recording
        rates = np.arange(turn, high, max(0.5 * turn, (high - turn) / MOST))
        by = lever(view)
        return [TangentDirection({size.name: 1.0, w.name: float(rate)},
                                 force=by * wave(rate * view.t))
                for rate in rates for size, wave in ((a, np.sin), (b, np.cos))]

    return Candidate(("swinging_parameter",), name, text, "dynamics", site,
                     (a, b, w), lambda m: extend(m, text), lambda view: [], families=("drive",),
                     per_recording=True, known=False, signs=signs)


def _undriven(law: Candidate) -> Callable[[View], list[TangentDirection]]:
    """The signs of a law that swings, but at frequencies at which an input does, too: anything may
    follow that.
    """
    shown, rate = law.signs, law.parameters[-1].name

    def directions(view: View) -> list[TangentDirection]:
        signs = shown(view) if shown else ()
        apart = [u - np.mean(u) for u in view.u.values()]
        driven = {w for w in {sign.start[rate] for sign in signs}
                  if any(_is_line(u, w * view.t) for u in apart)}
        return [sign for sign in signs if sign.start[rate] not in driven]

    return directions


def _is_line(u: np.ndarray, phase: np.ndarray) -> bool:
    """Whether most of an input (L,) about its mean swings with this phase (L,)."""
    waves = np.column_stack([np.ones_like(phase), np.sin(phase), np.cos(phase)])
    seen = waves.T @ u
    return bool(seen @ np.linalg.lstsq(waves.T @ waves, seen)[0] > LINE * (u @ u))
