"""What an experiment would show of a model: outputs and sensitivities in units of the noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from pikanid import errors
from pikanid.mismatch.data.whitened import TOO_ROUGH
from pikanid.mismatch.fitting.parallel import side_by_side
from pikanid.model import Model
from pikanid.problem.problem import Problem, Samples
from pikanid.recording import Recording
from pikanid.recording.channel import Array
from pikanid.simulation import Steps, VectorField
from pikanid.simulation.synthetic import with_outputs
from pikanid.simulation.translated import Translated

Sigma = float | Mapping[str, float] | None
Result = TypeVar("Result")
SHARE = 0.01  # numerical: of σ that an integration error may reach
SLOW = 1e-6  # numerical: of the fastest rate, below which rounding makes an oscillation
COARSE = 16.0  # numerical: sub-steps of a sample beyond which a motion is too wild to plan with


@dataclass(frozen=True, eq=False)
class WhitenedResponse:
    """A model's response to one excitation, at its own parameter values.

    Attributes:
        y: (N,) outputs, one after the other, in σ.
        jacobian: (N, p) derivatives by the free parameters, in σ.
        low: (p,) how far each free parameter may fall.
        high: (p,) how far it may rise.
        own: (p,) whether it belongs to this recording alone, as a free initial state does.
        outputs: Name -> (times, values) in its unit.
    """

    y: Array
    jacobian: Array
    low: Array
    high: Array
    own: np.ndarray
    outputs: Mapping[str, tuple[Array, Array]]

    def reached(self, output: str) -> float:
        """Largest |value| of an output."""
        return float(np.max(np.abs(self.outputs[output][1])))


class Watched:
    """A model in one experiment: simulated with exact sensitivities, without compiling it.

    Args:
        model: Any.
        excitation: Its inputs; outputs, where there are any, give the times and the noise.
        sigma: Noise of the outputs; None to take it from the recording or the model.

    Raises:
        BadSetting: If no σ is known for an output.
    """

    def __init__(self, model: Model, excitation: Recording, sigma: Sigma = None):
        full = with_outputs(model, excitation)
        for output in model.outputs:
            value = sigma.get(output.name) if isinstance(sigma, Mapping) else sigma
            if value is not None:
                full = full.with_sigma(**{output.name: value})
            elif full[output.name].sigma is None and output.sigma is None:
                raise errors.BadSetting(errors.sigma_unknown(output.name))
        self.model, self.name = model, excitation.name
        self.problem = Problem(model, full)
        self.simulator = Translated(model, self.problem.experiments[0],
                                    estimated=tuple(self.problem.columns(0)[0].tolist()))
        self.spread = np.concatenate([np.asarray(s.sigma, float) for s in self.samples])
        self.steps: Steps | None = None
        self.kept: dict[bytes, WhitenedResponse] = {}  # at the model's own values, and the last one

    @property
    def samples(self) -> tuple[Samples, ...]:
        """Where and how well each output is seen."""
        return self.problem.experiments[0].samples

    def at(self, theta: Array) -> WhitenedResponse:
        """The response at free parameters θ (p,).

        Raises:
            SimulationFailed: If the motion does not stay finite, or is too wild to follow.
        """
        key, own = theta.tobytes(), self.problem.guess.tobytes()
        if key not in self.kept:
            found = self._simulated(theta)
            self.kept = {k: s for k, s in self.kept.items() if k == own} | {key: found}
        return self.kept[key]

    def _simulated(self, theta: Array) -> WhitenedResponse:
        p = self.problem.parameters(theta, 0)
        inside, order = self.problem.columns(0)
        self.steps = self.steps or self._chosen_steps(p)
        response = self.simulator.run(p, inside, self.steps)
        if not response.finished:
            raise errors.SimulationFailed(errors.not_finite(response.stopped_at, self.model.name))
        jacobian = np.empty((len(self.spread), len(order)))
        jacobian[:, order] = response.sensitivity / self.spread[:, None]
        ends = np.cumsum([len(s.t) for s in self.samples])[:-1]
        outputs = {self.model.outputs[s.output].name: (s.t, values) for s, values in zip(
            self.samples, np.split(response.y, ends), strict=True)}
        own = np.array([f.recording is not None for f in self.problem.free], bool)
        return WhitenedResponse(response.y / self.spread, jacobian, self.problem.lower - theta,
                    self.problem.upper - theta, own, outputs)

    def _chosen_steps(self, p: Array) -> Steps:
        finest = float(np.median(np.diff(self.samples[0].t))) / COARSE
        steps = self.simulator.choose_steps(p, SHARE, finest=finest, scale=self.spread)
        if steps.error > TOO_ROUGH * SHARE:
            raise errors.SimulationFailed(errors.too_rough_to_plan(self.model.name, self.name))
        return steps


def response(model: Model, excitation: Recording, sigma: Sigma = None) -> WhitenedResponse:
    """The response of a model at its own values; arguments and errors as for `Watched`.

    >>> from pikanid.recording import excitation
    >>> from pikanid.model import systems
    >>> found = response(systems.sloshing(), excitation.two_pulse(), sigma=0.1*np.pi/180)
    >>> found.y.shape, found.jacobian.shape, round(found.reached("theta"), 3)
    ((501,), (501, 2), 0.198)
    """
    watched = Watched(model, excitation, sigma)
    return watched.at(watched.problem.guess)


class Watch:
    """Several models in any experiments: what is seen once is seen again at no cost.

    Args:
        models: Name -> model at its parameter values.
        sigma: As for `Watched`.
        workers: Threads; each model is simulated in one of them at a time.
    """

    def __init__(self, models: Mapping[str, Model], sigma: Sigma = None, workers: int = 1):
        self.models, self.sigma, self.workers = dict(models), sigma, workers
        self.kept: dict[tuple[str, int], tuple[Recording, Watched]] = {}

    def of(self, name: str, excitation: Recording) -> Watched:
        """One model in one experiment; errors as for `Watched`."""
        key = name, id(excitation)  # an id that stays taken: the recording is kept as well
        if key not in self.kept:
            self.kept[key] = excitation, Watched(self.models[name], excitation, self.sigma)
        return self.kept[key][1]

    def responses(self, excitations: Sequence[Recording]) -> dict[str, list[WhitenedResponse]]:
        """Name of a model -> its responses at its own values."""
        return self.of_each(lambda name: [w.at(w.problem.guess) for w in (
            self.of(name, e) for e in excitations)])

    def of_each(self, work: Callable[[str], Result]) -> dict[str, Result]:
        """Name of a model -> what `work` makes of it."""
        names = list(self.models)
        return dict(zip(names, side_by_side(names, work, self.workers), strict=True))


def joined(responses: Sequence[WhitenedResponse]) -> WhitenedResponse:
    """Responses of one model to several excitations, as one: shared parameters share a column."""
    first = responses[0]
    shared = ~first.own
    blocks = []
    for k, response in enumerate(responses):
        parts = [response.jacobian[:, shared]]
        for other in range(len(responses)):
            mine = response.jacobian[:, first.own]
            parts.append(mine if other == k else np.zeros_like(mine))
        blocks.append(np.hstack(parts))

    def repeated(bound: str) -> Array:
        return np.concatenate([getattr(first, bound)[shared],
                               *(getattr(r, bound)[first.own] for r in responses)])

    own = np.concatenate([np.zeros(shared.sum(), bool),
                          np.ones(int(first.own.sum()) * len(responses), bool)])
    return WhitenedResponse(np.concatenate([r.y for r in responses]), np.vstack(blocks),
                            repeated("low"), repeated("high"), own, {})


def natural_frequency(model: Model) -> float | None:
    """The slowest frequency at which a model rings around its initial state [Hz]; None if none.

    >>> from pikanid.model import systems
    >>> round(natural_frequency(systems.sloshing()), 2)
    2.35
    """
    slowest = _slowest(_eigenvalues(model).imag)
    return None if slowest is None else slowest / (2 * np.pi)


def decay_rate(model: Model) -> float | None:
    """That of the slowest decay around the initial state of a model [1/s]; None if none.

    >>> from pikanid.model import systems
    >>> round(decay_rate(systems.sloshing()), 3)
    0.25
    """
    return _slowest(_eigenvalues(model).real)


def _slowest(parts: Array) -> float | None:
    rates = np.abs(parts)
    some = rates[rates > SLOW * max(float(rates.max(initial=0.0)), 1e-12)]
    return float(some.min()) if len(some) else None


def _eigenvalues(model: Model) -> Array:
    """Of the linearised right-hand side [1/s]; none where that is not a number."""
    problem = Problem(model, _nothing(model), need_outputs=False)
    p = problem.parameters(problem.guess, 0)
    x = problem.experiments[0].initial(p)[None, :]
    u = np.zeros((1, len(model.inputs)))
    jacobian = VectorField(model).rhs_jacobians(np.zeros(1), x, u, p)[0][0]
    return np.linalg.eigvals(jacobian) if np.all(np.isfinite(jacobian)) else np.zeros(0)


def _nothing(model: Model) -> Recording:
    """Inputs that are zero."""
    t = np.array([0.0, 1.0])
    names = model.input_names or ("t_only",)
    return Recording.from_arrays(t, {name: np.zeros(2) for name in names},
                                 hold={name: "zero" for name in names})
