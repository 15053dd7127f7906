"""What is compared: a model at its values, what was estimated, and on which samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Any, Protocol, runtime_checkable

import numpy as np

from pikanid import errors
from pikanid.model import Model
from pikanid.optimise.propagation import finite
from pikanid.problem.problem import FreeParameter
from pikanid.recording import Recording

TRAINED = 0.1  # numerical: share of an output's moving samples that makes it seen by a fit


class Fitted(Protocol):
    """Measured samples that an estimate was fitted to: see `pikanid.estimate.Fit`."""

    @property
    def output(self) -> str:
        """Name of the output."""

    @property
    def t(self) -> np.ndarray:
        """Times (N,) [s]."""

    @property
    def measured(self) -> np.ndarray:
        """Samples (N,), in the model's unit."""


@runtime_checkable
class Estimated(Protocol):
    """What is used of an estimate: see `pikanid.Estimate`."""

    @property
    def strategy(self) -> str:
        """Name of the strategy."""

    @property
    def free(self) -> tuple[FreeParameter, ...]:
        """Layout of θ."""

    @property
    def covariance(self) -> np.ndarray:
        """Of θ (n_free, n_free)."""

    @property
    def fitted_model(self) -> Model:
        """The model at the estimates."""

    @property
    def fits(self) -> Sequence[Fitted]:
        """Fitted outputs."""


@dataclass(frozen=True, eq=False)
class Seen:
    """Samples of one output that something was fitted to: t (N,) [s], values (N,)."""

    output: str
    t: np.ndarray
    values: np.ndarray


@dataclass(frozen=True, eq=False)
class Contender:
    """A model that is compared.

    Attributes:
        name: In tables.
        model: At the values that are compared.
        estimated: Names (a,) of the parameters that all recordings share and that were estimated.
        covariance: Of these (a, a); zeros where it is not known.
        seen: What it was fitted to; None where that is not known.
    """

    name: str
    model: Model
    estimated: tuple[str, ...]
    covariance: np.ndarray
    seen: tuple[Seen, ...] | None

    def held_out(self, t: np.ndarray, values: np.ndarray, output: str) -> bool | None:
        """Whether samples (N,) of an output were held out from the fit; None if it is not known.

        Samples count as seen where time and value are those of a fit.  Of a signal at rest any two
        recordings share some: only samples that differ from the one before are asked.
        """
        if self.seen is None:
            return None
        moving = np.concatenate([[False], np.diff(values) != 0])
        moving = moving if moving.any() else np.ones(len(t), bool)
        for own in self.seen:
            if own.output != output or not len(own.t):
                continue
            order = np.argsort(own.t)
            at = order[np.clip(np.searchsorted(own.t[order], t), 0, len(order) - 1)]
            same = (own.t[at] == t) & np.isclose(own.values[at], values, rtol=1e-12, atol=0.0)
            if np.mean(same[moving]) > TRAINED:
                return False
        return True


def contenders(models: Any, training: Sequence[Recording]) -> tuple[Contender, ...]:
    """What is compared, under names that differ.

    Args:
        models: A model or an estimate, several of them, or a dictionary: name -> one of them.
        training: What models that are no estimates were fitted to; empty where it is not known.

    Raises:
        BadModel: One of them is neither; or they do not measure the same outputs.
    """
    if isinstance(models, Mapping):
        named = [(str(name), model) for name, model in models.items()]
    else:
        given = models if isinstance(models, list | tuple) else [models]
        named = [("", model) for model in given]
    if not named:
        raise errors.BadModel(errors.no_models())
    found = [_contender(name, model, training) for name, model in named]
    outputs = found[0].model.output_names
    for other in found[1:]:
        if set(other.model.output_names) != set(outputs):
            raise errors.BadModel(errors.other_outputs(
                found[0].name, outputs, other.name, other.model.output_names))
    return tuple(replace(one, name=name) for one, name in zip(
        found, told_apart([one.name for one in found]), strict=True))


def told_apart(names: Sequence[str]) -> list[str]:
    """Names of which no two are alike.

    >>> told_apart(["fit", "fit", "other"])
    ['fit', 'fit (2)', 'other']
    """
    made: list[str] = []
    for name in names:
        numbered = (f"{name} ({k})" for k in count(2))
        made.append(name if name not in made else next(n for n in numbered if n not in made))
    return made


def _contender(name: str, given: Any, training: Sequence[Recording]) -> Contender:
    if isinstance(given, Model):
        shared = tuple(p.name for p in given.parameters if p.free and p.scope == "shared")
        return Contender(name or given.name, given, shared, np.zeros((len(shared),) * 2),
                         _samples(given, training) if training else None)
    if not isinstance(given, Estimated):
        raise errors.BadModel(errors.no_model_or_estimate(type(given).__name__))
    keep = [k for k, f in enumerate(given.free) if f.recording is None]
    covariance = finite(np.array(given.covariance)[np.ix_(keep, keep)])
    return Contender(name or given.fitted_model.name, given.fitted_model,
                     tuple(given.free[k].name for k in keep), covariance,
                     tuple(Seen(f.output, f.t, f.measured) for f in given.fits))


def _samples(model: Model, recordings: Sequence[Recording]) -> tuple[Seen, ...]:
    found = []
    for recording in recordings:
        for o in model.outputs:
            own = recording.as_output(o.name, o.unit if o.unit and recording[o.name].unit else None)
            there = np.isfinite(own.values)
            found.append(Seen(o.name, own.time[there], own.values[there]))
    return tuple(found)
