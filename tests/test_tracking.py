"""The angle of a drawn surface: unbiased, inside its own band as often as that says, or refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from crude import crude_picture
from scipy.stats import binom

from pikanid import errors
from pikanid.tracking.colours import ColourRange, learn
from pikanid.tracking.deviation import deviations
from pikanid.tracking.journal import Journal
from pikanid.tracking.region import Region, propose
from pikanid.tracking.render import Glare, Scene, Stage
from pikanid.tracking.settings import USUAL
from pikanid.tracking.surface import Surface, failed
from pikanid.tracking.tracked import Seen
from pikanid.tracking.video import Tracker

pytest.importorskip("cv2")
SMALL = Scene(size=(240, 320), tank=(60, 20, 200, 200))


def drawn(scene: Scene, angles: np.ndarray, seed: int = 0) -> list[np.ndarray]:
    stage, rng = Stage(scene), np.random.default_rng(seed)
    return [np.ascontiguousarray(stage.picture(a, rng)[..., ::-1]) for a in angles]


def tracker(pictures: list[np.ndarray]) -> Tracker:
    region = propose(pictures[:12])
    return Tracker(region, learn([region.cut(p) for p in pictures[:12]], USUAL))


def sigmas(found: list[Surface]) -> np.ndarray:
    columns = [np.array([getattr(f, name) for f in found])
               for name in ("theta", "variance", "finer")]
    return deviations(*columns, np.array([f.gains[0] if f.gains else np.nan for f in found]), USUAL)


@pytest.mark.parametrize("changes", [
    {}, {"noise": 12.0}, {"blur": 2.5}, {"light": (0.3, 0.25)}, {"dye": (215.0, 150.0, 145.0)}],
    ids=["plain", "noise", "blur", "light", "pale"])
def test_errors_are_as_large_as_stated(changes: dict[str, object]) -> None:
    truths = np.radians(25) * np.sin(np.arange(200) / 9 + 0.3)  # moves as liquids do, not at random
    pictures = drawn(replace(SMALL, **changes), truths)
    looks = tracker(pictures)
    found = [looks.find(p)[1] for p in pictures]
    off, sigma = np.array([f.theta for f in found]) - truths, sigmas(found)
    inside = int(np.sum(np.abs(off) < 1.96 * sigma))
    # one run in 1000 leaves these limits of 92 % and 98 %
    assert binom.ppf(0.001, 200, 0.92) <= inside <= binom.ppf(0.999, 200, 0.98)
    assert np.sqrt(np.mean(off**2)) < np.radians(0.1)
    assert 1.96 * np.median(sigma) < np.radians(0.15)


@pytest.mark.parametrize("dark", [False, True])
def test_another_renderer_gives_the_same_angles(dark: bool) -> None:
    truths = np.linspace(-25, 25, 41)
    pictures = [crude_picture(a, k, dark=dark) for k, a in enumerate(truths)]
    region = Region(0, 0, 240, 200)
    looks = Tracker(region, learn(pictures[18:23], USUAL))
    found = [looks.find(p)[1] for p in pictures]
    z = (np.array([f.theta for f in found]) - np.radians(truths)) / sigmas(found)
    assert int(np.sum(np.abs(z) < 1.96)) >= 34  # 95 % but for one run in 1000
    assert np.max(np.abs(z)) < 4.5


def test_glare_and_meniscus_do_not_move_the_line() -> None:
    spoilt = replace(SMALL, glare=(Glare(150, 120, 8, 20),), meniscus=(5.0, 5.0))
    truths = np.radians(np.linspace(-20, 20, 60))
    pictures = drawn(spoilt, truths)
    looks = tracker(pictures)
    off = np.array([looks.find(p)[1].theta for p in pictures]) - truths
    assert np.sqrt(np.nanmean(off**2)) < np.radians(0.1)
    assert np.sum(np.isnan(off)) == 0


def test_a_curved_surface_has_its_nearest_line_and_shape() -> None:
    u = np.linspace(-1, 1, 401)
    heights = 12 * u + 5 * (3 * u**2 - 1) / 2
    curved = Stage(SMALL).picture(heights, np.random.default_rng(0))
    pictures = [*drawn(SMALL, np.zeros(12)), np.ascontiguousarray(curved[..., ::-1])]
    looks = tracker(pictures)
    found = looks.find(pictures[-1])[1]
    assert found.theta == pytest.approx(np.arctan(12 / 100), abs=1e-3)
    # the region is a little narrower than the tank: the curvature scales with its square
    assert found.shape[0] == pytest.approx(5 * (looks.region.width / 200) ** 2, rel=0.02)
    assert abs(found.shape[1]) < 0.5


def test_an_occluded_surface_is_found_beside_the_cover_or_refused() -> None:
    pictures = drawn(SMALL, np.radians(np.full(14, 8.0)))
    looks = tracker(pictures)
    pictures[12][:, 150:190] = 20
    pictures[13][:, 60:240] = 20
    some, none = (looks.find(p)[1] for p in pictures[12:])
    assert some.theta == pytest.approx(np.radians(8), abs=np.radians(0.3))
    assert np.isnan(none.theta) and none.reason


def test_what_shows_no_surface_is_refused() -> None:
    pictures = drawn(SMALL, np.zeros(12))
    looks = tracker(pictures)
    empty, full = pictures[0].copy(), pictures[0].copy()
    empty[:], full[:] = (200, 208, 205), (175, 80, 40)
    noise = np.random.default_rng(0).integers(0, 256, empty.shape).astype(np.uint8)
    smeared = np.repeat(np.linspace(200, 60, 240)[:, None, None], 320, 1).repeat(3, 2)
    for shown in (empty, full, noise, smeared.astype(np.uint8)):
        found = looks.find(shown)[1]
        assert np.isnan(found.theta) and found.reason


def test_a_region_holds_the_liquid_and_room_above() -> None:
    region = propose(drawn(SMALL, np.zeros(3)))
    left, _, width, _ = SMALL.tank
    assert left < region.left < left + 12 and 0.9 * width < region.width < width
    assert region.top <= SMALL.waterline - 0.5 * width / 2 and region.top + region.height <= 220


def test_a_colour_may_be_given() -> None:
    pictures = drawn(SMALL, np.radians([3.0, -5.0]))
    within = ColourRange.parse("hsv:100..130,100..255,60..255")
    region = propose(pictures, within)
    looks = Tracker(region, learn([region.cut(p) for p in pictures], USUAL, within))
    assert looks.find(pictures[1])[1].theta == pytest.approx(np.radians(-5), abs=2e-3)


@pytest.mark.parametrize("text", ["", "rgb:1..2,1..2,1..2", "hsv:1..2,1..2", "hsv:9..200,0..1,0..1",
                                  "lab:9..2,0..1,0..1", "hsv:a..b,1..2,3..4"])
def test_a_range_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(errors.BadSetting, match="colour range"):
        ColourRange.parse(text)


def test_a_hue_may_run_over_its_end() -> None:
    red = np.full((1, 1, 3), (20, 20, 200), np.uint8)
    assert ColourRange.parse("hsv:170..10,50..255,50..255").mask(red).all()


def test_grey_pictures_show_no_tank() -> None:
    with pytest.raises(errors.BadRecording, match="stands out"):
        propose([np.full((80, 80, 3), 90, np.uint8)])
    with pytest.raises(errors.BadRecording, match="two colours"):
        learn([np.full((80, 80, 3), 90, np.uint8)], USUAL)


def test_a_run_that_begins_anew_keeps_no_lines_of_the_one_before(tmp_path: Path) -> None:
    path, asked = tmp_path / "frames", {"video": "one"}
    for resume, numbers in ((True, range(5)), (False, range(2))):
        kept = Journal(path, asked, resume)
        for number in numbers:
            kept.add(Seen(number, 0.01 * number, failed("stopped")))
        kept.close(done=False)
    last = Journal(path, asked)
    last.close(done=True)
    assert [seen.number for seen in last.found] == [0, 1] and not path.exists()
