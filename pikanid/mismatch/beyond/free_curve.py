"""Free curves of states, inputs, outputs: in place of laws that nobody has listed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pikanid.mismatch.beyond.patch import FreeCurve
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.fitting.closest import Closest
from pikanid.mismatch.fitting.hypothesis import Hypothesis, fitted
from pikanid.model import Model

FINE = 12  # numerical: pieces of a curve, for a law that acts in a tenth of the range
PIECES = (FINE, 6, 3)  # numerical: with which a curve is tried, one after the other


def with_free_curve(nominal: Model, h: Hypothesis, effects: Sequence[Candidate], argument: str,
                    site: Site, near: float = np.inf, tried: Sequence[int] = PIECES,
                    zero_at_zero: bool = False, start: Hypothesis | None = None
                    ) -> Hypothesis | None:
    """Effects of a hypothesis and a free curve as a force, refitted from where it stands, with
    fewer pieces where that ends in nothing that can be run; None where no curve can be.

    Args:
        nominal: Model without effects.
        h: The hypothesis; its motion is the curve's range.
        effects: Some of its effects.
        argument: State that the curve is a function of.
        site: Coordinate in whose equation it stands.
        near: χ² to come near to: a fit that stays far above is not carried through.
        tried: Numbers of pieces.
        zero_at_zero: Whether the curve holds no constant; none can be that was never near zero.
        start: Where to begin instead: a fit with such a curve.
    """
    visited = h.whitened.motion(h.minimum.theta)[argument]
    low, high = float(visited.min()), float(visited.max())
    if zero_at_zero and not low < 0 < high:
        return None
    curves = (FreeCurve(argument, low, high, h.model, pieces, zero_at_zero=zero_at_zero)
              for pieces in tried)
    return next((found for curve in curves if (found := fitted(
        nominal, [*effects, curve.candidate(site)], h.whitened.records, [(start or h).point], 1,
        Closest(near), h.key)) is not None), None)


def with_free_input(nominal: Model, h: Hypothesis, effects: Sequence[Candidate], argument: str,
                    site: Site, near: float = np.inf, zero_at_zero: bool = False,
                    start: Hypothesis | None = None) -> Hypothesis | None:
    """The same with a free curve of an input in what acts; None where that never changes."""
    problem = h.whitened.problem
    at = nominal.input_names.index(argument)
    visited = np.concatenate([e.held[at].values for e in problem.experiments])
    return _beside(nominal, h, effects, argument, visited, nominal.input(argument).unit,
                   FreeCurve.of_input, site, near, zero_at_zero, start)


def with_free_sensor(nominal: Model, h: Hypothesis, effects: Sequence[Candidate],
                     site: Site, near: float = np.inf) -> Hypothesis | None:
    """The same with a free curve of the site's output in what it shows."""
    problem, output = h.whitened.problem, site.output
    visited = np.concatenate([s.y for e in problem.experiments for s in e.samples
                              if problem.model.outputs[s.output].name == output.name])
    return _beside(nominal, h, effects, output.name, visited, output.unit, FreeCurve.of_sensor,
                   site, near)


def _beside(nominal: Model, h: Hypothesis, effects: Sequence[Candidate], name: str,
            visited: np.ndarray, unit: str, curve_of: Callable[[FreeCurve, Site], Candidate],
            site: Site, near: float, zero_at_zero: bool = False, start: Hypothesis | None = None
            ) -> Hypothesis | None:
    low, high = float(visited.min()), float(visited.max())
    if low == high or (zero_at_zero and not low < 0 < high):
        return None
    curve = FreeCurve(name, low, high, h.model, FINE, unit, zero_at_zero)
    return fitted(nominal, [*effects, curve_of(curve, site)], h.whitened.records,
                  [(start or h).point], 1, Closest(near), h.key)
