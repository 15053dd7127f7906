"""A force that goes on swinging: what a rig does that was pushed once, where it is pushed on."""

from __future__ import annotations

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.model.parts import Parameter

FASTEST = 3.0  # numerical: times the natural frequency, up to which it is looked for
TURNS = 24.0  # numerical: in a recording, of what has no natural frequency
MOST = 300  # limit: frequencies that are looked at


def swinging_force(start: Candidate) -> Candidate:
    """a sin ωt + b cos ωt, in place of another initial state.

    Near a resonance it rings as that does, and does not decay.
    """
    site = start.site
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
        rates = np.arange(turn, high, max(0.5 * turn, (high - turn) / MOST))
        return [TangentDirection({size.name: 1.0, w.name: float(rate)}, force=wave(rate * view.t))
                for rate in rates for size, wave in ((a, np.sin), (b, np.cos))]

    return Candidate(("swinging_force",), "a force that swings", text, "dynamics", site, (a, b, w),
                     lambda m: site.pushed(m, text), lambda view: [], families=("drive",),
                     per_recording=True, known=False, next_to=start.key, signs=signs)
