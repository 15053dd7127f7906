"""Sound inputs of the fuzz: a file of every format, saved results, words of command lines."""

from __future__ import annotations

import gzip
import io
from functools import cache
from typing import Any

import numpy as np

RECORDINGS = (".csv", ".csv.gz", ".xlsx", ".xls", ".parquet", ".mat", ".v73.mat", ".npz")
CODE = "__import__('os').abort()"


def sound_recording(ending: str) -> bytes:
    """A small sound file."""
    t = np.arange(30) * 0.1
    columns = {"t": t, "theta [deg]": np.sin(t), "u": np.cos(t)}
    buffer = io.BytesIO()
    if ending.startswith(".csv"):
        rows = [",".join(columns), *(",".join(map(repr, r)) for r in np.c_[t, t**2, -t].tolist())]
        text = "\n".join(rows).encode()
        return gzip.compress(text, mtime=0) if ending.endswith("gz") else text
    if ending == ".xls":  # the header of an old workbook; a whole one nobody writes any more
        return b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(16) + b"\x3e\0\x03\0\xfe\xff\x09\0" + (
            bytes(480) + bytes(range(256)) * 8)
    if ending == ".xlsx":
        import openpyxl

        book = openpyxl.Workbook(write_only=True)
        page = book.create_sheet("run")
        for row in [list(columns), *np.column_stack(list(columns.values())).tolist()]:
            page.append(row)
        book.save(buffer)
    elif ending == ".parquet":
        import pyarrow as pa
        import pyarrow.parquet as pq

        pq.write_table(pa.table(columns), buffer)
    elif ending == ".npz":
        np.savez(buffer, t=t, theta=t**2, pair=np.stack([t, -t]))
    elif ending == ".v73.mat":
        import h5py

        with h5py.File(buffer, "w") as file:
            file["t"], file["y"] = t, t**2
            file.create_group("s")["values"] = -t
            file.create_dataset("z", data=t, chunks=(10,), compression="gzip")
    else:
        from scipy.io import savemat

        cells = np.empty(2, dtype=object)
        cells[:] = [t, -t]
        savemat(buffer, {"t": t, "y": t**2, "s": {"time": t, "values": -t}, "c": cells},
                do_compression=True)
    return buffer.getvalue()


MODEL = """
name = "pendulum"
[states]
theta = { unit = "rad", initial = "free", guess = 0.1, bounds = [-1, 1] }
omega = { unit = "rad/s" }
[inputs]
u = { unit = "m/s^2", hold = "first", gain = "k", delay = 0.1, saturation = 3.0, lag = "l" }
[parameters]
l = { unit = "m", guess = 0.06, bounds = [0.005, 0.5] }
k = { value = 1.0 }
[equations]
theta = "omega"
omega = "u/l*cos(theta) - 9.81/l*sin(theta) + edge(omega) - max(k, 0.1)*sign(omega)"
[outputs]
theta = { unit = "rad", expression = "theta", sigma = 0.01, offset = "k", clip = [-1, 1] }
[splines]
edge = { degree = 1, knots = [0, 0, 1, 2, 2] }
"""


@cache
def estimate_content() -> dict[str, Any]:
    """What a saved estimate holds."""
    import tomllib

    from pikanid import Model

    t = [0.0, 0.1, 0.2]
    fit = {"recording": "r", "output": "theta", "unit": "rad", "t": t, "measured": t, "fitted": t,
           "sigma": None}
    model = Model.from_dict(tomllib.loads(MODEL))
    return {"pikanid_estimate": 1, "model": model.to_dict(), "strategy": "nls",
            "free": [{"name": "l", "recording": None, "guess": 0.1, "bounds": [0.0, 1.0],
                      "unit": "m"}],
            "theta": [0.05], "covariance": [[1e-6]], "fits": [fit],
            "trajectories": [{"t": t, "x": [[0.0] * len(model.states)] * 3}], "cost": 0.5,
            "adequacy": {"value": 3.0, "dof": 2, "p_value": 0.2, "verdict": "fits",
                         "source": "given"},
            "converged": True, "settings": {"grid": [1, 2]}, "history": [{"cost": 1.0}],
            "warnings": ["note"], "seconds": 0.1, "seed": None, "version": "0.1"}


@cache
def network_content() -> dict[str, Any]:
    """What a saved network [1, 1] of three intervals holds."""
    ones = [[1.0]]
    layer = {"grid": [[-2.0, -1.0, 0.0, 1.0, 2.0, 3.0]], "coef": [[[0.1, 0.2, 0.3, 0.4]]],
             "scale_base": ones, "scale_sp": ones, "mask": ones, "node_scale": [1.0],
             "node_bias": [0.0], "subnode_scale": [1.0], "subnode_bias": [0.0],
             "symbolic_mask": [[0.0]], "symbolic_affine": [[[1.0, 0.0, 1.0, 0.0]]]}
    return {"format": "pikanid-kan", "version": 1, "width": [[1, 0], [1, 0]], "k": 1,
            "base": "zero", "arity": 2, "symbols": [[["0"]]], "kinks": None,
            "arrays": {"batch": [[0.5]], **{f"layer0_{n}": v for n, v in layer.items()}}}


CASE: dict[str, Any] = {
    "id": "001", "class": "single", "nameable": True, "base": {"l_theta": {"value": 0.045}},
    "effects": [{"id": "input_delay", "twins": ["sensor_delay"], "near": ""}],
    "visibility": {"nominal": 40.0, "effects": [40.0], "best_rival": ["a"],
                   "best_rival_distance": 9.0}}
ANSWER: dict[str, Any] = {
    "verdict": "named", "mismatch": True, "held_out": {"rmse_after": 0.1, "noise": 0.1},
    "hypotheses": [{"effects": [{"ids": ["sensor_delay"]}], "probability": 0.97}],
    "parameters": {"after": {"l_theta": {"value": 0.044, "std": 0.001}}}}
TRUTH = {"schema_version": 1, "sealed": False, "seed": "1", "nonce": "ab", "settings": {},
         "cases": [{"sha256": {"001.csv": "0"}}]}
SEAL = {"schema_version": 1, "sealed": False, "sha256": "0"}
WORDS = ("identify", "simulate", "models", "diagnose", "extract", "design", "confusable", "conceal",
         "equivalence", "study", "--model", "-m", "sloshing", "pendulum", "run.csv", "model.toml",
         "absent.csv", "--sigma", "0.1deg", "theta=", "--set", "l_theta=0.05", "--rate", "--unit",
         "theta=m", "t=h", "--column", "--strategy", "nls", "--json", "--out", "--help", "-1",
         "1e309", "nan", "\0", "\x1b[2J", CODE, "x" * 5000,
         "--version", "--decimate", "--from", "--to",
         "", "--free", "--fix", "--input", "--output", "--seed", "--cases", "0", "--duration", "=")
