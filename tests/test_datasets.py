"""Real recordings: found in the folder, checked, cut as their authors cut them."""

from __future__ import annotations

import gzip
import itertools
import shutil
from pathlib import Path

import numpy as np
import pytest

from pikanid.errors import BadSetting, DatasetUnavailable
from pikanid.recording import datasets, origins


@pytest.fixture
def offline(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """No network and an empty cache; returns an empty folder of recordings."""
    import pooch
    import requests

    def refuse(*_: object, **__: object) -> None:
        raise requests.ConnectionError("no network")

    monkeypatch.setattr(pooch.HTTPDownloader, "__call__", refuse)
    monkeypatch.setattr(pooch, "os_cache", lambda _: tmp_path / "cache")
    folder = tmp_path / "recordings"
    folder.mkdir()
    monkeypatch.setenv(datasets.FOLDER, str(folder))
    return folder


def test_without_network_and_cache_it_says_what_to_do(offline: Path) -> None:
    with pytest.raises(DatasetUnavailable) as caught:
        datasets.silverbox()
    sentence = str(caught.value)
    assert "silverbox/SNLS80mV.mat" in sentence
    assert "raw.githubusercontent.com/biaslab/nsi-silverbox/728f07e" in sentence
    assert "PIKANID_DATA" in sentence


def test_a_folder_that_is_not_there(offline: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(datasets.FOLDER, str(offline / "missing"))
    with pytest.raises(DatasetUnavailable, match="cannot be downloaded"):
        datasets.falling_balls()


@pytest.mark.parametrize("damage", [b"", b"something else"])
def test_an_altered_file_is_refused(offline: Path, damage: bytes) -> None:
    path = offline / origins.SILVERBOX.local
    path.parent.mkdir()
    path.write_bytes(damage)
    with pytest.raises(DatasetUnavailable, match="checksum"):
        datasets.silverbox()
    packed = offline / f"{origins.FREE_SWING.local}.gz"
    packed.parent.mkdir()
    packed.write_bytes(gzip.compress(b"x" * 1000)[:20])
    with pytest.raises(DatasetUnavailable, match="checksum"):
        datasets.single_pendulum_free_swing()


def test_the_cache_is_used_without_network(
    recordings_folder: Path, offline: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    origin = origins.FALLING_BALLS
    cached = tmp_path / "cache" / origin.local
    cached.parent.mkdir(parents=True)
    shutil.copyfile(recordings_folder / origin.local, cached)
    monkeypatch.delenv(datasets.FOLDER)
    assert datasets.falling_balls().name == "Baseball, drop 1"


@pytest.mark.parametrize(
    "call",
    [
        lambda: datasets.single_pendulum("half"),  # type: ignore[arg-type]
        lambda: datasets.silverbox("half"),  # type: ignore[arg-type]
        lambda: datasets.falling_balls("cannon ball"),
        lambda: datasets.falling_balls(drop=3),  # type: ignore[arg-type]
        lambda: datasets.single_pendulum_excerpt("half"),  # type: ignore[arg-type]
        lambda: datasets.falling_balls_excerpt("cannon ball"),
        lambda: datasets.falling_balls_excerpt(drop=3),  # type: ignore[arg-type]
        lambda: datasets.slosh_lar("half"),
    ],
)
def test_what_there_is_not(call: object) -> None:
    with pytest.raises(BadSetting, match=r"There is no .* \(known: "):
        call()  # type: ignore[operator]


def test_every_origin_is_pinned() -> None:
    every = [origins.SINGLE_PENDULUM, origins.FREE_SWING, origins.SILVERBOX, origins.FALLING_BALLS]
    every += [origin for name in datasets.SLOSH_MOTIONS for origin in origins.slosh(name)]
    assert len({origin.sha256 for origin in every}) == len(every) == 34
    for origin in every:
        assert len(origin.commit) == 40
        assert len(origin.sha256) == 64
        assert " " not in origin.url


# --- what comes with the package -----------------------------------------------------------------


@pytest.mark.usefixtures("offline")
def test_excerpts_need_no_network_and_no_folder() -> None:
    train, other, whole = (datasets.single_pendulum_excerpt(part)
                           for part in ("train", "held_out", "all"))
    assert whole["theta"].uniform and len(whole["theta"]) == 5501
    assert other.start - train.stop == pytest.approx(0.01)
    for ball in datasets.BALLS:
        for drop in (1, 2):
            h = datasets.falling_balls_excerpt(ball, drop)["h"]  # type: ignore[arg-type]
            assert 40 < len(h) < 65 and h.values[0] > 44 > 20 > h.values[-1]
    assert datasets.falling_balls_excerpt("golf ball").name == "Golf Ball, drop 1"


def test_excerpts_are_small_and_carry_licence_and_source() -> None:
    folder = Path(datasets.__file__).parent / "data"
    sizes = {path.name: path.stat().st_size for path in folder.glob("*.csv")}
    assert len(sizes) == 3 and sum(sizes.values()) < 150_000
    readme = (folder / "README.md").read_text()
    for origin in (origins.SINGLE_PENDULUM, origins.FALLING_BALLS):
        assert all(x in readme for x in (origin.repository, origin.commit, origin.path))
        licence = (folder / f"LICENSE-{origin.local.split('/')[0].removesuffix('_uw')}.txt")
        assert licence.name in readme
        assert "MIT License\n\nCopyright (c) 20" in licence.read_text()
    assert all(name in readme for name in sizes)


@pytest.mark.usefixtures("recordings_folder")
@pytest.mark.parametrize("balls", [
    ("Golf Ball",), pytest.param(datasets.BALLS, marks=pytest.mark.slow)])
def test_excerpts_are_made_from_the_originals(balls: tuple[str, ...]) -> None:
    import thin_recordings

    folder = Path(datasets.__file__).parent / "data"
    made = thin_recordings.excerpts(balls)
    assert set(made) == {path.name for path in folder.glob("*.csv")}
    for name, text in made.items():
        kept = (folder / name).read_text().splitlines()
        if "ball,drop" in kept[0]:
            kept = [kept[0], *(row for row in kept if row.split(",")[0] in balls)]
        assert kept == text.splitlines()


def test_thinning_measures_what_it_would_fold_back() -> None:
    import thin_recordings

    t = np.arange(50_000) / 1000.0
    slow, fast = np.sin(2 * np.pi * 3.0 * t), 0.01 * np.sin(2 * np.pi * 80.0 * t)
    assert thin_recordings.above(slow + fast, 1000.0, 10) == pytest.approx(0.01 / 2**0.5, rel=0.01)
    assert thin_recordings.above(slow + fast, 1000.0, 5) < 1e-5


# --- the recordings themselves -------------------------------------------------------------------


@pytest.mark.usefixtures("recordings_folder")
def test_single_pendulum_follows_on() -> None:
    pieces = datasets.single_pendulum("all")
    assert [len(piece.t) for piece in pieces] == [9167] * 5 + [9166]
    assert pieces == datasets.single_pendulum() + datasets.single_pendulum("held_out")
    for before, after in itertools.pairwise(pieces):
        assert after.start - before.stop == pytest.approx(0.001)
    theta = pieces[0].as_output("theta", "rad")
    assert theta.values[0] == pytest.approx(1.52316373 - np.pi)
    rate = np.gradient(theta.values, theta.time)
    assert np.corrcoef(rate, pieces[0]["theta_dot"].values)[0, 1] > 0.999


@pytest.mark.usefixtures("recordings_folder")
def test_free_swing_comes_to_rest() -> None:
    theta = datasets.single_pendulum_free_swing()["theta"]
    assert theta.time[0] == 60.0
    assert np.max(np.abs(theta.values)) < 0.07
    assert np.ptp(theta.values[theta.time > 66]) < 0.001


@pytest.mark.usefixtures("recordings_folder")
def test_silverbox_is_cut_officially() -> None:
    lengths = {"train": 65062, "held_out": 21688, "arrow": 40475, "arrow_no_extrapolation": 32000}
    for part, length in lengths.items():
        rec = datasets.silverbox(part)  # type: ignore[arg-type]
        assert len(rec.t) == length
        assert 1 / rec["u"].interval == pytest.approx(610.35, abs=0.01)
    whole = datasets.silverbox("all")["u"].values
    np.testing.assert_array_equal(datasets.silverbox("held_out")["u"].values, whole[105712:127400])


@pytest.mark.usefixtures("recordings_folder")
@pytest.mark.parametrize("ball", [
    datasets.BALLS[0], *(pytest.param(b, marks=pytest.mark.slow) for b in datasets.BALLS[1:])])
def test_balls_fall(ball: str) -> None:
    for drop in (1, 2):
        rec = datasets.falling_balls(ball.lower().replace(" ", "_"), drop)  # type: ignore[arg-type]
        h, v = rec.as_output("h", "m"), rec.as_output("v", "m/s")
        assert 40 < len(h) < 65
        assert h.values[0] > 44
        assert v.values[-1] < -10


@pytest.mark.usefixtures("recordings_folder")
@pytest.mark.parametrize("name", datasets.SLOSH_MOTIONS)
def test_sloshing_runs_have_motion_and_heights(name: str) -> None:
    rec = datasets.slosh_lar(name)
    assert rec.names == ("x", "y", "z", "qx", "qy", "qz", "qw", "h")
    assert rec["x"].interval == pytest.approx(0.002)
    assert rec["h"].interval == pytest.approx(1 / 59.94, rel=1e-2)
    assert rec.as_output("h", "m").values.max() < 0.1
    attitude = np.array([rec[key].values for key in ("qx", "qy", "qz", "qw")])
    np.testing.assert_allclose(np.linalg.norm(attitude, axis=0), 1, atol=1e-9)
    idle = rec.window(0, 0.9)
    assert np.ptp(idle["x"].values) < 1e-3


def test_tanks_are_those_of_the_benchmark(recordings_folder: Path) -> None:
    train, held_out = (datasets.cascaded_tanks(part) for part in ("train", "held_out"))
    assert train.names == ("u", "h") and len(train.t) == len(held_out.t) == 1024
    assert (train["u"].unit, train["u"].hold, train.stop) == ("V", "zero", 4092.0)
    assert (train["u"].values[0], train["h"].values[0]) == (3.2567, 5.205)
    assert (held_out["u"].values[0], held_out["h"].values[0]) == (0.97619, 4.9728)
    assert train["h"].values.max() <= 10.0 and recordings_folder.is_dir()
    with pytest.raises(BadSetting, match="train"):
        datasets.cascaded_tanks("all")  # type: ignore[arg-type]  # what is no part


def test_runs_of_the_double_pendulum_have_torques_of_their_own(recordings_folder: Path) -> None:
    runs = [datasets.double_pendulum(part) for part in ("train", "held_out", "held_out_2")]
    for run in runs:
        assert {"q1", "q2", "tau1", "tau2"} == {*run.names} and 4990 < len(run.t) <= 5000
        assert run.t[0] == 0 and np.median(np.diff(run.t)) == pytest.approx(0.002, rel=1e-3)
        assert run["tau1"].hold == "zero" and run["q1"].unit == "rad"
        assert np.abs(run["q1"].values[0]) < 0.02  # hanging
    assert len({float(run["tau2"].values.max()) for run in runs}) == 3
    assert recordings_folder.is_dir()


def test_a_building_is_cut_in_two(recordings_folder: Path) -> None:
    train, other = (datasets.building(part) for part in ("train", "held_out"))
    assert (len(train.t), len(other.t)) == (4143, 2762) and train.t[1] == 900.0
    assert (train["T_a"].values[0], other["T_a"].values[0]) == (7.6, 4.8)
    assert other["T"].values[0] == pytest.approx(17.5708333)
    assert (train["T"].unit, train["P"].hold, recordings_folder.is_dir()) == ("degC", "zero", True)


def test_twelve_subjects_have_doses_of_their_own(recordings_folder: Path) -> None:
    subjects = datasets.theophylline()
    assert [len(s.t) for s in subjects] == [11] * 12 and recordings_folder.is_dir()
    assert all(np.ptp(s["dose"].values) == 0 for s in subjects)
    first = subjects[0]
    assert (first["dose"].values[0], first["c"].values[1], first.t[1]) == (4.02, 2.84, 900.0)


def test_populations_are_counted_by_year_and_by_day(recordings_folder: Path) -> None:
    pelts, boys = datasets.lynx_hare(), datasets.boarding_school()
    assert (len(pelts.t), pelts["prey"].values[1], pelts["predators"].values[1]) == (21, 47.2, 6.1)
    assert pelts.t[1] == 365.25 * 86400
    assert (len(boys.t), boys.t[1], boys["I"].values[0]) == (14, 86400.0, 3.4)
    assert recordings_folder.is_dir()
