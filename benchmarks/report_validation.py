"""How well models predict real recordings, beside the best linear model.

Usage: python benchmarks/report_validation.py FOLDER [CLEAN]

Writes FOLDER/validation.md and FOLDER/figures/validation-*.png: Silverbox with the protocol of its
benchmark, the free swing of a pendulum, and how often the joint tests of the residual reject a
right model (CLEAN recordings of each noise; 400 by default).
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import diagnosis_real
import numpy as np
from provenance import provenance
from scipy.signal import lfilter
from scipy.stats import binomtest

import pikanid as pk
from pikanid.comparison.predictions import BASELINE
from pikanid.figures import save_figure
from pikanid.pieces.sheet import Sheet
from pikanid.storage.outputs import atomically

FIRST = 50  # samples of a Silverbox test that may serve to find the initial state
SECOND = 100  # samples of the swing in one second
TESTS = {"held_out": "multisine", "arrow": "arrow",
         "arrow_no_extrapolation": "arrow, no extrapolation"}
SIGMA, RHOS, LEVELS = 2e-3, (0.0, 0.6), (0.01, 0.05)

NOMINAL = diagnosis_real.MODELS["silverbox"]
OSCILLATOR = pk.Model.from_dict({
    **NOMINAL, "name": "linear oscillator", "inputs": {"u": {"unit": "V", "hold": "first"}},
    "parameters": {**NOMINAL["parameters"], "y0": {"unit": "V", "value": 0.0}},
    "outputs": {"y": {"unit": "V", "expression": "x + y0"}}})
PENDULUM = pk.Model.from_dict(diagnosis_real.MODELS["pendulum"])


@dataclass(frozen=True)
class Shown:
    """A unit to show errors in: its name, and how many of it are one of the output's unit."""

    unit: str
    factor: float


def silverbox_models(train: pk.Recording) -> dict[str, pk.Estimate]:
    """The oscillator, and that with a cubic spring, fitted to the official training part."""
    nominal = fitted(OSCILLATOR, train)
    hard = nominal.fitted_model.with_term("v", "-k3*x**3", [
        pk.Parameter("k3", 1e4, "1/(V^2*s^2)")]).free("y0")
    return {"linear oscillator (nominal)": nominal, "with cubic spring": fitted(hard, train)}


def fitted(model: pk.Model, train: pk.Recording, beginning: float = 4.0) -> pk.Estimate:
    """NLS on the beginning, then on all of it."""
    start = pk.NLS(starts=1).fit(model, train.window(0.0, beginning))
    return pk.NLS(starts=1).fit(start.fitted_model, train)


def swing_models(train: pk.Recording) -> dict[str, pk.Estimate]:
    """The viscous pendulum, and that with dry friction, and with dry friction and drag."""
    theta = train["theta"]
    begun = PENDULUM.with_values(
        theta_0=float(theta.values[0]),
        theta_dot_0=float(np.gradient(theta.values, theta.time)[0]))
    nominal = fitted(begun, train)
    dry = nominal.fitted_model.with_term("theta_dot", "-c*sign(theta_dot)", [
        pk.Parameter("c", 0.01, "rad/s^2", (0.0, np.inf))])
    both = dry.with_term("theta_dot", "-q*abs(theta_dot)*theta_dot", [
        pk.Parameter("q", 0.001, "1/rad", (0.0, np.inf))])
    return {"viscous pendulum (nominal)": nominal, "with dry friction": fitted(dry, train),
            "with dry friction and drag": fitted(both, train)}


def table(found: Iterable[tuple[str, pk.Validation]], shown: Shown) -> str:
    """All scores of some validations, one below the other, with a line for each test."""
    headers = ("test", "model", "N", f"RMSE [{shown.unit}]", "fit %", "R²", "parameters", "AIC",
               "BIC")
    rows = []
    for name, validation in found:
        place = {model: k for k, model in enumerate(validation.ranking)}
        for s in sorted(validation.scores, key=lambda s: place.get(s.model, len(place))):
            counts = ("", "", "") if s.model not in place else (
                str(s.parameters), f"{s.aic:.6g}", f"{s.bic:.6g}")
            rows.append((name, s.model, str(s.n), f"{shown.factor * s.rmse:.3g}", f"{s.fit:.2f}",
                         f"{s.r2:.5f}", *counts))
    return Sheet(headers, tuple(rows), headers[2:]).to_markdown()


def sentences(found: Mapping[str, pk.Validation]) -> list[str]:
    """What is significantly better, and what is left, test by test."""
    lines = []
    for name, validation in found.items():
        pairs = ", ".join(f"{p.better} over {p.worse} (p = {p.p_value:.2g})"
                          for p in validation.significant())
        lines.append(f"- {name}: {pairs or 'no difference is significant'}.")
        for analysis in (a for own in validation.residuals.values() for a in own):
            lines.append(f"  - {analysis.sentence()}")
    return lines


