"""`validate`: its numbers against independent computations, and what it says of several models."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

import pikanid as pk
from pikanid import errors
from pikanid.comparison.predictions import BASELINE
from pikanid.comparison.validation import NOISE

DT, N = 0.02, 240
K, D = 40.0, 0.8
A = np.array([[0.0, 1.0], [-K, -D]])
B = np.array([[0.0], [1.0]])


def oscillator(**outputs: str) -> pk.Model:
    wanted = outputs or {"x": "x"}
    return pk.Model.from_dict({
        "name": "oscillator",
        "states": {"x": {"unit": "m"}, "v": {"unit": "m/s"}},
        "inputs": {"u": {"unit": "m/s^2", "hold": "zero"}},
        "parameters": {"k": {"guess": K, "unit": "1/s^2", "bounds": [1, 200]},
                       "d": {"guess": D, "unit": "1/s", "bounds": [0, 10]}},
        "equations": {"x": "v", "v": "-k*x - d*v + u"},
        "outputs": {name: {"expression": text, "unit": {"x": "m", "v": "m/s"}[text]}
                    for name, text in wanted.items()}})


def matrices() -> tuple[np.ndarray, np.ndarray]:
    """x_{t+1} = F x_t + G u_t, by the matrix exponential."""
    whole = expm(DT * np.block([[A, B], [np.zeros((1, 3))]]))
    return whole[:2, :2], whole[:2, 2]


def exact(x0: np.ndarray, u: np.ndarray) -> np.ndarray:
    F, G = matrices()
    x = [x0]
    for value in u[:-1]:
        x.append(F @ x[-1] + G * value)
    return np.array(x)


@pytest.fixture(scope="module")
def recorded() -> pk.Recording:
    rng = np.random.default_rng(4)
    u = np.repeat(rng.normal(0.0, 3.0, N // 8), 8)
    y = exact(np.array([0.3, -0.5]), u)[:, 0] + rng.normal(0.0, 0.01, N)
    return pk.Recording.from_arrays(DT * np.arange(N), {"u": u, "x": y},
                                    {"u": "m/s^2", "x": "m"}, {"x": 0.01}, {"u": "zero"})


def test_fit_per_cent_of_a_free_simulation_is_that_of_an_independent_one(
        recorded: pk.Recording) -> None:
    score = pk.validate(oscillator(), recorded, baseline=False).score("oscillator")
    y, yhat = recorded["x"].values, exact(np.zeros(2), recorded["u"].values)[:, 0]
    e = y - yhat
    assert score.fit == pytest.approx(
        100 * (1 - np.linalg.norm(e) / np.linalg.norm(y - y.mean())), abs=1e-9)
    assert score.rmse == pytest.approx(np.sqrt(np.mean(e**2)), abs=1e-9)
    assert score.r2 == pytest.approx(1 - e @ e / np.sum((y - y.mean())**2), abs=1e-9)
    assert score.chi2 == pytest.approx(np.sum((e / 0.01)**2), rel=1e-8)
    assert score.n == N and score.dof == N and score.sigma_source == "given"


@pytest.mark.parametrize("first", [0, 30])
def test_the_start_is_the_least_squares_one(recorded: pk.Recording, first: int) -> None:
    """Free, from all samples; or from the first 30, which are not scored."""
    found = pk.validate(oscillator(), recorded, baseline=False, first=first,
                        initial="model" if first else "free")
    y, u = recorded["x"].values, recorded["u"].values
    forced = exact(np.zeros(2), u)[:, 0]
    responses = np.stack([exact(x, 0 * u)[:, 0] for x in np.eye(2)], axis=1)
    used = slice(0, first or N)
    x0 = np.linalg.lstsq(responses[used], (y - forced)[used], rcond=None)[0]
    e = (y - forced - responses @ x0)[first:]
    score = found.score("oscillator")
    assert score.n == N - first
    assert score.rmse == pytest.approx(np.sqrt(np.mean(e**2)), abs=1e-9)
    assert score.parameters == 4
    assert score.dof == (N - first if first else N - 2)


@pytest.mark.parametrize(("horizon", "window"), [(1, 6), (5, 12), (20, 25)])
def test_predictions_ahead_are_those_of_an_independent_computation(
        recorded: pk.Recording, horizon: int, window: int) -> None:
    """One of two states measured: of a window before each origin, by linear least squares."""
    found = pk.validate(oscillator(), recorded, baseline=False, horizon=horizon, window=window)
    (p,) = found.predictions["oscillator"]
    F, G = matrices()
    y, u = recorded["x"].values, recorded["u"].values
    expected = np.full(N, np.nan)
    for i in range(window - 1, N - horizon):
        begin = i - window + 1
        rows, forced = [np.array([1.0, 0.0])], [0.0]
        x, P = np.zeros(2), np.eye(2)
        for t in range(begin, i + horizon):
            x, P = F @ x + G * u[t], F @ P
            rows.append(P[0])
            forced.append(x[0])
        x0 = np.linalg.lstsq(np.array(rows[:window]), y[begin:i + 1] - forced[:window],
                             rcond=None)[0]
        expected[i + horizon] = forced[-1] + rows[-1] @ x0
    assert np.array_equal(np.isfinite(p.predicted), np.isfinite(expected))
    there = np.isfinite(expected)
    assert np.max(np.abs(p.predicted - expected)[there]) < 1e-9
    e = (y - expected)[there]
    assert found.score("oscillator").fit == pytest.approx(
        100 * (1 - np.linalg.norm(e) / np.linalg.norm(y[there] - y[there].mean())), abs=1e-9)


def test_with_every_state_measured_a_window_of_one_is_the_plain_restart() -> None:
    rng = np.random.default_rng(0)
    u = rng.normal(0.0, 3.0, 60)
    x = exact(np.array([0.1, 0.0]), u) + rng.normal(0.0, 0.05, (60, 2))
    rec = pk.Recording.from_arrays(DT * np.arange(60), {"u": u, "x": x[:, 0], "v": x[:, 1]},
                                   {"u": "m/s^2", "x": "m", "v": "m/s"}, hold={"u": "zero"})
    found = pk.validate(oscillator(x="x", v="v"), rec, baseline=False, horizon=1, window=1)
    F, G = matrices()
    ahead = x[:-1] @ F.T + np.outer(u[:-1], G)
    for k, p in enumerate(found.predictions["oscillator"]):
        assert np.isnan(p.predicted[0])
        assert np.max(np.abs(p.predicted[1:] - ahead[:, k])) < 1e-9


def test_information_criteria_are_those_of_statsmodels() -> None:
    """A static line is linear in its parameters: ordinary least squares."""
    sm = pytest.importorskip("statsmodels.api")
    model = pk.Model.from_dict({
        "name": "line", "states": {"z": {"initial": 0.0}}, "inputs": {"u": {}},
        "parameters": {"a": {"guess": 0.0}, "b": {"guess": 0.0}}, "equations": {"z": "-z"},
        "outputs": {"y": {"expression": "a + b*u"}}})
    rng = np.random.default_rng(2)
    u = rng.normal(size=80)
    rec = pk.Recording.from_arrays(np.arange(80) * 0.1,
                                   {"u": u, "y": 2.0 - 3.0 * u + rng.normal(size=80)},
                                   hold={"u": "zero"})
    est = pk.NLS().fit(model, rec)
    score = est.validate(rec, baseline=False).score("line")
    oracle = sm.OLS(rec["y"].values, sm.add_constant(u)).fit()
    assert score.aic == pytest.approx(oracle.aic, abs=1e-8)
    assert score.bic == pytest.approx(oracle.bic, abs=1e-8)
    assert score.r2 == pytest.approx(oracle.rsquared, abs=1e-10)
    assert score.held_out is False and score.parameters == 2


def test_held_out_is_what_was_not_fitted(recorded: pk.Recording) -> None:
    begin, end = recorded.split(2.0)
    est = pk.NLS().fit(oscillator(), begin.with_hold(u="zero"))
    found = est.validate([recorded, begin, end], baseline=False)
    assert [s.held_out for s in found.scores if s.model != NOISE] == [False, False, True]
    bare = pk.validate(oscillator(), end, baseline=False)
    assert bare.score("oscillator").held_out is None
    assert pk.validate(oscillator(), end, training=begin).score("oscillator").held_out is True


def test_two_models_are_told_apart_only_where_they_differ(recorded: pk.Recording) -> None:
    right = oscillator().with_initial(x=0.3, v=-0.5)
    same, wrong = right.with_values(k=K + 0.01), right.with_values(k=K * 1.1)
    found = pk.validate({"wrong": wrong, "same": same, "right": right}, recorded, baseline=False)
    assert found.ranking[-1] == "wrong"
    significant = {(p.better, p.worse) for p in found.significant()}
    assert {("right", "wrong"), ("same", "wrong")} == significant
    p_value, = (p.p_value for p in found.pairs if {p.better, p.worse} == {"right", "same"})
    assert f"is not significant (p = {p_value:.2g}, below 0.01 would be)" in found.sentence()
    assert found.pairs == pk.validate({"wrong": wrong, "same": same, "right": right}, recorded,
                                      baseline=False).pairs


def test_a_model_given_twice_is_no_pair(recorded: pk.Recording) -> None:
    """It was told that it does not lead over itself, p = 1."""
    right = oscillator().with_initial(x=0.3, v=-0.5)
    given = {"one": right, "wrong": right.with_values(k=K * 1.1), "two": right}
    found = pk.validate(given, recorded, baseline=False)
    assert found.alike == (("one", "two"),) == tuple(map(tuple, found.to_dict()["alike"]))
    assert {(p.better, p.worse) for p in found.pairs} == {("one", "wrong"), ("two", "wrong")}
    assert found.sentence() == ("Best are 'one' and 'two', which predict the same, and are "
                                "significantly better than 'wrong'.")
    assert found.notes == ("These models predict the same: one, two. Is one of them given twice, "
                           "or was another meant?",)
    only = pk.validate([right, right], recorded, baseline=False)
    assert only.pairs == () and only.sentence().endswith("which predict the same.")


def test_two_outputs_of_two_recordings_with_missing_samples() -> None:
    model = oscillator(x="x", v="v")
    runs = []
    for seed in (1, 2):
        drive = pk.excitation.multisine(channel="u", duration=4.0)
        rec = pk.simulate(model, drive, sigma={"x": 0.01, "v": 0.05}, seed=seed)
        values = rec["x"].values.copy()
        values[50:60] = np.nan
        runs.append(replace(rec.with_channels(replace(rec["x"], values=values)),
                            name=f"run {seed}"))
    found = pk.validate(model, runs, training=runs[0])
    assert len(found.scores) == 3 * 4
    assert {(s.recording, s.output) for s in found.scores} == {
        (f"run {k}", o) for k in (1, 2) for o in "xv"}
    assert found.score("oscillator", "x", "run 1").n == len(runs[0].t) - 10
    for s in found.scores:
        if s.model != BASELINE:
            assert s.rmse == pytest.approx({"x": 0.01, "v": 0.05}[s.output], rel=0.15)
    assert found.score(BASELINE).held_out is False
    assert found.score(BASELINE, recording="run 2").held_out is True
    assert len(found.plot().axes) == 8
    ahead = pk.validate(model, runs, horizon=3)
    assert np.isfinite([s.rmse for s in ahead.scores]).all()


def test_a_model_that_runs_away_comes_last(recorded: pk.Recording) -> None:
    wild = oscillator().with_term("v", "5000*x**3")
    found = pk.validate({"wild": wild, "tame": oscillator()}, recorded)
    assert found.ranking[-1] == "wild" and found.score("wild").rmse == np.inf
    assert any("finite" in note for note in found.notes)
    assert "inf" in str(found)


def test_predict_gives_a_recording_without_looking_at_outputs(recorded: pk.Recording) -> None:
    est = pk.NLS().fit(oscillator().fix("k", "d").with_initial(x="free", v="free"), recorded)
    alone = est.predict(recorded.without("x"))
    fitted = est.predict(recorded)
    x0 = np.array([est["x_0"], est["v_0"]])
    assert np.allclose(alone["x"].values, exact(x0, recorded["u"].values)[:, 0], atol=1e-9)
    assert np.allclose(fitted["x"].values, est.fits[0].fitted, atol=1e-5)  # 1e-3 σ
    ahead = est.predict(recorded, horizon=3)["x"].values
    assert np.isnan(ahead[:22]).all() and np.isfinite(ahead[22:]).all()
    assert est["x_0"] == est.value("x_0") and est["x_0[0]"] == est["x_0"] and est["k"] == K
    with pytest.raises(errors.BadModel, match="mass"):
        est["mass"]


@pytest.mark.parametrize(("options", "words"), [
    ({"first": -1}, "'first'"), ({"first": N}, "take fewer"), ({"first": 1}, "raise first"),
    ({"horizon": 0}, "'horizon'"), ({"horizon": N}, "lower horizon"), ({"window": 1.5}, "'window'"),
    ({"initial": "guess"}, "'initial'"), ({"alpha": 1.0}, "'alpha'"), ({"origins": 0}, "'origins'"),
])
def test_what_cannot_be_is_refused(recorded: pk.Recording, options: dict[str, object],
                                   words: str) -> None:
    with pytest.raises(errors.BadSetting, match=words):
        pk.validate(oscillator(), recorded, **options)  # type: ignore[arg-type]


def test_models_must_be_models_of_the_same_outputs(recorded: pk.Recording) -> None:
    with pytest.raises(errors.BadModel, match="measures"):
        pk.validate([oscillator(), oscillator(v="v")], recorded)
    with pytest.raises(errors.BadModel, match="estimate is wanted"):
        pk.validate("sloshing", recorded)
    with pytest.raises(errors.BadModel, match="at least one"):
        pk.validate([], recorded)
    assert pk.validate([oscillator(), oscillator()], recorded, baseline=False).ranking == (
        "oscillator", "oscillator (2)")


def test_an_output_of_mere_noise_does_not_decide() -> None:
    """Of one output both models know nothing: on the other one of them is right."""
    model = pk.systems.sloshing_2d()
    rec = pk.simulate(model, pk.excitation.multisine(duration=5), sigma=2e-3, seed=1)
    off = model.with_values(l_theta=0.0452)
    found = pk.validate({"off": off, "right": model}, rec)
    assert found.score("right", "phi").fit < 5
    assert found.ranking[0] == "right"
    assert ("right", "off") in {(p.better, p.worse) for p in found.significant()}


def test_clean_recordings_of_several_outputs_are_told_in_one_sentence() -> None:
    model = pk.systems.sloshing_2d()
    runs = [replace(pk.simulate(model, pk.excitation.multisine(duration=5), sigma=2e-3, seed=k),
                    name=f"run {k}") for k in (1, 2)]
    found = pk.validate(model, runs, baseline=False)
    assert [good for _, good in found.left()] == [True]
    assert "all outputs" in str(found)
    wrong = pk.validate(model.with_values(l_theta=0.05), runs, baseline=False)
    assert sum(good for _, good in wrong.left()) == 2  # phi of both runs
    assert any("'theta'" in sentence for sentence, good in wrong.left() if not good)


def test_a_model_that_the_linear_baseline_beats_is_told_so(recorded: pk.Recording) -> None:
    found = pk.validate(oscillator().with_values(k=90.0), recorded)
    assert found.best == BASELINE
    assert found.sentence().startswith("No model beats the linear baseline")
