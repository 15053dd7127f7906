"""The result type: numbers, printing, files, tables; and that files of strangers do no harm."""

from __future__ import annotations

import dataclasses
import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t as student

import pikanid as pk
from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.estimate.rounding import rounded
from pikanid.model import systems
from pikanid.recording import excitation

SIGMA = 0.1 * np.pi / 180
MODEL = systems.sloshing().with_initial(theta="free").per_recording("d_theta")


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    """Two recordings, a damping and a start each; one recording has a column too many."""
    truth = systems.sloshing()
    a = pk.simulate(truth, excitation.two_pulse(), sigma=SIGMA, seed=0)
    b = pk.simulate(truth.with_values(d_theta=0.2), excitation.two_pulse(), sigma=SIGMA, seed=1)
    b = b.with_channels(dataclasses.replace(b["u_x"], name="spare"))
    return pk.NLS(starts=1).fit(MODEL, [a, b])


def test_values_by_name_and_recording(estimate: Estimate) -> None:
    assert estimate.value("l_theta") == estimate.theta[0]
    assert estimate.value("d_theta") == estimate.value("d_theta", 0)
    assert estimate.value("d_theta", 1) != estimate.value("d_theta", 0)
    assert estimate.value("m") == 0.30
    assert estimate.std("m") == 0
    assert estimate.std("d_theta", 1) == np.sqrt(
        estimate.covariance[estimate.index("d_theta", 1), estimate.index("d_theta", 1)])
    for wrong in (lambda: estimate.value("mass"), lambda: estimate.std("mass"),
                  lambda: estimate.value("d_theta", 2), lambda: estimate.interval("mass")):
        with pytest.raises(errors.BadModel):
            wrong()


def test_interval_is_students(estimate: Estimate) -> None:
    low, high = estimate.interval("d_theta", 0.9, 1)
    half = student.ppf(0.95, 1002 - 5) * estimate.std("d_theta", 1)
    assert (low + high) / 2 == pytest.approx(estimate.value("d_theta", 1))
    assert (high - low) / 2 == pytest.approx(half)


def test_correlation_is_a_correlation(estimate: Estimate) -> None:
    np.testing.assert_allclose(np.diag(estimate.correlation), 1)
    assert np.all(np.abs(estimate.correlation) <= 1 + 1e-12)
    np.testing.assert_allclose(estimate.correlation, estimate.correlation.T)


def test_fits_and_trajectories_are_those_of_the_estimate(estimate: Estimate) -> None:
    assert [f.recording for f in estimate.fits] == [t for t in ("two-pulse", "two-pulse")]
    assert estimate.n == 1002
    for fit, trajectory in zip(estimate.fits, estimate.trajectories, strict=True):
        np.testing.assert_allclose(fit.fitted, np.interp(fit.t, trajectory.t, trajectory.x[:, 0]),
                                   atol=1e-12)
        assert fit.rmse == pytest.approx(SIGMA, rel=0.15)
        assert trajectory.x.shape == (len(trajectory.t), 2)
    assert estimate.cost == pytest.approx(
        0.5 * sum(np.sum(f.residual**2) for f in estimate.fits))
    assert estimate.rmse == pytest.approx(np.sqrt(2 * estimate.cost / 1002))


def test_fitted_model_simulates_the_fit(estimate: Estimate) -> None:
    again = pk.simulate(estimate.fitted_model, excitation.two_pulse())
    fit = estimate.fits[0]
    # a fit integrates as exactly as its noise asks, `simulate` as exactly as the signal does
    np.testing.assert_allclose(again["theta"].values, fit.fitted, rtol=0,
                               atol=0.01 * fit.sigma.min() / np.sqrt(len(fit.fitted)))


def test_good_is_what_converged_and_is_no_misfit(estimate: Estimate) -> None:
    assert estimate.ok and estimate.converged
    misfit = dataclasses.replace(estimate.adequacy, verdict="misfit", value=9.0 * estimate.n)
    assert not dataclasses.replace(estimate, adequacy=misfit).ok
    assert not dataclasses.replace(estimate, converged=False).ok
    ratio = np.sqrt(9.0 * estimate.n / misfit.dof)
    assert f"{ratio:.3g} times the stated noise" in dataclasses.replace(
        estimate, adequacy=misfit).sentence()


def test_prints_everything_that_matters(estimate: Estimate) -> None:
    text = str(estimate)
    assert repr(estimate) == text
    for part in ("nls", "sloshing", "l_theta", "d_theta[0]", "d_theta[1]", "theta_0[1]", "±",
                 "explains", "spare"):
        assert part in text
    html = estimate._repr_html_()
    assert "<table>" in html
    assert "d_theta[1]" in html


def test_tables_and_plain_numbers(estimate: Estimate) -> None:
    frame = estimate.to_frame()
    assert list(frame.index) == [f.label for f in estimate.free]
    assert frame.loc["l_theta", "value"] == estimate.value("l_theta")
    for f in estimate.free:
        row = frame.loc[f.label]
        assert (row["lower"], row["upper"]) == estimate.interval(f.name, recording=f.recording)
        assert (row["value"], row["std"], row["unit"]) == (
            estimate.value(f.name, f.recording), estimate.std(f.name, f.recording), f.unit)
    content = json.loads(json.dumps(estimate.to_dict(), allow_nan=False))
    assert content["schema_version"] == 1
    for key in ("model", "strategy", "parameters", "cost", "chi2", "n", "warnings", "seconds",
                "seed", "version"):
        assert key in content
    assert content["parameters"]["d_theta[1]"] == {
        "value": estimate.value("d_theta", 1), "std": estimate.std("d_theta", 1), "unit": "N*s/m"}


