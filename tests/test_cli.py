"""The command line as a user meets it: results, exit codes, one sentence for every mistake."""

from __future__ import annotations

import gzip
import json
import os
import random
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pikanid as pk
from pikanid.cli import main
from pikanid.commands.options import adjusted, check_outputs, quantity
from pikanid.recording.excitation import EXCITATIONS
from pikanid.reporting import strict_json

Run = Callable[..., tuple[int, str, str]]
STRATEGIES = ("nls", "pda", "ipda")


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs a command line in an empty folder: (exit code, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)

    def call(*words: str) -> tuple[int, str, str]:
        capsys.readouterr()
        code = main(words)
        found = capsys.readouterr()
        return code, found.out, found.err

    return call


SIGMA = 0.1 * pi / 180


@pytest.fixture(scope="module")
def noisy() -> pk.Recording:
    """A noisy recording of the slosh pendulum."""
    return pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=SIGMA, seed=0)


@pytest.fixture
def recorded(noisy: pk.Recording, tmp_path: Path) -> str:
    """The name of that recording in the current folder."""
    noisy.write(tmp_path / "run.csv")
    return "run.csv"


def strict(text: str) -> dict[str, Any]:
    """JSON without NaN and infinity."""

    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is no JSON")

    return json.loads(text, parse_constant=refuse)


# --- what works ----------------------------------------------------------------------------------


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


def test_simulate_is_repeatable_and_exact_about_units(run: Run, tmp_path: Path) -> None:
    for name in ("a.csv", "b.csv.gz"):
        assert run("simulate", "-m", "sloshing", "--sigma", "0.1deg", "--seed", "3",
                   "--out", name)[0] == 0
    unpacked = gzip.decompress((tmp_path / "b.csv.gz").read_bytes())
    assert unpacked == (tmp_path / "a.csv").read_bytes()
    expected = pk.simulate(
        pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=SIGMA, seed=3)
    assert np.array_equal(
        pk.Recording.read("a.csv")["theta"].values, expected["theta"].values)


@pytest.mark.parametrize("model", ["linear_oscillator", "pendulum", "sloshing_2d"])
@pytest.mark.parametrize("excitation", EXCITATIONS)
def test_every_excitation_drives_every_model(run: Run, model: str, excitation: str) -> None:
    code, _, err = run("simulate", "-m", model, "-e", excitation, "--duration", "20", "-o", "a.csv")
    assert (code, err) == (0, "")
    names = set(pk.systems.SYSTEMS[model]().input_names)
    assert (set(pk.Recording.read("a.csv").names) - {"theta", "phi", "x"}) <= names


def test_simulate_with_recorded_inputs(run: Run, recorded: str) -> None:
    assert run("simulate", "-m", "sloshing", "-e", recorded, "-o", "again.csv")[0] == 0
    again, exact = pk.Recording.read("again.csv"), pk.simulate(
        pk.systems.sloshing(), pk.excitation.two_pulse())
    assert np.allclose(again["theta"].values, exact["theta"].values, atol=1e-9)


def test_models_lists_and_prints(run: Run) -> None:
    _, out, _ = run("models")
    assert all(name in out for name in pk.systems.SYSTEMS)
    _, out, _ = run("models", "sloshing")
    assert "l_theta" in out and "[equations]" in out


@pytest.mark.parametrize("name", list(pk.systems.SYSTEMS))
def test_printed_model_file_is_the_model(run: Run, name: str) -> None:
    code, out, _ = run("models", name, "--toml")
    assert code == 0
    assert pk.Model.from_dict(tomllib.loads(out)) == pk.systems.SYSTEMS[name]()


@pytest.mark.parametrize("words", [[], ["--help"], *([c, "--help"] for c in (
    "identify", "simulate", "models", "study"))], ids=" ".join)
def test_help_has_examples(run: Run, words: list[str]) -> None:
    code, out, _ = run(*words)
    assert code == 0
    assert "pikanid " in out and "Examples" in out


