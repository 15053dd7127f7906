"""Other structures, judged in the linear problem around a fit before anything is fitted for them.

An offer is a step at zero, a smoothness that varies along an edge, or a finer grid; its gain is the
rise of the log evidence in the linear problem.  What an offer adds answers through the variational
equation (`screening`), so that nothing is compiled for an offer that brings nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from pikanid.discrepancy.edges import EdgePlan
from pikanid.discrepancy.fit import PenalisedFit
from pikanid.discrepancy.level import Level
from pikanid.discrepancy.screening import spline_responses, step_responses
from pikanid.discrepancy.smoothness import Smoothness

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Offer:
    """A change of one edge: rise of the log evidence, structure, and the linear problem's fit."""

    gain: float
    plans: tuple[EdgePlan, ...]
    pieces: tuple[int, ...]
    fit: PenalisedFit


def strongest(offers: Sequence[Offer], least: float) -> Offer | None:
    """The offer of largest gain, if that is at least `least`."""
    best = max(offers, key=lambda o: o.gain, default=None)
    return None if best is None or best.gain < least else best


def step_offers(level: Level, equation: str) -> list[Offer]:
    """A step at zero in every edge whose argument changes sign and that has none."""
    fit, priors = level.fit, level.fit.smoothness.priors
    able = [k for k, p in enumerate(level.plans)
            if not p.step and p.limits[0] < 0.0 < p.limits[1]]
    if not able:
        return []
    base = _evidence(fit.smoothness, fit.information, fit.gain, fit.rho)
    answers = step_responses(level.shooting, fit.theta, equation, level.plans)
    J = level.shooting.jacobian(fit.theta)
    target = J @ fit.theta - level.shooting.residual(fit.theta)
    found = []
    for k in able:
        wider = np.column_stack([J, answers[:, k]]) / fit.noise
        plans = _with(level.plans, k, replace(level.plans[k], step=True))
        prior = replace(priors[k], plan=plans[k], at=np.append(priors[k].at, len(fit.theta)))
        smooth = replace(fit.smoothness, priors=_with(priors, k, prior),
                         weak=np.append(fit.smoothness.weak, 0.0))
        found.append(_offer(level, base, plans, level.pieces, smooth, wider.T @ wider,
                            wider.T @ target / fit.noise, np.append(fit.inside, True)))
    return found


def variation_offers(level: Level) -> list[Offer]:
    """A smoothness that varies along the edge, for every edge where it does not yet."""
    fit, priors = level.fit, level.fit.smoothness.priors
    base = _evidence(fit.smoothness, fit.information, fit.gain, fit.rho)
    found, pieces = [], fit.smoothness.settings.pieces
    for k, prior in enumerate(priors):
        if prior.pieces == 1:
            smooth = replace(fit.smoothness,
                             priors=_with(priors, k, replace(prior, pieces=pieces)))
            found.append(_offer(level, base, level.plans, _with(level.pieces, k, pieces), smooth,
                                fit.information, fit.gain, fit.inside))
    return found


def finer_gain(level: Level, equation: str, finer: Sequence[EdgePlan]) -> float:
    """Rise of the log evidence on finer grids; both grids answer by the variational equation."""
    fit = level.fit
    J, r = level.shooting.jacobian(fit.theta), level.shooting.residual(fit.theta)
    splines = [p.at[: p.plan.intervals + 3] for p in fit.smoothness.priors]
    others = np.setdiff1d(np.arange(len(fit.theta)), np.concatenate(splines))
    coarse = spline_responses(level.shooting, fit.theta, equation, level.plans)
    target = coarse @ fit.theta[np.concatenate(splines)] + J[:, others] @ fit.theta[others] - r
    evidences = []
    for plans, answers in ((level.plans, coarse), (tuple(finer), spline_responses(
            level.shooting, fit.theta, equation, finer))):
        columns = np.hstack([J[:, others], answers]) / fit.noise
        priors, first = [], len(others)
        for prior, plan in zip(fit.smoothness.priors, plans, strict=True):
            at = np.arange(first, first + plan.intervals + 3)
            first += len(at)
            if plan.step:
                at = np.append(at, np.searchsorted(others, prior.at[-1]))
            priors.append(replace(prior, plan=plan, at=at))
        weak = np.append(fit.smoothness.weak[others], np.zeros(answers.shape[1]))
        smooth = replace(fit.smoothness, priors=tuple(priors), weak=weak)
        evidences.append(_evidence(
            smooth, columns.T @ columns, columns.T @ target / fit.noise, fit.rho))
    return evidences[1] - evidences[0]


def _evidence(smooth: Smoothness, A: np.ndarray, b: np.ndarray, start: np.ndarray) -> float:
    return smooth.evidence(A, b, smooth.choose(A, b, start))


def _offer(level: Level, base: float, plans: tuple[EdgePlan, ...], pieces: tuple[int, ...],
           smooth: Smoothness, A: np.ndarray, b: np.ndarray, inside: np.ndarray) -> Offer:
    fit = level.fit
    rho = smooth.choose(A, b, fit.smoothness.carry(fit.rho, smooth))
    gain = smooth.evidence(A, b, rho) - base
    theta = np.append(fit.theta, np.zeros(len(b) - len(fit.theta)))
    held = b[inside] - A[np.ix_(inside, ~inside)] @ theta[~inside]
    theta[inside] = np.linalg.solve((A + smooth.precision(rho))[np.ix_(inside, inside)], held)
    wider = replace(fit, theta=theta, rho=rho, information=A, gain=b, inside=inside,
                    smoothness=smooth, evidence=fit.evidence + gain)
    return Offer(gain, plans, pieces, wider)


def _with(items: tuple[T, ...], k: int, item: T) -> tuple[T, ...]:
    return (*items[:k], item, *items[k + 1:])
