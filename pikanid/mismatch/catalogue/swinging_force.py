"""A force that goes on swinging: what a rig does that was pushed once, where it is pushed on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pikanid.mismatch.catalogue.candidate import SYMBOLIC, Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site
from pikanid.model.parts import Parameter

FASTEST = 3.0  # numerical: times the natural frequency, up to which it is looked for
TURNS = 24.0  # numerical: in a recording, of what has no natural frequency
MOST = 300  # limit: frequencies that are looked at
LINE = 0.5  # numerical: of an input's variance, at a frequency: from there on that may be its doing


def swinging_force(site: Site, next_to: str) -> Candidate:
    """a sin ωt + b cos ωt, in place of another initial state: near a resonance it rings as that
    does, and does not decay.
    """
    a, b = (Parameter(site.name(name), 0.0, site.force_unit, scope="recording")
            for name in ("swing_a", "swing_b"))
    first, last = site.span
    turn = 2 * np.pi / (last - first)
    fastest = np.pi / site.interval
    natural = FASTEST * site.rate  # of what hardly turns in a recording none shows
    high = min(natural if natural > turn else TURNS * turn, fastest)
    w = Parameter(site.name("swing_rate"), min(site.rate or turn, fastest), "rad/s",
                  (0.0, fastest))
    text = f"{a.name}*sin({w.name}*t) + {b.name}*cos({w.name}*t)"

    def signs(view: View) -> list[TangentDirection]:
        # two swings can be told apart that differ by half a turn in a recording
        rates = [rate for rate in np.arange(turn, high, max(0.5 * turn, (high - turn) / MOST))
                 if not _driven(view, rate)]
        return [TangentDirection({size.name: 1.0, w.name: float(rate)}, force=wave(rate * view.t))
                for rate in rates for size, wave in ((a, np.sin), (b, np.cos))]

    return Candidate(("swinging_force",), "a force that swings", text, "dynamics", site, (a, b, w),
                     lambda m: site.pushed(m, text), lambda view: [], families=("drive",),
                     per_recording=True, known=False, next_to=next_to, signs=signs)


def swinging_on_its_own(site: Site) -> Candidate:
    """The same in nothing's place, as a formula that was read: what waves, wind and shafts that
    turn do.
    """
    law = swinging_force(site, "")
    return replace(law, ids=(SYMBOLIC + law.expression,), known=True,
                   directions=law.signs or law.directions, signs=None)


def _driven(view: View, rate: float) -> bool:
    """Whether an input swings at this frequency itself: anything may follow it then."""
    waves = np.column_stack([np.ones(len(view.t)), np.sin(rate * view.t), np.cos(rate * view.t)])
    for u in view.u.values():
        apart = u - np.mean(u)
        left = u - waves @ np.linalg.lstsq(waves, u)[0]
        if np.sum(left**2) < (1 - LINE) * np.sum(apart**2):
            return True
    return False
