"""Is a hypothesis adequate: on what it was fitted to, and on a recording that it never saw?"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import cast

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.detect.remainder import residual_tests
from pikanid.mismatch.detect.residual_tests import Detection
from pikanid.mismatch.fitting.extended import extended
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.lowest import lowest
from pikanid.mismatch.fitting.progressive_horizon import progressive_horizon, rough
from pikanid.mismatch.judge.beginning import own_beginning
from pikanid.mismatch.judge.prior import Prior, elsewhere, of_fit, room
from pikanid.mismatch.judge.together import fitted_together, part_of, tested_together
from pikanid.model import Model
from pikanid.noise.projection import project
from pikanid.optimise.levenberg_marquardt import Minimum

Residual = tuple[int, str, np.ndarray, np.ndarray]  # recording, output, times, values


@dataclass(frozen=True)
class HeldOut:
    """What a hypothesis makes of a recording that it was not fitted to.

    Attributes:
        rmse: Of the residual of each output, in its unit, by name.
        misfit: Root mean square of the residual of all outputs, in units of their noise.
        tested, tested_together: Make `detection` and `together`.
        chi2: Of the residual with that forgiveness.
        deviance: -2 ln of the probability density of the recording, given the fit (up to a
            constant that all hypotheses share).
        predicted, measured, t: First output.
        moved, rmse_moved: The same prediction, and the RMSE of each output, with the parameters
            moved within their errors to where they suit this recording best.
        rest: (N,) whitened residual with that forgiveness.
        acts: By parameter, the norm of what its whole size changes in `rest`; none where the
            recording is at rest.
        motion: χ² of the whole predicted motion about its mean: what can be seen there at all.
        residuals: Number of the recording, output, times (N,) and residual (N,) of every one.
        known: Tests made so far.
    """

    rmse: Mapping[str, float]
    misfit: float
    tested: Callable[[], Detection]
    tested_together: Callable[[], Detection | None]
    chi2: float
    deviance: float
    t: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    moved: np.ndarray
    rmse_moved: Mapping[str, float]
    residuals: tuple[Residual, ...]
    rest: np.ndarray
    acts: Mapping[str, float]
    motion: float
    known: dict[str, Detection | None] = field(default_factory=dict, repr=False)

    # cached properties would let threads wait for each other
    @property
    def detection(self) -> Detection:
        """Tests of what is left, with the parameters' uncertainty forgiven."""
        if "alone" not in self.known:
            self.known["alone"] = self.tested()
        return cast(Detection, self.known["alone"])

    @property
    def together(self) -> Detection | None:
        """Tests of what one fit of all recordings leaves in them; None where no such fit is."""
        if "together" not in self.known:
            self.known["together"] = self.tested_together()
        return self.known["together"]


def held_out(hypothesis: Hypothesis, nominal: Model, records: Records,
             candidates: tuple[Candidate, ...], rate: float) -> HeldOut | None:
    """Predict records that the hypothesis was not fitted to, and test what is left.

    Shared parameters keep their estimates, with the fit's uncertainty as prior: the residual is
    whitened by I + J_h (JᵀJ)⁻¹ J_hᵀ.  Where that leads far from the estimates, J is taken anew: far
    from a wall that was touched once, the uncertainty is no ellipsoid.  What each recording has for
    itself is estimated anew; what happens once (a disturbance) is left out.
    """
    effects = [e for e in hypothesis.effects if not e.absent]
    bare = extended(nominal, effects)
    model = bare.with_values({n: v for n, v in hypothesis.values.items()
                              if n in bare.parameter_names})
    whitened = Whitened(model, records)
    free = whitened.problem.free
    guess = whitened.problem.guess.copy()
    names = [f.name for f in hypothesis.whitened.problem.free]
    shared = [k for k, f in enumerate(free) if f.recording is None and f.name in names]
    known = [free[k].name for k in shared]
    guess[shared] = [hypothesis.values[n] for n in known]
    prior = fit = of_fit(hypothesis, known)
    misfit = hypothesis.minimum.chi2 / max(hypothesis.whitened.rows, 1)
    if not whitened.choose_steps(guess, misfit=misfit):
        return None

    own = np.array([k not in shared for k in range(len(free))])
    if own.any():
        begun = own_beginning(whitened.problem, guess, tuple({c.site.v: c.site
                                                              for c in candidates}.values()))
        guess = min(guess, begun, key=whitened.chi2)
        first = lowest(whitened, guess, records.settings.budget.beginnings,
                       lower=np.where(own, whitened.problem.lower, guess),
                       upper=np.where(own, whitened.problem.upper, guess))
        if first is not None:
            guess = first.theta
    found, prior = _moved(hypothesis, whitened, guess, shared, prior)
    if found is None or not np.isfinite(found.J).all():
        return None
    movable = found.movable(whitened.problem.lower, whitened.problem.upper)
    tests = functools.partial(residual_tests, whitened, found.theta, found.r, movable, candidates,
                              rate)
    together = functools.partial(tested_together, hypothesis, whitened, found, candidates, rate)
    predicted, gaps = _shown(whitened, guess)
    moved, closer = _shown(whitened, found.theta)
    left = project(movable, found.r)  # corners, as of a wall hardly touched, may have stopped it
    # nowhere does the first recording suit better than where it was fitted
    worse = max(float(np.sum(left[whitened.rows:] ** 2)) + prior.constant, 0.0)
    chi2 = float(np.sum(left[: whitened.rows] ** 2)) + worse
    samples = whitened.problem.experiments[0].samples[0]
    residuals = tuple(_residuals(whitened, gaps))
    sized = np.concatenate([g / sigma for g, sigma in zip(gaps, whitened.sigma, strict=True)])
    return HeldOut(_rmse(residuals), float(np.sqrt(np.mean(sized**2))), tests, together, chi2,
                   chi2 + room(found.J, shared, fit, functools.partial(
                       elsewhere, prior, hypothesis, found.theta[shared])),
                   samples.t, samples.y, predicted, moved, _rmse(_residuals(whitened, closer)),
                   residuals, found.r[: whitened.rows], _acts(whitened, found, nominal),
                   _motion(whitened, gaps))


