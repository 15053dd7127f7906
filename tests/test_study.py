"""The study: what its tables say, what it does without data, and the report."""

from __future__ import annotations

from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import pikanid as pk
from pikanid import errors
from pikanid.model import systems
from pikanid.pieces.html import text as printed
from pikanid.pieces.sheet import Sheet
from pikanid.recording import fetched
from pikanid.reporting import study_report, study_sheets
from pikanid.validation.study import pendulum, run, slosh

DENSE_LOW = slosh.SCENARIOS[1]


@pytest.fixture(scope="module")
def swing() -> pendulum.Swing:
    """A simulated one with dry friction: the real one takes long to diagnose."""
    model = systems.pendulum().with_values(l=0.25, d=0.05, theta_0=1.0).with_term(
        "theta_dot", "-c*sign(theta_dot)", [pk.Parameter("c", 0.3, "rad/s^2")])
    t = np.arange(0.0, 9.0, 0.02)
    grid = pk.Recording.from_arrays(t, {"theta": np.zeros(len(t))}, {"theta": "rad"})
    whole = pk.simulate(model, grid, sigma=0.002, seed=0)
    return pendulum.Swing(whole.window(0.0, 5.99), whole.window(6.0, 9.0))


@pytest.fixture(scope="module")
def small(swing: pendulum.Swing) -> run.Study:
    """A small study."""
    return run.run(seeds=3, strategies=("nls", "ipda"), swing=swing)


def test_scenarios_are_those_of_the_paper() -> None:
    assert [s.label for s in slosh.SCENARIOS] == [
        "dense, clean", "dense, 0.1°", "dense, 1°", "sparse, clean", "sparse, 0.1°", "sparse, 1°"]
    assert [len(slosh.recording(s, 0)["theta"]) for s in slosh.SCENARIOS] == [501] * 3 + [51] * 3


def test_results_of_another_process_find_their_place() -> None:
    first, second = slosh.SCENARIOS[:2]
    results = [slosh.Result(replace(second), "nls", None),
               slosh.Result(replace(first), "pinn", None), slosh.Result(first, "nls", None)]
    found = [(r.scenario.name, r.strategy) for r in run._in_order(results, ["nls", "pinn"])]
    assert found == [(first.name, "nls"), (first.name, "pinn"), (second.name, "nls")]


def test_sparse_recordings_keep_the_whole_input() -> None:
    sparse = slosh.recording(slosh.SCENARIOS[4], seed=0)
    assert len(sparse["u_x"]) == 501


def test_single_fits_reach_the_reference() -> None:
    # Reference for N = 501, σ = 0.1°, default_rng(0).
    found = slosh.fit(DENSE_LOW, "nls", seed=0).estimate
    assert found is not None
    assert found.value("l_theta") == pytest.approx(0.04501202, abs=2e-8)
    assert found.value("d_theta") == pytest.approx(0.14891704, abs=2e-6)
    assert found.cost == pytest.approx(7.814036e-4, rel=1e-5)


def test_spread_is_measured_against_the_bound() -> None:
    spread = slosh.repeated(DENSE_LOW, "nls", range(40))
    assert spread.cells["l_theta"].bound == pytest.approx(9.89e-6, rel=1e-2)
    # χ² with 40 degrees of freedom: 99.9 % of the ratios lie in this interval.
    for name in slosh.TRUE:
        assert 0.61 < spread.cells[name].ratio.value < 1.43


def test_a_strategy_that_cannot_be_used_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass(frozen=True)
    class Refuses:
        def fit(self, model: object, recording: object) -> None:
            raise errors.BadSetting("This cannot work.")

    monkeypatch.setattr(slosh.trial, "strategy_class", lambda name: Refuses)
    result = slosh.fit(DENSE_LOW, "nls", seed=0)
    assert result.estimate is None
    assert result.reason == "This cannot work."
    assert np.isnan(result.error("l_theta"))


def test_report_shows_both_recordings(small: run.Study, tmp_path: Path) -> None:
    assert [r.strategy for r in small.pendulum_fits] == ["nls", "ipda"]
    assert all(r.held_out > 0.0 for r in small.pendulum_fits)
    assert len(small.slosh_fits) == 12
    written = study_report.write(small, tmp_path)
    assert {path.name for path in written} == {
        "study.md", "study.html", "study-slosh-trajectories.png", "study-slosh-errors.png",
        "study-pendulum.png", "study-pendulum-diagnosis.png", "study-video.png"}


