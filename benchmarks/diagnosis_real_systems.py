"""Diagnoses of real systems that are no single oscillator, each with its nominal model alone.

Tanks, a linkage, a building, a medicine, two populations.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from diagnosis_rows import Row, laws, row

import pikanid as pk
from pikanid.errors import BadRecording
from pikanid.mismatch.report.diagnosis import Diagnosis
from pikanid.model import Model
from pikanid.recording import datasets

WINDOW, HEAD = 192, 96  # samples: 48 h of a building, of which the first half finds the start
SUBJECTS = 8  # of twelve: they tell, the others confirm
ASSAY = 0.5  # mg/l: noise of a concentration in blood


def tanks() -> list[Row]:
    """The benchmark's own split."""
    dx, seconds = _diagnosed(pk.systems.cascaded_tanks(), datasets.cascaded_tanks("train"),
                             datasets.cascaded_tanks("held_out"))
    return [row("cascaded tanks", dx, seconds, laws(dx))]


def linkage() -> list[Row]:
    """Two runs with other torques, at 100 Hz."""
    train, other = (datasets.double_pendulum(part).decimate(5) for part in ("train", "held_out"))
    dx, seconds = _diagnosed(pk.systems.double_pendulum(), train, other)
    said = ""
    if dx.held_out:
        gaps = [(c.before - c.measured, c.after - c.measured) for c in dx.held_out.curves.values()]
        before, after = (_rms(np.concatenate(each)) for each in zip(*gaps, strict=True))
        said = f"both angles {before:.3g} → {after:.3g} rad; {laws(dx)}"
    return [row("double pendulum", dx, seconds, said)]


def building() -> list[Row]:
    """Windows of 48 h with starts of their own, some to fit and others held out.

    What a hidden store explains is said whatever the verdict: of the square of the error a day
    ahead, by a model of two temperatures that is written and fitted by hand, with sun and without.
    """
    train, other = (_windows(part) for part in ("train", "held_out"))
    room = pk.systems.thermal_rc().with_values(R=1.0, C=1.8e5)
    dx, seconds = _diagnosed(room, train, other)
    found = _day_ahead(dx.model, train, other)
    ahead = {"nominal": _day_ahead(room, train, other)}
    ahead["hidden store"] = _day_ahead(_house(), train, other)
    ahead["hidden store that the sun heats"] = _day_ahead(_house("s*I"), train, other)
    noise = dx.held_out.noise if dx.held_out else 0.0
    before = ahead["nominal"] ** 2 - noise**2
    told = [f"{name} {value:.3f}" + (
        "" if name == "nominal" else f" ({1 - (value**2 - noise**2) / before:.0%} explained)")
        for name, value in ahead.items()]
    return [row("building", dx, seconds, f"a day ahead: what was found {found:.3f}; fitted by "
                f"hand: {', '.join(told)} degC; {laws(dx)}")]


def at_once() -> Model:
    """Theophylline goes into the blood at once; subjects have parameters of their own."""
    own = {"scope": "recording"}
    return Model.from_dict({
        "name": "at once in the blood", "inputs": {"dose": {"unit": "mg/kg"}},
        "states": {"c": {"unit": "mg/l", "initial": "dose/V"}},
        "parameters": {"k": {"unit": "1/h", "guess": 0.08, "bounds": [1e-5, 100.0], **own},
                       "V": {"unit": "l/kg", "guess": 0.5, "bounds": [1e-3, 1e4], **own}},
        "equations": {"c": "-k*c"}, "outputs": {"c": {"unit": "mg/l", "expression": "c"}}})


def theophylline() -> list[Row]:
    """At once in the blood is the nominal model."""
    subjects = [s.with_sigma(c=ASSAY) for s in datasets.theophylline()]
    model = at_once()
    dx, seconds = _diagnosed(model, subjects[:SUBJECTS], subjects[SUBJECTS:])
    each = dx.model.replace(parameters=tuple(
        replace(p, scope="recording") if p.free else p for p in dx.model.parameters))
    told = ", ".join(f"{name} {left_out(one, subjects):.3g}"
                     for name, one in (("nominal", model), ("with what was found", each)))
    return [row("theophylline", dx, seconds, f"samples left out one by one: {told} mg/l")]