def test_version(run: Run) -> None:
    assert run("--version") == (0, f"pikanid {pk.__version__}\n", "")


# --- what does not work --------------------------------------------------------------------------

FILES: dict[str, bytes] = {
    "junk.csv": random.Random(0).randbytes(3000),
    "junk.mat": random.Random(1).randbytes(3000),
    "junk.xlsx": random.Random(2).randbytes(3000),
    "junk.parquet": random.Random(3).randbytes(3000),
    "junk.npz": random.Random(4).randbytes(3000),
    "empty.csv": b"",
    "header.csv": b"t,theta\n",
    "unit.csv": b"t [s],u_x [m/s^2],theta [parsec]\n0,0,0\n1,1,1\n2,0,3\n",
    "unknown_unit.csv": b"t,u_x,theta [blub]\n0,0,0\n1,1,1\n2,0,3\n",
    "no_theta.csv": b"t,u_x\n0,0\n1,1\n2,2\n",
    "no_input.csv": b"t,theta\n0,0\n1,1\n2,2\n",
    "word.csv": b"t,u_x,theta\n0,0,0\n1,x,1\n2,3,4\n",
    "back.csv": b"t,u_x,theta\n0,0,0\n2,0,1\n1,3,4\n",
    "no_time.csv": b"u_x,theta\n0,0\n0,1\n2,4\n",
    "dead.csv": b"t,u_x,theta\n0,0,1\n1,2,1\n2,3,1\n",
    "huge.csv": b"t,u_x,theta\n0,0,1e308\n1,2,-1e308\n2,3,1e307\n",
    "ragged.csv": b"t,u_x,theta\n0,0,1\n1,2\n2,3,1\n",
    "escape.csv": b"t,u_x,thet\x1b[31ma\n0,0,1\n1,2,3\n2,3,1\n",
    "broken.toml": b'name="x"\n[states\n',
    "junk.toml": random.Random(5).randbytes(300),
    "evil.toml": b'name="x"\n[states]\nx={}\n[equations]\nx="__import__(1)"\n'
                 b'[outputs]\nx={expression="x"}\n',
    "hollow.toml": b'name="x"\n',
}
IDENTIFY = ("identify", "run.csv", "--model", "sloshing")
MISTAKES: list[tuple[str, ...]] = [
    *(("identify", name, "--model", "sloshing") for name in FILES if not name.endswith("toml")),
    *(("identify", "run.csv", "--model", name) for name in FILES if name.endswith("toml")),
    ("identify", "absent.csv", "--model", "sloshing"),
    ("identify", "folder", "--model", "sloshing"),
    ("identify", "folder.csv", "--model", "sloshing"),
    ("identify", "run.xyz", "--model", "sloshing"),
    ("identify", "na\0me.csv", "--model", "sloshing"),
    ("identify", "run.csv"),
    ("identify", "--model", "sloshing"),
    ("identify", "run.csv", "--model", "slosing"),
    ("identify", "run.csv", "--model", "absent.toml"),
    ("identify", "run.csv", "--model", "folder"),
    ("identify", "run.csv", "--model", "run.csv"),
    ("identify", "run.csv", "--model", "linear_oscillator"),
    (*IDENTIFY, "--strategy", "nsl"),
    (*IDENTIFY, "--protocol", "papr"),
    *((*IDENTIFY, "--sigma", text) for text in (
        "0.1furlong", "0.1xyz", "abc", "-1", "0", "nan", "1e999", "phi=0.1", "=1", "theta=")),
    (*IDENTIFY, "--sigma", "1", "--sigma", "2"),
    *((*IDENTIFY, "--set", text) for text in (
        "l_theta", "l_teta=0.05", "l_theta=5", "l_theta=5kg", "l_theta=x", "=1", "theta=1")),
    (*IDENTIFY, "--set", "m=1", "--set", "m=2"),
    (*IDENTIFY, "--fix", "l_theta", "--fix", "d_theta"),
    (*IDENTIFY, "--fix", "l_theta", "--free", "l_theta"),
    (*IDENTIFY, "--fix", "l_theta="),
    (*IDENTIFY, "--free", "nix"),
    (*IDENTIFY, "--column", "theta=foo"),
    (*IDENTIFY, "--column", "thta=theta"),
    (*IDENTIFY, "--column", "theta"),
    (*IDENTIFY, "--unit", "theta=blub"),
    (*IDENTIFY, "--unit", "theta=kg"),
    *((*IDENTIFY, "--rate", text) for text in ("abc", "-5", "nan", "77")),
    (*IDENTIFY, "--from", "3", "--to", "2"),
    (*IDENTIFY, "--from", "30"),
    (*IDENTIFY, "--from", "nan"),
    *((*IDENTIFY, "--decimate", text) for text in ("0", "-3", "1.5", "1000")),
    (*IDENTIFY, "--seed", "-1"),
    (*IDENTIFY, "--json", "absent/a.json"),
    (*IDENTIFY, "--json", "a.txt"),
    (*IDENTIFY, "--json", "folder.json"),
    (*IDENTIFY, "--plot", "a.gif"),
    (*IDENTIFY, "--save", "a.pickle"),
    (*IDENTIFY, "--json", "a.json", "--save", "./a.json"),
    (*IDENTIFY, "--strategy", "all", "--save", "a.json"),
    (*IDENTIFY, "--bogus"),
    ("identfy",),
    ("--bogus",),
    ("simulate", "--model", "sloshing"),
    ("simulate", "--model", "sloshing", "--out", "a.txt"),
    ("simulate", "--model", "sloshing", "--out", "run.csv", "--excitation", "run.csv"),
    ("simulate", "--model", "sloshing", "--out", "a.csv", "--excitation", "absent.csv"),
    ("simulate", "--model", "sloshing", "--out", "a.csv", "--excitation", "two_puls"),
    ("simulate", "--model", "sloshing", "--out", "a.csv", "--excitation", "no_input.csv"),
    ("simulate", "--model", "sloshing", "--out", "a.csv", "--duration", "-1"),
    ("simulate", "--model", "sloshing", "--out", "a.csv", "--rate", "0"),
    ("simulate", "--model", "sloshing", "--out", "a.csv", "--rate", "7"),
    ("simulate", "--model", "sloshing", "--out", "a.csv", "--sigma", "1kg"),
    ("simulate", "--model", "sloshing", "--out", "a.csv", "--sigma", "-1"),
    ("models", "nix"),
    ("study", "--out", "run.csv"),
    ("study", "--seeds", "-1"),
]


