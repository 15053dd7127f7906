"""How strong an effect must be to be seen, and the recording that it then gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.design.response import SHARE, Sigma
from pikanid.mismatch.fitting.descent import start_from
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.search.screen import Screen
from pikanid.mismatch.settings.settings import Settings
from pikanid.model import Model
from pikanid.noise.level import NoiseModel
from pikanid.noise.projection import project
from pikanid.recording import Channel, Recording
from pikanid.simulation.synthetic import with_outputs

LEAST = 1e-3  # numerical: of a distance: less is not told from none
STRIDE = 0.7  # numerical: of ln amplitude: a factor of two
CLOSE = 0.1  # numerical: relative error of a distance that is good enough


@dataclass(frozen=True, eq=False)
class Sized:
    """An effect at one size.

    Attributes:
        parameter: That is its size; empty if it has none.
        values: Of its parameters.
        departure: |size - value at no effect|; the size itself where it is a limit, a lag or the
            like, which have no such value.
        falling: Whether it shows the more the smaller its size, as a limit does.
        distance: Of the refitted nominal model [σ].
        records: What would be recorded, without noise.
        nominal: The nominal model refitted to that.
    """

    parameter: str
    values: Mapping[str, float]
    departure: float
    falling: bool
    distance: float
    records: Records
    nominal: Hypothesis


def recorded(model: Model, excitation: Recording, sigma: Sigma, settings: Settings) -> Records:
    """What a model would show, without noise but with its level.

    Raises:
        BadSetting: If no σ is known for an output.
        SimulationFailed: If the model cannot be simulated.
    """
    full = with_outputs(model, excitation)
    levels = {}
    for o in model.outputs:
        given = sigma.get(o.name) if isinstance(sigma, Mapping) else sigma
        known = full[o.name].sigma if given is None else given
        known = o.sigma if known is None else known
        if known is None:
            raise errors.BadSetting(errors.sigma_unknown(o.name))
        levels[o.name] = NoiseModel(
            float(np.median(known)), 0.0, 0.0, full[o.name].interval, "given")
    whitened = Whitened(model, Records((full,), (levels,), settings))
    theta = whitened.problem.guess
    if not whitened.choose_steps(theta, SHARE):
        raise errors.SimulationFailed(errors.too_rough_to_plan(model.name, excitation.name))
    response = whitened.responses(theta)[0]
    if not response.finished:
        raise errors.SimulationFailed(errors.not_finite(response.stopped_at, model.name))
    samples = whitened.problem.experiments[0].samples
    parts = np.split(response.y, np.cumsum([len(s.t) for s in samples])[:-1])
    channels = [Channel(o.name, s.t, y, o.unit, levels[o.name].sigma) for o, s, y in zip(
        (model.outputs[s.output] for s in samples), samples, parts, strict=True)]
    return Records((full.with_channels(*channels),), (levels,), settings)


def sized(candidate: Candidate, screen: Screen, own: np.ndarray, wanted: float, base: Hypothesis,
          excitation: Recording, sigma: Sigma, typical: bool = False) -> Sized | None:
    """An effect, so strong that the refitted nominal model is `wanted` σ away.

    Args:
        candidate: The effect.
        screen: Signs of it and of others about the nominal model.
        own: (k,) which signs are the candidate's.
        wanted: [σ].
        base: The nominal model.
        excitation: The experiment.
        sigma: Noise.
        typical: Whether to take the form of middling visibility, rather than the most visible.

    Returns:
        The closest size that was found, or None where none can be simulated.
    """
    signs, lengths = screen.found.directions, screen.lengths
    own = own[lengths[own] > 0]
    scaling = signs[own[0]].scales
    name = _size_of(candidate, [signs[k].start for k in own], scaling)
    if not scaling:  # levels are compared as logarithms
        own = np.array([k for k in own if signs[k].start.get(name, 1.0) > 0], dtype=int)
    if not len(own):
        return None
    starts = np.array([abs(signs[k].start.get(name, 1.0)) for k in own])
    slope = 1.0
    if scaling:
        # σ per unit of the parameter, whatever the sign was drawn with
        ranked = own[np.argsort(lengths[own] / starts, kind="stable")]
        chosen = int(ranked[len(ranked) // 2] if typical else ranked[-1])
    else:
        chosen = int(own[np.argmin(np.abs(np.log(lengths[own] / wanted)))])
        if len(own) > 1 and np.ptp(starts) > 0:
            slope = float(np.polyfit(np.log(starts), np.log(lengths[own]), 1)[0])
    sign = signs[chosen]
    null = next((p.value for p in candidate.parameters if p.name == name), 0.0) if scaling else 0.0
    amplitude = wanted / lengths[chosen] if scaling else 1.0
    absorbed = 1.0  # of the first order's distance, what a whole refit leaves
    tried: list[tuple[float, float]] = []
    best: Sized | None = None
    for _ in range(base.whitened.settings.budget.planned_sizes):
        values = dict(start_from(candidate, sign, amplitude, {}).values)
        if not scaling and name:
            values[name] = sign.start[name] * amplitude
        at = _shown(candidate, values, base, excitation, sigma)
        if at is None:
            break
        own_values, records, first_order = at
        tried.append((amplitude, absorbed * first_order))
        if not name or abs(absorbed * first_order / wanted - 1) < CLOSE:
            best = _refitted(name, own_values, null, slope < 0, records, base)
            if best is None or not name or abs(best.distance / wanted - 1) < 2 * CLOSE:
                break
            absorbed = max(best.distance / first_order, LEAST)
            tried = [(amplitude, best.distance)]
        amplitude = _next(tried, wanted, slope)
    if best is None and tried:
        best = _refitted(name, own_values, null, slope < 0, records, base)
    return best


def _refitted(name: str, values: Mapping[str, float], null: float, falling: bool,
              records: Records, base: Hypothesis) -> Sized | None:
    """The nominal model absorbs most of some effects, and bends doing so: it is refitted."""
    nominal = fitted(base.model, (), records, [base.values], 1)
    if nominal is None:
        return None
    distance = float(np.sqrt(nominal.minimum.chi2))
    return Sized(name, values, abs(values.get(name, 0.0) - null), falling, distance, records,
                 nominal)


def _size_of(candidate: Candidate, starts: Sequence[Mapping[str, float]], scaling: bool) -> str:
    """The parameter whose value decides how visible the effect is; empty if there is none."""
    names = list(starts[0])
    if not scaling:
        names = [n for n in names if len({start[n] for start in starts}) > 1] or names
    return names[0] if names else next((p.name for p in candidate.parameters), "")


def _next(tried: Sequence[tuple[float, float]], wanted: float, slope: float) -> float:
    """The next amplitude after (amplitude, distance): between two that embrace the wanted distance,
    or else along a power law."""
    below = [a for a, d in tried if d < wanted]
    above = [a for a, d in tried if d >= wanted]
    if below and above:
        near = (max(below), min(above)) if slope > 0 else (min(below), max(above))
        return float(np.sqrt(near[0] * near[1]))
    amplitude, distance = tried[-1]
    step = np.log(wanted / max(distance, LEAST * wanted)) / slope
    return float(amplitude * np.exp(np.clip(step, -STRIDE, STRIDE)))


def _shown(candidate: Candidate, values: Mapping[str, float], base: Hypothesis,
           excitation: Recording, sigma: Sigma
           ) -> tuple[dict[str, float], Records, float] | None:
    """Values, recording and first-order distance [σ] of an effect; None if it cannot be run."""
    own = {p.name: values.get(p.name, p.value) for p in candidate.parameters}
    try:
        records = recorded(candidate.applied(base.model).with_values(own), excitation, sigma,
                           base.whitened.settings)
    except (errors.SimulationFailed, errors.BadModel):
        return None
    at = Whitened(base.model, records)
    at.steps = base.whitened.steps
    residual = at.residual(base.minimum.theta)
    if residual is None:
        return None
    left = project(base.minimum.J, residual[0][:, None])
    return own, records, float(np.linalg.norm(left))