def silverbox(folder: Path) -> list[str]:
    """The chapter on Silverbox."""
    train = pk.datasets.silverbox("train")
    models = silverbox_models(train)
    found = {title: pk.validate(models, pk.datasets.silverbox(part), training=train, first=FIRST)
             for part, title in TESTS.items()}
    analysis = found["multisine"].residuals["with cubic spring"][0]
    save_figure(analysis.plot(), folder / "figures" / "validation-silverbox.png")
    order = BASELINE in found["multisine"].ranking
    return [
        "## Silverbox", "",
        f"Fitted to the official training part ({len(train.t)} samples). Free simulation of every "
        f"test; its first {FIRST} samples serve to find the initial state and are not scored, as "
        "the benchmark has it. The input runs in straight lines between samples. "
        + ("The linear baseline is ARX, its order by BIC of the simulated training part. "
           if order else "")
        + "Noise is what the recording, or the best model's residual, shows at the highest "
        "frequencies.", "",
        table(found.items(), Shown("mV", 1e3)), "",
        *sentences(found), "",
        "![What the oscillator with a cubic spring leaves of the multisine]"
        "(figures/validation-silverbox.png)", ""]


def pendulum(folder: Path) -> list[str]:
    """The chapter on the swing."""
    train = pk.datasets.single_pendulum_excerpt("train")
    test = pk.datasets.single_pendulum_excerpt("held_out")
    models = swing_models(train)
    simulated = pk.validate(models, test, training=train, first=SECOND)
    ahead = pk.validate(models, test, training=train, horizon=SECOND, window=SECOND)
    save_figure(simulated.plot(), folder / "figures" / "validation-pendulum.png")
    found = {"free simulation": simulated, "one second ahead": ahead}
    return [
        "## The single pendulum", "",
        f"Free swing, 100 Hz, fitted to the first {train.stop - train.start:.1f} s and held out "
        f"for the following {test.stop - test.start:.1f} s. Free simulation from a state that is "
        "found in the first second, which is not scored; and prediction one second ahead, from a "
        "state that is estimated of the second before. Without an input the linear baseline is AR; "
        "where it has one parameter, no linear model simulates the large swings of the training "
        "part better than their mean.", "",
        table(found.items(), Shown("mrad", 1e3)), "", *sentences(found), "",
        "![The held-out swing, simulated freely](figures/validation-pendulum.png)", ""]


def clean_rates(count: int) -> list[str]:
    """The chapter on joint tests of right models."""
    model = pk.systems.sloshing()
    clean = pk.simulate(model, pk.excitation.multisine(duration=5.0))
    rows = []
    for rho in RHOS:
        p_values = defaultdict(list)
        for seed in range(count):
            rec = noisy(clean, rho, np.random.default_rng([seed, int(100 * rho)]))
            (found,) = pk.NLS(starts=1).fit(model, rec).resid(rec)
            for t in found.tests:
                p_values[f"{t.kind} {t.of}".strip()].append(t.p_value)
        noise = f"AR(1), ρ = {rho:g}" if rho else "white"
        rows += [(noise, name, *(rate(np.array(p), level) for level in LEVELS))
                 for name, p in p_values.items()]
    headers = ("noise", "joint test", *(f"rejected at {100 * level:g} %" for level in LEVELS))
    return [
        "## Joint tests of the residual, where nothing is missing", "",
        f"{count} recordings of the slosh model for each noise, each fitted by NLS: how many a "
        "test rejects, with the 99 % Wilson interval of its rate.", "",
        Sheet(headers, tuple(rows), headers[2:]).to_markdown(), ""]


def noisy(clean: pk.Recording, rho: float, rng: np.random.Generator) -> pk.Recording:
    """The recording with stationary AR(1) noise."""
    theta = clean["theta"]
    e = rng.standard_normal(len(theta.values) + 200)
    noise = lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], e)[200:]
    return clean.with_channels(replace(
        theta, values=theta.values + SIGMA * noise, sigma=SIGMA))


def rate(p: np.ndarray, level: float) -> str:
    """Share of p-values below a level, in per cent, with its interval."""
    count = int(np.sum(p < level))
    low, high = binomtest(count, len(p)).proportion_ci(0.99, "wilson")
    return f"{100 * count / len(p):.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


def main(arguments: Sequence[str]) -> None:
    """Write the report."""
    folder = Path(arguments[0])
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    text = ["# Validation", "",
            "Models against the best linear model of the same data and the noise, by "
            "`pk.validate`. Fit per cent as MATLAB's `compare` counts it; a difference is "
            "significant below 1 % in a block bootstrap, adjusted for the number of pairs.", "",
            *silverbox(folder), *pendulum(folder),
            *clean_rates(int(arguments[1]) if len(arguments) > 1 else 400),
            f"Computed with {provenance()}.", ""]
    atomically(folder / "validation.md", "\n".join(text).encode())


if __name__ == "__main__":
    main(sys.argv[1:])
