"""Commands killed at random moments: what do they leave behind?

Usage: python benchmarks/reliability_kills.py COMMAND FILE.json

`conceal`, `study`, `identify --json --plot` and `diagnose --json --report` are killed (SIGKILL)
at moments drawn uniformly over the time that they take, every second one within its last tenth,
where files are written.  After each kill: outputs are all there and whole, or none is; no worker is
left after ten seconds; whoever may read the folder finds no secret.  After the last kill the same
command is run to its end.  Needs Linux: processes are found in /proc.
"""

from __future__ import annotations

import json
import os
import signal
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from pikanid.storage.outputs import STAGED, atomically

SEED = 21
MARK = "PIKANID_KILLED_RUN"
PATIENCE = 10.0  # [s] for workers to end
KILLS = {"identify": 16, "diagnose": 12, "conceal": 14, "study": 10}
# The study with two strategies, the second fitted in a process of its own as PINN is in the whole
# study, which takes minutes.
STUDY = """
import sys
from pathlib import Path
from pikanid.reporting.study_report import write
from pikanid.strategies import PDA
from pikanid.validation.study import run
if __name__ == "__main__":
    PDA.slow = True
    write(run.run(0, ("nls", "pda")), Path(sys.argv[1]))
"""
MODEL = ["--model", "sloshing", "--sigma", "0.1deg", "--quiet"]


@dataclass(frozen=True)
class Killed:
    """One kill, the seconds after which it came, and what was wrong afterwards.

    `strays` counts hidden files, not yet renamed, that kills have left beside the outputs.
    """

    command: str
    after: float
    ended: bool
    wrong: tuple[str, ...]
    strays: int


@dataclass(frozen=True)
class Command:
    """What is run, and what has to hold of the files in its folder after a kill."""

    words: Sequence[str]
    wrong: Callable[[Path], list[str]]


def commands(place: Path) -> Mapping[str, Command]:
    """The four commands, their files below `place`."""
    script = place / "study.py"
    script.write_text(STUDY)
    run, other = str(place / "run.csv"), str(place / "other.csv")
    out = [place / name for name in ("identify", "diagnose", "conceal", "study")]
    for folder in out:
        folder.mkdir()
    return {
        "identify": Command(
            ["-m", "pikanid", "identify", run, *MODEL, "--json", str(out[0] / "a.json"),
             "--plot", str(out[0] / "a.png")], pair),
        "diagnose": Command(
            ["-m", "pikanid", "diagnose", run, "--held-out", other, *MODEL,
             "--json", str(out[1] / "a.json"), "--report", str(out[1] / "a.html")], pair),
        "conceal": Command(
            ["-m", "pikanid", "conceal", "--out", str(out[2] / "given"), "--truth",
             str(out[2] / "truth.json"), "--cases", "6", "--mix", "nothing=1", "--excitation",
             "two_pulse", "--workers", "2", "--quiet"], concealed),
        "study": Command([str(script), str(out[3])], reported)}


def pair(folder: Path) -> list[str]:
    """JSON and picture or page: both or none, and whole."""
    files = sorted(p for p in folder.iterdir() if not p.match(STAGED))
    if len(files) not in (0, 2):
        return [f"{len(files)} of 2 files"]
    return [f"{p.name} is not whole" for p in files if not whole(p)]


def whole(file: Path) -> bool:
    """Whether a file ends as its kind does."""
    data = file.read_bytes()
    if file.suffix == ".json":
        return isinstance(json.loads(data), dict)
    return data.rstrip().endswith({".png": b"IEND\xaeB`\x82", ".html": b"</html>"}[file.suffix])


def concealed(folder: Path) -> list[str]:
    """No secret where somebody else can read it, and no recording before all are made."""
    state, given = folder / "truth.json.unfinished", folder / "given"
    wrong = []
    if state.exists() and stat.S_IMODE(state.stat().st_mode) & 0o077:
        wrong.append("the unfinished set is open to others")
    note = state / "set.json"
    if note.exists():
        key = json.loads(note.read_bytes())
        texts = [p.read_bytes() for p in given.iterdir()] if given.exists() else []
        wrong += [f"the {name} lies in the folder" for name in ("seed", "nonce")
                  if any(str(key[name]).encode() in text for text in texts)]
    truth = folder / "truth.json"
    if truth.exists():
        from pikanid.validation.concealed.seal import matches

        if not matches(given, truth):
            wrong.append("the seal does not fit")
        if stat.S_IMODE(truth.stat().st_mode) & 0o077:
            wrong.append("the truth is open to others")
    return wrong


