"""Estimates on disk: one JSON file (gzip where the name ends in .gz), written atomically.

JSON and no pickle: a file from a stranger can hold numbers only.
"""

from __future__ import annotations

import gzip
import json
import os
from collections.abc import Callable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar, get_args

import numpy as np

from pikanid import errors
from pikanid.estimate.data import EstimateData, Fit, Trajectory
from pikanid.model import Model
from pikanid.objective.adequacy import Adequacy, Verdict
from pikanid.problem.problem import FreeParameter
from pikanid.storage.entries import MOST_ENTRIES, Entry
from pikanid.storage.limits import json_content
from pikanid.storage.outputs import atomically

SCHEMA = 1  # definition: of the format that files name
E = TypeVar("E", bound=EstimateData)


def save(estimate: EstimateData, path: str | os.PathLike[str]) -> None:
    """Write `estimate`; an existing file is replaced only once the new one is complete.

    Raises:
        BadRecording: The place cannot be written to.
    """
    atomically(path, content(estimate, path))


def content(estimate: EstimateData, path: str | os.PathLike[str]) -> bytes:
    """What `save` writes to `path`."""
    entries: dict[str, Any] = {
        "pikanid_estimate": SCHEMA,
        "model": estimate.model.to_dict(),
        "strategy": estimate.strategy,
        "free": [asdict(f) for f in estimate.free],
        "theta": estimate.theta.tolist(),
        "covariance": estimate.covariance.tolist(),
        "fits": [_arrays(asdict(f)) for f in estimate.fits],
        "trajectories": [_arrays(asdict(t)) for t in estimate.trajectories],
        "cost": estimate.cost,
        "adequacy": asdict(estimate.adequacy),
        "converged": estimate.converged,
        "settings": dict(estimate.settings),
        "history": [dict(h) for h in estimate.history],
        "warnings": list(estimate.warnings),
        "seconds": estimate.seconds, "seed": estimate.seed, "version": estimate.version,
    }
    data = json.dumps(entries).encode()
    return gzip.compress(data, mtime=0) if Path(path).suffix == ".gz" else data


def load(path: str | os.PathLike[str], kind: Callable[..., E]) -> E:
    """Read an estimate; `kind` makes it of its fields.

    Raises:
        BadSetting: The file is absent or is no saved estimate.
        BadModel: The model in it is none.
    """
    def wrong(detail: str) -> errors.BadSetting:
        return errors.BadSetting(errors.unreadable("estimate file", str(path), detail))

    content = json_content(path, wrong)
    if not isinstance(content, dict) or content.get("pikanid_estimate") != SCHEMA:
        raise wrong("it does not hold a saved estimate, as 'identify --save' writes it")
    return from_content(content, wrong, kind)


_KEYS = ("pikanid_estimate", "model", "strategy", "free", "theta", "covariance", "fits",
         "trajectories", "cost", "adequacy", "converged", "settings", "history", "warnings",
         "seconds", "seed", "version")


def from_content(content: dict[str, Any], wrong: Callable[[str], errors.PikanidError],
                 kind: Callable[..., E]) -> E:
    """The estimate that a file's content describes; `wrong` makes the exception from a sentence.

    Raises:
        PikanidError: Anything in it is of another type, shape or size.
    """
    entries = Entry(content, "its content", wrong).table(_KEYS)
    get = {key: entry.called(f"its {key}") for key, entry in entries.items()}
    model = Model.from_dict(get["model"].value)
    fits = tuple(map(_fit, get["fits"].items()))
    free = tuple(_free(entry, model) for entry in get["free"].items())
    n = len(free)
    covariance = get["covariance"].array(n, n)
    if np.any(np.diag(covariance) < 0):
        raise wrong(errors.entry_negative("the diagonal of its covariance"))
    seed = get["seed"]
    return kind(
        model=model, strategy=get["strategy"].text(), free=free, theta=get["theta"].array(n),
        covariance=covariance, fits=fits,
        trajectories=tuple(_trajectory(e, len(model.states)) for e in get["trajectories"].items()),
        cost=get["cost"].number(finite=False, nan=True), adequacy=_adequacy(get["adequacy"]),
        converged=get["converged"].flag(), settings=_table(get["settings"]),
        history=tuple(map(_table, get["history"].items())),
        warnings=tuple(entry.text() for entry in get["warnings"].items()),
        seconds=get["seconds"].number(finite=False, nan=True),
        seed=None if seed.value is None else seed.integer(0, 2**128),
        version=get["version"].text())


def _table(entry: Entry) -> dict[str, Any]:
    entry.table(optional=None)
    return dict(entry.plain())


def _free(entry: Entry, model: Model) -> FreeParameter:
    get = entry.table(("name", "recording", "guess", "bounds", "unit"))
    name, recording = get["name"].text(model.parameter_names), get["recording"]
    low, high = get["bounds"].pair()
    return FreeParameter(
        name, None if recording.value is None else recording.integer(0, MOST_ENTRIES),
        get["guess"].number(), (low.number(finite=False), high.number(finite=False)),
        get["unit"].text())


def _fit(entry: Entry) -> Fit:
    get = entry.table(("recording", "output", "unit", "t", "measured", "fitted", "sigma"),
                      ("spread",))
    t = get["t"].array(None)
    sigma, spread = get["sigma"], get.get("spread")
    return Fit(get["recording"].text(), get["output"].text(), get["unit"].text(), t,
               get["measured"].array(len(t)), get["fitted"].array(len(t)),
               None if sigma.value is None else sigma.array(len(t)),
               None if spread is None or spread.value is None else spread.array(len(t)))


def _trajectory(entry: Entry, states: int) -> Trajectory:
    get = entry.table(("t", "x"))
    t = get["t"].array(None)
    return Trajectory(t, get["x"].array(len(t), states))


def _adequacy(entry: Entry) -> Adequacy:
    get = entry.table([f.name for f in fields(Adequacy)])
    return Adequacy(
        value=get["value"].number(low=0.0, finite=False, nan=True),
        dof=get["dof"].integer(1, 10**12), p_value=get["p_value"].number(0.0, 1.0, nan=True),
        verdict=get["verdict"].text(get_args(Verdict)),  # type: ignore[arg-type]  # one of them
        source=get["source"].text(("given", "differences", "none")))  # type: ignore[arg-type]  # likewise


def _arrays(entry: dict[str, Any]) -> dict[str, Any]:
    return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in entry.items()}
