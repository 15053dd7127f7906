"""Recordings from and to what other libraries hold: pandas, xarray, nonlinear_benchmarks."""

from __future__ import annotations

import importlib.util
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import pikanid as pk
from pikanid import errors
from pikanid.problem.arguments import one_recording, several
from pikanid.recording import Channel, Recording

T = np.arange(0.0, 1.0, 0.02)


def two_clocks() -> Recording:
    sigma = np.linspace(0.1, 0.2, 20)
    return Recording({
        "θ": Channel("θ", T, np.where(T > 0.9, np.nan, T), "deg", 0.25),
        "u": Channel("u", T[::5], T[::5] ** 2, "m/s^2", hold="first"),
        "z": Channel("z", np.arange(20) / 7, np.arange(20.0), "", sigma)}, "run")


def test_pandas_takes_every_clock_and_gives_a_shared_one_back() -> None:
    rec = two_clocks()
    frame = rec.to_frame()
    assert list(frame.columns) == ["θ", "u", "z"] and frame.index.is_monotonic_increasing
    for name, ch in rec.channels.items():
        np.testing.assert_array_equal(frame.loc[ch.time, name], ch.values)
    one = rec.without("u", "z")
    again = Recording.from_frame(one.to_frame(), units={"θ": "deg"})
    np.testing.assert_array_equal(again["θ"].values, one["θ"].values)
    np.testing.assert_array_equal(again["θ"].time, one["θ"].time)


@pytest.mark.parametrize("header", ["T [degC]", "T"])
@pytest.mark.parametrize("kind", ["named", "dates", "seconds"])
def test_beside_an_index_of_times_a_temperature_is_no_time(header: str, kind: str) -> None:
    import pandas as pd

    index = {"named": pd.Index(T, name="time"), "seconds": pd.to_timedelta(T, unit="s"),
             "dates": pd.Timestamp("2026-01-15") + pd.to_timedelta(T, unit="s")}[kind]
    rec = Recording.from_frame(pd.DataFrame({header: 20.0 + T, "y": -T}, index=index))
    assert rec.names == ("T", "y")
    np.testing.assert_allclose(rec["y"].time, T, atol=1e-9)


def test_beside_numbers_of_rows_a_column_is_the_time() -> None:
    import pandas as pd

    frame = pd.DataFrame({"T [s]": T, "y": -T}, index=np.arange(len(T)) + 7)
    np.testing.assert_array_equal(Recording.from_frame(frame)["y"].time, T)


# --- xarray ----------------------------------------------------------------------------------


def xarray() -> Any:
    return pytest.importorskip("xarray", reason="needs the `xarray` extra")


def test_xarray_there_and_back_is_the_same() -> None:
    xarray()
    rec = two_clocks()
    assert Recording.from_xarray(rec.to_xarray(), name="run") == rec


def test_a_dimension_of_temperatures_is_no_time() -> None:
    xr = xarray()
    data = xr.DataArray(np.outer([1.0, 2.0], T), {
        "T": ("T", [20.0, 30.0], {"units": "degC"}), "time": T}, ["T", "time"], name="y")
    rec = Recording.from_xarray(data)
    assert rec.names == ("y[20.0]", "y[30.0]")
    np.testing.assert_array_equal(rec["y[30.0]"].values, 2 * T)


def test_dates_count_from_the_earliest() -> None:
    xr = xarray()
    start = np.datetime64("2026-01-15T10:00:00", "ns")
    data = xr.Dataset({
        "a": ("time", T, {"units": "Nm"}), "b": ("late", T[:10], {"units": "widgets"}),
        "text": ("time", ["x"] * len(T)), "alone": ((), 3.0)}, {
        "time": start + (1e9 * T).astype("m8[ns]"),
        "late": start + np.timedelta64(500, "ms") + (1e9 * T[:10]).astype("m8[ns]")})
    rec = Recording.from_xarray(data)
    assert rec.names == ("a", "b") and rec["a"].unit == "N*m"
    np.testing.assert_allclose(rec["a"].time, T, atol=1e-9)
    np.testing.assert_allclose(rec["b"].time, 0.5 + T[:10], atol=1e-9)
    assert rec.began == 1768471200.0
    with pytest.raises(errors.BadUnit, match="The unit 'widgets' of channel 'b' is unknown"):
        rec.as_output("b", "m")


def test_labels_of_a_second_dimension_are_signals() -> None:
    xr = xarray()
    both = xr.DataArray(np.stack([T, -T]), {"side": ["left", "right"], "t": 1e3 * T},
                        ["side", "t"], name="force", attrs={"units": "kN"})
    both["t"].attrs["units"] = "ms"
    rec = Recording.from_xarray(both, {"y": "force[right]"})
    np.testing.assert_array_equal(rec["y"].values, -T)
    np.testing.assert_allclose(rec["y"].time, T, atol=1e-12)
    assert rec["y"].unit == "kN" and set(Recording.from_xarray(both).names) == {
        "force[left]", "force[right]"}
    assert Recording.from_xarray(both, {"y": "*left*"}, {"y": "mN"})["y"].unit == "mN"


