"""What the renderer draws is what it was asked for: area, place, light, noise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pikanid import errors
from pikanid.tracking.render import Scene, Stage, picture, write

pytest.importorskip("cv2")
PLAIN = Scene(size=(200, 240), tank=(30, 20, 180, 160), blur=0.0, noise=0.0)


def share(shown: np.ndarray, scene: Scene) -> np.ndarray:
    """Of liquid, by the red channel."""
    return (scene.air[0] - shown[..., 0].astype(float)) / (scene.air[0] - scene.dye[0])


@pytest.mark.parametrize("degrees", [-25.0, 0.0, 3.0, 25.0])
def test_area_and_slope_are_exact(degrees: float) -> None:
    wet = share(picture(np.radians(degrees), PLAIN), PLAIN)[22:178, 40:200].sum(axis=0)
    expected = 178 - PLAIN.waterline + np.tan(np.radians(degrees)) * (np.arange(40, 200) + 0.5
                                                                      - 120 - 0.5)
    np.testing.assert_allclose(wet, expected - 0.5, atol=0.03)


def test_noise_is_as_large_as_asked_and_new_in_every_picture() -> None:
    stage, rng = Stage(replace(PLAIN, noise=5.0)), np.random.default_rng(0)
    a, b = (stage.picture(0.0, rng).astype(float)[:60] for _ in range(2))
    assert np.std(a - b) == pytest.approx(5 * np.sqrt(2), rel=0.03)
    again = Stage(replace(PLAIN, noise=5.0)).picture(0.0, np.random.default_rng(0))
    np.testing.assert_array_equal(again[:60], a)


def test_a_turned_camera_sees_a_trapezium() -> None:
    turned = replace(PLAIN, yaw=0.3)
    left, right = np.diff(turned.corners[[0, 3]], axis=0), np.diff(turned.corners[[1, 2]], axis=0)
    assert abs(left[0, 1] - right[0, 1]) > 5
    wet = share(picture(0.0, turned), turned)
    x, y = turned.seen(np.array([[60.0, 150.0]]))[0].round().astype(int)
    assert wet[y, x] == pytest.approx(1.0, abs=0.02)


def test_an_exposure_is_the_mean_of_its_moments() -> None:
    stage = Stage(PLAIN)
    both = stage.picture(np.array([stage.surface(0.1), stage.surface(-0.1)])).astype(float)
    mean = (stage.picture(0.1).astype(float) + stage.picture(-0.1)) / 2
    assert np.max(np.abs(both - mean)) <= 1


def test_what_cannot_be_drawn_or_written_is_refused(tmp_path: Path) -> None:
    for wrong in (np.nan, [1.0], np.zeros((2, 2, 2))):
        with pytest.raises(errors.BadSetting, match="surface of shape"):
            picture(wrong, PLAIN)
    with pytest.raises(errors.BadSetting, match="codec"):
        write(tmp_path / "run.mov", [0.0], PLAIN)
    with pytest.raises(errors.BadRecording, match="written"):
        write(tmp_path / "absent" / "run.avi", [0.0], PLAIN)