def populations() -> list[Row]:
    """Too short for a proof: what is there must not be found missing."""
    found = []
    for name, model, recording in (
            ("lynx and hare", pk.systems.lotka_volterra(), datasets.lynx_hare),
            ("boarding school", pk.systems.sir(), datasets.boarding_school)):
        try:
            dx, seconds = _diagnosed(model, recording())
        except BadRecording as refusal:
            found.append(Row(name, "refused", (), np.nan, np.nan, "", 0.0, str(refusal)))
        else:
            found.append(row(name, dx, seconds, f"p = {dx.p_value:.2g}"))
    return found


def _diagnosed(model: Model, train: pk.Recording | Sequence[pk.Recording],
               other: pk.Recording | Sequence[pk.Recording] | None = None
               ) -> tuple[Diagnosis, float]:
    begun = time.perf_counter()
    dx = pk.diagnose(model, train, other, workers=1)
    return dx, time.perf_counter() - begun


def _house(heats_the_store: str = "0") -> Model:
    """A room and a store of heat, level when a recording begins."""
    return Model.from_dict({
        "name": "room and store",
        "inputs": {"T_a": {"unit": "degC"}, "P": {"unit": "W"}, "I": {"unit": "W/m^2"}},
        "states": {"T": {"unit": "degC", "initial": "free", "guess": 20.0},
                   "store": {"unit": "degC", "initial": "T_0"}},
        "parameters": {
            "R": {"unit": "K/W", "guess": 1.0, "bounds": [1e-6, 1e4]},
            "C": {"unit": "J/K", "guess": 1.8e5, "bounds": [1.0, 1e12]},
            "k": {"unit": "1/s", "guess": 1e-4, "bounds": [0.0, 1.0]},
            "r": {"unit": "1/s", "guess": 1e-5, "bounds": [0.0, 1.0]},
            "s": {"unit": "K*m^2/(W*s)", ("guess" if "s" in heats_the_store else "value"): 0.0}},
        "equations": {"T": "(T_a - T)/(R*C) + P/C + k*(store - T)",
                      "store": f"r*(T - store) + {heats_the_store}"},
        "outputs": {"T": {"unit": "degC", "expression": "T"}}})


def _windows(part: str) -> list[pk.Recording]:
    """Of 48 h; heating counts in a unit of its own, and C in that."""
    whole = datasets.building(part)  # type: ignore[arg-type]  # train or held_out
    units = {"T": "degC", "T_a": "degC", "P": "W", "I": "W/m^2"}
    return [pk.Recording.from_arrays(
        whole.t[k:k + WINDOW] - whole.t[k],
        {c: whole[c].values[k:k + WINDOW] for c in units}, units,
        hold={"T_a": "zero", "P": "zero", "I": "zero"}, name=f"{part} from {whole.t[k]:.0f} s")
        for k in range(0, len(whole.t) - WINDOW + 1, WINDOW)]


def _day_ahead(model: Model, train: Sequence[pk.Recording], other: Sequence[pk.Recording]) -> float:
    """RMSE [degC] over the second day of windows whose first day finds where they start."""
    found = pk.NLS(starts=1).fit(model, train).fitted_model
    known = found.fix(**{p.name: p.value for p in found.parameters
                         if p.free and p.scope == "shared"})
    wrong = []
    for window in other:
        begun = pk.NLS(starts=1).fit(known, window.window(stop=window.t[HEAD - 1])).fitted_model
        wrong.append((pk.simulate(begun, window)["T"].values - window["T"].values)[HEAD:])
    return _rms(np.concatenate(wrong))


def left_out(model: Model, subjects: Sequence[pk.Recording]) -> float:
    """RMSE [mg/l] of each sample by a fit of its subject without it."""
    wrong = []
    for whole in subjects:
        for k in range(len(whole.t)):
            seen = whole["c"].values.copy()
            seen[k] = np.nan
            part = pk.Recording.from_arrays(
                whole.t, {"dose": whole["dose"].values, "c": seen}, {"dose": "mg/kg", "c": "mg/l"},
                hold={"dose": "zero"})
            found = pk.NLS(starts=1).fit(model, part).fitted_model
            wrong.append(pk.simulate(found, whole)["c"].values[k] - whole["c"].values[k])
    return _rms(np.array(wrong))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


SYSTEMS: dict[str, Callable[[], list[Row]]] = {
    "tanks": tanks, "linkage": linkage, "building": building, "theophylline": theophylline,
    "populations": populations}
