"""What can be wrong with derivatives, noise and excitations."""

from __future__ import annotations

from collections.abc import Sequence

from pikanid.errors.wording import did_you_mean, listed, short


def derivative_order(order: object) -> str:
    return f"Only first and second derivatives can be taken, not order {order!r}."


def derivative_short(name: str, n: int, wanted: int) -> str:
    return f"Channel '{name}' has {n} samples; this derivative needs at least {wanted}."


def no_sigma_to_smooth(name: str) -> str:
    return f"Channel '{name}' has no sigma, which says how smooth it is: give it one."


def savgol_uneven(name: str) -> str:
    return f"Channel '{name}' is not evenly sampled: use method='spline'."


def savgol_window(window: float | None) -> str:
    return f"method='savgol' needs a window in seconds, such as window=0.1, not {window!r}."


def bad_smoothing(smoothing: float) -> str:
    return f"smoothing = {smoothing:g} must be finite and not negative, or None."


def bad_quaternion(sample: int) -> str:
    return f"The attitude quaternion of sample {sample} is zero or not finite."


def pose_times(where: str) -> str:
    return f"'{where}': the channels of the pose do not share one time base."


def nothing_moves(where: str, names: Sequence[str]) -> str:
    return f"'{where}': nothing moves in {listed(names)}."


def signal_short(where: str, name: str, span: float, motion: float) -> str:
    return (f"'{where}': '{name}' lasts {span:.3g} s, and the motion {motion:.3g} s: it must cover "
            "the whole motion.")


def noise_short(name: str, n: int) -> str:
    return (f"Channel '{name}' has only {n} samples to estimate its noise from; give sigma "
            "yourself, with with_sigma or --sigma.")


def noise_none(name: str) -> str:
    return f"Channel '{name}' shows no noise to estimate sigma from; give it yourself."


def bad_grid(duration: float, dt: float) -> str:
    return f"duration = {duration:g} s and dt = {dt:g} s make no grid: both positive, dt smaller."


def pulse_off_grid(start: float, stop: float, dt: float) -> str:
    return (f"A pulse from {start:g} s to {stop:g} s does not start and stop on the grid of "
            f"dt = {dt:g} s: choose a dt that divides both.")


def bad_band(frequencies: Sequence[float], dt: float) -> str:
    return (f"Frequencies {', '.join(f'{f:g}' for f in frequencies) or '(none)'} Hz: they must "
            f"rise and lie between 0 and half the sampling rate, {0.5 / dt:g} Hz.")


def bad_move_bounds(acceleration: float, velocity: float) -> str:
    return (f"A move needs positive bounds, not acceleration = {acceleration:g} m/s^2 and "
            f"velocity = {velocity:g} m/s.")


def move_too_long(distance: float, seconds: float) -> str:
    return (f"A move over {distance:g} m takes {seconds:.3g} s and does not fit: give more "
            "duration, fewer moves, or higher bounds.")


def unknown_excitation(name: str, known: Sequence[str], close: Sequence[str]) -> str:
    return (f"'{short(name, 200)}' is neither an excitation ({listed(known)}) nor a file that "
            f"exists.{did_you_mean(close)}")
