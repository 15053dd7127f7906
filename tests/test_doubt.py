"""What held-out recordings could have refuted, on hypotheses fitted to simulated ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.loosened import loosened
from pikanid.mismatch.judge.doubt import why_not
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.model.effects_file import from_table
from pikanid.recording import Recording
from pikanid.strategies.nls import NLS

SIGMA = 0.002


@pytest.fixture(scope="module")
def hypotheses() -> tuple[Case, list[Hypothesis]]:
    """A cubic spring, found in a recording; held out, the same system in another motion."""
    case = open_case(pk.systems.sloshing(), (moved(1),), (moved(2),), None,
                     lambda text: None, DEFAULTS)
    effect = next(c for c in case.candidates if c.key == "cubic_stiffness")
    found = fitted(case.model, [effect], case.records, [{"k3": 200.0}], 30)
    assert found is not None
    return case, [found, case.base]


def moved(seed: int, drive: float = 1.0) -> Recording:
    truth = pk.systems.sloshing().with_term(
        "theta_dot", "-k3*theta**3", [pk.Parameter("k3", 200.0)])
    moves = pk.excitation.planar_moves(4, 6.0, seed=seed)
    moves = moves.with_channels(*(replace(moves[n], values=drive * moves[n].values)
                                  for n in moves.names))
    return pk.simulate(truth, moves, sigma=SIGMA, seed=seed)


def doubt(case: Case, ranked: list[Hypothesis], later: Recording) -> tuple[str, float]:
    held = replace(case.records, recordings=(later,))
    other = replace(case, later=held, predictions={})
    predicted = other.predicted(case.base)
    assert predicted is not None
    said = why_not(ranked[0], replace(other.evidence(ranked), scale=1.0))
    return said, predicted.motion


def test_another_motion_proves_a_spring(hypotheses: tuple[Case, list[Hypothesis]]) -> None:
    said, motion = doubt(*hypotheses, moved(2))
    assert said == "" and motion > 1e5


@pytest.mark.parametrize("guess", [0.05, 0.01, 0.0])
def test_what_a_parameter_would_do_past_its_bound_is_no_effect(guess: float) -> None:
    """A push beside a damping that its bound keeps from pushing, whatever its guess; a spring
    beside the same.
    """
    push, = from_table({"push": {
        "parameters": {"q": {"unit": "1/s", "guess": 0.1, "bounds": [0, 9]}},
        "add": {"x_dot": "q*x_dot"}, "null": {"q": 0}}}, "test")
    nominal = pk.systems.linear_oscillator().with_candidates(push)
    asked = nominal.with_values({"zeta": guess})

    def judged(pushed: float, k3: float, key: str, start: Mapping[str, float]) -> str:
        truth = nominal.with_term("x_dot", "pushed*x_dot - k3*x**3", [
            pk.Parameter("pushed", pushed), pk.Parameter("k3", k3)])
        train, later = (pk.simulate(truth, blows(seed), sigma=SIGMA, seed=seed) for seed in (1, 2))
        case = open_case(asked, (train,), (later,), None, lambda text: None, DEFAULTS)
        effect = next(c for c in case.candidates if c.key == key)
        found = fitted(case.model, [effect], case.records, [start], 30)
        assert found is not None and case.base.values["zeta"] < 1e-6
        return why_not(found, replace(case.evidence([found, case.base]), scale=1.0))

    said = judged(0.8, 0.0, "push", {"q": 0.1})
    assert said == "a parameter past its bound would explain as much as push does"
    assert judged(0.63, 10.0, "cubic_stiffness", {"k3": 1.0}) == ""


@pytest.mark.parametrize("order", [1, -1])
def test_each_recording_s_own_parameter_passes_its_own_bound(order: int) -> None:
    """Below the lower one in one recording, beyond the upper one in the other."""
    usual = pk.systems.linear_oscillator()
    nominal = usual.replace(parameters=tuple(
        replace(p, scope="recording", bounds=(0.0, 0.8)) if p.name == "zeta" else p
        for p in usual.parameters))
    free = usual.replace(parameters=tuple(
        replace(p, bounds=(-2.0, 2.0)) if p.name == "zeta" else p for p in usual.parameters))
    runs = tuple(pk.simulate(free.with_values({"zeta": zeta}), blows(k), sigma=SIGMA, seed=k)
                 for k, zeta in enumerate((-0.02, 0.9)))
    base = open_case(nominal, runs[::order], None, None, lambda text: None, DEFAULTS).base
    past = loosened(base, base)
    assert past is not None and base.minimum.chi2 > 2 * base.whitened.rows
    assert past == pytest.approx(base.whitened.rows, rel=0.15)


def test_what_no_bound_holds_is_not_loosened(hypotheses: tuple[Case, list[Hypothesis]]) -> None:
    _, (spring, base) = hypotheses
    assert not base.pinned and loosened(base, spring) is None


def test_a_size_that_may_be_nothing_is_not_sure(
        hypotheses: tuple[Case, list[Hypothesis]], monkeypatch: pytest.MonkeyPatch) -> None:
    """However much it gains: it stands for another effect's parameter that a bound holds without
    it.  Where none is held, the fit without it has said how much it gains, also where that is no
    parabola.
    """
    case, ranked = hypotheses
    monkeypatch.setattr("pikanid.mismatch.judge.doubt.loosened", lambda *asked: None)
    size = ranked[0].values["k3"]
    for error, pinned, sure in ((size / 4.0, True, True), (size / 2.0, True, False),
                                (size / 2.0, False, True)):
        monkeypatch.setattr(Hypothesis, "std", {"k3": error})
        monkeypatch.setattr(Hypothesis, "pinned", pinned)
        said, _ = doubt(case, ranked, moved(2))
        assert sure == (said == "") and sure != ("may be nothing" in said)


def test_a_size_that_may_be_nothing_beside_a_bound_is_not_sure(
        hypotheses: tuple[Case, list[Hypothesis]], monkeypatch: pytest.MonkeyPatch) -> None:
    """A bound holds a parameter of the explanation itself: that is hardly the system's."""
    case, ranked = hypotheses
    size = ranked[0].values["k3"]
    for error, pinned, sure in ((size / 4.0, True, True), (size / 2.0, True, False),
                                (size / 2.0, False, True)):
        monkeypatch.setattr(Hypothesis, "std", {"k3": error})
        monkeypatch.setattr(Hypothesis, "pinned", property(lambda h, p=pinned: p and h.effects))
        said, _ = doubt(case, ranked, moved(2))
        assert sure == (said == "") and sure != ("may be nothing" in said)


