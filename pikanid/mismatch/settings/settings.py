"""`Settings`: everything that a diagnosis takes as given, in one place."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from pikanid import errors
from pikanid.mismatch.settings import thresholds
from pikanid.mismatch.settings.budget import Budget
from pikanid.mismatch.settings.detection import DetectionSettings
from pikanid.mismatch.settings.fits import FitSettings, SearchSettings
from pikanid.mismatch.settings.noise import NoiseSettings
from pikanid.mismatch.settings.verdict import BeyondSettings, PartSettings, VerdictSettings
from pikanid.noise.settings import QuietSettings, RoundingSettings
from pikanid.objective.settings import AdequacySettings
from pikanid.settings import Amount, Count, Rate, Share, changed, check, items, told
from pikanid.storage.limits import toml_content
from pikanid.symbolic.settings import FormulaSettings
from pikanid.uncertainty.settings import UncertaintySettings


@dataclass(frozen=True)
class Settings:
    """What a diagnosis takes as given: error rates, what counts as evidence, budgets.

    The error rates are probabilities; thresholds follow from them (`pikanid.mismatch.settings.
    thresholds`).  What follows from no rate is a field of its own, with its reason.

    Attributes:
        alpha: Rate of false alarms: that something is found missing in a right model.
        power: Probability with which held-out recordings must refute an effect that is not there,
            and with which an effect of the size that counts as detectable is found.
        refusal: Rate at which a right hypothesis is refused for what it leaves in the recordings it
            was fitted to or in held-out ones, half of it in each.
        refusal_together: The same for what it leaves in all of them together.
        refuted: Rate at which held-out recordings alone refute a right model: their noise may
            differ a little from that of the others.
        needless: Rate at which a search goes on though nothing is left.
        noise_refusal: Rate at which repeats refuse the noise level that was found, if it is right.
        noise_excess: Probability that the noise is louder than what strong effects are asked
            against.
        noise_conflict: Rate at which noise read at all frequencies contradicts where it was sure.
        band: Probability that a force leaves its simultaneous band.
        confusion: Rate at which an experiment that tells two hypotheses apart takes one for the
            other.
        kinds: Shares of alpha for the signs of the catalogue, bands of frequency, and the inputs'
            past (Bonferroni); one or less in all.
        signs: Number of independent signs of which the largest counts, by its order.
        reached: Share of the distance that counts as detectable, which the strongest form of an
            effect must reach to be one that an experiment can show.
        choice_weight: γ of the extended Bayesian information criterion, the price of a choice; at 1
            the criterion is consistent for any number of choices that grows as a power of the
            number of rows (J. Chen and Z. Chen, Biometrika 95, 2008).
        quiet: When a stretch of a recording shows noise only.
        rounding: When a signal counts as rounded to the steps of its sensor.
        adequacy: When the nominal fit, and the extended one, explain a recording.
        uncertainty: When a parameter counts as not determined.
        noise: What counts as noise, as an outlier, as a repeat.
        detection: What a residual is tested for.
        fits: When a fit is a misfit.
        search: What one more effect must promise.
        verdict: What counts as evidence, and what as a proof.
        part: What is sure although something is left.
        beyond: What is said of a missing force that has no name.
        formulas: How formulas are read of its shape.
        budget: How much is computed.

    Raises:
        BadSetting: If a value is none that its field can have.

    >>> str(Settings())
    'Settings: defaults.'
    >>> str(Settings(alpha=0.05).with_values({"budget.singles": 20}))
    'Settings: alpha = 0.05, budget.singles = 20; all others defaults.'
    """

    alpha: Rate = 0.01
    power: Rate = 0.9
    refusal: Rate = 0.01
    refusal_together: Rate = 0.001
    refuted: Rate = 1e-6
    needless: Rate = 0.05
    noise_refusal: Rate = 0.05
    noise_excess: Rate = 0.05
    noise_conflict: Rate = 0.01
    band: Rate = 0.05
    confusion: Rate = 0.023
    kinds: tuple[Share, Share, Share] = (0.6, 0.2, 0.2)
    signs: Count = 100
    reached: Share = 0.8
    choice_weight: Amount = 1.0
    quiet: QuietSettings = field(default_factory=QuietSettings)
    rounding: RoundingSettings = field(default_factory=RoundingSettings)
    adequacy: AdequacySettings = field(default_factory=AdequacySettings)
    uncertainty: UncertaintySettings = field(default_factory=UncertaintySettings)
    noise: NoiseSettings = field(default_factory=NoiseSettings)
    detection: DetectionSettings = field(default_factory=DetectionSettings)
    fits: FitSettings = field(default_factory=FitSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    verdict: VerdictSettings = field(default_factory=VerdictSettings)
    part: PartSettings = field(default_factory=PartSettings)
    beyond: BeyondSettings = field(default_factory=BeyondSettings)
    formulas: FormulaSettings = field(default_factory=FormulaSettings)
    budget: Budget = field(default_factory=Budget)

    def __post_init__(self) -> None:
        check(self)
        if sum(self.kinds) > 1 + 1e-9:
            raise errors.BadSetting(errors.bad_value("kinds", self.kinds, "shares of 1"))

    @property
    def adequate(self) -> float:
        """p-value below which a hypothesis leaves something unexplained, in the recordings it was
        fitted to, or in held-out ones (Bonferroni).
        """
        return self.refusal / 2

    @property
    def least_proof(self) -> float:
        """χ² that an effect must be worth in held-out recordings."""
        return thresholds.least_proof(self.alpha, self.power)

    @property
    def visible(self) -> float:
        """Standard errors from which on an effect counts as detectable."""
        return thresholds.visible(self.alpha, self.power, self.signs)

    @property
    def separated(self) -> float:
        """Distance [σ] from which on two hypotheses count as told apart."""
        return thresholds.separated(self.confusion)

    @property
    def louder(self) -> float:
        """Standard errors by which the noise may be larger than it seems."""
        return thresholds.excess(self.noise_excess)

    @property
    def contradiction(self) -> float:
        """Log-likelihood that what all frequencies say may cost where noise was sure."""
        return thresholds.contradiction(self.noise_conflict)

    def items(self) -> Iterator[tuple[str, Any]]:
        """Name, as "search.faint", and value of every field, in their order."""
        return items(self)

    def with_values(self, values: Mapping[str, Any]) -> Settings:
        """The same with other values of some fields, by name as in `items`.

        Raises:
            BadSetting: If there is no such field, or a value is none that it can have.

        >>> Settings().with_values({"search.faint": 4.0}).search.faint
        4.0
        """
        known = [name for name, _ in self.items()]
        whole: dict[str, Any] = {}
        groups: dict[str, dict[str, Any]] = {}
        for name, value in values.items():
            if name not in known:
                raise errors.BadSetting(errors.unknown_setting(
                    name, difflib.get_close_matches(name, known, 1)))
            group, dot, inner = name.rpartition(".")
            place = groups.setdefault(group, {}) if dot else whole
            place[inner] = tuple(value) if isinstance(value, list) else value
        for group, own in groups.items():
            kept = getattr(self, group)
            check(kept, f"{group}.", own)  # in the words of the whole
            whole[group] = replace(kept, **own)
        return replace(self, **whole)

    def changed(self) -> dict[str, Any]:
        """The fields that differ from the defaults, by name as in `items`."""
        return changed(self)

    def to_dict(self) -> dict[str, Any]:
        """For JSON and TOML: fields by name, groups as tables."""
        found: dict[str, Any] = {}
        for name, value in self.items():
            group, _, inner = name.rpartition(".")
            place = found.setdefault(group, {}) if group else found
            place[inner] = list(value) if isinstance(value, tuple) else value
        return found

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> Settings:
        """The settings that `to_dict` describes; what is not mentioned keeps its default.

        Raises:
            BadSetting: If there is no such field, or a value is none that it can have.
        """
        flat: dict[str, Any] = {}
        for name, value in content.items():
            if isinstance(value, Mapping):
                flat |= {f"{name}.{inner}": own for inner, own in value.items()}
            else:
                flat[name] = value
        return DEFAULTS.with_values(flat)

    @staticmethod
    def read(path: str | os.PathLike[str]) -> Settings:
        """Settings from a TOML file, as `from_dict` takes them.

        Raises:
            BadSetting: If it is no TOML file, or for what it holds.
        """
        def wrong(detail: str) -> errors.BadSetting:
            return errors.BadSetting(errors.settings_unreadable(str(path), detail))

        return Settings.from_dict(toml_content(path, wrong))

    def __str__(self) -> str:
        return told(self)


DEFAULTS = Settings()
