"""Event-exact integration, compiled: Runge-Kutta 8(5,3) steps between switches and events.

The coefficients are those of SciPy's DOP853 (E. Hairer, S. P. Nørsett, G. Wanner, Solving
Ordinary Differential Equations I).  No step crosses a knot of the drive, and every reversal,
sticking, release and contact is located by repeating the step with another length until the guard
vanishes, so that each step sees a smooth right-hand side.
"""

# mypy: disallow-untyped-defs=False
# Numba infers the types of compiled functions from the call.

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.integrate import DOP853

from pikanid.storage.jit import cached_jit
from pikanid.validation.concealed import equations as eq
from pikanid.validation.concealed import tank_equations

STAGES = int(DOP853.n_stages)
A, B, C = np.array(DOP853.A[:STAGES, :STAGES]), np.array(DOP853.B), np.array(DOP853.C[:STAGES])
E3, E5 = np.array(DOP853.E3[:STAGES]), np.array(DOP853.E5[:STAGES])
# Many coefficients are zero: for each stage the earlier ones that count, and those of the result.
USED = np.array([len(np.flatnonzero(row)) for row in A])
PLACES = np.array([np.r_[np.flatnonzero(row), np.zeros(STAGES - k, int)]
                   for row, k in zip(A, USED, strict=True)])
FINAL = np.flatnonzero((B != 0) | (E3 != 0) | (E5 != 0))  # definition: of the method

RIG, TANK = 0, 1  # definition: numbers of the two systems
# Tolerances of one step; a recording takes some 2000.
ABSOLUTE, RELATIVE = 1e-12, 1e-11  # numerical: as close as sums of 2000 steps stay double precision
MOST_EVENTS = 100_000  # limit: of one recording
MOST_STEPS = 1_000_000  # limit: of one recording

# Discrete state.
SIGN, CONTACT, MEMORY_SIGN, STUCK, HELD, TAUT, SIDE = range(7)  # definition: positions in it
# Guards.
NONE, REVERSAL, WALL, STOP, MEMORY, RELEASE, CABLE, CENTRE = range(8)  # definition: the guards


@njit
def _rhs(kind, t, x, n, row, drive, p, mode, u, dx):
    since = t - drive[row, 0]
    for i in range(4):
        u[i] = drive[row, 1 + i] + drive[row, 5 + i] * since
    stuck = mode[STUCK] + mode[HELD] > 0
    if kind == TANK:
        return tank_equations.rhs(x, u, p, mode[SIGN], stuck, dx)
    return eq.rhs(t, x, n, u, p, mode[SIGN], mode[CONTACT], mode[MEMORY_SIGN], stuck, mode[TAUT],
                  mode[SIDE], dx)


@njit
def _step(kind, t, h, x, n, row, drive, p, mode, u, stages, x_new):
    """One step of length h from (t, x) into x_new; returns the error relative to tolerance."""
    for i in range(STAGES):
        for j in range(n):
            x_new[j] = x[j]
        for place in range(USED[i]):
            k = PLACES[i, place]
            a = h * A[i, k]
            for j in range(n):
                x_new[j] += a * stages[k, j]
        _rhs(kind, t + C[i] * h, x_new, n, row, drive, p, mode, u, stages[i])
    fifth, third = 0.0, 0.0
    for j in range(n):
        change, e5, e3 = 0.0, 0.0, 0.0
        for stage in FINAL:
            change += B[stage] * stages[stage, j]
            e5 += E5[stage] * stages[stage, j]
            e3 += E3[stage] * stages[stage, j]
        x_new[j] = x[j] + h * change
        scale = ABSOLUTE + RELATIVE * max(abs(x[j]), abs(x_new[j]))
        fifth += (e5 / scale) ** 2
        third += (e3 / scale) ** 2
    both = fifth + 0.01 * third
    return abs(h) * fifth / np.sqrt(both * n) if both > 1e-200 else 0.0


@njit
def _limits(kind, p, x):
    """Friction that holds against being pushed up, and down."""
    if kind == TANK:
        return p[1], p[1]
    return eq.friction(p, x[0], 1, 0.0), eq.friction(p, x[0], -1, 0.0)


