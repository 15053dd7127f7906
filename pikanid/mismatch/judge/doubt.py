"""What keeps an explanation that predicts held-out data from being proved there."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.fitting.decisions import below, smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.loosened import loosened
from pikanid.mismatch.judge.evidence import Evidence
from pikanid.mismatch.judge.prediction import HeldOut
from pikanid.mismatch.settings.settings import Settings
from pikanid.mismatch.settings.verdict import VerdictSettings
from pikanid.model.parts import Parameter

NOTHING = 1e-6  # numerical: of a row, where a limit is not met
EXPLAINED_AWAY = "most of the model's own parameters are not known beside it"


def why_not(h: Hypothesis, evidence: Evidence) -> str:
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
    """
    nominal, proof = evidence.predict(evidence.nominal), evidence.predict(h)
    if nominal and proof and smaller(
            evidence.settings.verdict.worse * nominal.misfit, proof.misfit):
        return "as it stands it predicts the held-out recording worse than the nominal model"
    if h.explained_away():
        return EXPLAINED_AWAY
    fits = {o.key: o for o in evidence.ranked}
    claims = (_Claim(evidence, h, e, fits) for e in h.effects)
    return next((why for claim in claims for why in claim.doubts() if why), "")


@dataclass(frozen=True)
class _Claim:
    """That an effect of a hypothesis is there."""

    evidence: Evidence
    h: Hypothesis
    effect: Candidate
    fits: Mapping[frozenset[str], Hypothesis]

    @property
    def asks(self) -> VerdictSettings:
        return self.evidence.settings.verdict

    @property
    def rest(self) -> frozenset[str]:
        return self.h.key - {self.effect.key}

    @property
    def sizes(self) -> list[Parameter]:
        return [p for p in self.effect.parameters if p.free]

    @cached_property
    def once(self) -> bool:
        """Whether held-out recordings do not speak of it."""
        proof = self.evidence.predict(self.h)
        return self.effect.absent if proof is None else _once(self.effect, proof)

    def without(self) -> Iterator[Hypothesis]:
        """The fits of the others; of a formula that is the sum of two entries with either, both of
        which it must need.
        """
        parts = self.effect.covers if self.h.symbolic else ()
        return (self.fits[key] for key in (self.rest, *(self.rest | {p} for p in parts))
                if key in self.fits)

    def doubts(self) -> Iterator[str]:
        """Of every rule, empty where it has none."""
        yield _undetermined_formula(self)
        for other in self.without():
            yield from (rule(self, other) for rule in COMPARED)
        yield from (rule(self) for rule in BY_ITSELF)


def _undetermined_formula(c: _Claim) -> str:
    if not c.h.symbolic or not c.sizes:
        return ""
    name = c.sizes[0].name
    size, error = c.h.values[name], c.h.std[name]
    if not below(abs(size), c.asks.sized * error):
        return ""
    return (f"the recording does not determine {name} of {c.effect.name} ({size:.3g} with a "
            f"standard error of {error:.2g}): other forms do as well")


def _hardly_shown(c: _Claim, other: Hypothesis) -> str:
    gain = (other.minimum.chi2 - c.h.minimum.chi2) / c.evidence.scale
    return f"the recording itself hardly shows {c.effect.name}" if below(gain, c.asks.shown) else ""


def _not_refutable(c: _Claim, other: Hypothesis) -> str:
    least = c.evidence.settings.least_proof
    power = worth(c.effect, c.evidence.predict(c.h), c.evidence.predict(other)) / c.evidence.scale
    if not below(power, least):
        return ""
    return (f"the held-out recording could not have refuted {c.effect.name} (it is worth "
            f"{power:.1f} of chi-squared there, {least:.0f} are asked)")


def _too_weak_for_its_form(c: _Claim, other: Hypothesis) -> str:
    gain, asked = c.evidence.gained(c.h, other), c.asks.minor_strong
    if not c.effect.read or other.key != c.rest or not below(gain, asked * len(c.sizes)):
        return ""
    return (f"{c.effect.name} is too weak for its form to be sure (it lowers chi-squared by "
            f"{gain:.0f}, {asked:.0f} are asked for each parameter)")


def _too_little_beside_the_rest(c: _Claim, other: Hypothesis) -> str:
    whole = c.evidence.gained(c.h, c.evidence.nominal)
    gain = c.evidence.gained(c.h, other)
    asked = c.asks.minor_strong
    if c.once and len(c.h.effects) == 1:
        asked *= 0.5  # it is in one recording of two
    if not (c.once or below(gain, c.asks.minor * whole)) or not below(gain, asked):
        return ""
    what = ("does not act in any other recording, and explains so little" if c.once else
            "explains so little beside the rest")
    of = f" of {whole:.0f}" if len(c.h.effects) > 1 else ""
    return (f"{c.effect.name} {what} that it may stand for anything of its size (it lowers "
            f"chi-squared by {gain:.0f}{of}, {asked:.0f} are asked)")


