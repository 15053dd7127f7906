"""Accelerations derived from positions and poses, and gravity in tilted axes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pikanid.errors import BadRecording, BadSetting
from pikanid.recording import Recording, kinematics
from pikanid.recording.channel import Channel

T = np.arange(0, 3, 0.002)
X = 0.25 * np.sin(2 * np.pi * 1.5 * T) * np.sin(np.pi * T / 3) ** 4  # starts and ends at rest
A = np.gradient(np.gradient(X, T, edge_order=2), T, edge_order=2)


@pytest.mark.parametrize("method", ["spline", "savgol"])
def test_a_commanded_position_gives_its_acceleration(method: kinematics.Method) -> None:
    a = kinematics.derivative(Channel("x", T, X, "mm"), method=method, window=0.04)
    assert a.unit == "mm/s^2"
    np.testing.assert_allclose(a.values[10:-10], A[10:-10], atol=2e-3 * np.max(np.abs(A)))


def test_noise_is_smoothed_away() -> None:
    noisy = X + 1e-4 * np.random.default_rng(0).standard_normal(len(T))
    naive = np.gradient(np.gradient(noisy, T), T)
    smooth = kinematics.derivative(Channel("x", T, noisy))
    inside = slice(50, -50)
    error = np.sqrt(np.mean((smooth.values - A)[inside] ** 2))
    assert error < 0.03 * np.max(np.abs(A))
    assert error < 0.05 * np.sqrt(np.mean((naive - A)[inside] ** 2))


def test_uneven_times_are_for_the_spline() -> None:
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 3, 1500))
    x = Channel("x", t, np.interp(t, T, X))
    a = kinematics.derivative(x)
    np.testing.assert_allclose(
        a.values[50:-50], np.interp(t, T, A)[50:-50], atol=0.05 * np.max(np.abs(A))
    )
    with pytest.raises(BadRecording, match="method='spline'"):
        kinematics.derivative(x, method="savgol", window=0.1)


def test_savgol_carries_sigma_over() -> None:
    rng = np.random.default_rng(0)
    noise = Channel("x", np.arange(20_000) * 0.01, rng.standard_normal(20_000), sigma=1.0)
    a = kinematics.derivative(noise, method="savgol", window=0.2)
    assert np.std(a.values) == pytest.approx(float(np.asarray(a.sigma)), rel=0.05)


def test_scale_does_not_matter() -> None:
    noisy = X + 1e-4 * np.random.default_rng(0).standard_normal(len(T))
    small = kinematics.derivative(Channel("x", T * 1e-3, noisy * 1e-6)).values
    large = kinematics.derivative(Channel("x", T, noisy)).values
    np.testing.assert_allclose(small, large, rtol=1e-3, atol=1e-3 * np.max(np.abs(large)))


def test_settings() -> None:
    x = Channel("x", T, X)
    with pytest.raises(BadSetting, match="order"):
        kinematics.derivative(x, order=3)
    with pytest.raises(BadSetting, match="window"):
        kinematics.derivative(x, method="savgol")
    with pytest.raises(BadSetting, match="smoothing"):
        kinematics.derivative(x, smoothing=-1.0)
    with pytest.raises(BadRecording, match="at least"):
        kinematics.derivative(Channel("x", [0, 1, 2], [0, 1, 0]))  # type: ignore[arg-type]
    with pytest.raises(BadRecording, match="missing"):
        kinematics.derivative(Channel("x", np.arange(9), [0, 1, np.nan, *range(6)]))  # type: ignore[arg-type]


def test_a_recording_says_that_it_was_derived() -> None:
    rec = Recording.from_arrays(T, {"x": X}, {"x": "m"})
    made = kinematics.with_acceleration(rec, {"u_x": "x"})
    assert made["u_x"].unit == "m/s^2"
    assert made["u_x"].hold == "first"
    assert "derived from 'x'" in made.notes[0]


# --- poses ---------------------------------------------------------------------------------------


def pose(angle: np.ndarray, axis: str = "y") -> Recording:
    q = Rotation.from_euler(axis, angle[:, None]).as_quat()
    zero = np.zeros(len(T))
    return Recording.from_arrays(
        T,
        {"x": X, "y": zero, "z": zero, **{k: q[:, i] for i, k in enumerate(kinematics.QUATERNION)}},
        {"x": "m", "y": "m", "z": "m"},
    )


def test_gravity_along_a_tilted_body() -> None:
    tilt = 0.3 * np.sin(T)
    rec = kinematics.gravity_along_body(pose(tilt))
    # Tilted about +y by a, the body's x axis points a below the horizon.
    np.testing.assert_allclose(rec["g_x"].values, 9.81 * np.sin(tilt), atol=1e-12)
    np.testing.assert_allclose(rec["g_y"].values, 0, atol=1e-12)
    np.testing.assert_allclose(rec["g_z"].values, -9.81 * np.cos(tilt), atol=1e-12)


def test_acceleration_along_a_turning_body() -> None:
    turn = np.pi / 2 * np.ones(len(T))
    rec = kinematics.acceleration_along_body(pose(turn, "z"), method="savgol", window=0.04)
    np.testing.assert_allclose(rec["u_y"].values[20:-20], -A[20:-20], atol=5e-3 * np.abs(A).max())
    np.testing.assert_allclose(rec["u_x"].values, 0, atol=1e-9)


def test_what_is_no_attitude() -> None:
    rec = pose(np.zeros(len(T)))
    zero = rec.with_channels(Channel("qw", T, np.zeros(len(T))))
    with pytest.raises(BadRecording, match="zero or not finite"):
        kinematics.gravity_along_body(zero)
    with pytest.raises(BadRecording, match="one time base"):
        kinematics.gravity_along_body(rec.shift("qw", 0.1))


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_attitude_angles_of_a_body_that_turns_about_one_axis(axis: str) -> None:
    angle = 9.0 * T if axis == "z" else 0.4 * np.sin(3 * T)  # headings go beyond a full turn
    q = Rotation.from_euler(axis, angle[:, None]).as_quat()
    pose = dict(zip(kinematics.QUATERNION, q.T, strict=True))
    found = kinematics.attitude_angles(Recording.from_arrays(T, pose))
    for name, about in (("tilt_x", "x"), ("tilt_y", "y"), ("heading", "z")):
        if about == axis:
            np.testing.assert_allclose(found[name].values, angle, atol=1e-10)
        else:
            assert np.ptp(found[name].values) == 0.0  # rounding is no motion
