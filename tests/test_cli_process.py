"""The command line as a process: pipes, interrupts, terminals, full disks."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest


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
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_full_disk_is_one_sentence(unbuffered: str) -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, "-m", "pikanid", "models"], stdout=full,
                              stderr=subprocess.PIPE, text=True, timeout=120,
                              env={**os.environ, "PYTHONUNBUFFERED": unbuffered})
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
    assert b"fitting" in (said := in_a_terminal(words, PIKANID_CACHE=str(tmp_path / "cache")))
    assert b"compiling sloshing" in said
    assert b"\x1b" in in_a_terminal(["models"])
    assert b"\x1b" not in in_a_terminal(["models"], NO_COLOR="1")
    assert b"\x1b" not in in_a_terminal(["models"], TERM="dumb")