def _too_weak(c: _Claim, other: Hypothesis) -> str:
    settings, gain = c.evidence.settings, c.evidence.gained(c.h, other)
    spread = min(c.h.whitened.records.spread, settings.noise.order_only)
    count = max(len(c.h.effects), len(c.effect.covers) if c.h.symbolic else 1)
    asked = c.asks.strong[count - 1] * float(np.exp(settings.louder * spread))
    if not below(gain, asked):
        return ""
    return (f"{c.effect.name} is too weak to be sure of (it lowers chi-squared by {gain:.0f}, "
            f"{asked:.0f} are asked)")


def _not_needed(c: _Claim, other: Hypothesis) -> str:
    margin = c.asks.needed * c.evidence.scale
    if len(c.h.effects) == 1 or c.once or c.evidence.speaks(c.h, other, margin):
        return ""
    return f"the held-out recording does not need {c.effect.name}"


def _taken_up_by_what_lasts(c: _Claim, other: Hypothesis) -> str:
    evidence = c.evidence
    most = c.asks.once * (other.minimum.chi2 - c.h.minimum.chi2)
    if not c.once or not any(
            smaller(most, other.minimum.chi2 - o.minimum.chi2) and _lasts(o, c.rest, evidence)
            and not evidence.speaks(c.h, o, c.asks.needed * evidence.scale)
            for o in evidence.ranked if len(o.effects) == len(other.effects) + 1):
        return ""
    return f"a lasting effect would take up most of what {c.effect.name} does"


def _no_size_at_a_bound(c: _Claim) -> str:
    return no_size(c.effect, c.h, 1.0, c.evidence.settings) if c.h.pinned else ""


def _past_a_bound(c: _Claim) -> str:
    fewer = c.fits.get(c.rest)
    if not c.sizes or fewer is None or not fewer.pinned:
        return ""
    past = loosened(fewer, c.h)
    if past is None:
        return no_size(c.effect, c.h, 1.0, c.evidence.settings)
    if not below(past, c.h.minimum.chi2 + c.asks.sized**2 * c.evidence.scale):
        return ""
    return f"a parameter past its bound would explain as much as {c.effect.name} does"


def _may_be_in_proportion(c: _Claim) -> str:
    exponent = c.effect.exponent
    if not isinstance(exponent, Parameter) or any(
            o.exponent == 1 and key == c.rest | {o.key} for key, f in c.fits.items()
            for o in f.effects):  # a law in proportion has been fitted in its place
        return ""
    n, error = c.h.values[exponent.name], c.h.std[exponent.name]
    if not below(abs(n - 1), c.asks.open * error):
        return ""
    return (f"{c.effect.name} may be in proportion (its exponent is {n:.3g} with a standard error "
            f"of {error:.2g}), and what is so the model has itself")


def _any_is_as_good(c: _Claim) -> str:
    if c.h.determines(c.effect):
        return ""
    return (f"the recording does not determine {c.sizes[0].name} of {c.effect.name}: any is as "
            "good")


COMPARED: tuple[Callable[[_Claim, Hypothesis], str], ...] = (
    _hardly_shown, _not_refutable, _too_weak_for_its_form, _too_little_beside_the_rest, _too_weak,
    _not_needed, _taken_up_by_what_lasts)  # definition: rules, of a fit without the effect
BY_ITSELF: tuple[Callable[[_Claim], str], ...] = (
    _no_size_at_a_bound, _past_a_bound, _may_be_in_proportion, _any_is_as_good,
)  # definition: rules


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


def _lasts(h: Hypothesis, rest: frozenset[str], evidence: Evidence) -> bool:
    """Whether a hypothesis is a rest and effects that act in held-out recordings as well; it is
    none where it cannot be run there.
    """
    seen = evidence.predict(h)
    return seen is not None and rest < h.key and not any(
        e.absent or idle(e, seen) for e in h.effects if e.key not in rest)


def _once(effect: Candidate, seen: HeldOut) -> bool:
    """Whether nothing of an effect is there: it has happened once, or is a limit that is not met.
    A law that a small motion hardly shows is there.
    """
    return effect.absent or idle(effect, seen, NOTHING)


def idle(effect: Candidate, seen: HeldOut, below_norm: float = 1.0) -> bool:
    """Whether an effect that lasts changes less than a row of what is held out."""
    return bool(effect.parameters) and all(
        seen.acts.get(p.name, np.inf) < below_norm for p in effect.parameters)


def worth(effect: Candidate, with_it: HeldOut | None, without: HeldOut | None) -> float:
    """χ² that an effect is worth in held-out recordings, where it is there: how far apart the
    predictions with it and without it lie, each with its parameters moved within their errors.

    What is not there is worth nothing: then the motion has to be seen, or any lasting effect in
    its place would go unnoticed; nor is there more to compare with where a model without it cannot
    be run.
    """
    if with_it is None:
        return 0.0
    if without is None or _once(effect, with_it):
        return with_it.motion
    if idle(effect, with_it):
        return 0.0
    return float(np.sum((with_it.rest - without.rest) ** 2))
