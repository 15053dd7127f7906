"""The next experiment: the feasible input profile that tells most.

*Which hypothesis is true?*  For hypotheses a and b, complete models with their values, the
recording of a profile would differ from the best that b can still do by

    D²(a, b) = min_δ Σ_e |r_e - J_e δ|²,   r_e = (y_a - y_b)/σ,   J_e = (∂y_b/∂θ_b)/σ,

summed over the profile and what was recorded before, δ within the bounds of b's free parameters.
The finalists are judged again by refitting b's simulation.  D² is the non-centrality of the
likelihood-ratio test between the two; the worst pair decides.

*What are the parameters?*  Of all profiles the D-optimal one has the largest determinant of the
Fisher information F = Σ_e J_eᵀ J_e (V. V. Fedorov, Theory of Optimal Experiments, 1972).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import TYPE_CHECKING, Literal

import numpy as np

from pikanid import errors
from pikanid.mismatch.design.profiles import Bounds, profiles_for, scaled
from pikanid.mismatch.design.ranges import Range
from pikanid.mismatch.design.reach import reach_sentence, reached
from pikanid.mismatch.design.response import (
    Sigma,
    Watch,
    WhitenedResponse,
    joined,
)
from pikanid.mismatch.design.separation import distance, mean_precision, refitted_within
from pikanid.mismatch.settings.settings import DEFAULTS, Settings
from pikanid.model import Model
from pikanid.problem.arguments import a_model, several
from pikanid.recording import Recording
from pikanid.recording.channel import Array
from pikanid.uncertainty.information import covariance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LESS = 0.99  # numerical: of a proportional size, which a softening spring would never come down to
Score = Callable[[Mapping[str, list[WhitenedResponse]], Sequence[Recording]], float]


@dataclass(frozen=True, eq=False)
class NextExperiment:
    """A profile to run, and what it promises.

    Attributes:
        profile: Inputs, ready to run.
        purpose: What it was chosen for.
        value: `separate`: smallest D [σ] between two hypotheses, with all that was recorded before;
            `parameters`: geometric mean of the standard errors' inverses.
        before: The same without the profile, 0 where nothing was recorded before.
        repeated: The same if the last recording were repeated instead, or, where there is none, of
            the median candidate.
        ranking: (name, value) of the finalists, the best first.
        responses: Name of a hypothesis -> its outputs under the profile: name -> (times, values).
        std: Foretold standard errors of the parameters, for `parameters`.
        separated: Distance [σ] that tells two hypotheses apart.
        units: Of the outputs, by name.
    """

    profile: Recording
    purpose: Literal["separate", "parameters"]
    value: float
    before: float
    repeated: float
    ranking: tuple[tuple[str, float], ...]
    responses: Mapping[str, Mapping[str, tuple[Array, Array]]]
    std: Mapping[str, float]
    separated: float
    units: Mapping[str, str]

    @property
    def gain(self) -> float:
        """How many times better than what it is compared with (`repeated`)."""
        return self.value / self.repeated if self.repeated > 0 else np.inf

    @property
    def reach(self) -> dict[str, tuple[float, float]]:
        """Least and largest value of each output under the profile, by any of the hypotheses."""
        return reached(self.responses.values())

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the profile to a CSV, TSV or Parquet file.

        Raises:
            BadRecording: If the place cannot be written to.
        """
        self.profile.write(path)

    def plot(self) -> Figure:
        """The profile, and the outputs that the hypotheses foretell."""
        from pikanid.mismatch.design.figure import design_figure

        return design_figure(self.profile, self.responses, self.units)

    def to_dict(self) -> dict[str, object]:
        """What can go into a report as JSON."""
        return {"profile": self.profile.name, "purpose": self.purpose, "value": self.value,
                "before": self.before, "repeated": self.repeated,
                "gain": self.gain if np.isfinite(self.gain) else None,
                "std": dict(self.std), "reach": {k: list(v) for k, v in self.reach.items()},
                "ranking": [list(row) for row in self.ranking]}

    def __str__(self) -> str:
        name = self.profile.name
        ends = (reach_sentence(self.reach, self.units), *self.profile.notes)
        if self.purpose == "separate":
            verdict = "tells them apart" if self.value >= self.separated else (
                f"does not tell them apart yet ({self.separated:g} σ are needed)")
            return " ".join((f"Next experiment: {name}. The closest two hypotheses are "
                             f"{self.value:.3g} σ apart afterwards ({self.before:.3g} σ now): it "
                             f"{verdict}.", *ends))
        otherwise = ("if the last recording were repeated" if self.before > 0
                     else "with the median profile")
        bounds = ", ".join(f"{key} ± {std:.2g}" for key, std in self.std.items())
        return " ".join((f"Next experiment: {name}. Standard errors of {bounds}; {self.gain:.3g} "
                         f"times smaller on average than {otherwise}.", *ends))


