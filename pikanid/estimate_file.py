"""Estimates on disk: one JSON file (gzip where the name ends in .gz), written atomically.

JSON and no pickle: a file from a stranger can hold numbers only.
"""

from __future__ import annotations

import gzip
import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.adequacy import Adequacy
from pikanid.estimate import Estimate, Fit, Trajectory
from pikanid.model import Model
from pikanid.outputs import atomically
from pikanid.problem import FreeParameter

SCHEMA = 1


def save(estimate: Estimate, path: str | os.PathLike[str]) -> None:
    """Write `estimate`; an existing file is replaced only once the new one is complete.

    Raises
    ------
    pikanid.errors.BadRecording : the place cannot be written to
    """
    atomically(path, content(estimate, path))


def content(estimate: Estimate, path: str | os.PathLike[str]) -> bytes:
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


def load(path: str | os.PathLike[str]) -> Estimate:
    """Read an estimate.

    Raises
    ------
    pikanid.errors.BadSetting : the file is absent or is no saved estimate
    """
    try:
        data = Path(path).read_bytes()
        text = gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
        content = json.loads(text)
        if content["pikanid_estimate"] != SCHEMA:
            raise KeyError("pikanid_estimate")
        return _build(content)
    except OSError as problem:
        detail = problem.strerror or "it is no complete gzip file"
        raise errors.BadSetting(errors.estimate_file(str(path), detail)) from None
    except (ValueError, KeyError, TypeError, AttributeError, EOFError):
        detail = "it does not hold a saved estimate"
        raise errors.BadSetting(errors.estimate_file(str(path), detail)) from None


def _build(content: dict[str, Any]) -> Estimate:
    free = tuple(FreeParameter(**{**f, "bounds": tuple(f["bounds"])}) for f in content["free"])
    fits = tuple(Fit(**{k: _array(v) for k, v in f.items()}) for f in content["fits"])
    trajectories = tuple(Trajectory(_array(t["t"]), _array(t["x"]).reshape(len(t["t"]), -1))
                         for t in content["trajectories"])
    kept = {k: content[k] for k in ("strategy", "cost", "converged", "settings", "seconds", "seed",
                                    "version")}
    return Estimate(
        model=Model.from_dict(content["model"]), free=free, theta=np.array(content["theta"], float),
        covariance=np.array(content["covariance"], float).reshape(len(free), len(free)),
        fits=fits, trajectories=trajectories, adequacy=Adequacy(**content["adequacy"]),
        history=tuple(content["history"]), warnings=tuple(content["warnings"]), **kept)


def _arrays(entry: dict[str, Any]) -> dict[str, Any]:
    return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in entry.items()}


def _array(value: Any) -> Any:
    return np.array(value, float) if isinstance(value, list) else value
