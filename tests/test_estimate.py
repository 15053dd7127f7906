"""The one result type: printing, tables, files."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pikanid as pk
from pikanid import errors
from pikanid.estimate import rounded


@pytest.fixture(scope="module")
def estimate() -> pk.Estimate:
    model = pk.systems.sloshing()
    recording = pk.simulate(model, pk.excitation.two_pulse(), sigma=math.radians(0.1), seed=0)
    return pk.NLS().fit(model.with_values(l_theta=0.06, d_theta=0.05), recording)


def test_values_and_standard_errors(estimate: pk.Estimate) -> None:
    assert estimate.value("l_theta") == estimate.theta[0]
    assert estimate.value("m") == 0.30  # fixed
    assert estimate.std("m") == 0.0
    low, high = estimate.interval("d_theta")
    assert low < 0.15 < high
    assert high - low == pytest.approx(2 * 1.9647 * estimate.std("d_theta"), rel=1e-3)
    with pytest.raises(errors.BadModel, match="l_theta"):
        estimate.value("length")


def test_shows_itself(estimate: pk.Estimate) -> None:
    text = str(estimate)
    assert "l_theta" in text and "±" in text and "explains the recording" in text
    assert "<table>" in estimate._repr_html_()
    frame = estimate.to_frame()
    assert list(frame.columns) == ["value", "std", "lower", "upper", "unit"]
    assert frame.loc["l_theta", "value"] == estimate.theta[0]


def test_dictionary_is_strict_json(estimate: pk.Estimate) -> None:
    content = json.loads(json.dumps(estimate.to_dict(), allow_nan=False))
    for key in ("schema_version", "model", "strategy", "parameters", "cost", "chi2", "n",
                "warnings", "seconds", "seed", "version"):
        assert key in content
    assert content["parameters"]["l_theta"] == {
        "value": estimate.theta[0], "std": estimate.std("l_theta"), "unit": "m"}


@pytest.mark.parametrize("name", ["fit.json", "fit.json.gz"])
def test_comes_back_from_a_file(estimate: pk.Estimate, tmp_path: Path, name: str) -> None:
    estimate.save(tmp_path / name)
    back = pk.Estimate.load(tmp_path / name)
    assert back.model == estimate.model
    assert back.free == estimate.free
    assert back.adequacy == estimate.adequacy
    assert back.to_dict() == estimate.to_dict()
    np.testing.assert_array_equal(back.covariance, estimate.covariance)
    np.testing.assert_array_equal(back.trajectories[0].x, estimate.trajectories[0].x)
    np.testing.assert_array_equal(back.fits[0].residual, estimate.fits[0].residual)
    assert list(tmp_path.iterdir()) == [tmp_path / name]  # no half-written file left


@pytest.mark.parametrize("content", [b"", b"{}", b"\x1f\x8b\x08broken", b"[1, 2]", b"\xff\xfe",
                                     b'{"pikanid_estimate": 1}'])
def test_other_files_are_refused_in_a_sentence(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "fit.json"
    path.write_bytes(content)
    with pytest.raises(errors.PikanidError, match=r"fit\.json"):
        pk.Estimate.load(path)
    with pytest.raises(errors.PikanidError, match="absent"):
        pk.Estimate.load(tmp_path / "absent.json")


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e6))
def test_rounding_keeps_two_digits_of_the_error(value: float, std: float) -> None:
    shown, error = (float(part) for part in rounded(value, std).split(" ± "))
    assert abs(error - std) <= 0.06 * std + 1e-12 or std > 10
    assert abs(shown - value) <= max(std, 1e-6 * abs(value))