def next_experiment(hypotheses: Mapping[str, Model], recorded: Sequence[Recording] | Recording = (),
                    sigma: Sigma = None, candidates: Sequence[Recording] | None = None,
                    bounds: Bounds | None = None, duration: float | None = None,
                    dt: float | None = None, limits: Mapping[str, float] | None = None,
                    seed: int = 0, workers: int = 1, settings: Settings = DEFAULTS,
                    ranges: Mapping[str, Range] | None = None) -> NextExperiment:
    """The feasible profile that best separates hypotheses.

    Args:
        hypotheses: Name -> model at its parameter values; its free parameters are those that a fit
            could still adjust.
        recorded: What was recorded before.
        sigma: Noise of the outputs, if recordings and models do not carry it.
        candidates: Profiles to choose from; by default those of `profiles`.
        bounds: Of the drive, for the default candidates; by default those of a planar motor for
            inputs that are accelerations.
        duration: Of the default candidates [s]; by default that of the longest recording, without
            any 20 s, or five periods or time constants of the first model.
        dt: Their sampling interval [s]; by default that of what was recorded, else 0.01 s or what
            these ask for.
        limits: Output -> largest |value| that the experiment may reach; profiles are made smaller
            until every hypothesis keeps to it.
        seed: Of the default candidates.
        workers: Threads that simulate hypotheses side by side; the choice does not depend on them.
        settings: When hypotheses are told apart, and how many profiles are judged by refitting.
        ranges: Input -> its least and largest value in the model's unit, for the default
            candidates; by default those in `recorded`, where it is no acceleration.

    Raises:
        BadSetting: With fewer than two hypotheses, no σ, an input whose range is not known, or
            bounds that leave no room.
        SimulationFailed: If no candidate can be simulated.

    >>> from pikanid.recording import excitation
    >>> from pikanid.model import systems
    >>> from pikanid.model import Parameter
    >>> nominal = systems.sloshing()
    >>> rough = nominal.with_term("theta_dot", "-c*sign(theta_dot)", [Parameter("c", 0.5)])
    >>> drag = nominal.with_term("theta_dot", "-q*abs(theta_dot)*theta_dot", [Parameter("q", 0.5)])
    >>> chosen = next_experiment({"friction": rough, "drag": drag}, sigma=0.1*np.pi/180,
    ...                          candidates=[excitation.two_pulse(), excitation.two_pulse(20.0)])
    >>> len(chosen.profile.t), chosen.value > 4
    (2001, True)
    """
    if not isinstance(hypotheses, Mapping):
        raise errors.BadSetting(errors.not_of_kind(
            "'hypotheses'", type(hypotheses).__name__, "a dictionary: name -> model"))
    if len(hypotheses) < 2:
        raise errors.BadSetting(errors.too_few_hypotheses(len(hypotheses)))
    past = [] if isinstance(recorded, Sequence) and not recorded else list(several(recorded))
    models = {str(name): a_model(model) for name, model in hypotheses.items()}
    watch = Watch(models, sigma, workers)
    known = watch.responses(past)

    def worst(new: Mapping[str, list[WhitenedResponse]], profiles: Sequence[Recording]) -> float:
        return min(distance([*known[a], *new[a]], [*known[b], *new[b]])
                   for a, b in permutations(models, 2))

    def refit(new: Mapping[str, list[WhitenedResponse]], profiles: Sequence[Recording]) -> float:
        def nearest(b: str) -> float:
            watched = [watch.of(b, e) for e in (*past, *profiles)]
            return min(refitted_within([*known[a], *new[a]], watched) for a in models if a != b)

        return min(watch.of_each(nearest).values())

    offered = (profiles_for(models, bounds, duration, dt, seed, ranges, past)
               if candidates is None else candidates)
    return _chosen(watch, "separate", worst, refit, known, past, offered, limits, settings)


