"""In which part of the state, and when, a law acts; in which channels something surely does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.beyond.region import Course, Interval, course
from pikanid.mismatch.catalogue.candidate import Candidate, Channel
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.judge.same_law import Names
from pikanid.mismatch.report.findings import Where
from pikanid.mismatch.report.locate import locate
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel

SIGMA = 0.001
WALL = 0.12


@pytest.fixture(scope="module")
def stopped() -> tuple[Hypothesis, Hypothesis, Site, dict[str, Candidate]]:
    """The nominal fit to a pendulum that meets a wall, and that of the model with the wall."""
    model = pk.systems.sloshing()
    truth = model.with_term("theta_dot", f"-8000*max(theta - {WALL}, 0)")
    recording = pk.simulate(truth, pk.excitation.two_pulse(), sigma=SIGMA, seed=0)
    records = Records((recording,), ({"theta": NoiseModel(SIGMA, 0.0, 0.0, 0.01, "")},), DEFAULTS)
    base = fitted(model, (), records, [{}], 1)
    (site,) = sites(model, (recording,))
    known = {c.key: c for c in candidates((site,))}
    assert base is not None
    best = fitted(model, (known["wall_impact"],), records,
                  [{**base.values, "wall": 0.118, "k_wall": 7000.0}], 1)
    assert best is not None
    return base, best, site, known


def given(*h: Hypothesis, verdict: str = "named") -> Answer:
    return Answer(verdict, h, ())  # type: ignore[arg-type]  # one of the verdicts


def test_a_wall_acts_beyond_it_and_while_it_is_touched(
        stopped: tuple[Hypothesis, Hypothesis, Site, dict[str, Candidate]]) -> None:
    base, best, site, _ = stopped
    where = locate(base, best, given(best), site, None, None)
    (beyond,) = where.region
    theta = base.whitened.records.recordings[0]["theta"]
    assert (beyond.state, beyond.unit, where.channels) == ("theta", "rad", ("dynamics",))
    assert beyond.low == pytest.approx(WALL, rel=0.02)
    assert beyond.high == pytest.approx(np.max(theta.values), abs=4 * SIGMA)
    # what the nominal model leaves is loud far beyond the seconds of contact
    touched = theta.time[theta.values > WALL]
    assert where.time[0][0] == pytest.approx(touched[0], abs=0.05)
    assert where.time[-1][1] == pytest.approx(touched[-1], abs=0.05)
    unsure = locate(base, best, given(best, verdict="unconfirmed"), site, None, None)
    assert unsure.region == () and unsure.time != where.time


@pytest.mark.parametrize("key", ["coulomb_friction", "cubic_stiffness"])
def test_a_law_that_acts_always_has_no_region(
        key: str, stopped: tuple[Hypothesis, Hypothesis, Site, dict[str, Candidate]]) -> None:
    base, _, site, known = stopped
    model = base.model
    h = fitted(model, (known[key],), base.whitened.records, [base.point], 1)
    assert h is not None
    found = course(h, model, known[key])
    assert found is not None and found.intervals(site, 0.05) == ()


def test_the_course_of_a_law_beside_a_further_input() -> None:
    """What an effect reads besides is no input of the nominal model."""
    model = pk.systems.sloshing()
    run = pk.simulate(model, pk.excitation.two_pulse(), sigma=SIGMA, seed=0)
    run = run.with_channels(replace(run["u_x"], name="u_y", values=run["u_x"].values[::-1]))
    records = Records((run,), ({"theta": NoiseModel(SIGMA, 0.0, 0.0, 0.01, "")},), DEFAULTS)
    known = {c.key: c for c in candidates(sites(model, (run,)))}
    h = fitted(model, (known["cross_axis[u_y]"], known["wall_impact"]), records,
               [{"wall": 0.05, "k_wall": 40.0}], 1)
    assert h is not None and len(h.model.input_names) > len(model.input_names)
    found = course(h, model, known["wall_impact"])
    assert found is not None
    np.testing.assert_array_equal(found.acts, found.values["theta"] > h.values["wall"])


def test_what_is_no_force_of_the_instant_has_no_course(
        stopped: tuple[Hypothesis, Hypothesis, Site, dict[str, Candidate]]) -> None:
    base, _, _, known = stopped
    for key in ("hysteresis[bouc_wen]", "input_delay", "sensor_offset", "initial_state"):
        assert course(base, base.model, known[key]) is None


def moving(acts: np.ndarray, **values: np.ndarray) -> Course:
    return Course(np.arange(len(acts)) / 100, acts, values)


def test_the_argument_that_decides_is_the_one_reported(
        stopped: tuple[Hypothesis, Hypothesis, Site, dict[str, Candidate]]) -> None:
    site = stopped[2]
    t = np.arange(3000) / 100
    x, v = np.sin(7 * t) * np.exp(-t / 20), 7 * np.cos(7 * t) * np.exp(-t / 20)
    fast = moving(np.abs(v) > 4, theta=x, theta_dot=v)
    low, high = fast.intervals(site, 0.05)
    assert (low.state, high.state) == ("theta_dot", "theta_dot")
    assert (low.low, low.high) == pytest.approx((v.min(), -4), abs=0.05)
    assert (high.low, high.high) == pytest.approx((4, v.max()), abs=0.05)
    assert str(replace(high, low=4.0, high=6.5)) == "theta_dot from 4 to 6.5 rad/s"
    # no interval of one state tells where both decide, or chance does
    corner = moving((v > 3) & (x > 0.2), theta=x, theta_dot=v)
    assert corner.intervals(site, 0.05) == ()
    chance = moving(np.random.default_rng(0).random(len(t)) < 0.3, theta=x, theta_dot=v)
    assert chance.intervals(site, 0.05) == ()
    # a sign of zero at rest is no region
    rubbing = moving(np.r_[np.zeros(300, bool), np.ones(2700, bool)],
                     theta=np.r_[np.zeros(300), x[300:]], theta_dot=np.r_[np.zeros(300), v[300:]])
    assert rubbing.intervals(site, 0.05) == ()


def test_windows_a_gap_apart_are_several() -> None:
    acts = np.zeros(1000, bool)
    acts[100:150] = acts[160:200] = acts[700:710] = True
    assert moving(acts, theta=np.zeros(1000)).windows(0.5) == ((1.0, 1.99), (7.0, 7.09))
    # without a period neighbouring samples still are one window
    assert moving(acts, theta=np.zeros(1000)).windows(0.0) == (
        (1.0, 1.49), (1.6, 1.99), (7.0, 7.09))


def test_a_long_list_of_windows_is_cut() -> None:
    several = tuple((float(k), k + 0.5) for k in range(9))
    assert Where(("input",), "v", (), several[:2], None).times == "0 to 0.5 s, 1 to 1.5 s"
    assert Where(("input",), "v", (), several, None).times.endswith("5 to 5.5 s, and 3 more")
    assert Where(("input",), "v", (), (), None).times == ""


def effect(known: dict[str, Candidate], *keys: str) -> tuple[Candidate, ...]:
    return tuple(known[k] for k in keys)


@pytest.mark.parametrize(("keys", "channels"), [
    (("coulomb_friction",), ("dynamics",)),
    (("coulomb_friction", "input_dead_zone"), ("dynamics", "input")),
    (("sensor_drift",), ("sensor",)),
])
def test_channels_are_those_of_all_effects(
        keys: tuple[str, ...], channels: tuple[Channel, ...],
        stopped: tuple[Hypothesis, Hypothesis, Site, dict[str, Candidate]]) -> None:
    base, _, site, known = stopped
    h = replace(base, effects=effect(known, *keys))
    where = locate(base, h, given(h), site, None, None, tuple(known.values()))
    assert where.channels == channels
    assert where.channel == (channels[0] if len(channels) == 1 else "several")


def test_twins_in_two_channels_leave_it_undecided_and_in_one_do_not(
        stopped: tuple[Hypothesis, Hypothesis, Site, dict[str, Candidate]]) -> None:
    base, _, site, known = stopped

    def where(key: str, *ids: str) -> tuple[str, ...]:
        h = replace(base, effects=effect(known, key))
        answer = replace(given(h), twins={h.key: {key: Names(ids, ids)}})
        return locate(base, h, answer, site, None, None, tuple(known.values())).channels

    assert where("input_delay", "input_delay", "sensor_delay") == ()
    assert where("hysteresis[bouc_wen]", "hysteresis", "coulomb_friction") == ("dynamics",)


def test_a_set_says_the_channels_that_all_of_it_share(
        stopped: tuple[Hypothesis, Hypothesis, Site, dict[str, Candidate]]) -> None:
    base, _, site, known = stopped
    one = replace(base, effects=effect(known, "coulomb_friction", "input_dead_zone"))
    two = replace(base, effects=effect(known, "quadratic_drag"))

    def channels(verdict: str, *h: Hypothesis) -> tuple[str, ...]:
        return locate(base, h[0], given(*h, verdict=verdict), site, None, None,
                      tuple(known.values())).channels

    assert channels("set", one, two) == ("dynamics",)
    # what is not confirmed decides only where nothing speaks for another channel
    assert channels("unconfirmed", one, two) == ()
    assert channels("unconfirmed", two) == ("dynamics",)


@pytest.mark.parametrize(("formula", "channels"), [
    ("a*u_x*abs(u_x)", ("input",)), ("a*u_x*theta_dot", ()), ("a*theta**2", ("dynamics",))])
def test_a_formula_of_inputs_alone_is_an_inputs_curve(
        formula: str, channels: tuple[str, ...],
        stopped: tuple[Hypothesis, Hypothesis, Site, dict[str, Candidate]]) -> None:
    base, _, site, known = stopped
    law = Candidate((f"symbolic:{formula}",), formula, formula, "dynamics", site, (),
                    lambda m: m.with_term(site.v, "2" + formula[1:]), lambda view: [],
                    known=False)
    h = replace(base, effects=(law,))
    assert locate(base, h, given(h), site, None, None, tuple(known.values())).channels == channels


def test_intervals_are_said_with_their_unit() -> None:
    assert str(Interval("u", -1.0, 2.0, "")) == "u from -1 to 2"


@pytest.mark.slow
def test_a_diagnosis_says_where_a_wall_is() -> None:
    model = pk.systems.sloshing()
    truth = model.with_term("theta_dot", f"-8000*max(theta - {WALL}, 0)")
    seen = [pk.simulate(truth, pk.excitation.planar_moves(10, 15.0, seed=seed), sigma=SIGMA,
                        seed=seed) for seed in (1, 2)]
    where = pk.diagnose(model, *seen, workers=1).to_dict()["where"]
    (beyond,) = where["region"]
    assert (beyond["state"], beyond["unit"]) == ("theta", "rad")
    assert beyond["from"] == pytest.approx(WALL, rel=0.02)
    assert (where["channel"], where["channels"]) == ("dynamics", ["dynamics"])


@pytest.mark.slow
def test_a_diagnosis_says_where_a_drag_of_no_catalogue_acts() -> None:
    model = pk.systems.sloshing()
    truth = model.with_term("theta_dot", "-12*max(theta_dot - 0.8, 0)")
    seen = [pk.simulate(truth, pk.excitation.planar_moves(10, 20.0, seed=seed), sigma=SIGMA,
                        seed=seed) for seed in (1, 2)]
    where = pk.diagnose(model, *seen, workers=1).to_dict()["where"]
    beyond = where["region"][-1]
    assert beyond["state"] == "theta_dot" and beyond["from"] == pytest.approx(0.8, rel=0.05)
    # its formula, a force beyond a dead zone, may begin again where the motion hardly ever was
    rest = where["region"][:-1]
    assert sum(r["to"] - r["from"] for r in rest) < 0.1 * (beyond["to"] - beyond["from"])