def _moved(hypothesis: Hypothesis, whitened: Whitened, guess: np.ndarray, shared: list[int],
           prior: Prior) -> tuple[Minimum | None, Prior]:
    """Where parameters suit both a recording and a prior, and that prior, linearised near there."""
    settings = whitened.settings
    effects = [e for e in hypothesis.effects if not e.absent]

    def known(before: Prior, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rows = np.zeros((len(before.root), len(theta)))
        rows[:, shared] = before.root
        return before.residual(theta[shared]), rows

    def suited(before: Prior, begin: np.ndarray) -> Minimum | None:
        return lowest(whitened, begin, settings.budget.held_out,
                      besides=functools.partial(known, before))

    found = suited(prior, guess)
    suits = not rough(hypothesis.minimum.chi2, hypothesis.whitened.rows, effects, settings)
    if suits and found is not None and rough(found.chi2, whitened.rows, effects, settings):
        whole = progressive_horizon(whitened, effects, guess, functools.partial(known, prior))
        found = min(found, whole or found, key=lambda m: m.chi2)
    for _ in range(settings.budget.relinearised):
        if found is None or prior.distance(found.theta[shared]) < settings.verdict.linear:
            break
        anew = elsewhere(prior, hypothesis, found.theta[shared])
        if anew is None:
            break
        prior, found = anew, suited(anew, found.theta)
    if suits and found is not None and rough(found.chi2, whitened.rows, effects, settings):
        # a wall that was hardly touched is stiffer than any line from there leads to
        both = fitted_together(hypothesis, whitened, found, whitened.rows)
        begin = None if both is None else part_of(both, whitened)
        anew = None if begin is None else elsewhere(prior, hypothesis, begin[shared])
        other = None if begin is None or anew is None else suited(anew, begin)
        if anew and other and other.chi2 + anew.constant < found.chi2 + prior.constant:
            prior, found = anew, other
    return found, prior


def _acts(whitened: Whitened, found: Minimum, nominal: Model) -> Mapping[str, float]:
    """By parameter that the recordings share, the norm of what its whole size changes in the
    residual; none where none of the nominal model does: what holds a rig at rest is not idle.
    """
    size = np.linalg.norm(found.J[: whitened.rows], axis=0) * np.abs(found.theta)
    found_of: dict[str, float] = {}
    for f, acts in zip(whitened.problem.free, size, strict=True):
        found_of[f.name] = min(float(acts), found_of.get(f.name, np.inf))
    own = {f.name for f in whitened.problem.free if f.recording is None} & set(nominal.free_names)
    return found_of if any(found_of[n] >= 1 for n in own) else {}


def _motion(whitened: Whitened, gaps: Sequence[np.ndarray]) -> float:
    """χ² of what is predicted about the mean of each output, from the gaps to what is measured."""
    total = 0.0
    for r, gap in enumerate(gaps):
        moved, first = gap + whitened.measured(r), 0
        for s in whitened.problem.experiments[r].samples:
            part = slice(first, first + len(s.t))
            moved[part] -= moved[part].mean()
            first += len(s.t)
        total += float(np.sum(whitened.whiten(r, moved) ** 2))
    return total


def _shown(whitened: Whitened, theta: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """The first output as predicted (N,), and what is left of every recording."""
    responses = whitened.responses(theta)
    gaps = [response.y - whitened.measured(r) for r, response in enumerate(responses)]
    return responses[0].y[: len(whitened.problem.experiments[0].samples[0].t)], gaps


def rmse(whitened: Whitened, theta: np.ndarray) -> dict[str, float]:
    """RMSE of each output at θ (n,), in its unit, over all recordings."""
    return _rmse(_residuals(whitened, _shown(whitened, theta)[1]))


def _rmse(residuals: Iterable[Residual]) -> dict[str, float]:
    """By output, over all recordings: residuals in several units have no mean."""
    found: dict[str, list[np.ndarray]] = {}
    for _, name, _, gap in residuals:
        found.setdefault(name, []).append(gap)
    return {name: float(np.sqrt(np.mean(np.concatenate(own) ** 2))) for name, own in found.items()}


def _residuals(whitened: Whitened, gaps: list[np.ndarray]) -> Iterator[Residual]:
    for r, gap in enumerate(gaps):
        first = 0
        for s in whitened.problem.experiments[r].samples:
            name = whitened.problem.model.outputs[s.output].name
            yield r, name, s.t, gap[first:first + len(s.t)]
            first += len(s.t)
