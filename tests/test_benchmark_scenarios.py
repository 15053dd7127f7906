"""Scenarios of the benchmark: what they make, what can be said in a file, what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import pikanid as pk
from pikanid import errors
from pikanid.uncertainty import cramer_rao
from pikanid.validation.benchmark import files, summary
from pikanid.validation.benchmark.noise import Noise
from pikanid.validation.benchmark.scenario import Scenario
from pikanid.validation.study import slosh


def test_the_papers_scenarios_are_those_of_table_2() -> None:
    """Written out here once more: {N = 501, 51} × {clean, 0.1°, 1°} under two pulses."""
    truth = pk.systems.sloshing().with_values(l_theta=0.045, d_theta=0.15)
    cases = [(s, noise) for s in (1, 10) for noise in (0.0, 0.1, 1.0)]
    for one, (stride, degrees) in zip(files.chosen(["paper"]), cases, strict=True):
        sigma = degrees * np.pi / 180
        full = pk.simulate(truth, pk.excitation.two_pulse(), sigma=sigma, seed=3)["theta"]
        mine = one.recording(3)["theta"]
        np.testing.assert_allclose(mine.values, full.values[::stride], rtol=0, atol=1e-15)
        assert np.array_equal(mine.time, full.time[::stride])
        assert mine.sigma == (pytest.approx(sigma) if sigma else None)
        assert len(one.recording(3)["u_x"]) == 501
        assert one.true == {"l_theta": 0.045, "d_theta": 0.15}
        assert [one.fitted.values[p] for p in one.true] == [0.06, 0.05]


@pytest.mark.parametrize("name", [*files.GROUPS["paper"], *files.GROUPS["beyond"]])
def test_every_ready_made_scenario_makes_its_recording_again(name: str) -> None:
    one, again = files.chosen([name])[0], files.chosen([name])[0]
    assert one.digest == again.digest
    assert np.array_equal(one.recording(1)["theta"].values, again.recording(1)["theta"].values)
    same = np.array_equal(one.recording(1)["theta"].values, one.recording(2)["theta"].values)
    assert same == one.clean


def test_the_bound_is_that_of_the_kit() -> None:
    for name in ("dense_low", "sparse_high"):
        one = files.chosen([name])[0]
        wanted = cramer_rao(slosh.model(), one.recording(0))
        assert one.bound is not None
        for p in one.true:
            assert one.bound[p] == pytest.approx(wanted.std(p), rel=1e-6)


def test_no_bound_where_it_would_be_another_problems() -> None:
    for name in ("dense_clean", "dense_process", "dense_drag", "dense_late"):
        assert files.chosen([name])[0].bound is None


def test_the_bound_with_coloured_noise_is_that_of_its_covariance() -> None:
    noise, n, stride = Noise(0.3, correlation=0.8), 40, 2
    jacobian = np.random.default_rng(0).normal(size=(n, 2))
    lag = stride * np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    wanted = jacobian.T @ np.linalg.solve(0.3**2 * 0.8**lag, jacobian)
    white = noise.whitened(jacobian, stride)
    np.testing.assert_allclose(white.T @ white, wanted, rtol=1e-10)


def test_coloured_noise_has_its_size_and_correlation() -> None:
    # 20,000 samples: standard errors are 0.02 sigma and 0.005; four of them are allowed
    e = Noise(2.0, correlation=0.8).drawn(np.random.default_rng(0), 20_000)
    assert np.std(e) == pytest.approx(2.0, abs=0.17)
    assert np.corrcoef(e[1:], e[:-1])[0, 1] == pytest.approx(0.8, abs=0.02)
    assert np.corrcoef(e[3:], e[:-3])[0, 1] == pytest.approx(0.8**3, abs=0.05)


def test_outliers_cost_little_information_and_are_as_many_as_said() -> None:
    noise = Noise(1.0, outliers=0.05, size=20.0)
    e = noise.drawn(np.random.default_rng(0), 20_000)
    # beyond five: a share of 0.05·P(|N(0, 20²+1)| > 5) = 0.0401; standard error 0.0014
    assert np.mean(np.abs(e) > 5.0) == pytest.approx(0.0401, abs=0.006)
    assert 0.9 < noise.information < 0.96
    assert Noise(1.0).information == 1.0
    # of one Gaussian with the same variance as itself
    assert Noise(1.0, outliers=0.5, size=1e-6).information == pytest.approx(1.0, abs=1e-6)


def test_process_noise_shakes_the_motion_and_not_the_sensor() -> None:
    one = files.chosen(["dense_process"])[0]
    still = files.chosen(["dense_low"])[0]
    shaken = one.recording(0)
    assert shaken.names == still.recording(0).names
    off = shaken["theta"].values - still.recording(0)["theta"].values
    # the sensor's noise is the same and drops out; what is left is smooth
    assert 0.002 < np.std(off) < 0.1
    assert np.std(np.diff(off, 2)) < 0.05 * np.std(off)


def test_a_file_of_ones_own(tmp_path: Path) -> None:
    pk.systems.thermal_rc().save(tmp_path / "room.toml")
    model = pk.systems.thermal_rc()
    t = np.arange(0.0, 3600.0, 60.0)
    drive = pk.Recording.from_arrays(
        t, {i.name: np.where(t % 1800 < 900, 100.0, 0.0) for i in model.inputs},
        {i.name: i.unit for i in model.inputs})
    drive.write(tmp_path / "day.csv")
    free = model.free_names[0]
    (tmp_path / "mine.toml").write_text(
        '[defaults]\nmodel = "room.toml"\nexcitation = "day.csv"\n'
        f'[scenarios.warm]\nvalues = {{ {free} = {1.1 * model.values[free]} }}\n'
        'stride = 2\n[scenarios.warm.noise]\nsigma = 0.05\ncorrelation = 0.5\n', "utf-8")
    (one,) = files.chosen([str(tmp_path / "mine.toml")])
    assert (one.name, one.label, one.stride) == ("warm", "warm", 2)
    assert one.true[free] == pytest.approx(1.1 * model.values[free])
    assert one.bound is not None and set(one.bound) == set(model.free_names)
    assert len(one.recording(0)[model.output_names[0]]) == 30


def test_the_readmes_scenario_can_be_read(tmp_path: Path) -> None:
    readme = (Path(__file__).resolve().parents[1] / "README.md").read_text("utf-8")
    (content,) = (b for b in re.findall(r"```toml\n(.*?)```", readme, re.DOTALL)
                  if b.startswith("# mine.toml"))
    (model,) = (b for b in re.findall(r"```toml\n(.*?)```", readme, re.DOTALL)
                if b.startswith("# my.toml"))
    (tmp_path / "my.toml").write_text(model, "utf-8")
    pk.excitation.two_pulse().write(tmp_path / "run.csv")
    (tmp_path / "mine.toml").write_text(content, "utf-8")
    (one,) = files.chosen([str(tmp_path / "mine.toml")])
    assert one.true == {"l": 0.05} and one.fitted.values["l"] == 0.06
    assert len(one.recording(0)["theta"]) == 126


def text(**changes: str) -> str:
    entries = {"model": '"sloshing"', "excitation": '"two_pulse"', "noise": "{ sigma = 0.01 }"}
    return "[scenarios.one]\n" + "\n".join(
        f"{k} = {v}" for k, v in (entries | changes).items() if v)


@pytest.mark.parametrize(("content", "said"), [
    ("nonsense", "cannot be read"),
    (text(model="3"), "text in quotes"),
    (text(model=""), "'one' lacks model"),
    (text(model='"slushing"'), "Did you mean 'sloshing'"),
    (text(excitation='"absent.csv"'), "absent.csv"),
    (text(stride="0"), "an integer from 1"),
    (text(noise="{ sigma = -1.0 }"), "from 0"),
    (text(noise='{ sigma = "1 kg" }'), "kg"),
    (text(noise="{ sigma = 0.1, correlation = 1.5 }"), "correlation"),
    (text(process="{ omega = 1.0 }"), "omega"),
    (text(values="{ length = 0.1 }"), "length"),
    (text(start="{ l_theta = 0.045, other = 1 }"), "other"),
    (text(colour='"red"'), "colour"),
    ('[scenarios."../x"]\n', "letters, digits and _"),
    (text(model='"pendulum"', truth='"sloshing"', excitation='"two_pulse"'), "u_x|one"),
])
def test_what_a_file_cannot_say(content: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(content, "utf-8")
    with pytest.raises(errors.PikanidError, match=said):
        files.chosen([str(tmp_path / "bad.toml")])


def test_an_unknown_scenario_is_named_with_the_nearest() -> None:
    with pytest.raises(errors.BadSetting, match="Did you mean 'sparse_low'"):
        files.chosen(["sparse_lo"])


def test_two_scenarios_of_one_name_are_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(
        text().replace("one", "dense_low"), "utf-8")
    with pytest.raises(errors.BadSetting, match="Two different scenarios"):
        files.chosen(["dense_low", str(tmp_path / "mine.toml")])


def cell(estimates: list[float], std: float = 0.1, bound: float = 0.1) -> summary.Cell:
    values = np.array(estimates)
    return summary.Cell(values, np.full(values.size, std), 1.0, bound)


def test_a_cell_says_what_its_estimates_are() -> None:
    one = cell([1.1, 0.9, 1.2, np.nan])
    assert one.median == pytest.approx(1.1)
    assert one.bias.value == pytest.approx(0.2 / 3)
    assert one.rmse.value == pytest.approx(np.sqrt(0.06 / 3))
    assert one.ratio.value == pytest.approx(np.sqrt(2.0))
    assert one.coverage.value == pytest.approx(2 / 3)
    assert one.broken.tolist() == [False, False, False, True]
    assert cell([1.55, 1.65]).broken.tolist() == [False, True]  # six bounds are 0.6
    assert cell([1.4, 1.55], bound=np.nan).broken.tolist() == [False, True]  # half of the value
    assert summary.breakdowns([cell([1.0, 3.0]), cell([5.0, 1.0])]).value == 1.0


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    # 400 studies of 60 seeds: coverage of 95 % has a standard error of 1.1 %; the bootstrap of 60
    # errors is a little short, 91 to 97.5 % is allowed
    rng = np.random.default_rng(0)
    held = [0, 0]
    for _ in range(400):
        one = cell(list(1.0 + 0.1 * rng.normal(size=60)))
        held[0] += one.bias.low <= 0.0 <= one.bias.high
        held[1] += one.ratio.low <= 1.0 <= one.ratio.high
    assert all(0.91 * 400 <= n <= 0.975 * 400 for n in held)


def test_scenarios_of_others_are_no_true_values() -> None:
    one = files.chosen(["dense_low"])[0]
    other = Scenario("x", "x", pk.systems.linear_oscillator(), one.fitted, one.drive, one.noise)
    assert not other.true
