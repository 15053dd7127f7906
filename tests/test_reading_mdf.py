"""MDF files: groups, conversions, missing samples, and formulas that are read, not run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import benches
import numpy as np
import pytest

from pikanid import errors
from pikanid.recording import Recording

pytest.importorskip("asammdf", reason="needs the `mdf` extra")

T = np.arange(0.0, 1.0, 0.01)


def signal(values: Any, name: str, t: Any = T, **more: Any) -> Any:
    from asammdf import Signal

    return Signal(np.asarray(values), t, name=name, **more)


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """One file with everything that a channel can be."""
    from asammdf.blocks.conversion_utils import from_dict

    folder = tmp_path_factory.mktemp("mdf")
    counts = np.arange(len(T)).astype("u2")
    benches.mdf(folder / "run.mf4", {
        "linear": [signal(counts, "lin", conversion=from_dict({"a": 0.5, "b": -3}))],
        "rational": [signal(counts, "rat", conversion=from_dict(
            {"P1": 0, "P2": 2, "P3": 1, "P4": 0, "P5": 0, "P6": 4}))],
        "formula": [signal(counts, "alg", conversion=from_dict(
            {"formula": "sqrt(X)*2 + X**2/8"}))],
        "states": [signal(counts % 2, "gear", conversion=from_dict(
            {"val_0": 0, "text_0": "off", "val_1": 1, "text_1": "on", "default": b"?"}))],
        "gaps": [signal(T, "gaps", invalidation_bits=np.arange(len(T)) % 10 == 3)],
        "nan": [signal(np.where(T > 0.5, np.nan, T), "nan")],
        "same": [signal(T, "speed", unit="1/min")], "other": [signal(-T, "speed", unit="km/h")],
        "odd": [signal(T, "Öltemperatur µ [x]", unit="°C"), signal(T, "force", unit="Vlt")],
    }, compression=2)
    return Recording.read(folder / "run.mf4", {k: k for k in (
        "lin", "rat", "alg", "gear", "gaps", "nan", "Öltemperatur µ [x]", "force")} | {
        "motor": "same/speed", "car": "o?her/speed"})


def test_conversions(measured: Recording) -> None:
    counts = np.arange(len(T), dtype=float)
    np.testing.assert_allclose(measured["lin"].values, 0.5 * counts - 3)
    np.testing.assert_allclose(measured["rat"].values, (2 * counts + 1) / 4)
    np.testing.assert_allclose(measured["alg"].values, 2 * np.sqrt(counts) + counts**2 / 8)
    np.testing.assert_array_equal(measured["gear"].values, counts % 2)
    np.testing.assert_allclose(measured["lin"].time, T, atol=1e-12)


def test_missing_samples_are_missing(measured: Recording) -> None:
    gaps = measured["gaps"].values
    np.testing.assert_array_equal(np.isnan(gaps), np.arange(len(T)) % 10 == 3)
    np.testing.assert_array_equal(gaps[~np.isnan(gaps)], T[~np.isnan(gaps)])
    np.testing.assert_array_equal(np.isnan(measured["nan"].values), T > 0.5)
    with pytest.raises(errors.BadRecording, match=r"sample 4 .* is missing \(NaN\)"):
        measured.as_input("gaps")


def test_names_and_units(measured: Recording) -> None:
    assert measured["Öltemperatur µ [x]"].unit == "degC"
    assert (measured["motor"].unit, measured["car"].unit) == ("1/min", "km/h")
    np.testing.assert_array_equal(measured["car"].values, -T)
    with pytest.raises(errors.BadUnit, match="Did you mean 'volt'"):
        measured.as_output("force", "V")


@pytest.mark.parametrize(("name", "told"), [
    ("bad", "the samples of 'hostile/bad' cannot be read"), ("label", "holds text or bytes"),
    ("back", "goes back"), ("empty", "needs|no usable|0 usable|no numeric")])
def test_channels_that_cannot_be_used(tmp_path: Path, name: str, told: str) -> None:
    from asammdf.blocks.conversion_utils import from_dict

    mark = tmp_path / "mark"
    benches.mdf(tmp_path / "run.mf4", {
        "hostile": [signal(T, "bad", conversion=from_dict(
            {"formula": f"__import__('pathlib').Path('{mark}').touch() or X"}))],
        "words": [signal(np.array([b"a", b"b"] * (len(T) // 2)), "label", encoding="utf-8")],
        "back": [signal(T, "back", t=np.where(T == 0.5, 0.2, T))],
        "empty": [signal(np.array([]), "empty", t=np.array([]))]})
    with pytest.raises(errors.PikanidError, match=told):
        Recording.read(tmp_path / "run.mf4", {"y": name}).as_output("y")
    assert not mark.exists()


def test_mdf_3(tmp_path: Path) -> None:
    from asammdf import MDF
    from asammdf.blocks.conversion_utils import from_dict

    counts = np.arange(len(T)).astype("u2")
    with MDF(version="3.30") as file:
        file.append([signal(T, "y", unit="Nm"), signal(counts, "k", conversion=from_dict(
            {"formula": "X1*2 + sqrt(X1)"}))])
        file.append([signal(T[::5], "u", t=T[::5], unit="V")])
        file.save(tmp_path / "run.mdf", overwrite=True)
    rec = Recording.read(tmp_path / "run.mdf")
    np.testing.assert_allclose(rec["k"].values, 2.0 * counts + np.sqrt(counts))
    np.testing.assert_allclose(rec["u"].time, T[::5], atol=1e-12)
    np.testing.assert_array_equal(rec["y"].values, T)
    assert rec["y"].unit == "N*m"


def test_a_file_without_channels(tmp_path: Path) -> None:
    benches.mdf(tmp_path / "run.mf4", {})
    with pytest.raises(errors.BadRecording, match="holds no signals"):
        Recording.read(tmp_path / "run.mf4")