def d_optimal(model: Model, recorded: Sequence[Recording] | Recording = (), sigma: Sigma = None,
              candidates: Sequence[Recording] | None = None, bounds: Bounds | None = None,
              duration: float | None = None, dt: float | None = None,
              limits: Mapping[str, float] | None = None, seed: int = 0,
              settings: Settings = DEFAULTS, ranges: Mapping[str, Range] | None = None
              ) -> NextExperiment:
    """The feasible profile from which a model's free parameters are learnt best.

    Arguments and errors as for `next_experiment`.

    >>> from pikanid.recording import excitation
    >>> from pikanid.model import systems
    >>> chosen = d_optimal(systems.sloshing(), sigma=0.1*np.pi/180,
    ...                    candidates=[excitation.two_pulse(), excitation.two_pulse(amplitude=0.5)])
    >>> chosen.profile["u_x"].values.max(), float(f"{chosen.std['l_theta']:.2e}")
    (np.float64(1.0), 9.89e-06)
    """
    if not a_model(model).free_names:
        raise errors.BadSetting(errors.nothing_to_learn(model.name))
    past = [] if isinstance(recorded, Sequence) and not recorded else list(several(recorded))
    watch = Watch({model.name: model}, sigma)
    known = watch.responses(past)

    def precision(new: Mapping[str, list[WhitenedResponse]], profiles: Sequence[Recording]
                  ) -> float:
        every = [*known[model.name], *new[model.name]]
        return mean_precision(joined(every).jacobian) if every else 0.0

    offered = (profiles_for(watch.models, bounds, duration, dt, seed, ranges, past)
               if candidates is None else candidates)
    return _chosen(watch, "parameters", precision, precision, known, past, offered, limits,
                   settings)


def _chosen(watch: Watch, purpose: Literal["separate", "parameters"], quick: Score, full: Score,
            known: Mapping[str, list[WhitenedResponse]], past: Sequence[Recording],
            candidates: Sequence[Recording], limits: Mapping[str, float] | None,
            settings: Settings) -> NextExperiment:
    """The best candidate, ready to run: all are ranked by `quick`, the first of them by `full`."""
    tried = []
    for candidate in candidates:
        try:
            profile, responses = _within(watch, candidate, limits or {},
                                         settings.budget.smaller)
        except errors.SimulationFailed:
            continue  # a profile too rough for one of the hypotheses is no candidate
        new = {name: [r] for name, r in responses.items()}
        tried.append((quick(new, [profile]), profile, new))
    if not tried:
        raise errors.SimulationFailed(errors.no_profile_simulated(
            len(candidates), len(watch.models)))
    tried.sort(key=lambda entry: -entry[0])
    few = tried[:settings.budget.finalists]
    finalists = [(full(new, [profile]), profile, new) for _, profile, new in few]
    finalists.sort(key=lambda entry: -entry[0])
    value, profile, new = finalists[0]
    if past:
        repeated = full({name: responses[-1:] for name, responses in known.items()}, past[-1:])
    else:
        _, usual, responses_to_it = tried[len(tried) // 2]
        repeated = full(responses_to_it, [usual])
    before = full({name: [] for name in watch.models}, []) if past else 0.0
    model = next(iter(watch.models.values()))
    std = _foretold(model, known, new) if purpose == "parameters" else {}
    return NextExperiment(
        profile, purpose, value, before, repeated,
        tuple((entry[1].name, entry[0]) for entry in finalists),
        {name: r[0].outputs for name, r in new.items()}, std, settings.separated,
        {o.name: o.unit for model in watch.models.values() for o in model.outputs})


def _foretold(model: Model, known: Mapping[str, list[WhitenedResponse]],
              new: Mapping[str, list[WhitenedResponse]]) -> dict[str, float]:
    """Standard errors of the shared free parameters after the experiment."""
    every = joined([*known[model.name], *new[model.name]])
    spread = np.sqrt(np.diag(covariance(every.jacobian, np.ones(len(every.low), bool))))
    shared = [p.name for p in model.parameters if p.free and p.scope == "shared"]
    return {name: float(x) for name, x in zip(shared, spread, strict=False)}


def _within(watch: Watch, profile: Recording, limits: Mapping[str, float], tries: int
            ) -> tuple[Recording, dict[str, WhitenedResponse]]:
    """The profile, made smaller until every model keeps to the limits, and the responses to it."""
    for _ in range(tries):
        try:
            responses = {name: found[0] for name, found in watch.responses([profile]).items()}
        except errors.SimulationFailed:
            if not limits:
                raise
            profile = scaled(profile, 0.5)
            continue
        share = min((limit / max(r.reached(output), 1e-300) for r in responses.values()
                     for output, limit in limits.items()), default=1.0)
        if share >= 1.0:
            return profile, responses
        profile = scaled(profile, LESS * share)
    raise errors.SimulationFailed(errors.limits_not_kept(profile.name))
