"""Free curves of states, inputs, outputs: in place of laws that nobody has listed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pikanid.formula import units
from pikanid.mismatch.beyond.patch import FreeCurve
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.fitting.closest import Closest
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.model import Model

FINE = 12  # numerical: pieces of a curve, for a law that acts in a tenth of the range
PIECES = (FINE, 6, 3)  # numerical: with which a curve is tried, one after the other


def with_free_curve(nominal: Model, h: Hypothesis, effects: Sequence[Candidate], argument: str,
                    site: Site, near: float = np.inf, tried: Sequence[int] = PIECES
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
    """
    curves = (state_curve(h, argument, site, pieces) for pieces in tried)
    return next((found for curve in curves
                 if (found := _refitted(nominal, h, effects, curve, near)) is not None), None)


def with_free_input(nominal: Model, h: Hypothesis, effects: Sequence[Candidate], name: str,
                    site: Site, near: float = np.inf) -> Hypothesis | None:
    """The same with a free curve of an input in what acts; None where that never changes."""
    return _refitted(nominal, h, effects, input_curve(h, name, site), near)


def with_free_sensor(nominal: Model, h: Hypothesis, effects: Sequence[Candidate],
                     site: Site, near: float = np.inf) -> Hypothesis | None:
    """The same with a free curve of the site's output in what it shows."""
    problem, output = h.whitened.problem, site.output
    visited = np.concatenate([s.y for e in problem.experiments for s in e.samples
                              if problem.model.outputs[s.output].name == output.name])
    curve = _curve(h, output.name, visited, output.unit, FINE, False)
    return _refitted(nominal, h, effects, curve.of_sensor(site) if curve else None, near)


def with_and_instead(nominal: Model, h: Hypothesis, rest: Sequence[Candidate],
                     curve: Candidate | None, near: float
                     ) -> tuple[Hypothesis | None, Hypothesis | None]:
    """A hypothesis with a curve beside all its effects, and, from there, beside the rest of them:
    without its constant force a drive spins far off.
    """
    both = _refitted(nominal, h, h.effects, curve, near)
    return both, None if both is None else _refitted(nominal, both, rest, curve, near)


def state_curve(h: Hypothesis, name: str, site: Site, pieces: int = FINE,
                zero_at_zero: bool = False) -> Candidate | None:
    """A free curve of a state over a hypothesis' motion as a force; None where there can be none.
    """
    curve = _curve(h, name, h.whitened.motion(h.minimum.theta)[name], h.model.state(name).unit,
                   pieces, zero_at_zero)
    return curve.candidate(site) if curve else None


def input_curve(h: Hypothesis, name: str, site: Site, zero_at_zero: bool = False
                ) -> Candidate | None:
    """The same of an input in what acts."""
    at = h.model.input_names.index(name)
    visited = np.concatenate([e.held[at].values for e in h.whitened.problem.experiments])
    curve = _curve(h, name, visited, h.model.input(name).unit, FINE, zero_at_zero)
    return curve.of_input(site) if curve else None


def _curve(h: Hypothesis, name: str, visited: np.ndarray, unit: str, pieces: int,
           zero_at_zero: bool) -> FreeCurve | None:
    """None of what never changes, or, where it has to be zero at zero, was never there or has no
    zero but by convention, as degrees Celsius.
    """
    low, high = float(visited.min()), float(visited.max())
    if low == high or (zero_at_zero and not (
            low <= 0 <= high and not (unit and units.begins_elsewhere(unit)))):
        return None
    return FreeCurve(name, low, high, h.model, pieces, unit, zero_at_zero)


def _refitted(nominal: Model, h: Hypothesis, effects: Sequence[Candidate],
              curve: Candidate | None, near: float) -> Hypothesis | None:
    return None if curve is None else fitted(
        nominal, [*effects, curve], h.whitened.records, [h.point], 1, Closest(near), h.key)