@pytest.mark.parametrize("name", ["fit.json", "fit.json.gz"])
def test_saved_and_loaded_it_is_the_same(estimate: Estimate, name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    estimate.save(path)
    again = Estimate.load(path)
    assert str(again) == str(estimate)
    assert again.to_dict() == estimate.to_dict()
    assert (again.model, again.free, again.adequacy, again.history) == (
        estimate.model, estimate.free, estimate.adequacy, estimate.history)
    np.testing.assert_array_equal(again.theta, estimate.theta)
    np.testing.assert_array_equal(again.covariance, estimate.covariance)
    for a, b in zip(again.fits, estimate.fits, strict=True):
        for field in dataclasses.fields(a):
            np.testing.assert_array_equal(getattr(a, field.name), getattr(b, field.name))
    for a, b in zip(again.trajectories, estimate.trajectories, strict=True):
        np.testing.assert_array_equal(a.x, b.x)
    assert (path.read_bytes()[:2] == b"\x1f\x8b") == name.endswith(".gz")
    assert list(tmp_path.iterdir()) == [path]


def test_unknown_standard_errors_survive_the_file_and_become_null_in_json(tmp_path: Path) -> None:
    """At a bound the standard error is NaN, without influence infinite."""
    recording = pk.simulate(systems.sloshing(), excitation.two_pulse(), sigma=SIGMA, seed=0)
    found = pk.NLS(starts=1).fit(systems.sloshing().with_values(d_theta=0.2).with_bounds(
        d_theta=(0.16, 1)), recording)
    assert np.isnan(found.std("d_theta"))
    assert json.loads(json.dumps(found.to_dict(), allow_nan=False))[
        "parameters"]["d_theta"]["std"] is None
    found.save(tmp_path / "fit.json")
    assert np.isnan(Estimate.load(tmp_path / "fit.json").std("d_theta"))
    assert "d_theta" in str(found)


def test_an_estimate_of_nothing_is_one_too(tmp_path: Path) -> None:
    recording = pk.simulate(systems.sloshing(), excitation.two_pulse(), sigma=SIGMA, seed=0)
    found = pk.NLS().fit(systems.sloshing().fix("l_theta", "d_theta"), recording)
    found.save(tmp_path / "fit.json")
    again = Estimate.load(tmp_path / "fit.json")
    assert again.covariance.shape == (0, 0)
    assert str(again) == str(found)
    assert len(found.to_frame()) == 0


@pytest.mark.parametrize("content", [
    b"", b"{", b"null", b"[]", b"3", b"{}", b'{"pikanid_estimate": 99}', b'{"pikanid_estimate": 1}',
    b"\x1f\x8b\x08", b"\x00\xff" * 20, b'{"pikanid_estimate": 1, "model": {}}'])
def test_files_that_hold_no_estimate(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "fit.json"
    path.write_bytes(content)
    with pytest.raises(errors.PikanidError, match=r"cannot be read|model"):
        Estimate.load(path)


def test_files_cut_or_changed_anywhere(estimate: Estimate, tmp_path: Path) -> None:
    """Whatever is missing or of another kind: one sentence, never a traceback."""
    path = tmp_path / "fit.json"
    estimate.save(path)
    content = json.loads(path.read_text())
    for key in content:
        for other in (None, 3, "text", [], {}):
            changed = {**content, key: other}
            path.write_text(json.dumps(changed))
            try:
                loaded = Estimate.load(path)
            except errors.PikanidError:
                continue
            assert isinstance(loaded, Estimate)
    for cut in (10, 100, len(gzip.compress(json.dumps(content).encode())) // 2):
        path.write_bytes(gzip.compress(json.dumps(content).encode())[:cut])
        with pytest.raises(errors.BadSetting):
            Estimate.load(path)
    with pytest.raises(errors.BadSetting, match="cannot be read"):
        Estimate.load(tmp_path)
    with pytest.raises(errors.BadSetting, match="cannot be read"):
        Estimate.load(tmp_path / "absent.json")


@pytest.mark.parametrize(("value", "std", "expected"), [
    (0.0450123, 0.0000099, "0.0450123 ± 0.0000099"), (12.3456, 0.5, "12.35 ± 0.50"),
    (1234.5, 20.0, "1234 ± 20"), (3.0, 0.0, "3"), (3.0, float("nan"), "3"),
    (3.0, float("inf"), "3"), (1e-9, 1e-11, "1.000e-09 ± 1.0e-11"),
    (2.5e8, 1e5, "2.5000e+08 ± 1.0e+05"), (-0.5, 0.01, "-0.500 ± 0.010"),
    (0.0, 0.1, "0.00 ± 0.10")])
def test_rounding_shows_two_digits_of_the_error(value: float, std: float, expected: str) -> None:
    assert rounded(value, std) == expected


def test_the_band_survives_saving_and_files_without_one_load(tmp_path: Path) -> None:
    recording = pk.simulate(systems.sloshing(), excitation.two_pulse(), sigma=SIGMA, seed=0)
    estimate = pk.NLS().fit(systems.sloshing(), recording)
    path = tmp_path / "fit.json"
    estimate.save(path)
    again = pk.Estimate.load(path)
    assert np.array_equal(again.fits[0].spread, estimate.fits[0].spread)
    older = json.loads(path.read_text())
    del older["fits"][0]["spread"]
    path.write_text(json.dumps(older))
    assert pk.Estimate.load(path).fits[0].spread is None
