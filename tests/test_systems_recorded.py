"""Ready-made models on the real recordings that they describe, by figures of other software.

The figures are RMS errors of least-squares fits through a Runge-Kutta simulation that shares no
code with the package.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from ready_made import HOUR

import pikanid as pk
from pikanid.model import Model, systems
from pikanid.problem.problem import bind
from pikanid.simulation.simulator import Simulator

WINDOW, HEAD = 192, 96  # samples: 48 h of a building, of which the first half finds the start


def misses(model: Model, recording: pk.Recording) -> np.ndarray:
    """Simulated minus measured outputs, one after the other."""
    experiment = bind(model, recording)
    p = np.array(list(model.values.values()))
    return Simulator(model, experiment).run(p).y - np.concatenate(
        [s.y for s in experiment.samples])


def rms(*parts: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))


def fitted(model: Model, recordings: pk.Recording | list[pk.Recording]) -> Model:
    return pk.NLS(starts=1).fit(model, recordings).fitted_model


def held(model: Model) -> Model:
    """The model with all but its start fixed."""
    return model.fix(**{p.name: p.value for p in model.parameters
                        if p.free and p.scope == "shared"})


def read(folder: Path, name: str, **columns: str) -> pk.Recording:
    if not (folder / name).exists():
        pytest.skip(f"{name} is not among the real recordings at hand")
    return pk.Recording.read(folder / name, columns)


def test_tanks(recordings_folder: Path) -> None:
    train = read(recordings_folder, "cascaded_tanks/train.csv")
    found = fitted(systems.cascaded_tanks(), train)
    assert rms(misses(found, train)) == pytest.approx(0.603, abs=0.002)
    other = read(recordings_folder, "cascaded_tanks/heldout.csv")
    assert rms(misses(found, other)) == pytest.approx(0.669, abs=0.002)


def test_double_pendulum(recordings_folder: Path) -> None:
    """Both angles count alike; the held-out run starts at rest where it was measured to be."""
    train = read(recordings_folder, "double_pendulum/train.csv.gz")
    found = fitted(systems.double_pendulum(), train.with_sigma(q1=0.01, q2=0.01))
    assert rms(misses(found, train)) == pytest.approx(0.163, abs=0.001)
    other = read(recordings_folder, "double_pendulum/heldout.csv.gz")
    at_rest = found.with_values(q1_0=other["q1"].values[0], q2_0=other["q2"].values[0],
                                v1_0=0.0, v2_0=0.0)
    assert rms(misses(at_rest, other)) == pytest.approx(0.204, abs=0.001)


def test_building(recordings_folder: Path) -> None:
    """Fitted to windows of 48 h with starts of their own; a day predicts the next one."""
    def windows(name: str) -> list[pk.Recording]:
        whole = read(recordings_folder, f"buildings/{name}.csv", T="Ti", T_a="Ta", P="Thm")
        channels = {"T": "degC", "T_a": "degC", "P": "W"}
        return [pk.Recording.from_arrays(
            whole.t[k:k + WINDOW] - whole.t[k],
            {c: whole[c].values[k:k + WINDOW] for c in channels}, channels,
            hold={"T_a": "zero", "P": "zero"})
            for k in range(0, len(whole.t) - WINDOW + 1, WINDOW)]

    # the heating channel has no unit of its own, and C counts in that
    found = held(fitted(systems.thermal_rc().with_values(R=1.0, C=1.8e5), windows("train")))
    wrong = []
    for window in windows("heldout"):
        head = window.window(stop=window.t[HEAD - 1])
        wrong.append(misses(fitted(found, head), window)[HEAD:])
    assert rms(*wrong) == pytest.approx(0.971, abs=0.003)


def test_theophylline(recordings_folder: Path) -> None:
    """Twelve subjects with parameters of their own; the dose of each is a channel."""
    import pandas as pd

    path = recordings_folder / "theophylline" / "Theoph.csv"
    if not path.exists():
        pytest.skip("theophylline is not among the real recordings at hand")
    wrong = []
    for _, rows in pd.read_csv(path).groupby("Subject"):
        subject = pk.Recording.from_arrays(
            rows["Time"].to_numpy(float) * HOUR,
            {"dose": rows["Dose"].to_numpy(float), "c": rows["conc"].to_numpy(float)},
            {"dose": "mg/kg", "c": "mg/l"}, hold={"dose": "zero"})
        wrong.append(misses(fitted(systems.one_compartment(), subject), subject))
    assert len(wrong) == 12
    assert rms(*wrong) == pytest.approx(0.597, abs=0.002)


def test_boarding_school(recordings_folder: Path) -> None:
    counted = read(recordings_folder, "populations/boarding_school_flu/all.csv", I="bed")
    assert rms(misses(fitted(systems.sir(), counted), counted)) == pytest.approx(16.1, abs=0.1)


def test_hares_and_lynxes(recordings_folder: Path) -> None:
    """By the logarithm of what was counted, as the figure is."""
    pelts = read(recordings_folder, "populations/lynx_hare/all.csv", prey="hare", predators="lynx")
    model = systems.lotka_volterra()
    model = model.replace(outputs=tuple(
        dataclasses.replace(o, expression=sp.log(o.expression)) for o in model.outputs))
    logs = pk.Recording.from_arrays(pelts.t, {n: np.log(pelts[n].values) for n in pelts.names})
    assert rms(misses(fitted(model, logs), logs)) == pytest.approx(0.219, abs=0.001)
