"""What hides a part of the surface for some frames: the right angle, or none and a reason."""

from __future__ import annotations

import tracemalloc
from collections import deque
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pikanid.tracking.render import Cover, Scene, Splash, Stage, write
from pikanid.tracking.settings import USUAL
from pikanid.tracking.surface import Surface
from pikanid.tracking.tracked import Seen
from pikanid.tracking.video import track
from pikanid.tracking.volume import CHANGED, without_changes

pytest.importorskip("cv2")
SCENE = Scene(size=(240, 320), tank=(60, 20, 200, 200))
TRUTH = np.radians(20) * np.sin(np.arange(120) / 9)
ARM = Cover((0, 60), (-30, 200), 28.0, 30, 100, (4.0, 0.0))


@pytest.mark.parametrize("colour", [(60.0, 50.0, 45.0), SCENE.air, SCENE.dye],
                         ids=["dark", "as air", "as the dye"])
def test_an_arm_that_passes_gives_no_wrong_angle(tmp_path: Path,
                                                 colour: tuple[float, float, float]) -> None:
    scene = replace(SCENE, covers=(replace(ARM, colour=colour),))
    found = track(write(tmp_path / "arm.avi", TRUTH, scene))
    off, there = found.theta - TRUTH, np.isfinite(found.theta)
    assert np.max(np.abs(off[there])) < np.radians(1)
    assert all(bool(reason) != good for reason, good in zip(found.reasons, there, strict=True))
    # where nothing is in the way nothing is refused; somewhere the arm hides too much
    assert there[:ARM.first].all() and there[ARM.last + 1:].all() and not there.all()


def test_a_thin_cable_costs_no_frame(tmp_path: Path) -> None:
    scene = replace(SCENE, covers=(Cover((140, 0), (190, 240), 3.0, 30, 90),))
    found = track(write(tmp_path / "cable.avi", TRUTH, scene))
    assert np.max(np.abs(found.theta - TRUTH)) < np.radians(0.1)


def test_a_splash_gives_no_wrong_angle(tmp_path: Path) -> None:
    splash = Splash(170, 120, 30, 80, drops=40, radius=7.0, rise=6.0, fall=0.3)
    found = track(write(tmp_path / "splash.avi", TRUTH, replace(SCENE, splashes=(splash,))))
    off, there = found.theta - TRUTH, np.isfinite(found.theta)
    assert np.max(np.abs(off[there])) < np.radians(1)
    assert there[:30].all() and there[81:].all()


def _levels(theta: np.ndarray, level: np.ndarray) -> list[Seen]:
    return [Seen(k, k / 100, Surface(float(a), float(z)))
            for k, (a, z) in enumerate(zip(theta, level, strict=True))]


def test_a_mean_height_that_jumps_is_no_surface() -> None:
    rng = np.random.default_rng(0)
    theta = 0.4 * np.sin(np.arange(200) / 7)
    level = 100 + 3 * np.tan(theta) + 0.05 * rng.standard_normal(200)  # a camera beside the middle
    assert not any(s.surface.reason for s in without_changes(_levels(theta, level), 200.0, USUAL))
    level[50:60] += 2.0
    found = without_changes(_levels(theta, level), 200.0, USUAL)
    assert [s.number for s in found if s.surface.reason == CHANGED] == list(range(50, 60))
    assert all(np.isnan(found[k].surface.theta) for k in range(50, 60))


def test_a_level_that_is_unsteady_itself_is_no_jump() -> None:
    rng = np.random.default_rng(1)
    theta, level = 0.3 * np.sin(np.arange(200) / 7), 100 + 2 * rng.standard_normal(200)
    assert not any(s.surface.reason for s in without_changes(_levels(theta, level), 200.0, USUAL))


def test_covers_and_drops_are_drawn_where_they_are() -> None:
    clean = replace(SCENE, noise=0.0, blur=0.0)
    cover = Cover((100, 40), (200, 40), 10.0, 3, 4, (0.0, 5.0), (10.0, 20.0, 30.0))
    drops = Splash(160, 100, 3, 4, drops=1, radius=6.0)
    stage = Stage(replace(clean, covers=(cover,), splashes=(drops,)))
    plain, first, second = (stage.picture(0.0, number=k) for k in (2, 3, 4))
    np.testing.assert_array_equal(plain, Stage(clean).picture(0.0))
    assert first[40, 150].tolist() == [10, 20, 30] and second[34, 150].tolist() != [10, 20, 30]
    assert second[54, 150].tolist() == [10, 20, 30]
    assert first[100, 160].tolist() == [round(c) for c in SCENE.dye]


@pytest.mark.parametrize("held", [False, True], ids=["streams", "control: all held"])
def test_memory_does_not_grow_with_the_video(tmp_path: Path, held: bool) -> None:
    scene = Scene(size=(120, 160), tank=(20, 10, 120, 100))
    frames, size = (200, 2000), 120 * 160 * 3
    peaks = []
    for count in frames:
        path = write(tmp_path / f"{count}.avi", TRUTH[np.arange(count) % 120], scene)
        kept: deque[object] = deque(maxlen=None if held else 1)
        tracemalloc.start()
        try:
            track(path, watch=lambda frame, *_, keep=kept.append: keep(frame))
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    # what was found takes some hundred numbers a frame, the frames themselves ten times as much
    grown = (peaks[1] - peaks[0]) / (frames[1] - frames[0])
    assert (grown > size / 2) if held else (grown < size / 10)
