"""What keeps an explanation that predicts held-out data from being proved there."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.fitting.decisions import below, smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.loosened import loosened
from pikanid.mismatch.judge.prediction import HeldOut
from pikanid.mismatch.settings.settings import Settings
from pikanid.model.parts import Parameter

Predict = Callable[[Hypothesis], HeldOut | None]
NOTHING = 1e-6  # numerical: of a row, where a limit is not met
EXPLAINED_AWAY = "most of the model's own parameters are not known beside it"


def why_not(h: Hypothesis, ranked: Sequence[Hypothesis], predict: Predict, scale: float,
            settings: Settings) -> str:
    """Why a hypothesis is not proved on other data; empty where it is.

    Each effect has to be strong.  What is weak can be a facet of anything: laws that no catalogue
    holds leave nothing beside it that a test would find; a minor one beside what explains most can
    be whatever else the rig has that nobody modelled.  The held-out recording has to be one that
    could have refuted it.  And it has to speak for each of several: one is easily found that takes
    up what the others leave, whatever that is.  Where a bound holds a parameter without the effect,
    one that has a size must do what that parameter would not do past the bound (a reversed sign is
    what a gain would do there); its own error has to say that there is any where that is another
    effect's, which means nothing there.  What happens once, or is a limit that is not met there, of
    which it cannot speak, takes up anything: then what lasts must not do most of that as well and
    predict as well.

    Args:
        h: To prove.
        ranked: All hypotheses.
        predict: What they make of the held-out recordings.
        scale: That divides χ².
        settings: What counts as a proof.
    """
    fits = {o.key: o for o in ranked}
    asks, least_proof = settings.verdict, settings.least_proof
    nominal = predict(fits[frozenset()])
    proof = predict(h)
    if nominal and proof and smaller(asks.worse * nominal.misfit, proof.misfit):
        return "as it stands it predicts the held-out recording worse than the nominal model"
    if h.explained_away():
        return EXPLAINED_AWAY
    spread = min(h.whitened.records.spread, settings.noise.order_only)
    louder = float(np.exp(settings.louder * spread))

    minor = asks.minor * gained(h, fits[frozenset()], predict, scale)
    for e in h.effects:
        rest = h.key - {e.key}
        sizes = [p for p in e.parameters if p.free]
        once = e.absent if proof is None else _once(e, proof)
        if h.symbolic and sizes:
            size, error = h.values[sizes[0].name], h.std[sizes[0].name]
            if below(abs(size), asks.sized * error):
                return (f"the recording does not determine {sizes[0].name} of {e.name} ({size:.3g} "
                        f"with a standard error of {error:.2g}): other forms do as well")
        count = max(len(h.effects), len(e.covers) if h.symbolic else 1)
        asked = asks.strong[count - 1] * louder
        # a formula that is the sum of two entries must need both
        for fewer in (rest, *(rest | {part} for part in e.covers if h.symbolic)):
            o = fits.get(fewer)
            if o is None:
                continue
            if below((o.minimum.chi2 - h.minimum.chi2) / scale, asks.shown):
                return f"the recording itself hardly shows {e.name}"
            power = worth(e, predict(h), predict(o)) / scale
            if below(power, least_proof):
                return (f"the held-out recording could not have refuted {e.name} (it is worth "
                        f"{power:.1f} of chi-squared there, {least_proof:.0f} are asked)")
            gain = gained(h, o, predict, scale)
            if e.read and fewer == rest and below(gain, asks.minor_strong * len(sizes)):
                return (f"{e.name} is too weak for its form to be sure (it lowers chi-squared by "
                        f"{gain:.0f}, {asks.minor_strong:.0f} are asked for each parameter)")
            seen = 0.5 if once and len(h.effects) == 1 else 1.0  # in one recording of two
            if (once or below(gain, minor)) and below(gain, seen * asks.minor_strong):
                what = ("does not act in any other recording, and explains so little"
                        if once else "explains so little beside the rest")
                return (f"{e.name} {what} that it may stand for anything of its size (it lowers "
                        f"chi-squared by {gain:.0f} of {minor / asks.minor:.0f}, "
                        f"{seen * asks.minor_strong:.0f} are asked)")
            if below(gain, asked):
                return (f"{e.name} is too weak to be sure of (it lowers chi-squared by {gain:.0f}, "
                        f"{asked:.0f} are asked)")
            if len(h.effects) > 1 and not once and not speaks(
                    h, o, predict, asks.needed * scale):
                return f"the held-out recording does not need {e.name}"
            most = asks.once * (o.minimum.chi2 - h.minimum.chi2)
            if once and any(
                    smaller(most, o.minimum.chi2 - other.minimum.chi2)
                    and _lasts(other, rest, predict)
                    and not speaks(h, other, predict, asks.needed * scale)
                    for other in fits.values() if len(other.effects) == len(o.effects) + 1):
                return f"a lasting effect would take up most of what {e.name} does"
        if h.pinned and (said := no_size(e, h, 1.0, settings)):
            return said
        if sizes and rest in fits and fits[rest].pinned:
            past = loosened(fits[rest], h)
            if past is None and (said := no_size(e, h, 1.0, settings)):
                return said
            if past is not None and below(past, h.minimum.chi2 + asks.sized**2 * scale):
                return f"a parameter past its bound would explain as much as {e.name} does"
        if isinstance(e.exponent, Parameter) and not _in_proportion(e, h, fits):
            n, error = h.values[e.exponent.name], h.std[e.exponent.name]
            if below(abs(n - 1), asks.open * error):
                return (f"{e.name} may be in proportion (its exponent is {n:.3g} with a standard "
                        f"error of {error:.2g}), and what is so the model has itself")
        if not h.determines(e):
            return f"the recording does not determine {sizes[0].name} of {e.name}: any is as good"
    return ""


def _in_proportion(e: Candidate, h: Hypothesis, fits: Mapping[frozenset[str], Hypothesis]) -> bool:
    """Whether a law in proportion has been fitted in the place of one of free exponent."""
    rest = h.key - {e.key}
    return any(o.exponent == 1 and key == rest | {o.key} for key, f in fits.items()
               for o in f.effects)


def gained(h: Hypothesis, over: Hypothesis, predict: Predict, scale: float) -> float:
    """χ² in all recordings that a hypothesis takes away from what another one leaves."""
    a, b = predict(h), predict(over)
    later = 0.0 if a is None or b is None else max(b.deviance - a.deviance, 0.0)
    return (over.minimum.chi2 - h.minimum.chi2 + later) / scale


def no_size(effect: Candidate, h: Hypothesis, overdispersion: float, settings: Settings,
            spread: Mapping[str, float] = MappingProxyType({})) -> str:
    """That the size of an effect of one parameter may be nothing; empty where it is not so.

    Args:
        effect: Of the hypothesis.
        h: As it was fitted.
        overdispersion: That divides χ²: standard errors grow with its root.
        settings: How many of them a size must be from nothing.
        spread: How far apart other explanations have parameters, by name.
    """
    sizes = [p for p in effect.parameters if p.free and p.scope == "shared"]
    if len(sizes) != 1:
        return ""
    size = h.values[sizes[0].name]
    error = math.hypot(math.sqrt(overdispersion) * h.std[sizes[0].name],
                       spread.get(sizes[0].name, 0.0))
    if not below(abs(size - sizes[0].value), settings.verdict.sized * error):
        return ""
    return (f"the size of {effect.name} may be nothing beside the rest ({size:.3g} with a "
            f"standard error of {error:.2g})")


def _lasts(h: Hypothesis, rest: frozenset[str], predict: Predict) -> bool:
    """Whether a hypothesis is a rest and effects that act in held-out recordings as well."""
    seen = predict(h)
    return rest < h.key and not any(e.absent or (seen is not None and idle(e, seen))
                                    for e in h.effects if e.key not in rest)


def _once(effect: Candidate, seen: HeldOut) -> bool:
    """Whether nothing of an effect is there: it has happened once, or is a limit that is not met.
    A law that a small motion hardly shows is there.
    """
    return effect.absent or idle(effect, seen, NOTHING)


def speaks(one: Hypothesis, other: Hypothesis, predict: Predict, margin: float = 0.0) -> bool:
    """Whether held-out recordings speak for one hypothesis rather than another, by a `margin`."""
    a, b = predict(one), predict(other)
    return a is not None and b is not None and below(a.deviance, b.deviance - margin)


def idle(effect: Candidate, seen: HeldOut, below_norm: float = 1.0) -> bool:
    """Whether an effect that lasts changes less than a row of what is held out."""
    return bool(effect.parameters) and all(
        seen.acts.get(p.name, np.inf) < below_norm for p in effect.parameters)


def worth(effect: Candidate, with_it: HeldOut | None, without: HeldOut | None) -> float:
    """χ² that an effect is worth in held-out recordings, where it is there: how far apart the
    predictions with it and without it lie, each with its parameters moved within their errors.

    What is not there is worth nothing: then the motion has to be seen, or any lasting effect in
    its place would go unnoticed.
    """
    if with_it is None or without is None:
        return 0.0
    if _once(effect, with_it):
        return with_it.motion
    if idle(effect, with_it):
        return 0.0
    return float(np.sum((with_it.rest - without.rest) ** 2))