def test_the_page_says_what_the_report_says(small: run.Study, tmp_path: Path) -> None:
    written = {path.name: path for path in study_report.write(small, tmp_path)}
    html = written["study.html"].read_text(encoding="utf-8")
    sheets = [part for part in study_report.parts(small) if isinstance(part, Sheet)]
    assert html.count("<table>") == len(sheets) and html.count("<img ") == 5
    assert all(f">{printed(cell)}</td>" in html for s in sheets for row in s.rows for cell in row)
    assert printed(small.diagnosis.sentence()) in html


def test_the_study_ends_with_a_diagnosis(small: run.Study) -> None:
    found = small.diagnosis
    assert {"coulomb_friction"} <= {i for h in found.hypotheses for e in h.effects for i in e.ids}
    proof = found.held_out
    assert proof is not None and proof.rmse_after < proof.rmse_before
    screen = Console(width=100, record=True, file=StringIO())
    study_report.show(screen, small)
    # found, modelled, held-out error before and after: on the screen and in the report
    for text in (screen.export_text(), study_report.text(small, {})):
        assert found.sentence() in text
        assert "-c*sign(theta_dot)" in text
        assert f"held-out RMSE {proof.rmse_before:.3g} -> {proof.rmse_after:.3g} rad" in text


def test_a_video_goes_all_the_way(small: run.Study) -> None:
    found = small.filmed
    assert found is not None and found.estimate is not None
    assert found.estimate.adequacy.verdict == "fits" and len(found.stills) == 2
    assert np.degrees(found.rmse) < 0.1
    for name, true in slosh.TRUE.items():
        assert abs(found.estimate.value(name) - true) < 3 * found.estimate.std(name)
    assert "From a video" in study_report.text(small, {})


def test_tables_show_estimate_error_and_standard_error(small: run.Study) -> None:
    sheet = study_sheets.slosh(small, "dense", paper=True)
    row = next(cells for cells in sheet.rows if cells[:2] == ("0.1°", "nls"))
    assert row[2:5] == ("0.045012", "1.2e-05", "9.8e-06")
    assert row[-1] == "0.0450, 0.152"
    assert len(study_sheets.slosh(small, "sparse").headers) == len(sheet.headers) - 1
    assert len(study_sheets.spread(small).rows) == 8


def test_report_names_seeds_and_versions_and_no_folders(small: run.Study) -> None:
    text = study_report.text(small, {})
    assert "Seeds 0 to 2" in text
    assert "numpy" in text and "Python" in text
    assert str(Path.home()) not in text and str(Path.cwd()) not in text


def test_steps_are_announced(swing: pendulum.Swing) -> None:
    steps: list[str] = []
    run.run(seeds=0, strategies=("nls",), step=steps.append, swing=swing)
    assert steps[0] == "compiling the model"
    assert steps[-1] == "real pendulum, missing physics"
    assert len(steps) <= run.count_steps(("nls",))


@pytest.fixture
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(origin: object) -> bytes:
        raise errors.DatasetUnavailable("The recording is not here.")

    monkeypatch.setattr(fetched, "content", nothing)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.usefixtures("no_network")
def test_diagnosis_of_the_real_pendulum() -> None:
    """Dry friction and drag are sure, the law of either is not; a damping that falls with time
    would be negative before the swing ends.
    """
    found = pendulum.missing_physics(pendulum.load())
    assert found.verdict == "partial"
    assert {p.family: p.or_family for p in found.present} == {"dry friction": "", "drag": ""}
    assert not any(p.ids for p in found.present)
    assert found.held_out is not None
    assert found.held_out.rmse_before == pytest.approx(0.027, abs=0.001)
    assert found.held_out.rmse_after < 0.5 * found.held_out.rmse_before


@pytest.mark.usefixtures("no_network")
def test_held_out_error_of_the_real_pendulum() -> None:
    swing = pendulum.load()
    assert swing.train.stop == pytest.approx(36.667, abs=0.02)
    assert swing.held_out.stop == pytest.approx(55.0, abs=0.02)
    result = pendulum.fit(swing, "nls")
    assert result.estimate is not None
    assert result.estimate.adequacy.verdict == "misfit"
    assert result.held_out == pytest.approx(0.058, abs=0.001)
    assert result.restarted == pytest.approx(0.051, abs=0.001)
