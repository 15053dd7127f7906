"""Every law of no catalogue against SciPy, with its equation written a second time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from concealing import push, still
from scipy.integrate import solve_ivp

from pikanid.validation.concealed.effect import Scales
from pikanid.validation.concealed.effects import (
    IDS,
    NEAR,
    OUTSIDE,
    UNFORESEEN,
)
from pikanid.validation.concealed.excitations import two_pulse
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured, motion

LENGTH, GRAVITY, RATE = 0.045, 9.81, 0.15 / 0.30  # RATE is d/m
LAWS = {law.id: law for law in UNFORESEEN}
COVERED: set[str] = set()
State = np.ndarray
Signs = Sequence[float]


@dataclass(frozen=True)
class Law:
    """θ'' of Eq. (6) and what is added to it; the zero of each guard switches a sign of its own."""

    force: Callable[[float, State, float, Signs], float] = lambda t, x, u, s: 0.0
    rates: Callable[[float, State, float, Signs], list[float]] = lambda t, x, u, s: []
    guards: tuple[Callable[[State], float], ...] = ()
    gravity: Callable[[float], float] = lambda t: GRAVITY
    damping: Callable[[float], float] = lambda t: RATE
    states: int = 2

    def rhs(self, t: float, x: State, u: float, signs: Signs) -> list[float]:
        smooth = (u / LENGTH * np.cos(x[0]) - self.gravity(t) / LENGTH * np.sin(x[0])
                  - self.damping(t) * x[1] * np.cos(x[0]) ** 2)
        return [x[1], smooth + self.force(t, x, u, signs), *self.rates(t, x, u, signs)]


def solved(law: Law, e: Experiment, at: np.ndarray | None = None) -> np.ndarray:
    """θ at times, by DOP853 from knot to knot of the drive and from event to event."""
    at = e.t if at is None else at
    cuts = [0, *(np.flatnonzero(np.diff(e.u_x)) + 1).tolist(), len(e.t) - 1]
    x, theta = np.zeros(law.states), np.zeros(len(at))
    for first, last in pairwise(cuts):
        t, u = float(e.t[first]), float(e.u_x[first])
        while t < e.t[last] - 1e-13:
            # Which side a guard at zero goes to: where a tiny step with either sign leads.
            ahead = x + 1e-7 * np.array(law.rhs(t, x, u, [0.0] * len(law.guards)))
            ahead[0] += 0.5e-14 * law.rhs(t, x, u, [0.0] * len(law.guards))[1]
            signs = [float(np.sign(g(ahead)) or 1.0) for g in law.guards]

            def slides(t: float, x: State, u: float = u, signs: Signs = signs) -> list[float]:
                return law.rhs(t, x, u, signs)

            events = [_event(g, s) for g, s in zip(law.guards, signs, strict=True)]
            begun = t
            done = solve_ivp(slides, (t, e.t[last]), x, method="DOP853", rtol=1e-12, atol=1e-13,
                             events=events or None, dense_output=True)
            x, t = done.y[:, -1], float(done.t[-1])
            inside = (at >= begun - 1e-12) & (at <= t + 1e-12)
            theta[inside] = done.sol(np.clip(at[inside], begun, t))[0]
    return theta


def _event(guard: Callable[[State], float], sign: float) -> Callable[[float, State], float]:
    def leaves(t: float, x: State) -> float:
        # Just beyond the surface, so that it is not met again where it was just left.
        return sign * guard(x) + 1e-13

    leaves.terminal, leaves.direction = True, -1  # type: ignore[attr-defined]
    return leaves


def bristles(c: float, give: float, rise: float, speed: float) -> Law:
    def bend(t: float, x: State, u: float, s: Signs) -> list[float]:
        holds = 1 + rise * np.exp(-((x[1] / speed) ** 2))
        return [(x[1] - s[0] * x[1] * x[2] / holds) / give]

    return Law(lambda t, x, u, s: -c * x[2], bend, (lambda x: x[1],), states=3)


CASES: list[tuple[str, dict[str, float], Law]] = [
    ("smooth_friction", {"c": 1.5, "width": 0.015},
     Law(lambda t, x, u, s: -1.5 * np.tanh(x[1] / 0.015))),
    ("stick_slip_friction", {"c": 1.5, "give": 0.006, "rise": 0.8, "speed": 0.2},
     bristles(1.5, 0.006, 0.8, 0.2)),
    ("position_friction", {"c": 60.0},
     Law(lambda t, x, u, s: -60 * x[0] ** 2 * s[0], guards=(lambda x: x[1],))),
    ("cogging", {"a": 1.2, "m": 45.0, "phi": 0.7},
     Law(lambda t, x, u, s: -1.2 * (np.sin(45 * x[0] + 0.7) - np.sin(0.7)))),
    ("cable_drag", {"k": 700.0, "theta_c": 0.06},
     Law(lambda t, x, u, s: -700 * (x[0] - 0.06) ** 2 * (s[0] > 0),
         guards=(lambda x: x[0] - 0.06,))),
    ("magnet", {"a": 6.0, "width": 0.03},
     Law(lambda t, x, u, s: -6 * (x[0] / 0.03) / (1 + (x[0] / 0.03) ** 2) ** 2)),
    ("asymmetric_spring", {"kappa": -35.0},
     Law(lambda t, x, u, s: 35 * s[0] * x[0], guards=(lambda x: x[0],))),
    ("parametric_excitation", {"epsilon": 0.1, "rate": 29.0},
     Law(gravity=lambda t: GRAVITY * (1 + 0.1 * np.sin(29 * t)))),
    ("fluid_memory", {"kappa": 6.0, "tau": 0.08},
     Law(lambda t, x, u, s: -6 * (x[1] - x[2]), lambda t, x, u, s: [(x[1] - x[2]) / 0.08],
         states=3)),
    ("warming_damping", {"a": 2.0, "tau": 1.5},
     Law(damping=lambda t: RATE * (1 + 2 * np.exp(-t / 1.5)))),
    ("platform_tilt", {"kappa": -0.08},
     Law(lambda t, x, u, s: GRAVITY * np.sin(-0.08 * x[2]) / LENGTH * np.cos(x[0]),
         lambda t, x, u, s: [x[3], u], states=4)),
    ("quadratic_input", {"kappa": 0.3},
     Law(lambda t, x, u, s: 0.3 * u**2 / LENGTH * np.cos(x[0]))),
]
COVERED.update(name for name, _, _ in CASES)


@pytest.mark.parametrize(("name", "values", "law"), CASES, ids=[name for name, _, _ in CASES])
def test_motion_agrees_to_1e_8(name: str, values: Mapping[str, float], law: Law) -> None:
    e = two_pulse()
    found, nominal = measured(LAWS[name].applied(Rig(), values), e), measured(Rig(), e)
    assert np.max(np.abs(found - nominal)) > 1e-3  # it does something
    assert np.max(np.abs(found - solved(law, e))) < 1e-8


def test_friction_that_grows_with_the_angle_holds_there() -> None:
    """At 0.1 rad gravity pulls with 21.76 rad/s²; friction holds up to c/100."""
    held = motion(Rig(position_friction=2250.0, start_angle=0.1), still(1.0), still(1.0).t)
    assert np.all(held[:, 0] == 0.1)
    slides = motion(Rig(position_friction=2100.0, start_angle=0.1), still(1.0), still(1.0).t)
    assert slides[-1, 0] < 0.1 - 1e-3


def test_a_rig_in_a_detent_rests_where_the_forces_balance() -> None:
    rig = Rig(bias=8.0, cogging=2.0, cogging_pitch=60.0, cogging_phase=0.4, cable=300.0,
              cable_angle=0.02, magnet=3.0, magnet_width=0.05, asymmetry=20.0)
    theta = measured(rig, still(2.0))
    at = theta[0]
    balance = (8.0 - GRAVITY / LENGTH * np.sin(at) - 2 * (np.sin(60 * at + 0.4) - np.sin(0.4))
               - 300 * max(at - 0.02, 0.0) ** 2 - 3 * (at / 0.05) / (1 + (at / 0.05) ** 2) ** 2
               - 20 * abs(at))
    assert abs(balance) < 1e-9
    assert at > 0.01
    assert theta == pytest.approx(at, abs=1e-10)


# --- sensor ------------------------------------------------------------------------------------


def test_an_eccentric_disc_adds_a_sine_of_the_angle() -> None:
    COVERED.add("eccentric_encoder")
    e, s = two_pulse(), measured(Rig(), two_pulse())
    rig = LAWS["eccentric_encoder"].applied(Rig(), {"a": 0.004, "m": 30.0, "phi": -0.5})
    wanted = s + 0.004 * (np.sin(30 * s - 0.5) + np.sin(0.5))
    assert measured(rig, e) == pytest.approx(wanted, abs=1e-12)


def test_a_trembling_camera_is_seen_at_the_folded_frequency() -> None:
    COVERED.add("aliased_vibration")
    e = still(5.0)
    rig = LAWS["aliased_vibration"].applied(
        Rig(), {"a": 0.01, "rate": 2 * np.pi * 93.0, "phi": 0.3})
    # 93 Hz sampled at 100 Hz is -7 Hz.
    assert measured(rig, e) == pytest.approx(0.01 * np.sin(-14 * np.pi * e.t + 0.3), abs=1e-10)


def test_jitter_moves_the_samples_and_keeps_their_order() -> None:
    COVERED.add("timing_jitter")
    e, size = two_pulse(), 2e-3
    rig = LAWS["timing_jitter"].applied(Rig(), {"std": size, "key": 77.0})
    wrong = np.clip(size * np.random.default_rng(77).standard_normal(len(e.t)), -4.5e-3, 4.5e-3)
    at = np.maximum(e.t + wrong, 0.0)
    assert np.all(np.diff(at) > 0)
    inside = at <= e.t[-1]
    assert measured(rig, e)[inside] == pytest.approx(solved(Law(), e, at)[inside], abs=1e-8)


# --- the list ----------------------------------------------------------------------------------


def test_every_law_has_an_oracle_and_a_name_of_its_own() -> None:
    assert set(LAWS) == COVERED
    assert len(LAWS) == len(UNFORESEEN) == 15
    assert set(LAWS).isdisjoint({*IDS, *(e.id for e in (*NEAR, *OUTSIDE))})
    assert {law.near for law in UNFORESEEN} <= {*IDS, ""}
    assert {law.kind for law in UNFORESEEN if law.near} == {"near"}
    assert {law.kind for law in UNFORESEEN if not law.near} == {"outside"}


def test_every_law_fades_away_with_its_size_and_can_be_gross() -> None:
    e = two_pulse()
    scales, nominal = Scales(0.2, 1.0, 5.0, 14.8), measured(Rig(), two_pulse())
    for law in UNFORESEEN:
        shape = law.drawn(np.random.default_rng(2), scales)
        faint, gross = (float(np.max(np.abs(measured(law.applied(Rig(), shape.sized(share)), e)
                                            - nominal))) for share in (0.0, 0.95))
        assert faint < 1e-3 < 3e-3 < gross, law.id


def test_states_of_one_law_do_not_disturb_another() -> None:
    """Laws with states of their own share the state vector with effects that have some as well."""
    e = push(3.0, lambda t: np.where((t > 0.2) & (t < 0.6), 1.0, 0.0))
    both = Rig(layer=0.02, sensor_lag=0.02, mode_gain=1.0, wake=3.0, tilt=0.02, bristle=0.5)
    for without in ({"layer": 1e-300}, {"mode_gain": 1e-300}, {"bristle": 1e-300},
                    {"wake": 1e-300}, {"tilt": 1e-300}):
        name = next(iter(without))
        idle = measured(both._replace(**without), e)
        assert measured(both._replace(**{name: 0.0}), e) == pytest.approx(idle, abs=1e-9)
