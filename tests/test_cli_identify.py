"""`pikanid identify`: what it prints and writes, and what its options do."""

from __future__ import annotations

import re
from math import pi
from pathlib import Path

import numpy as np
import pytest
from commandline import SIGMA, Run, strict

import pikanid as pk

STRATEGIES = ("nls", "pda", "ipda")


def test_identify_prints_parameters_and_verdict(run: Run, recorded: str) -> None:
    code, out, err = run("identify", recorded, "--model", "sloshing", "--sigma", "0.1deg")
    assert code == 0
    assert "0.0450120 ± 0.0000098" in out
    assert "explains the recording" in out
    assert err == ""
    assert "\x1b" not in out


def test_identify_writes_what_was_agreed(run: Run, recorded: str, tmp_path: Path) -> None:
    code, *_ = run("identify", recorded, "--model", "sloshing", "--sigma", "0.1deg", "--quiet",
                   "--json", "a.json", "--plot", "a.png", "--save", "b.json.gz")
    assert code == 0
    content = strict((tmp_path / "a.json").read_text())
    assert set(content) >= {"schema_version", "model", "strategy", "parameters", "cost", "chi2",
                            "n", "warnings", "seconds", "seed", "version"}
    assert content["parameters"]["l_theta"].keys() == {"value", "std", "unit"}
    assert content["parameters"]["l_theta"]["value"] == pytest.approx(0.04501202, abs=2e-8)
    assert content["cost"] == pytest.approx(7.814036e-4, rel=1e-5)
    assert content["recordings"] == ["run"]
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert pk.Estimate.load(tmp_path / "b.json.gz").n == 501
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.json", "a.png", "b.json.gz", "run.csv"]


def test_a_page_lists_the_files_that_were_read(run: Run, recorded: str, tmp_path: Path) -> None:
    pk.systems.sloshing().save(tmp_path / "mine.toml")
    for model, read in (("mine.toml", ["run.csv", "mine.toml"]), ("sloshing", ["run.csv"])):
        assert run("identify", recorded, "--model", model, "--quiet", "--report", "a.html")[0] == 0
        listed = (tmp_path / "a.html").read_text(encoding="utf-8").split("<p>Files: ")[1]
        shown = re.findall("<code>(.*?)</code>", listed.split("</p>")[0])
        assert [Path(name).name for name in shown] == read


def test_all_strategies_side_by_side(
        run: Run, recorded: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pikanid.strategies.pinn_fit.NEWTON_STEPS", 25)  # of 400: half a minute
    code, out, _ = run("identify", recorded, "--model", "sloshing", "--sigma", "0.1deg",
                       "--strategy", "all", "--json", "-")
    content = strict(out)
    assert code == 0  # PDA misfits, but the model does explain the recording
    tried = [e["strategy"] for e in content["estimates"]]
    tried += [e["strategy"] for e in content["failed"]]
    assert set(STRATEGIES) <= set(tried)
    assert content["schema_version"] == 1


@pytest.mark.slow
def test_all_reports_what_cannot_be_used(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pikanid.strategies.pinn_fit.NEWTON_STEPS", 25)
    assert run("simulate", "--model", "pendulum", "--set", "theta_0=1", "--sigma", "0.1deg",
               "--out", "p.csv")[0] == 0
    # No strategy but NLS can estimate a delay.
    Path("late.toml").write_text("""
name = "late pendulum"
[states]
theta = { unit = "rad", initial = 1.0 }
theta_dot = { unit = "rad/s" }
[parameters]
l = { unit = "m", guess = 0.25, bounds = [0.05, 1.0] }
tau = { unit = "s", guess = 0.001, bounds = [0.0, 0.1] }
[equations]
theta = "theta_dot"
theta_dot = "-9.81/l*sin(theta) - 0.1*theta_dot"
[outputs]
theta = { unit = "rad", expression = "theta", delay = "tau" }
""")
    code, out, _ = run("identify", "p.csv", "--model", "late.toml", "--sigma", "0.1deg",
                       "--strategy", "all", "--json", "-")
    content = strict(out)
    assert code == 0
    assert "ipda" in [f["strategy"] for f in content["failed"]]
    assert all(f["reason"].endswith(".") for f in content["failed"])


def test_a_misfit_is_exit_code_3(run: Run, recorded: str) -> None:
    code, out, _ = run("identify", recorded, "--model", "sloshing", "--sigma", "0.1deg",
                       "--fix", "d_theta=2.0")
    assert code == 3
    assert "does NOT explain" in out


def test_quiet_prints_nothing(run: Run, recorded: str) -> None:
    assert run("identify", recorded, "-m", "sloshing", "--sigma", "0.1deg", "-q") == (0, "", "")


def test_several_recordings_are_fitted_jointly(run: Run, recorded: str, tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_bytes((tmp_path / recorded).read_bytes())
    code, out, _ = run("identify", recorded, "b.csv", "--model", "sloshing", "--sigma", "0.1deg",
                       "--json", "-")
    content = strict(out)
    assert (code, content["n"], content["recordings"]) == (0, 1002, ["run", "b"])


def test_columns_units_rate_and_headers(run: Run, tmp_path: Path) -> None:
    rec = pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse())
    table = np.column_stack([rec["u_x"].values, rec["theta"].values * 180 / pi])
    np.savetxt(tmp_path / "raw.csv", table, delimiter=";", header="acc;angle", comments="")
    code, out, _ = run("identify", "raw.csv", "--model", "sloshing", "--column", "u_x=acc",
                       "--column", "theta=angle", "--unit", "theta=deg", "--rate", "100",
                       "--sigma", "0.01deg", "--json", "-")
    assert code == 0
    assert strict(out)["parameters"]["l_theta"]["value"] == pytest.approx(0.045, rel=1e-6)


def test_sigma_is_converted_to_the_unit_of_the_file(
    run: Run, noisy: pk.Recording, tmp_path: Path
) -> None:
    noisy.with_channels(noisy["theta"].converted("deg")).write(tmp_path / "deg.csv")
    found = [strict(run("identify", "deg.csv", "-m", "sloshing", "--sigma", text, "--json", "-")[1])
             for text in ("0.1deg", str(SIGMA), "theta=0.1 deg")]
    assert {f"{content['chi2']['value']:.4f}" for content in found} == {"513.0393"}


def test_window_and_decimation_keep_the_inputs(run: Run, recorded: str) -> None:
    code, out, _ = run("identify", recorded, "-m", "sloshing", "--sigma", "0.1deg", "--json", "-",
                       "--from", "0.15", "--to", "4.55", "--decimate", "7")
    content = strict(out)
    assert (code, content["n"]) == (0, 63)
    assert content["parameters"]["l_theta"]["value"] == pytest.approx(0.045, rel=5e-3)


def test_a_state_can_be_freed(run: Run, recorded: str) -> None:
    code, out, _ = run("identify", recorded, "-m", "sloshing", "--sigma", "0.1deg", "--from", "2",
                       "--free", "theta", "--free", "theta_dot", "--json", "-")
    assert code == 0
    assert "theta_0[0]" in strict(out)["parameters"]


def test_protocol_of_the_paper(run: Run, recorded: str) -> None:
    code, out, _ = run("identify", recorded, "-m", "sloshing", "--sigma", "0.1deg",
                       "--protocol", "paper", "--set", "l_theta=60mm", "--json", "-")
    content = strict(out)
    assert (code, content["settings"]["protocol"]) == (0, "paper")
