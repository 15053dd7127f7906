"""What a user can get wrong at the command line: one sentence, exit code 2, nothing written."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from commandline import Run

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