@pytest.mark.parametrize("words", MISTAKES, ids=lambda words: " ".join(words).replace("\0", "~"))
def test_a_mistake_is_one_sentence_and_exit_code_2(
    run: Run, recorded: str, tmp_path: Path, words: tuple[str, ...]
) -> None:
    for name, content in FILES.items():
        (tmp_path / name).write_bytes(content)
    for name in ("folder", "folder.csv", "folder.json"):
        (tmp_path / name).mkdir()
    before = sorted(tmp_path.iterdir())
    code, out, err = run(*words)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1 and err.startswith("Error: ") and err[-2] in ".?"
    assert all(c.isprintable() for c in err[:-1])
    assert "Traceback" not in err
    assert sorted(tmp_path.iterdir()) == before


def test_an_output_never_overwrites_an_input(run: Run, recorded: str, tmp_path: Path) -> None:
    os.symlink(tmp_path / recorded, tmp_path / "link.json")
    content = (tmp_path / recorded).read_bytes()
    code, _, err = run("identify", recorded, "--model", "sloshing", "--json", "link.json")
    assert code == 2 and "overwrite" in err
    assert (tmp_path / recorded).read_bytes() == content


def test_outputs_are_checked_before_inputs_are_read(run: Run) -> None:
    code, _, err = run("identify", "absent.csv", "-m", "sloshing", "--plot", "absent/a.png")
    assert code == 2 and "--plot" in err


