"""The study: what its tables say, what it does without data, and the report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pikanid import errors
from pikanid.reporting import study_report, study_sheets
from pikanid.study import pendulum, run, slosh

DENSE_LOW = slosh.SCENARIOS[1]


@pytest.fixture(scope="module")
def offline(tmp_path_factory: pytest.TempPathFactory) -> run.Study:
    """A small study on a machine without recordings and without network."""
    with pytest.MonkeyPatch.context() as patch:

        def nothing(part: str) -> None:
            raise errors.DatasetUnavailable("The recording is not here.")

        patch.setattr(pendulum.datasets, "single_pendulum", nothing)
        return run.run(seeds=3, strategies=("nls", "ipda"))


def test_scenarios_are_those_of_the_paper() -> None:
    assert [s.label for s in slosh.SCENARIOS] == [
        "dense, clean", "dense, 0.1°", "dense, 1°", "sparse, clean", "sparse, 0.1°", "sparse, 1°"]
    assert [len(slosh.recording(s, 0)["theta"]) for s in slosh.SCENARIOS] == [501] * 3 + [51] * 3


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
    assert spread.bound["l_theta"] == pytest.approx(9.89e-6, rel=1e-2)
    # χ² with 40 degrees of freedom: 99.9 % of the ratios lie in this interval.
    for name in slosh.TRUE:
        assert 0.61 < spread.rmse[name] / spread.bound[name] < 1.43


def test_a_strategy_that_cannot_be_used_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    class Refuses:
        def fit(self, model: object, recording: object) -> None:
            raise errors.BadSetting("This cannot work.")

    monkeypatch.setattr(slosh, "strategy", lambda name: Refuses)
    result = slosh.fit(DENSE_LOW, "nls", seed=0)
    assert result.estimate is None
    assert result.reason == "This cannot work."
    assert np.isnan(result.error("l_theta"))


def test_without_recordings_the_study_goes_on(offline: run.Study, tmp_path: Path) -> None:
    assert offline.missing == "The recording is not here."
    assert offline.pendulum_fits == ()
    assert len(offline.slosh_fits) == 12
    written = study_report.write(offline, tmp_path)
    assert {path.name for path in written} == {
        "study.md", "study-slosh-trajectories.png", "study-slosh-errors.png"}
    assert "not at hand" in (tmp_path / "study.md").read_text()


def test_tables_show_estimate_error_and_standard_error(offline: run.Study) -> None:
    sheet = study_sheets.slosh(offline, "dense", paper=True)
    row = next(cells for cells in sheet.rows if cells[:2] == ("0.1°", "nls"))
    assert row[2:5] == ("0.045012", "1.2e-05", "9.8e-06")
    assert row[-1] == "0.0450, 0.152"
    assert len(study_sheets.slosh(offline, "sparse").headers) == len(sheet.headers) - 1
    assert len(study_sheets.spread(offline).rows) == 8


def test_report_names_seeds_and_versions_and_no_folders(offline: run.Study) -> None:
    text = study_report.text(offline, {})
    assert "Seeds 0 to 2" in text
    assert "numpy" in text and "Python" in text
    assert str(Path.home()) not in text and str(Path.cwd()) not in text


def test_steps_are_announced() -> None:
    steps: list[str] = []
    run.run(seeds=0, strategies=("nls",), step=steps.append)
    assert steps[0] == "compiling the model"
    assert len(steps) <= run.count_steps(("nls",))


def test_held_out_error_of_the_real_pendulum(recordings_folder: Path) -> None:
    swing = pendulum.load()
    assert swing.train.stop == pytest.approx(36.667, abs=0.02)
    assert swing.held_out.stop == pytest.approx(55.0, abs=0.02)
    result = pendulum.fit(swing, "nls")
    assert result.estimate is not None
    assert result.estimate.adequacy.verdict == "misfit"
    assert result.held_out == pytest.approx(0.058, abs=0.001)
    assert result.restarted == pytest.approx(0.051, abs=0.001)