@njit
def _settle(kind, t, x, n, row, drive, p, mode, u, dx):
    """What a body with θ' = 0 does next: rest, or move which way."""
    x[1] = 0.0
    mode[STUCK], mode[HELD] = 0, 0
    free = _rhs(kind, t, x, n, row, drive, p, mode, u, dx)
    up, down = _limits(kind, p, x)
    if kind == RIG and x[0] >= p[eq.STOP] and free >= 0.0:
        x[0] = p[eq.STOP]
        mode[HELD], mode[SIGN] = 1, 1
    elif up + down > 0.0 and -down <= free <= up:
        mode[STUCK] = 1
    elif free != 0.0:
        mode[SIGN] = 1 if free > 0.0 else -1


@njit
def _guard(which, kind, t, x, n, row, drive, p, mode, u, dx):
    """A function of time that becomes negative where something switches."""
    if which == REVERSAL:
        return mode[SIGN] * x[1]
    if which == WALL:
        return x[0] - p[eq.WALL] if mode[CONTACT] else p[eq.WALL] - x[0]
    if which == STOP:
        return p[eq.STOP] - x[0]
    if which == MEMORY:
        return mode[MEMORY_SIGN] * x[eq.HYSTERESIS]
    if which == CABLE:
        return x[0] - p[eq.CABLE_ANGLE] if mode[TAUT] else p[eq.CABLE_ANGLE] - x[0]
    if which == CENTRE:
        return mode[SIDE] * x[0]
    free = _rhs(kind, t, x, n, row, drive, p, mode, u, dx)
    if mode[HELD]:
        return free
    up, down = _limits(kind, p, x)
    return min(up - free, free + down)


@njit
def _watched(which, kind, p, mode, reverses):
    resting = mode[STUCK] + mode[HELD] > 0
    if which == REVERSAL:
        return reverses and not resting
    if which == RELEASE:
        return resting
    if kind == TANK or resting:
        return False
    if which == WALL:
        return p[eq.WALL_STIFFNESS] > 0.0
    if which == STOP:
        return p[eq.STOP] < 1e8
    if which == CABLE:
        return p[eq.CABLE] != 0.0
    if which == CENTRE:
        return p[eq.ASYMMETRY] != 0.0
    return p[eq.MEMORY] != 0.0


@njit
def _broken(kind, t, x, n, row, drive, p, mode, reverses, but, u, dx):
    """The first guard that (t, x) violates, other than `but`."""
    for which in range(REVERSAL, CENTRE + 1):
        if which != but and _watched(which, kind, p, mode, reverses) and \
                _guard(which, kind, t, x, n, row, drive, p, mode, u, dx) < 0.0:
            return which
    return NONE


@njit
def _locate(which, kind, t, h, x, n, row, drive, p, mode, u, stages, x_new, dx):
    """Length of the step at whose end a guard has just become negative (Illinois method)."""
    low, high = 0.0, h
    g_low = _guard(which, kind, t, x, n, row, drive, p, mode, u, dx)
    g_high = _guard(which, kind, t + h, x_new, n, row, drive, p, mode, u, dx)
    if g_low <= 0.0:  # starts on the surface: find a step that has left it on the right side
        trial = 0.5 * h
        for _ in range(40):
            _step(kind, t, trial, x, n, row, drive, p, mode, u, stages, x_new)
            g = _guard(which, kind, t + trial, x_new, n, row, drive, p, mode, u, dx)
            if g > 0.0:
                low, g_low = trial, g
                break
            high, g_high = trial, g
            trial *= 0.5
        if low == 0.0:
            return 0.0
    side = 0
    for _ in range(60):
        if high - low <= 1e-14 + 4e-16 * t:
            break
        trial = 0.5 * (low + high)
        if g_low - g_high > 1e-200:
            secant = (low * g_high - high * g_low) / (g_high - g_low)
            trial = secant if low < secant < high else trial
        _step(kind, t, trial, x, n, row, drive, p, mode, u, stages, x_new)
        g = _guard(which, kind, t + trial, x_new, n, row, drive, p, mode, u, dx)
        if g < 0.0:
            high, g_high = trial, g
            if side == -1:
                g_low *= 0.5
            side = -1
            if g > -1e-15:
                break
        else:
            low, g_low = trial, g
            if side == 1:
                g_high *= 0.5
            side = 1
            if g == 0.0:
                high = trial
                break
    return high