@pytest.mark.parametrize("wrong", ["no coordinate", "three dimensions", "not rising"])
def test_what_has_no_times_is_told(wrong: str) -> None:
    xr = xarray()
    if wrong == "no coordinate":
        data = xr.DataArray([1.0, 2.0], dims=["t"])
    elif wrong == "three dimensions":
        data = xr.DataArray(np.zeros((2, 2, 2)), {"t": [0, 1]}, ["t", "x", "y"])
    else:
        data = xr.DataArray([1.0, 2.0], {"t": [1.0, 0.0]})
    with pytest.raises(errors.BadRecording, match=r"coordinate of times|goes back"):
        Recording.from_xarray(data, {"y": "y"} if wrong == "not rising" else None)
    with pytest.raises(errors.BadRecording, match="A recording is needed, not a list"):
        Recording.from_xarray([1.0, 2.0])


def test_without_xarray_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(errors.BadSetting, match=r"'pikanid\[xarray\]'"):
        two_clocks().to_xarray()


# --- nonlinear_benchmarks --------------------------------------------------------------------


def benchmark(**more: Any) -> Any:
    return SimpleNamespace(**{"u": T**2, "y": np.stack([T, -T], axis=1), "sampling_time": 0.5,
                              "name": "Tanks", "state_initialization_window_length": 5, **more})


def test_a_benchmark_is_a_recording() -> None:
    rec = Recording.from_benchmark(benchmark(), units={"y2": "V"})
    assert rec.names == ("u", "y1", "y2") and rec.name == "Tanks" and rec["y2"].unit == "V"
    np.testing.assert_allclose(rec["u"].time, 0.5 * np.arange(len(T)))
    np.testing.assert_array_equal(rec["y2"].values, -T)
    assert "first 5 samples" in rec.notes[0]
    named = Recording.from_benchmark(benchmark(), ["pump"], ["upper", "lower"], rate=4.0)
    assert named.names == ("pump", "upper", "lower") and named["pump"].interval == 0.25


@pytest.mark.parametrize(("more", "options", "told"), [
    ({"sampling_time": None}, {}, "does not say its sampling time"),
    ({"sampling_time": "Discrete"}, {}, "does not say its sampling time"),
    ({"sampling_time": 0.0}, {}, "does not say its sampling time"),
    ({}, {"rate": -1.0}, "sampling rate of -1 Hz"), ({}, {"inputs": ["a", "b"]}, "2 names of inp"),
    ({}, {"units": {"w": "V"}}, "units names 'w'"), ({"y": ["a"]}, {}, "are not all numbers"),
    ({"u": np.zeros((2, 2, 2))}, {}, "are not all numbers")])
def test_what_a_benchmark_lacks_is_told(more: Any, options: Any, told: str) -> None:
    with pytest.raises(errors.PikanidError, match=told):
        Recording.from_benchmark(benchmark(**more), **options)
    with pytest.raises(errors.BadRecording, match="A recording is needed, not a int"):
        Recording.from_benchmark(3)


@pytest.mark.skipif(importlib.util.find_spec("nonlinear_benchmarks") is None,
                    reason="nonlinear_benchmarks is not installed")
def test_objects_of_the_real_library() -> None:
    utilities = pytest.importorskip("nonlinear_benchmarks.utilities")
    data = utilities.Input_output_data(T**2, T, sampling_time=0.1, name="real",
                                       state_initialization_window_length=7)
    rec = one_recording(data)
    assert rec.names == ("u", "y") and rec.name == "real" and "first 7 samples" in rec.notes[0]
    (again,) = several(data[3:])
    np.testing.assert_array_equal(again["y"].values, T[3:])


# --- wherever a recording is taken ------------------------------------------------------------


class Benchmark:
    """Iterable over u and y, as the library's own objects are."""

    def __init__(self, rec: Recording) -> None:
        self.u, self.y = rec["u_x"].values, rec["theta"].values
        self.sampling_time, self.name = 0.01, "bench"

    def __iter__(self) -> Any:
        yield from (self.u, self.y)


def test_a_fit_takes_them_all() -> None:
    model = pk.systems.sloshing()
    rec = pk.simulate(model, pk.excitation.two_pulse(duration=2.0), sigma=0.002, seed=1)
    rec = rec.with_sigma(theta=None)
    names = {"u": "u_x", "y": "theta"}
    made = Recording.from_benchmark(Benchmark(rec)).rename(names)
    np.testing.assert_allclose(made["theta"].time, rec["theta"].time, atol=1e-12)
    (one,) = several(Benchmark(rec))
    assert one.names == ("u", "y")
    given = [rec, rec.to_frame()]
    if importlib.util.find_spec("xarray"):
        given.append(rec.to_xarray())
    fits = [pk.NLS(starts=1).fit(model, source) for source in given]
    for fit in fits[1:]:
        np.testing.assert_allclose(fit.theta, fits[0].theta, rtol=1e-9)