def blows(seed: int) -> Recording:
    rng = np.random.default_rng(seed)
    t = np.arange(400) * 0.02
    return Recording.from_arrays(t, {"u": np.repeat(rng.normal(0, 6, 20), 20)}, {"u": "N"})


@pytest.mark.parametrize("more", [(pk.Parameter("b", 1.0, "1/rad"),), ()])
def test_a_formula_that_is_not_determined_is_no_name(
        hypotheses: tuple[Case, list[Hypothesis]], more: tuple[pk.Parameter, ...],
        monkeypatch: pytest.MonkeyPatch) -> None:
    """Two parameters that go together may fit as well wherever they are; of one nobody has said
    that the law is another one where it is nothing.
    """
    case, ranked = hypotheses
    (effect,) = ranked[0].effects
    formula = replace(effect, ids=("symbolic:a*tanh(b*theta)",), known=False, name="a law",
                      parameters=(*effect.parameters, *more))
    found = [replace(ranked[0], effects=(formula,)), ranked[1]]
    size = found[0].values["k3"]
    for error, sure in ((size / 4.0, True), (4.0 * size, False)):
        monkeypatch.setattr(Hypothesis, "std", {"k3": error, "b": 0.1})
        said, _ = doubt(case, found, moved(2))
        assert sure == (said == "") and sure != ("does not determine k3" in said)


def test_what_is_at_rest_or_short_proves_nothing(
        hypotheses: tuple[Case, list[Hypothesis]]) -> None:
    for later in (moved(2, 0.0), moved(2).window(0.0, 0.045)):
        said, motion = doubt(*hypotheses, later)
        assert "could not have refuted cubic stiffness" in said
        assert motion < 100
    assert doubt(*hypotheses, moved(2, 0.0))[1] < DEFAULTS.least_proof


def test_a_small_motion_bends_no_spring(hypotheses: tuple[Case, list[Hypothesis]]) -> None:
    """It moves far more than its noise, but a cubic spring does not show in it."""
    said, motion = doubt(*hypotheses, moved(2, 0.1))
    assert "could not have refuted cubic stiffness" in said and motion > 1e3


def test_a_model_of_which_nothing_is_seen_is_refused_before_any_fit(
        monkeypatch: pytest.MonkeyPatch) -> None:
    fits: list[object] = []
    monkeypatch.setattr(NLS, "fit", lambda *given: fits.append(given))
    decay = pk.Model.from_dict({
        "name": "decay", "states": {"x": {"initial": 1.0}},
        "parameters": {"k": {"guess": 0.5}}, "equations": {"x": "-k*x"},
        "outputs": {"y": {"expression": "k*t"}}})
    t = np.linspace(0, 1, 50)
    with pytest.raises(pk.errors.BadModel, match="no state that reaches an output"):
        pk.diagnose(decay, Recording.from_arrays(t, {"y": np.exp(-t)}))
    assert not fits
