"""A moving tank, or a camera that moves with it: surface and motion from one video."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import pikanid as pk
from pikanid import errors
from pikanid.cli import app
from pikanid.recording import Recording
from pikanid.tracking.geometry import from_corners
from pikanid.tracking.marker import Side
from pikanid.tracking.region import Region
from pikanid.tracking.render import Cover, Pattern, Scene, write
from pikanid.tracking.video import track
from pikanid.validation.study import slosh

pytest.importorskip("cv2")
RATE, PIXEL, COUNT = 50.0, 5e-4, 101
TIME = np.arange(COUNT) / RATE
MOVED = 14 * np.sin(np.pi * TIME / 2) ** 2 * np.sin(7 * TIME)  # [px]
THETA = np.radians(10) * np.sin(8 * TIME)
TANK = Scene(size=(130, 240), tank=(85, 10, 110, 105), pattern=Pattern(110, 14, 32, 20))
RIDING = replace(TANK, pattern=Pattern(22, 40, 32, 32), glued=False, riding=True)
CASES: dict[Side, tuple[Scene, Region]] = {
    "tank": (TANK, Region(111, 15, 30, 18)), "background": (RIDING, Region(23, 41, 30, 30))}
MOTION = [(x, 0.0) for x in MOVED]


@pytest.fixture(scope="module")
def clips(tmp_path_factory: pytest.TempPathFactory) -> dict[Side, Path]:
    folder = tmp_path_factory.mktemp("moving")
    return {side: write(folder / f"{side}.avi", THETA, scene, RATE, motion=MOTION)
            for side, (scene, _) in CASES.items()}


@pytest.mark.parametrize("side", ["tank", "background"])
def test_position_acceleration_and_surface_of_one_video(clips: dict[Side, Path], side: Side
                                                        ) -> None:
    found = track(clips[side], follow=(CASES[side][1], side), pixel=PIXEL)
    recording = found.recording()
    x = recording["x"]
    off = x.values - PIXEL * MOVED
    off -= np.mean(off)
    assert np.sqrt(np.mean(off**2)) < 0.02 * PIXEL
    assert np.mean(np.abs(off) < 1.96 * np.asarray(x.sigma)) > 0.85
    assert np.sqrt(np.mean((recording["theta"].values - THETA) ** 2)) < np.radians(0.05)
    u = np.gradient(np.gradient(PIXEL * MOVED, TIME), TIME)[3:-3]
    assert np.sqrt(np.mean((recording["u_x"].values[3:-3] - u) ** 2)) < 0.06 * np.std(u)
    assert np.max(np.abs(recording["y"].values)) < 0.06 * PIXEL
    assert "smoothing spline through 'x'" in " ".join(recording.notes)
    other = track(clips[side], follow=(CASES[side][1], side), pixel=PIXEL, flip=True).recording()
    np.testing.assert_array_equal(other["x"].values, -x.values)


def test_a_camera_that_looks_askew_needs_the_corners(tmp_path: Path) -> None:
    scene = replace(TANK, yaw=0.25, pitch=-0.1)
    video = write(tmp_path / "run.avi", THETA, scene, RATE, motion=MOTION)
    geometry = from_corners(scene.corners, 110 * PIXEL, 105 * PIXEL, scene.size)
    left, top = scene.seen(np.array([[113.0, 17.0]]))[0].round().astype(int)
    found = track(video, follow=(Region(int(left), int(top), 24, 14), "tank"), geometry=geometry)
    x = found.motion[0][:, 0] - PIXEL * MOVED
    # perspective turns and stretches the patch a little while it goes
    assert np.std(x) < 0.03 * PIXEL
    assert np.sqrt(np.mean((found.theta - THETA) ** 2)) < np.radians(0.1)
    straight = track(video, follow=(Region(int(left), int(top), 24, 14), "tank"), pixel=PIXEL)
    assert np.std(straight.motion[0][:, 0] - PIXEL * MOVED) > 3 * np.std(x)


def test_without_its_marker_a_moving_tank_is_lost(clips: dict[Side, Path]) -> None:
    still = track(clips["tank"])
    assert np.count_nonzero(np.isnan(still.theta)) > 10 or np.nanmax(
        np.abs(still.theta - THETA)) > np.radians(0.5)


def test_a_stopped_run_goes_on_and_finds_the_same(clips: dict[Side, Path], tmp_path: Path) -> None:
    follow = (CASES["tank"][1], "tank")
    whole = track(clips["tank"], follow=follow, pixel=PIXEL)

    def stop(number: int) -> None:
        if number == 57:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        track(clips["tank"], follow=follow, pixel=PIXEL, journal=tmp_path / "frames", step=stop)
    done: list[int] = []
    again = track(clips["tank"], follow=follow, pixel=PIXEL, journal=tmp_path / "frames",
                  step=done.append)
    assert done[0] == 58 and again.seen == whole.seen
    np.testing.assert_array_equal(again.recording()["u_x"].values, whole.recording()["u_x"].values)


@pytest.mark.parametrize("side", ["tank", "background"])
def test_frames_without_the_marker_are_empty(tmp_path: Path, side: Side) -> None:
    scene, area = CASES[side]
    x = area.left + area.width / 2
    hidden = replace(scene, covers=(Cover((x, area.top - 9), (x, area.top + 20), 22.0, 40, 48),))
    video = write(tmp_path / "run.avi", THETA, hidden, RATE, motion=MOTION)
    found = track(video, follow=(area, side), pixel=PIXEL)
    lost = np.isnan(found.motion[0][:, 0])
    assert np.flatnonzero(lost).tolist() == list(range(40, 49))
    # of a tank whose place is not known nothing is, but a tank that stays in its place is seen
    assert np.isnan(found.theta[40:49]).all() == (side == "tank")
    u = found.recording()["u_x"]
    own = np.asarray(u.sigma)
    assert np.isfinite(u.values).all() and np.max(own[42:46]) > 2 * np.median(own)
    assert "of 101 frames have no position" in " ".join(found.sentences())


def test_the_command_follows_a_marker(clips: dict[Side, Path], tmp_path: Path) -> None:
    names = {"--out": "run.csv", "--json": "q.json", "--overlay": "o.mp4",
             "--contact-sheet": "s.png"}
    words = [w for option, name in names.items() for w in (option, str(tmp_path / name))]
    said = CliRunner().invoke(app, ["track", str(clips["tank"]), *words, "--roi", "86,12,108,101",
                                    "--marker", "111,15,30,18", "--tank", "54mm,50.5mm"])
    assert said.exit_code == 0, said.output
    assert "by the marker on the tank" in said.output and 'hold = "cubic"' in said.output
    back = Recording.read(tmp_path / "run.csv")
    assert np.ptp(back["x"].values) == pytest.approx(PIXEL * np.ptp(MOVED), rel=2e-3)
    assert back["u_x"].unit == "m/s^2" and back["x"].sigma is not None
    told = json.loads((tmp_path / "q.json").read_text())["marker"]
    assert told["on"] == "tank" and told["found"] == COUNT
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(names.values())


@pytest.mark.parametrize(("words", "told"), [
    (["--marker", "111,15,30,18"], "--pixel, as 0.22mm"),
    (["--marker", "111,15,30,18", "--tank", "54mm,50mm"], "--roi"),
    (["--marker", "111,15,30,18", "--tank", "54mm,90mm", "--roi", "86,12,108,101"], "high"),
    (["--marker", "111,15,30"], "4 numbers"), (["--pixel", "1mm"], "--marker"),
    (["--marker", "111,15,30,18", "--pixel", "0mm"], "cannot be"),
    (["--marker", "111,15,30,18", "--pixel", "1mm", "--motion", "{clip}"], "one of them"),
    (["--marker", "5,50,20,20", "--pixel", "1mm"], "no texture")])
def test_wrong_words_are_refused(clips: dict[Side, Path], tmp_path: Path, words: list[str],
                                 told: str) -> None:
    clip = clips["tank"]
    said = CliRunner().invoke(app, ["track", str(clip), "--out", str(tmp_path / "x.csv"),
                                    *(w.replace("{clip}", str(clip)) for w in words)])
    assert isinstance(said.exception, errors.PikanidError) and told in str(said.exception)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("side", ["tank", pytest.param("background", marks=pytest.mark.slow)])
def test_parameters_of_a_video_alone_are_as_sure_as_stated(tmp_path: Path, side: Side) -> None:
    fine = np.arange(-1, 2002) * 1e-3
    x = 1.2e-3 * np.sin(np.pi * fine / 2) ** 3 * np.sin(12 * fine)
    drive = Recording.from_arrays(fine[1:-1], {"u_x": np.diff(x, 2) / 1e-6}, {"u_x": "m/s^2"})
    drive = drive.with_channels(replace(drive["u_x"], hold="cubic"))
    theta = np.interp(TIME, fine[1:-1], pk.simulate(slosh.model(), drive)["theta"].values)
    scene, area = CASES[side]
    moved = np.interp(TIME, fine, x) / PIXEL
    video = write(tmp_path / "run.avi", theta, scene, RATE, motion=[(a, 0.0) for a in moved])
    track(video, follow=(area, side), pixel=PIXEL).recording().write(tmp_path / "run.parquet")
    run = Recording.read(tmp_path / "run.parquet")
    fit = pk.NLS().fit(slosh.model().with_values(slosh.START), run)
    counted = pk.bootstrap(fit, run, 20, positions={"u_x": "x"})
    for name, true in slosh.TRUE.items():
        assert abs(fit.value(name) - true) < 3 * counted.std(name)
        # the motion's errors are the larger part
        assert counted.std(name) > 1.5 * fit.std(name)
