"""What survives damage and violence: hostile inputs, cache files damaged, commands killed.

Usage: python benchmarks/report_reliability.py FOLDER

Writes FOLDER/reliability.md.  What has been run is kept below build/ and used again; remove it to
run anew.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import reliability_cache
import reliability_fuzz
import reliability_kills
from provenance import provenance

from pikanid.storage.outputs import atomically

KEPT = Path("build")
HOW = {
    "conceal": "6 cases by two processes; the same set goes on after every kill",
    "identify": "`--json --plot` of a fit by NLS",
    "diagnose": "`--json --report` with a held-out recording",
    "study": "NLS and PDA, the second in a process of its own; page and figures",
}


def main(folder: str) -> None:
    """Run what is missing and write the page, atomically."""
    by_seed = {seed: kept("reliability_cache", str(seed)) for seed in reliability_cache.SEEDS}
    damages = [d for found in by_seed.values() for d in found]
    counts = ", ".join(f"{seed}: {len(found)} damages" for seed, found in by_seed.items())
    kills = [k for name in reliability_kills.KILLS for k in kept("reliability_kills", name)]
    wanted = len(by_seed) * reliability_cache.DAMAGES, sum(reliability_kills.KILLS.values())
    made = len(damages), sum(not k["ended"] for k in kills)
    short = [] if made[0] >= wanted[0] and made[1] >= wanted[1] else [
        f"Cut short: {made[0]} of {wanted[0]} damages, {made[1]} of {wanted[1]} kills."]
    fuzzed = reliability_fuzz.fuzz()
    parts = ["# Reliability", *short, *fuzz_part(fuzzed), *cache_part(damages), *kills_part(kills),
             "## Settings", (
        f"Written by `benchmarks/report_reliability.py` from `reliability_fuzz.py` (seed "
        f"{fuzzed.seed}), `reliability_cache.py` (seeds {counts}) and `reliability_kills.py` (seed "
        f"{reliability_kills.SEED}). {provenance()}; numba {version('numba')}, llvmlite "
        f"{version('llvmlite')}.")]
    Path(folder).mkdir(parents=True, exist_ok=True)
    atomically(Path(folder) / "reliability.md", ("\n\n".join(parts) + "\n").encode())


def kept(script: str, argument: str) -> list[dict[str, Any]]:
    """What a script has found; run where a file below build/ does not hold it yet."""
    path = KEPT / f"{script}-{argument}.json"
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        subprocess.run([sys.executable, str(Path(__file__).with_name(f"{script}.py")), argument,
                        str(path)], check=True)
    found: list[dict[str, Any]] = json.loads(path.read_bytes())
    return found


def fuzz_part(fuzzed: reliability_fuzz.Fuzzed) -> list[str]:
    """Hostile inputs by reader or loader, and what became of them."""
    return ["## Hostile inputs", (
        "Files of every form, altered at random in their bytes or in their structure, and command "
        "lines. *Read*: an object came of it, which could be used; *refused*: one sentence. A "
        "failure is any other exception, more than 10 s of processor time for one input, or a "
        "process of more than 1 GB."), fuzzed.markdown()]


def cache_part(damages: Sequence[dict[str, Any]]) -> list[str]:
    """Damages by kind of entry and of damage, and how many were healed."""
    healed = sum(d["healed"] for d in damages)
    kinds = list(reliability_cache.SHARES)
    tried = Counter((d["damage"], d["kind"]) for d in damages)
    whole = Counter((d["damage"], d["kind"]) for d in damages if d["healed"])
    rows = [[damage, *(f"{whole[damage, k]} of {tried[damage, k]}" if tried[damage, k] else ""
                       for k in kinds)] for damage in reliability_cache.HOW]
    return ["## Damaged cache files", (
        f"{healed} of {len(damages)} random damages were healed: the same numbers, bit for bit, "
        "without a message, and a whole file afterwards (but for a folder in its place, which "
        "stays: code is then made anew by each process). Entries are machine code of tapes, that "
        "of functions compiled by numba, and of a compiled model its generated source and its "
        "machine code."),
        table(["damage", "tape", "function", "source of a model", "code of a model"], rows)]


def kills_part(kills: Sequence[dict[str, Any]]) -> list[str]:
    """Kills by command, and what was wrong after them."""
    rows = []
    for name in reliability_kills.KILLS:
        own = [k for k in kills if k["command"] == name and not k["ended"]]
        ends = [k for k in kills if k["command"] == f"{name}, to its end"]
        after = [k["after"] for k in own]
        span = f"{min(after):.1f} to {max(after):.1f}" if after else ""
        rows.append([f"`{name}`: {HOW[name]}", str(len(own)), span,
                     str(sum(bool(k["wrong"]) for k in own)),
                     "not run" if not ends else
                     "**no**" if any(k["wrong"] for k in ends) else "yes"])
    number = sum(not k["ended"] for k in kills)
    strays = sum(k["strays"] for k in kills if k["command"].endswith("to its end"))
    wrong = [f"- `{k['command']}` after {k['after']:.2f} s: {'; '.join(k['wrong'])}"
             for k in kills if k["wrong"]]
    return ["## Killed commands", (
        f"{number} kills (SIGKILL) at random moments, about every second one within the last tenth "
        "of the run, where files are written. After each: every file whole, the outputs of a "
        "command all there or none, no worker left after 10 s, no secret of `conceal` readable by "
        "others or among its recordings. In the end the same command is to succeed, and `conceal` "
        "to have gone on from what was finished and left no unfinished set. Hidden files on their "
        f"way to their names that kills left behind: {strays}."),
        table(["command", "kills", "after [s]", "with something wrong", "succeeds in the end"],
              rows), *(["What was wrong:", "\n".join(wrong)] if wrong else [])]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


if __name__ == "__main__":
    main(*sys.argv[1:])