def test_devices_are_not_replaced() -> None:
    with pytest.raises(pk.errors.BadSetting, match="no regular file"):
        check_outputs({"--json": (os.devnull, [""])}, [])


# --- parts ---------------------------------------------------------------------------------------


def test_strict_json_has_no_nan() -> None:
    content = {"a": float("nan"), "b": [np.inf, np.float32(1)], "c": np.arange(2), "d": Path("x")}
    assert strict(strict_json.text(content)) == {"a": None, "b": [None, 1.0], "c": [0, 1], "d": "x"}


def test_a_sigma_is_a_difference() -> None:
    assert quantity("1 degC", "K", "x", difference=True) == 1.0
    assert quantity("1 degC", "K", "x") == pytest.approx(274.15)


def test_free_then_fix_then_set() -> None:
    model = adjusted(pk.systems.sloshing(), ["m=200g"], ["d_theta"], ["g"])
    assert model.free_names == ("l_theta", "g")
    assert model.parameter("m").value == pytest.approx(0.2)


# --- as a process --------------------------------------------------------------------------------


def process(*words: str, **options: Any) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pikanid", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, **options)


def test_help_loads_nothing_heavy() -> None:
    code = ("import sys\nfrom pikanid.cli import main\nmain(['identify', '--help'])\n"
            "print(*sys.modules, file=sys.stderr)")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    heavy = {"numpy", "scipy", "sympy", "matplotlib", "pandas", "numba"}
    assert heavy.isdisjoint(done.stderr.split())


def test_a_closed_pipe_is_silent() -> None:
    command = f"{sys.executable} -m pikanid models sloshing | true; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=120)
    assert (done.stdout.split()[-1], done.stderr) == ("141", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_is_one_sentence() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, "-m", "pikanid", "models"], stdout=full,
                              stderr=subprocess.PIPE, text=True, timeout=120)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and "space" in done.stderr


def test_an_interrupt_is_one_word_and_leaves_nothing(tmp_path: Path) -> None:
    child = subprocess.Popen(
        [sys.executable, "-m", "pikanid", "study", "--out", str(tmp_path), "--seeds", "100000"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        # a session in the background ignores interrupts, and its children would do as it does
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    time.sleep(4)
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=60)
    # A shell shows either as 130; which one depends on where Python was interrupted.
    assert child.returncode in (130, -signal.SIGINT)
    assert (out, err) == ("", "Interrupted.\n")
    assert list(tmp_path.iterdir()) == []


def test_an_ascii_terminal_gets_question_marks() -> None:
    done = process("models", env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0


def in_a_terminal(words: list[str], **environment: str) -> bytes:
    """What a command writes when it believes to be in a terminal."""
    code = ("import pty, sys, os\n"
            "out = []\n"
            "def read(fd):\n"
            "    data = os.read(fd, 65536); out.append(data); return data\n"
            f"pty.spawn({[sys.executable, '-m', 'pikanid', *words]!r}, read)\n")
    env = {**os.environ, "TERM": "xterm-256color", **environment}
    return subprocess.run([sys.executable, "-c", code], stdin=subprocess.DEVNULL, timeout=120,
                          capture_output=True, env=env).stdout


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_a_terminal_gets_progress_and_colour_unless_refused(recorded: str, tmp_path: Path) -> None:
    words = ["identify", str(tmp_path / recorded), "-m", "sloshing", "--sigma", "0.1deg"]
    assert b"fitting" in in_a_terminal(words)
    assert b"\x1b" in in_a_terminal(["models"])
    assert b"\x1b" not in in_a_terminal(["models"], NO_COLOR="1")
    assert b"\x1b" not in in_a_terminal(["models"], TERM="dumb")
