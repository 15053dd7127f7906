"""Odd recordings end in a verdict or in a sentence: never in a foreign exception."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from odd_recordings import odd

import pikanid as pk
from pikanid import errors
from pikanid.mismatch.case import Case
from pikanid.mismatch.data.preparation import EXACT, beginnings, loud_enough
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.detect.remainder import condensed, lines, residual_tests
from pikanid.mismatch.detect.tangent import CELLS, Tangent, directions
from pikanid.mismatch.diagnose import diagnose
from pikanid.mismatch.fitting.decisions import BAND
from pikanid.mismatch.report.diagnosis import Diagnosis
from pikanid.mismatch.search.screen import best_level
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.noise.projection import project
from pikanid.recording import Recording
from pikanid.reporting import strict_json
from pikanid.reporting.diagnosis_page import page

QUICK = (1, 8, 14, 15)  # of the seeds below: each ends within a second
SLOW = 60


def swing(seed: int = 1, seconds: float = 4.0, sigma: float = 0.002, k3: float = 200.0
          ) -> Recording:
    truth = pk.systems.sloshing().with_term(
        "theta_dot", "-k3*theta**3", [pk.Parameter("k3", k3)])
    moves = pk.excitation.planar_moves(max(int(seconds / 2), 1), seconds, seed=seed)
    return pk.simulate(truth, moves, sigma=sigma, seed=seed)


def opened(train: Recording, later: Recording | None = None) -> Case:
    return open_case(pk.systems.sloshing(), (train,), None if later is None else (later,), None,
                   lambda text: None, DEFAULTS)


def told(train: Recording, later: Recording | None) -> Diagnosis | None:
    """The diagnosis, told in every form; None where the recordings are refused."""
    try:
        dx = diagnose(pk.systems.sloshing(), train, later, workers=1)
    except errors.PikanidError as refused:
        assert str(refused).endswith(".") and "\n" not in str(refused)
        return None
    assert page(dx, "odd").endswith("</html>\n") and str(dx)
    assert strict_json.text(dx.to_dict())
    chances = [h.probability for h in dx.hypotheses]
    # what differs by rounding stands in the order of names
    assert all(b < a * (1 + BAND) for a, b in pairwise(chances))
    return dx


@pytest.mark.parametrize("seed", [
    pytest.param(s, marks=() if s in QUICK else pytest.mark.slow) for s in range(SLOW)])
def test_an_odd_recording_is_diagnosed_or_refused(seed: int) -> None:
    train, later, _ = odd(seed)
    told(train, later)


def test_a_diagnosis_says_how_many_samples_it_needs() -> None:
    whole = swing()
    for count in (2, 8, 21):
        needed = 2 + DEFAULTS.noise.freedom
        with pytest.raises(errors.BadRecording, match=f"{count} usable.*at least {needed}"):
            diagnose(pk.systems.sloshing(), whole.window(1.0, 1.0 + 0.01 * count - 0.005))


def test_too_short_a_held_out_recording_proves_nothing() -> None:
    case = opened(swing(), swing(2).window(1.0, 1.045))
    assert not case.proves and case.later is None
    assert "5 usable samples" in case.excuse and "22" in case.excuse


@pytest.mark.parametrize("sigma", [None, 1e-9, 1e-30])
def test_no_noise_is_less_than_a_simulation_can_follow(sigma: float | None) -> None:
    """Neither in recordings without any, nor where a σ is given that nothing measured has."""
    train, later = (swing(seed, sigma=0.0) for seed in (1, 2))
    if sigma is not None:
        train, later = (r.with_sigma(theta=sigma) for r in (train, later))
    case = opened(train, later)
    level = case.records.levels[0]["theta"].sigma
    assert level >= EXACT * np.ptp(train["theta"].values) / 2
    assert np.isfinite(case.base.minimum.chi2) and case.predicted(case.base) is not None
    # what is louder stays as it is
    louder = replace(case.records.levels[0]["theta"], sigma=0.01)
    assert loud_enough(louder, train["theta"]) is louder


def test_levels_that_cannot_be_simulated_are_no_start() -> None:
    """Where no steps are fine enough, nothing is compared: that is no reason to stop."""
    case = opened(swing())
    wall = next(c for c in case.candidates if c.levels)
    hopeless = replace(case.base, whitened=Whitened(case.base.model, replace(
        case.records, levels=({"theta": replace(case.records.levels[0]["theta"], sigma=1e-30)},))))
    start = best_level(hopeless, wall, case.base.point)
    assert start.values.keys() >= {p.name for p in wall.parameters}
    whitened = hopeless.whitened
    assert whitened.chi2(case.base.minimum.theta) == np.inf
    assert whitened.residual(case.base.minimum.theta) is None


def test_a_page_without_edges_is_drawn() -> None:
    """As that of the shortest recording there may be."""
    dx = told(swing().window(1.0, 1.0 + 0.01 * (2 + DEFAULTS.noise.freedom) - 0.005), None)
    assert dx is not None and dx.shape is not None
    bare = replace(dx, shape=replace(dx.shape, edges=()), patch=None)
    assert len(bare.plot().axes) == len(replace(dx, shape=None, patch=None).plot().axes)


def test_long_recordings_are_cut_and_that_is_said() -> None:
    t = np.arange(8 * DEFAULTS.budget.samples) * 0.01
    y = np.random.default_rng(0).standard_normal(len(t))
    long = Recording.from_arrays(t, {"theta": y, "u_x": y}, units={"theta": "rad", "u_x": "m/s^2"})
    notes: list[str] = []
    (cut,) = beginnings(pk.systems.sloshing(), (long,), "the recording", notes, DEFAULTS.budget)
    assert len(cut["theta"].time) == pytest.approx(DEFAULTS.budget.samples, abs=2)
    assert cut.start == long.start
    assert "12 %" in notes[0] and str(len(t)) in notes[0]
    # two of them share what can be diagnosed; what is short stays as it is
    both = beginnings(pk.systems.sloshing(), (long, long), "the recording", [], DEFAULTS.budget)
    assert sum(len(r["theta"].time) for r in both) == pytest.approx(DEFAULTS.budget.samples, abs=4)
    assert beginnings(pk.systems.sloshing(), (cut,), "the recording", [], DEFAULTS.budget) == (cut,)


def test_few_signs_are_followed_at_once_along_a_long_recording(
        monkeypatch: pytest.MonkeyPatch) -> None:
    case = opened(swing(seconds=12.0))
    whitened, theta = case.base.whitened, case.base.minimum.theta
    whole = directions(whitened, theta, case.candidates).D
    sizes = []
    follow = Tangent._columns

    def watched(self: Tangent, listed: list) -> np.ndarray:  # type: ignore[type-arg]  # as it is
        sizes.append(len(listed) * len(self.t))
        return follow(self, listed)

    monkeypatch.setattr(Tangent, "_columns", watched)
    monkeypatch.setattr("pikanid.mismatch.detect.tangent.CELLS", CELLS // 20)
    few = directions(whitened, theta, case.candidates).D
    assert np.array_equal(few, whole) and len(sizes) > 3
    assert max(sizes) <= CELLS // 20


def test_the_signs_of_a_long_recording_are_shortened_one_after_the_other() -> None:
    """All at once they would take gigabytes; what is tested is the same."""
    case = opened(swing())
    h = case.base
    whole, _ = lines(h.whitened, case.rate, 3)
    made: list[int] = []

    def short(rows: np.ndarray) -> np.ndarray:
        made.append(rows.shape[1])
        return condensed(rows, h.whitened.rows, 5)

    bands, inputs = lines(h.whitened, case.rate, 3, short)
    assert made == [*(b.shape[1] for b in whole), inputs.shape[1]]
    assert all(len(b) == -(-h.whitened.rows // 5) + 3 for b in (*bands, inputs))
    h.whitened.records = replace(h.whitened.records, settings=DEFAULTS.with_values(
        {"budget.rows_tested": h.whitened.rows // 5}))
    found = residual_tests(h.whitened, h.minimum.theta, h.minimum.r, h.minimum.J, case.candidates,
                           case.rate)
    assert found.p_value < 1e-6
    # what is left of noise stays noise
    rng = np.random.default_rng(4)
    noise = project(h.minimum.J, rng.standard_normal(h.whitened.rows))
    assert residual_tests(h.whitened, h.minimum.theta, noise, h.minimum.J, case.candidates,
                          case.rate).p_value > 0.01
