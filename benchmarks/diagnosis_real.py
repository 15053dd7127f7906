"""Diagnoses of real recordings, each with its nominal model alone; rows for a report.

    python benchmarks/diagnosis_real.py [single_pendulum free_swing silverbox falling_balls
                                         slosh_lar tanks linkage building theophylline
                                         populations]

One function a recording; none is given anything but the nominal model and the data.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from diagnosis_real_systems import SYSTEMS
from diagnosis_rows import Row, laws, row, table

import pikanid as pk
from pikanid.mismatch.report.diagnosis import Diagnosis
from pikanid.recording import datasets
from pikanid.validation.study import pendulum

MODELS: dict[str, dict[str, Any]] = {
    "pendulum": {
        "name": "viscous pendulum",
        "states": {"theta": {"unit": "rad", "initial": "free"},
                   "theta_dot": {"unit": "rad/s", "initial": "free"}},
        "parameters": {"w2": {"unit": "1/s^2", "guess": 40.0, "bounds": [1.0, 1000.0]},
                       "d": {"unit": "1/s", "guess": 0.05, "bounds": [0.0, 10.0]}},
        "equations": {"theta": "theta_dot", "theta_dot": "-w2*sin(theta) - d*theta_dot"},
        "outputs": {"theta": {"unit": "rad", "expression": "theta"}}},
    # Both signals have an offset.  To a linear oscillator the two are one; it stands where it can
    # also move the point about which a restoring force bends: at the input.
    "silverbox": {
        "name": "linear oscillator with offset",
        "states": {"x": {"unit": "V", "initial": "free"}, "v": {"unit": "V/s", "initial": "free"}},
        "inputs": {"u": {"unit": "V", "hold": "zero"}},
        "parameters": {"omega": {"unit": "rad/s", "guess": 400.0, "bounds": [10.0, 2000.0]},
                       "zeta": {"guess": 0.05, "bounds": [0.0, 5.0]},
                       "b": {"unit": "1/s^2", "guess": 160000.0},
                       "u0": {"unit": "V", "guess": 0.0}},
        "equations": {"x": "v", "v": "b*(u + u0) - 2*zeta*omega*v - omega**2*x"},
        "outputs": {"y": {"unit": "V", "expression": "x"}}},
    "fall": {
        "name": "free fall",
        "states": {"h": {"unit": "m", "initial": "free"}, "v": {"unit": "m/s", "initial": "free"}},
        "parameters": {"g": {"unit": "m/s^2", "value": 9.81}},
        "equations": {"h": "v", "v": "-g"},
        "outputs": {"h": {"unit": "m", "expression": "h"}}},
    # The first mode of the water in an upright, round vessel, in both horizontal directions, after
    # H. Lamb, Hydrodynamics, 1932, for radius R and filling H: omega^2 = g xi/R tanh(xi H/R), and
    # a steady acceleration a raises the surface by c a at the wall, c = 2 R/((xi^2 - 1) g), with
    # xi = 1.8412, R = 49 mm, H = 78 mm.  That is theory for small waves: omega may be a quarter
    # off, c a factor of two.  What is seen is the highest point of the surface; the little square
    # keeps its slope finite at rest.
    "slosh": {
        "name": "upright slosh mode",
        "states": {"q_x": {"unit": "mm", "initial": 0.0}, "v_x": {"unit": "mm/s", "initial": 0.0},
                   "q_y": {"unit": "mm", "initial": 0.0}, "v_y": {"unit": "mm/s", "initial": 0.0}},
        "inputs": {"a_x": {"unit": "m/s^2", "hold": "first"},
                   "a_y": {"unit": "m/s^2", "hold": "first"}},
        "parameters": {"omega": {"unit": "rad/s", "guess": 19.1, "bounds": [14.3, 23.9]},
                       "zeta": {"guess": 0.01, "bounds": [0.0, 0.3]},
                       "c": {"unit": "mm*s^2/m", "guess": 4.18, "bounds": [2.09, 8.36]}},
        "equations": {"q_x": "v_x", "v_x": "-omega**2*(q_x + c*a_x) - 2*zeta*omega*v_x",
                      "q_y": "v_y", "v_y": "-omega**2*(q_y + c*a_y) - 2*zeta*omega*v_y"},
        "outputs": {"h": {"unit": "mm", "expression": "sqrt(q_x**2 + q_y**2 + 0.1**2)"}}}}


def single_pendulum() -> list[Row]:
    """The large free swing: fitted to 36.7 s, held out to 55 s."""
    train, other = (_joined(part) for part in ("train", "held_out"))
    dx, seconds = _diagnosed("pendulum", train, other)
    return [row("single pendulum", dx, seconds, _run_on())]


# Laws beside the viscous one, none of which may put energy in.
DRY, DRAG, AMPLITUDE = "-c*sign(theta_dot)", "-q*abs(theta_dot)*theta_dot", "-a*theta**2*theta_dot"


def _run_on() -> str:
    """What laws can explain when no state is estimated anew: RMSE [rad] where a fit to the train
    part runs on into the held-out one, and after a fit to both, which no prediction can be expected
    to beat by much.
    """
    swing = pendulum.load()
    whole = datasets.single_pendulum_excerpt("all")
    nominal = pk.NLS(starts=1).fit(pendulum.guess(swing.train), swing.train).fitted_model
    told = []
    for name, terms in (("nominal", ()), ("Coulomb + quadratic drag", (DRY, DRAG)),
                        ("Coulomb + amplitude damping", (DRY, AMPLITUDE))):
        new = [pk.Parameter(law[1], 0.001, "", (0.0, np.inf)) for law in terms]
        model = nominal.with_term("theta_dot", " ".join(terms), new) if terms else nominal
        left = [pendulum.rms(pendulum.run_on(pk.NLS(starts=1).fit(model, seen).fitted_model, swing)
                             - swing.held_out["theta"].values) for seen in (swing.train, whole)]
        told.append(f"{name} {left[0]:.4f}, {left[1]:.4f}")
    return ("run on from t = 0 (RMSE of the held-out part, and that after a fit to both parts): "
            f"{'; '.join(told)} rad")


def free_swing() -> list[Row]:
    """The small free swing, to rest: fitted to its first four seconds."""
    whole = datasets.single_pendulum_free_swing()["theta"]
    cut = int(np.searchsorted(whole.time, whole.time[0] + 4.0))
    parts = [pk.Recording.from_arrays(whole.time[k] - whole.time[k][0], {"theta": whole.values[k]},
                                      {"theta": "rad"}, name=name)
             for k, name in ((slice(0, cut), "first 4 s"), (slice(cut, None), "the rest"))]
    dx, seconds = _diagnosed("pendulum", *parts)
    return [row("free swing", dx, seconds)]


def silverbox(samples: int = 24000) -> list[Row]:
    """Fitted to samples from 42000 on; judged on both official tests [mV] too."""
    every = datasets.silverbox("all")
    dx, seconds = _diagnosed("silverbox", _range(every, 42000, 42000 + samples),
                             _range(every, 105712, 105712 + 12000))
    found = []
    for name, start, stop in (("multisine", 105712, 127400), ("arrow", 100, 40575)):
        begun = dx.model.fix(*(n for n in dx.model.free_names if n not in ("x_0", "v_0")))
        begun = pk.NLS(starts=1).fit(begun, _range(every, start, start + 200)).fitted_model
        test = _range(every, start, stop)
        gap = pk.simulate(begun, test)["y"].values - test["y"].values
        found.append(f"{name} {1e3 * np.sqrt(np.mean(gap[50:] ** 2)):.2f} mV")
    return [row("silverbox", dx, seconds, ", ".join(found))]


def falling_balls(balls: Sequence[str] = datasets.BALLS) -> list[Row]:
    """Every ball: drop 1 explained, drop 2 held out."""
    rows = []
    for ball in balls:
        drops = []
        for k in (1, 2):
            recording = datasets.falling_balls(ball, k)
            drops.append(pk.Recording.from_arrays(
                recording["h"].time, {"h": recording["h"].values}, {"h": "m"},
                name=recording.name))
        dx, seconds = _diagnosed("fall", *drops)
        rows.append(row(ball, dx, seconds))
    return rows


def slosh_lar(motions: Sequence[str] = datasets.SLOSH_MOTIONS) -> list[Row]:
    """Every run of a kind of motion explained, the next one of that kind held out.

    Runs of one kind differ in nothing but how long the same path takes.
    """
    kinds: dict[tuple[str, ...], list[str]] = {}
    for name in motions:
        *path, _, angle = name.split("_")
        kinds.setdefault((*path, angle), []).append(name)
    rows = []
    for runs in kinds.values():
        for train, other in zip(runs, [*runs[1:], runs[0]], strict=True):
            dx, seconds = _diagnosed("slosh", *map(datasets.slosh_lar_forced, (train, other)))
            rows.append(row(f"{train}, held out {other}", dx, seconds, laws(dx)))
    return rows


def _diagnosed(model: str, train: pk.Recording, other: pk.Recording) -> tuple[Diagnosis, float]:
    begun = time.perf_counter()
    dx = pk.diagnose(pk.Model.from_dict(MODELS[model]), train, other, workers=1)
    return dx, time.perf_counter() - begun


def _joined(part: str) -> pk.Recording:
    pieces = datasets.single_pendulum(part)  # type: ignore[arg-type]  # train or held_out
    t, y = (np.concatenate([getattr(p["theta"], name) for p in pieces])
            for name in ("time", "values"))
    return pk.Recording.from_arrays(t, {"theta": y}, {"theta": "rad"}, name=part)


def _range(recording: pk.Recording, start: int, stop: int) -> pk.Recording:
    channels = [replace(recording[n], time=recording[n].time[: stop - start],
                        values=recording[n].values[start:stop]) for n in ("u", "y")]
    return recording.with_channels(*channels)


RECORDINGS: dict[str, Callable[[], list[Row]]] = {
    "single_pendulum": single_pendulum, "free_swing": free_swing, "silverbox": silverbox,
    "falling_balls": falling_balls, "slosh_lar": slosh_lar, **SYSTEMS}

if __name__ == "__main__":
    for name in sys.argv[1:] or RECORDINGS:
        print(table(RECORDINGS[name]()), flush=True)