def reported(folder: Path) -> list[str]:
    """The page is there with all its figures, or nothing is."""
    page = folder / "study.md"
    pictures = list((folder / "figures").glob("*.png"))
    if not page.exists():
        return [f"{len(pictures)} figures without a page"] if pictures else []
    named = page.read_text().count("](figures/")
    return [] if len(pictures) == named and all(map(whole, pictures)) else ["figures are missing"]


def kills(name: str, seed: int = SEED) -> list[Killed]:
    """Kill a command `KILLS[name]` times, then let it run to its end."""
    rng, found = np.random.default_rng([seed, list(KILLS).index(name)]), list[Killed]()
    with tempfile.TemporaryDirectory() as text:
        place = Path(text)
        environment = {**os.environ, MARK: text, "OMP_NUM_THREADS": "1",
                       "OPENBLAS_NUM_THREADS": "1"}
        _recordings(place)
        command = commands(place)[name]
        span = _to_its_end(name, command, place / name, environment).after
        clear(place / name)
        while sum(not k.ended for k in found) < KILLS[name]:
            after = span * float(rng.uniform(0.9 if len(found) % 2 else 0.0, 1.0))
            found.append(_killed(name, command, place / name, after, environment))
            print(found[-1], file=sys.stderr, flush=True)
            if found[-1].ended:  # quicker than it was: the next one has something to interrupt
                span = min(span, found[-1].after)
                clear(place / name)
        found.append(_to_its_end(name, command, place / name, environment))
        print(found[-1], file=sys.stderr, flush=True)
    return found


def clear(folder: Path) -> None:
    """Remove what a command has written."""
    for path in sorted(folder.rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()


def _to_its_end(name: str, command: Command, folder: Path, environment: Mapping[str, str]
                ) -> Killed:
    begun = time.monotonic()
    done = subprocess.run([sys.executable, *command.words], env=environment)
    wrong = command.wrong(folder)
    if done.returncode != 0 or (folder / "truth.json.unfinished").exists():
        wrong.append(f"it could not be finished: exit code {done.returncode}")
    left = [path.name for path in folder.rglob(STAGED)]
    return Killed(f"{name}, to its end", time.monotonic() - begun, True, tuple(wrong), len(left))


def _killed(name: str, command: Command, folder: Path, after: float,
            environment: Mapping[str, str]) -> Killed:
    begun = time.monotonic()
    process = subprocess.Popen([sys.executable, *command.words], env=environment,
                               stderr=subprocess.DEVNULL)
    try:
        ended = process.wait(after) == 0
    except subprocess.TimeoutExpired:
        ended = False
    seconds = time.monotonic() - begun
    process.send_signal(signal.SIGKILL)
    process.wait()
    wrong = command.wrong(folder)
    until = time.monotonic() + PATIENCE
    while (left := _of(environment[MARK])) and time.monotonic() < until:
        time.sleep(0.1)
    for number in left:
        os.kill(number, signal.SIGKILL)
    if left:
        wrong.append(f"{len(left)} processes were left")
    return Killed(name, seconds, ended, tuple(wrong), len(list(folder.rglob(STAGED))))


def _of(mark: str) -> list[int]:
    """Processes whose environment holds the mark."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and f"{MARK}={mark}".encode() in (
                    entry / "environ").read_bytes().split(b"\0"):
                found.append(int(entry.name))
        except OSError:
            continue
    return found


def _recordings(place: Path) -> None:
    from pikanid.model import systems
    from pikanid.recording import excitation
    from pikanid.simulation import simulate

    for seed, name in enumerate(("run", "other")):
        made = simulate(systems.sloshing(), excitation.two_pulse(5.0 - seed, 0.02),
                        sigma={"theta": 0.1 * np.pi / 180}, seed=seed)
        made.write(place / f"{name}.csv")


def main(command: str, file: str) -> None:
    """Kill, print what was wrong, and keep every kill for the report."""
    found = kills(command)
    atomically(file, json.dumps([asdict(k) for k in found]).encode())
    for kill in found:
        if kill.wrong:
            print(f"{kill.command}, after {kill.after:.2f} s: {'; '.join(kill.wrong)}")
    number = sum(not k.ended for k in found)
    print(f"{number} kills, {sum(bool(k.wrong) for k in found)} with something wrong, seed {SEED}")


if __name__ == "__main__":
    main(*sys.argv[1:])
