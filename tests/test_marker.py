"""A marker is followed: where it is, how sure that is, and where it is not to be seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from pikanid import errors
from pikanid.tracking.displacement import metres, pixels
from pikanid.tracking.geometry import from_corners
from pikanid.tracking.marker import Marker, Place, marker
from pikanid.tracking.region import Region
from pikanid.tracking.render import Cover, Pattern, Scene, Stage
from pikanid.tracking.settings import USUAL

cv2 = pytest.importorskip("cv2")
SCENE = Scene(size=(90, 180), tank=(50, 10, 70, 70), pattern=Pattern(70, 14, 30, 30))
AREA = Region(71, 15, 28, 28)
ACROSS = 20 * np.sin(np.arange(120) * 0.06) + 0.3 * np.sin(np.arange(120) * 0.31)
DOWN = 0.7 * np.cos(np.arange(120) * 0.045) - 0.7


def drawn(scene: Scene, across: np.ndarray, down: np.ndarray | None = None,
          quality: int | None = None) -> list[np.ndarray]:
    stage, rng, out = Stage(scene), np.random.default_rng(0), []
    for k, x in enumerate(across):
        shown = stage.at(x, 0.0 if down is None else down[k]).picture(0.0, rng, k)[..., ::-1]
        if quality:
            shown = cv2.imdecode(cv2.imencode(
                ".jpg", np.ascontiguousarray(shown), [cv2.IMWRITE_JPEG_QUALITY, quality])[1], 1)
        out.append(np.ascontiguousarray(shown))
    return out


def followed(pictures: list[np.ndarray], area: Region = AREA) -> list[Place]:
    made, places = marker(area, pictures, "tank", USUAL), []
    for picture in pictures:
        places.append(made.find(picture, places))
    return places


@pytest.mark.parametrize(("changes", "quality", "largest"), [
    ({}, None, 0.008), ({"noise": 12.0}, None, 0.03),
    ({"light": (0.4, 0.2)}, None, 0.01), ({}, 60, 0.015),
    ({"pattern": Pattern(70, 14, 30, 30, contrast=12.0)}, None, 0.02)],
    ids=["plain", "noise", "light", "quality 60", "pale"])
def test_places_are_as_sure_as_stated(changes: dict[str, object], quality: int | None,
                                      largest: float) -> None:
    places = followed(drawn(replace(SCENE, **changes), ACROSS, DOWN, quality))
    where, sigma = pixels(places)
    for found, truth, own in zip(where.T, (ACROSS, DOWN), sigma.T, strict=True):
        # the first picture's own error is that of all others, too
        off = found - truth - np.mean(found - truth)
        assert np.sqrt(np.mean(off**2)) < largest
        # one run in 1000 leaves these limits of 85 % and 99 %
        assert binom.ppf(0.001, 120, 0.85) <= np.sum(np.abs(off) < 1.96 * own)
        assert np.median(own) < 2.5 * np.std(off)


def test_light_that_fades_moves_nothing() -> None:
    pictures = [(p * (1 - 0.004 * k) + 0.1 * k).astype(np.uint8)
                for k, p in enumerate(drawn(replace(SCENE, noise=0.5), ACROSS))]
    off = pixels(followed(pictures))[0][:, 0] - ACROSS
    assert np.std(off) < 0.01 and not np.isnan(off).any()


def test_what_is_covered_has_no_place_and_is_found_again() -> None:
    arm = Cover((30, 0), (30, 89), 12.0, 20, 95, (2.0, 0.0))
    places = followed(drawn(replace(SCENE, covers=(arm,)), 0.5 * ACROSS))
    where, sigma = pixels(places)
    hidden = np.array([abs(30 + 2 * (k - 20) - 85 - 0.5 * x) < 12 and 20 <= k <= 95
                       for k, x in enumerate(ACROSS)])
    assert np.isnan(where[hidden]).all() and hidden.sum() >= 10
    assert all(p.reason for k, p in enumerate(places) if hidden[k])
    off = where[:, 0] - 0.5 * ACROSS
    assert np.count_nonzero(np.isnan(off[96:])) == 0
    # a few pixels of its rim may be hidden unseen
    assert np.nanmax(np.abs(off)) < 0.15 and np.nanmax(np.abs(off / sigma[:, 0])) < 8


def test_a_patch_without_texture_or_place_is_refused() -> None:
    blank = drawn(replace(SCENE, pattern=replace(SCENE.pattern, contrast=0.0)), ACROSS[:3])
    with pytest.raises(errors.BadSetting, match="no texture"):
        marker(Region(77, 21, 16, 16), blank, "tank", USUAL)
    striped = [np.repeat(p[:1], 90, axis=0) for p in drawn(SCENE, ACROSS[:3])]
    striped[0][:, ::6] = 20
    with pytest.raises(errors.BadSetting, match="no texture"):
        marker(AREA, striped, "tank", USUAL)
    for wrong in (Region(170, 10, 28, 28), Region(-1, 10, 28, 28), Region(70, 10, 8, 28)):
        with pytest.raises(errors.BadSetting, match="within the picture"):
            marker(wrong, drawn(SCENE, ACROSS[:1]), "tank", USUAL)


def test_of_two_that_are_alike_none_is_taken_when_it_was_lost() -> None:
    picture = drawn(replace(SCENE, noise=0.0), ACROSS[:1])[0]
    made = marker(AREA, [picture], "tank", USUAL)
    picture[45:73, 120:148] = picture[15:43, 71:99]
    assert not made.find(picture, [Place(0.0, 0.0)] * 3).reason
    assert "alone" in made.find(picture, [Place(reason="hidden")] * 4).reason


def test_metres_are_those_of_the_tanks_plane() -> None:
    turned = replace(SCENE, yaw=0.35, pattern=None)
    geometry = from_corners(turned.corners, 0.07, 0.07, turned.size)
    centre = np.array([[85.0, 30.0], [85.0 + 12, 30.0]])
    (x0, y0), (x1, y1) = turned.seen(centre)
    area = Region(round(x0) - 10, round(y0) - 10, 21, 21)
    made = Marker(area, np.zeros((37, 37), np.float32), "tank", USUAL)
    where, sigma = metres(np.array([[x1 - x0, y1 - y0]]), np.array([[0.01, 0.01]]), made, geometry,
                          None)
    assert where[0] == pytest.approx([0.012, 0.0], abs=2e-4)
    assert sigma[0, 0] == pytest.approx(0.01 * 0.012 / np.hypot(x1 - x0, y1 - y0), rel=0.1)
    behind = replace(made, on="background")
    there, _ = metres(np.array([[3.0, 1.0]]), np.array([[0.01, 0.01]]), behind, None, 1e-3)
    assert there[0] == pytest.approx([-3e-3, 1e-3])
