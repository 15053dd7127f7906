"""Accelerations from recorded positions and poses, and gravity in a tilted body's axes.

A motion is often recorded as a position or a pose, while a model is driven by an acceleration.
Differentiating is never done behind the user's back: these functions do it when asked to, and
the recordings they return say how in their notes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from pikanid import errors
from pikanid.formula import units
from pikanid.recording.channel import Array, Channel, check_times, check_values
from pikanid.recording.recording import Recording

Method = Literal["savgol", "spline"]
GRAVITY = 9.81  # definition: [m/s²], as in the sloshing model
QUATERNION = ("qx", "qy", "qz", "qw")
_DEGREE = 4  # numerical: of the polynomials: unbiased up to the 4th derivative of the motion


def derivative(channel: Channel, order: int = 2, method: Method = "spline",
               window: float | None = None, smoothing: float | None = None) -> Channel:
    """The `order`-th time derivative of a recorded signal, at its own sample times.

    Args:
        channel: Without gaps; a position [m] gives an acceleration [m/s²] for order 2.
        order: 1 or 2.
        method: ``"spline"``: the cubic smoothing spline minimising Σ(y-x)² + λ∫ẍ²dt (P. Craven
            and G. Wahba, Numer. Math. 31, 1979), for even and uneven times.  Its ends have no
            acceleration.  ``"savgol"``: local quartic polynomials (A. Savitzky and
            M. J. E. Golay, Anal. Chem. 36, 1964), for even times.
        window: Length of the local polynomials [s]; needed by ``"savgol"``.
        smoothing: λ of the spline; by generalised cross-validation if None.

    Returns:
        A channel of the same name and times, to be held first-order; ``"savgol"`` carries a
        scalar sigma over (as for white noise).

    Raises:
        BadRecording: If times or values are unusable, or too few or too uneven for the method.
        BadSetting: If `order`, `window` or `smoothing` cannot work.

    >>> t = np.linspace(0, 2, 201)
    >>> a = derivative(Channel("x", t, np.sin(3 * t), "m"), method="savgol", window=0.2)
    >>> bool(abs(a.values + 9 * np.sin(3 * t))[10:-10].max() < 0.01), a.unit
    (True, 'm/s^2')
    """
    check_times(channel, channel.name)
    check_values(channel, channel.name, missing_allowed=False)
    if order not in (1, 2):
        raise errors.BadSetting(errors.derivative_order(order))
    sigma: float | None = None
    if method == "savgol":
        values, gain = _local_polynomials(channel, order, window)
        sigma = channel.sigma * gain if isinstance(channel.sigma, float) else None
    else:
        values = _smoothing_spline(channel, order, smoothing)
    unit = channel.unit and units.product((channel.unit, 1), ("s", -order))
    return replace(channel, values=values, unit=unit, sigma=sigma, hold="first")


def _smoothing_spline(channel: Channel, order: int, smoothing: float | None) -> Array:
    from scipy.interpolate import make_smoothing_spline

    if len(channel) < 5:
        raise errors.BadRecording(errors.derivative_short(channel.name, len(channel), 5))
    if smoothing is not None and not 0 <= smoothing < np.inf:
        raise errors.BadSetting(errors.bad_smoothing(smoothing))
    # In units of samples and of the signal's spread, so that λ is found whatever the units.
    scale = float(np.ptp(channel.values)) or 1.0
    step = channel.interval
    t = (channel.time - channel.time[0]) / step
    y = (channel.values - channel.values[0]) / scale
    lam = None if smoothing is None else smoothing / step**3
    spline = make_smoothing_spline(t, y, lam=lam)
    return np.asarray(spline(t, order) * scale / step**order, dtype=float)


def _local_polynomials(channel: Channel, order: int, window: float | None) -> tuple[Array, float]:
    from scipy.signal import savgol_coeffs, savgol_filter

    if not channel.uniform:
        raise errors.BadRecording(errors.savgol_uneven(channel.name))
    if window is None or not 0 < window < np.inf:
        raise errors.BadSetting(errors.savgol_window(window))
    half = max(round(window / channel.interval / 2), _DEGREE // 2 + 1)
    length = 2 * half + 1
    if len(channel) < length:
        raise errors.BadRecording(errors.derivative_short(channel.name, len(channel), length))
    step = channel.interval
    values = savgol_filter(channel.values, length, _DEGREE, deriv=order, delta=step, mode="interp")
    taps = savgol_coeffs(length, _DEGREE, deriv=order, delta=step)
    return np.asarray(values, dtype=float), float(np.sqrt(np.sum(np.asarray(taps) ** 2)))


def with_acceleration(recording: Recording, channels: Mapping[str, str], method: Method = "spline",
                      window: float | None = None, smoothing: float | None = None) -> Recording:
    """A recording with accelerations derived from its positions.

    Args:
        recording: With the positions.
        channels: Name of the new acceleration -> name of the position.
        method: As in `derivative`.
        window: As in `derivative`.
        smoothing: As in `derivative`.

    >>> t = np.linspace(0, 1, 101)
    >>> rec = Recording.from_arrays(t, {"x": t**2}, {"x": "m"})
    >>> with_acceleration(rec, {"u_x": "x"}, "savgol", 0.1)["u_x"].values[50].round(6)
    np.float64(2.0)
    """
    how = f"local quartics over {window:g} s" if window else "a smoothing spline"
    for new, old in channels.items():
        made = replace(derivative(recording[old], 2, method, window, smoothing), name=new)
        recording = replace(
            recording.with_channels(made),
            notes=(*recording.notes, f"Acceleration '{new}' is derived from '{old}' by {how}."))
    return recording


def to_body(vectors: Array, quaternions: Array) -> Array:
    """Vectors given in fixed axes, in the axes of a rotating body: Rᵀ(q) v.

    Args:
        vectors: (N, 3) or (3,).
        quaternions: (N, 4), scalar last (x, y, z, w), of any length but zero; they turn body
            axes into fixed ones.

    Returns:
        (N, 3).

    Raises:
        BadRecording: If a quaternion is zero or not finite.

    >>> quarter = np.array([[0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)]])       # about y
    >>> to_body(np.array([0.0, 0.0, -9.81]), quarter).round(6).tolist()
    [[9.81, 0.0, 0.0]]
    """
    from scipy.spatial.transform import Rotation

    lengths = np.linalg.norm(quaternions, axis=1)
    wrong = np.flatnonzero(~(np.isfinite(lengths) & (lengths > 1e-6)))
    if wrong.size:
        raise errors.BadRecording(errors.bad_quaternion(int(wrong[0]) + 1))
    return np.asarray(Rotation.from_quat(quaternions).inv().apply(vectors), dtype=float).reshape(
        len(quaternions), 3)


def gravity_along_body(recording: Recording, quaternion: Sequence[str] = QUATERNION,
                       names: Sequence[str] = ("g_x", "g_y", "g_z"),
                       g: float = GRAVITY) -> Recording:
    """A recording with the gravity vector in body axes, from the attitude of a tilted pose.

    Upright, (g_x, g_y, g_z) = (0, 0, -g).

    Args:
        recording: With four channels of an attitude quaternion on one time base.
        quaternion: Their names, scalar last.
        names: Of the three new channels [m/s²].
        g: Gravity [m/s²], along the fixed -z axis.

    >>> upright = {"qx": [0, 0], "qy": [0, 0], "qz": [0, 0], "qw": [1, 1]}
    >>> rec = Recording.from_arrays([0, 1], upright)
    >>> gravity_along_body(rec)["g_z"].values.tolist()
    [-9.81, -9.81]
    """
    time, q = _stacked(recording, quaternion)
    return _with_vector(recording, time, to_body(np.array([0.0, 0.0, -g]), q), names)


def acceleration_along_body(recording: Recording, position: Sequence[str] = ("x", "y", "z"),
                            quaternion: Sequence[str] = QUATERNION,
                            names: Sequence[str] = ("u_x", "u_y", "u_z"), method: Method = "spline",
                            window: float | None = None,
                            smoothing: float | None = None) -> Recording:
    """A recording with the acceleration of a pose's origin, in the axes of the moving body.

    Together with `gravity_along_body` this is what drives a liquid in a tilted container: a - g
    in body axes is what an accelerometer on the container shows.

    Args:
        recording: With position [m] and attitude on one time base.
        position: Names of the three position channels.
        quaternion: Names of the four attitude channels, scalar last.
        names: Of the three new channels [m/s²].
        method: As in `derivative`.
        window: As in `derivative`.
        smoothing: As in `derivative`.
    """
    time, q = _stacked(recording, quaternion)
    fixed = [
        derivative(recording[key].converted("m") if recording[key].unit else recording[key], 2,
                   method, window, smoothing)
        for key in position
    ]
    if any(not np.array_equal(ch.time, time) for ch in fixed):
        raise errors.BadRecording(errors.pose_times(recording.name))
    turned = to_body(np.column_stack([ch.values for ch in fixed]), q)
    return _with_vector(recording, time, turned, names)


def attitude_angles(recording: Recording, quaternion: Sequence[str] = QUATERNION,
                    names: Sequence[str] = ("tilt_x", "tilt_y", "heading")) -> Recording:
    """A recording with the angles by which a body's axis leans, and by which it has turned [rad].

    With the body's axis u in fixed axes: tilt_x = atan2(-u_y, u_z) about the fixed x axis, tilt_y =
    atan2(u_x, u_z) about the fixed y axis; heading is the twist about the vertical, 2 atan2(q_z,
    q_w), continued over full turns.

    Args:
        recording: With four channels of an attitude quaternion on one time base.
        quaternion: Their names, scalar last.
        names: Of the three new channels.

    >>> quarter = {"qx": [0, 0.6], "qy": [0, 0], "qz": [0, 0], "qw": [1, 0.8]}     # about x
    >>> attitude_angles(Recording.from_arrays([0, 1], quarter))["tilt_x"].values.round(4).tolist()
    [0.0, 1.287]
    """
    time, q = _stacked(recording, quaternion)
    lean = to_body(np.array([0.0, 0.0, 1.0]), q * [-1.0, -1.0, -1.0, 1.0])
    heading = np.unwrap(2 * np.arctan2(q[:, 2], q[:, 3]))
    angles = (np.arctan2(-lean[:, 1], lean[:, 2]), np.arctan2(lean[:, 0], lean[:, 2]), heading)
    # what is left of an axis that does not turn is rounding
    return recording.with_channels(*(
        Channel(name, time, np.round(angle, 12) + 0.0, "rad", hold="first")
        for name, angle in zip(names, angles, strict=True)))


def _stacked(recording: Recording, names: Sequence[str]) -> tuple[Array, Array]:
    parts = [recording.as_input(key) for key in names]
    if any(not np.array_equal(ch.time, parts[0].time) for ch in parts):
        raise errors.BadRecording(errors.pose_times(recording.name))
    return parts[0].time, np.column_stack([ch.values for ch in parts])


def _with_vector(recording: Recording, time: Array, vectors: Array,
                 names: Sequence[str]) -> Recording:
    return recording.with_channels(
        *(Channel(name, time, vectors[:, k], "m/s^2", hold="first") for k, name in enumerate(names))
    )