@njit
def _switch(which, kind, t, x, n, row, drive, p, mode, u, dx):
    if which == WALL:
        mode[CONTACT] = 1 - mode[CONTACT]
    elif which == MEMORY:
        mode[MEMORY_SIGN] = -mode[MEMORY_SIGN]
    elif which == CABLE:
        mode[TAUT] = 1 - mode[TAUT]
    elif which == CENTRE:
        mode[SIDE] = -mode[SIDE]
    elif which == STOP and x[1] > 1e-7:
        x[0], x[1] = p[eq.STOP], -p[eq.RESTITUTION] * x[1]
        mode[SIGN] = -1
    else:
        _settle(kind, t, x, n, row, drive, p, mode, u, dx)
        if which == RELEASE and mode[STUCK] + mode[HELD] > 0:
            # Exactly on the limit, which the last bits put on the wrong side: it does let go.
            free = _rhs(kind, t, x, n, row, drive, p, mode, u, dx)
            mode[SIGN] = 1 if free > 0.0 and mode[STUCK] else -1
            mode[STUCK], mode[HELD] = 0, 0


@cached_jit()
def integrate(kind, p, drive, stops, segments, x0, reverses, states):
    """Integrate from stops[0] through all stops.

    Args: kind RIG or TANK; p its settings; drive (K, 9): knot [s], four values at the knot,
    four slopes; stops (M,) rising [s]; segments (M,) row of `drive` that holds up to each
    stop; x0 (n,); `reverses`: whether θ' = 0 is an event; states (M, n) result.

    Returns the number of events, or -1 where events or steps do not end or the state is not
    finite.
    """
    n = len(x0)
    x, x_new, u, dx = x0.copy(), np.empty(n), np.empty(4), np.empty(n)
    stages = np.empty((STAGES, n))
    mode = np.zeros(7, dtype=np.int64)
    mode[SIGN], mode[MEMORY_SIGN], mode[SIDE] = 1, 1, 1
    t, h_next, events, steps = stops[0], np.inf, 0, 0
    states[0] = x
    for m in range(1, len(stops)):
        row = segments[m]
        if reverses and x[1] == 0.0:
            _settle(kind, t, x, n, row, drive, p, mode, u, dx)
        while t < stops[m]:
            left = stops[m] - t
            h = min(h_next, left)
            error = _step(kind, t, h, x, n, row, drive, p, mode, u, stages, x_new)
            steps += 1
            if not error <= 1.0:
                if h < 1e-15 or error != error or steps > MOST_STEPS:
                    return -1
                h_next = h * max(0.2, 0.9 * error ** (-1.0 / 8.0))
                continue
            grow = 5.0 if error < 1e-6 else min(5.0, 0.9 * error ** (-1.0 / 8.0))
            h_next = max(h * grow, h_next if h == left else 0.0)
            broken = _broken(kind, t + h, x_new, n, row, drive, p, mode, reverses, NONE, u, dx)
            if broken == NONE:
                t = stops[m] if h == left else t + h
                x[:] = x_new
                continue
            for _ in range(4):  # two guards may meet: do not pass the turn to and fro for ever
                h = _locate(broken, kind, t, h, x, n, row, drive, p, mode, u, stages, x_new, dx)
                _step(kind, t, h, x, n, row, drive, p, mode, u, stages, x_new)
                earlier = _broken(
                    kind, t + h, x_new, n, row, drive, p, mode, reverses, broken, u, dx)
                if earlier == NONE or h == 0.0:
                    break
                broken = earlier
            events += 1
            if events > MOST_EVENTS:
                return -1
            t += h
            x[:] = x_new
            if broken == REVERSAL and h == 0.0:
                mode[SIGN] = -mode[SIGN]
            else:
                _switch(broken, kind, t, x, n, row, drive, p, mode, u, dx)
        states[m] = x
    return events
