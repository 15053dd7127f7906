"""From a clip to a recording with a sigma for each frame; bad videos in a sentence."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from pikanid import errors
from pikanid.cli import app
from pikanid.recording import Recording
from pikanid.tracking import drawing
from pikanid.tracking.frames import open_film
from pikanid.tracking.region import Region
from pikanid.tracking.render import Cover, Scene, Stage, write
from pikanid.tracking.video import track

cv2 = pytest.importorskip("cv2")
SCENE = Scene(size=(200, 240), tank=(30, 20, 180, 160))
TRUTH = np.radians(15) * np.sin(np.arange(80) / 9)


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("clip") / "run.avi", TRUTH, SCENE, rate=50.0)


def spoilt(path: Path, **wrong: int) -> Path:
    """The clip with one frame hidden, one repeated, some of them left out."""
    stage, rng = Stage(SCENE), np.random.default_rng(0)
    pictures = [np.ascontiguousarray(stage.picture(a, rng)[..., ::-1]) for a in TRUTH]
    if "hidden" in wrong:
        pictures[wrong["hidden"]][:] = 30
    if "repeated" in wrong:
        pictures[wrong["repeated"]] = pictures[wrong["repeated"] - 1]
    path.mkdir()
    for k, shown in enumerate(pictures):
        if k != wrong.get("dropped"):
            cv2.imwrite(str(path / f"frame_{k:04d}.png"), shown)
    return path


@pytest.mark.parametrize("ending", ["avi", "mp4"])
def test_a_clip_becomes_a_recording(tmp_path: Path, ending: str) -> None:
    found = track(write(tmp_path / f"run.{ending}", TRUTH, SCENE, rate=50.0))
    found.recording().write(tmp_path / "run.csv")
    back = Recording.read(tmp_path / "run.csv")["theta"]
    assert back.interval == pytest.approx(0.02) and not np.isnan(back.values).any()
    off, sigma = back.values - TRUTH, np.asarray(back.sigma)
    assert np.sqrt(np.mean(off**2)) < np.radians(0.1)
    # errors of compressed frames are alike in time: fewer than 80 independent ones
    assert 0.5 < np.sqrt(np.mean((off / sigma) ** 2)) < 1.6


def test_a_folder_tells_what_is_hidden_repeated_and_missing(tmp_path: Path) -> None:
    folder = spoilt(tmp_path / "images", hidden=7, repeated=20, dropped=40)
    found = track(folder, rate=50.0)
    assert len(found.seen) == 79 and found.dropped == (pytest.approx(39 / 50),)
    assert np.flatnonzero(np.isnan(found.theta)).tolist() == [7, 20]
    assert "same picture" in found.reasons[20] and found.reasons[7]
    np.testing.assert_allclose(np.delete(found.time, 0), np.delete(np.arange(80) / 50, [0, 40]))
    notes = " ".join(found.recording().notes)
    assert "1 of 79 frames have no angle" in notes and "missing after 1" in notes


def test_a_slower_playing_clip_has_the_cameras_times(clip: Path) -> None:
    assert track(clip, rate=500.0).time[-1] == pytest.approx(79 / 500)


def test_a_truncated_video_gives_what_can_be_read(clip: Path, tmp_path: Path) -> None:
    content = clip.read_bytes()
    (tmp_path / "cut.avi").write_bytes(content[:len(content) // 2])
    found = track(tmp_path / "cut.avi")
    assert 20 < len(found.seen) < 60
    whole = track(clip)
    np.testing.assert_array_equal(found.theta[:20], whole.theta[:20])
    if found.promised:
        assert "The video ends after" in " ".join(found.recording().notes)


def test_a_stopped_run_goes_on_and_finds_the_same(clip: Path, tmp_path: Path) -> None:
    journal = tmp_path / "frames"
    whole = track(clip)

    def stop(number: int) -> None:
        if number == 61:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        track(clip, journal=journal, step=stop)
    with journal.open("a") as file:
        file.write("[62, 1.2")  # the line at which it was killed
    done: list[int] = []
    again = track(clip, journal=journal, step=done.append)
    assert done[0] == 62 and "first 61 frames" in again.notes[0]
    np.testing.assert_array_equal(again.theta, whole.theta)
    np.testing.assert_array_equal(again.sigma, whole.sigma)
    assert not journal.exists()


def test_a_journal_of_another_question_is_left_aside(clip: Path, tmp_path: Path) -> None:
    journal = tmp_path / "frames"
    journal.write_text('{"video": "another"}\n[0, 0.0]\n')
    assert not track(clip, journal=journal).notes


def test_seen_from_behind_the_angle_is_the_other_one(clip: Path) -> None:
    np.testing.assert_array_equal(track(clip, flip=True).theta, -track(clip).theta)


def test_what_is_no_video_is_refused(tmp_path: Path) -> None:
    (tmp_path / "no.avi").write_bytes(b"no video")
    with pytest.raises(errors.BadRecording, match="no picture"):
        track(tmp_path / "no.avi", rate=50.0)
    with pytest.raises(errors.BadRecording, match="There is no file"):
        track(tmp_path / "absent.avi")
    (tmp_path / "folder").mkdir()
    with pytest.raises(errors.BadRecording, match="no picture"):
        track(tmp_path / "folder", rate=1.0)


def test_what_cannot_be_set_is_refused(clip: Path) -> None:
    with pytest.raises(errors.BadSetting, match="within the picture"):
        track(clip, region=Region(100, 0, 200, 100))
    with pytest.raises(errors.BadSetting, match="frames per second"):
        track(clip, rate=-1.0)


def test_the_command_writes_all_that_is_asked_for(clip: Path, tmp_path: Path) -> None:
    rest = np.arange(80) / 50
    Recording.from_arrays(rest, {"acc": np.ones(80)}, {"acc": "m/s^2"}).write(tmp_path / "m.csv")
    asked = {"--out": "run.csv", "--plot": "t.png", "--contact-sheet": "s.png",
             "--overlay": "o.mp4", "--json": "q.json"}
    words = [w for option, name in asked.items() for w in (option, str(tmp_path / name))]
    said = CliRunner().invoke(app, ["track", str(clip), *words, "--motion",
                                    str(tmp_path / "m.csv"), "--column", "u_x=acc",
                                    "--delay", "10ms"])
    assert said.exit_code == 0, said.output
    assert "80 frames at 50 per second, 80 with an angle" in said.output
    found = Recording.read(tmp_path / "run.csv")
    assert found["u_x"].time[0] == pytest.approx(0.01) and len(found["theta"]) == 80
    assert json.loads((tmp_path / "q.json").read_text())["angles"] == 80
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([*asked.values(), "m.csv"])
    assert len(track(tmp_path / "o.mp4", region=Region(34, 40, 170, 130)).seen) == 80


def test_no_line_is_drawn_where_the_whole_track_says_that_there_is_none(tmp_path: Path) -> None:
    cover = Cover((100, 95), (200, 95), 16.0, 40, 41, (0.0, 0.0), SCENE.dye)
    path = write(tmp_path / "run.avi", TRUTH, replace(SCENE, covers=(cover,)), rate=50.0)
    at_once: list[bool] = []
    found = track(path, watch=lambda frame, edges, surface: at_once.append(bool(surface.reason)))
    assert not any(at_once) and [s.number for s in found.seen if s.surface.reason] == [40, 41]
    shown = list(drawing.stills(open_film(path), found, range(38, 44)))
    assert [s.frame.number for s in shown if not len(s.found.x)] == [40, 41]
    there, flagged = (drawing.overlaid(s, found) for s in shown[1:3])
    assert (there == drawing.LINE).all(axis=2).any()
    assert not (flagged == drawing.LINE).all(axis=2).any()


@pytest.mark.parametrize(("words", "told"), [
    (["--roi", "1,2,3"], "4 numbers"), (["--corners", "1,2 3,4"], "--tank"),
    (["--column", "u_x=acc"], "--motion"), (["--colour", "red"], "colour range"),
    (["--lens", "0.1"], "--corners"), (["--overlay", "x.gif"], "--overlay")])
def test_wrong_words_are_refused(clip: Path, tmp_path: Path, words: list[str], told: str) -> None:
    said = CliRunner().invoke(app, ["track", str(clip), "--out", str(tmp_path / "x.csv"), *words])
    assert isinstance(said.exception, errors.PikanidError) and told in str(said.exception)
    assert not list(tmp_path.iterdir())
