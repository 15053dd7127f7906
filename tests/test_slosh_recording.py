"""Water in a vessel that a robot carries: the recorded runs, and what a diagnosis makes of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pikanid.recording import datasets

TILTED = "Tilt_LE_2D_0m_6.5s_30deg"
LEVEL = "LE_2D_0m_5s_900deg"


@pytest.mark.usefixtures("recordings_folder")
@pytest.mark.parametrize("name", [
    TILTED, LEVEL, *(pytest.param(n, marks=pytest.mark.slow) for n in datasets.SLOSH_MOTIONS
                     if n not in (TILTED, LEVEL))])
def test_runs_are_on_one_clock(name: str) -> None:
    rec = datasets.slosh_lar_forced(name)
    assert rec.names == ("h", "tilt_x", "tilt_y", "a_x", "a_y", "spin")
    assert [rec[n].unit for n in rec.names] == ["mm", "rad", "rad", "m/s^2", "m/s^2", "rad/s"]
    h = rec.as_output("h", "mm")
    # the water is at rest when the motion begins, and rises far before it ends
    assert np.median(np.abs(h.values[:10])) < 3.0 < 15.0 < h.values.max()
    # far below its resonance the surface follows the force along the vessel, g sin(tilt) included:
    # heights on the right clock resemble it more than those a tenth or half of a second off
    t = rec["a_x"].time
    force = np.hypot(rec["a_x"].values - 9.81 * np.sin(rec["tilt_y"].values),
                     rec["a_y"].values + 9.81 * np.sin(rec["tilt_x"].values))

    def likeness(shift: float) -> float:
        return float(np.corrcoef(h.values, np.interp(h.time - shift, t, force))[0, 1])

    assert likeness(0.0) > 0.9
    assert likeness(0.0) > max(likeness(0.1), likeness(-0.1))
    assert likeness(0.0) > max(likeness(0.5), likeness(-0.5)) + 0.1


@pytest.mark.usefixtures("recordings_folder")
def test_what_does_not_move_stays_exactly_still() -> None:
    tilted, level = (datasets.slosh_lar_forced(n) for n in (TILTED, LEVEL))
    for rec, still in ((tilted, ("tilt_y", "spin")), (level, ("tilt_x", "tilt_y"))):
        assert all(np.ptp(rec[n].values) == 0.0 for n in still)
    assert np.degrees(np.abs(tilted["tilt_x"].values).max()) == pytest.approx(30.0, abs=0.1)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_gravity_along_a_tilted_vessel_is_found(recordings_folder: Path) -> None:
    # the heights hold more than any catalogue (the cameras' dead band): never more than partial.
    # The family alone: its exact name was sure before motions were offered a coupling
    import diagnosis_real

    rows = diagnosis_real.slosh_lar(["Tilt_LE_2D_0m_6.5s_30deg", "Tilt_LE_2D_0m_6s_30deg"])
    for row in rows:
        assert (row.verdict, row.hypotheses) == ("partial", ("surely other axis",))
        assert "tilt_x" in row.remark
        assert row.unit == "mm"
        assert row.before > 8.0
        assert row.after < 4.0
