"""How well the diagnoses of concealed sets say where: a section of `reports/where.md`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from pikanid.pieces.sheet import Sheet
from pikanid.validation.concealed.acting import experiment_of, truth_of
from pikanid.validation.concealed.where import Place, place, tally

UNKNOWN = ("outside", "unforeseen")  # classes of cases that hide a law of no catalogue


def section(work: Path) -> str:
    """Scores of every set in the work folder of `report_diagnosis.py` whose cases are diagnosed,
    and of all of them by whether a catalogue holds what hides.
    """
    of_sets = {folder.name: scored for folder in sorted(work.glob("*"))
               if (folder / "truth.json").exists() and (folder / "answers").is_dir()
               and (scored := places(folder))}
    if not of_sets:
        return ""
    every = [each for scored in of_sets.values() for each in scored]
    columns = {**{name: [place for _, place in scored] for name, scored in of_sets.items()},
               "all in the catalogue": [place for kind, place in every if kind not in UNKNOWN],
               "all others": [place for kind, place in every if kind in UNKNOWN]}
    counted = {name: tally(found) for name, found in columns.items()}
    lines = ["\n## Concealed sets\n", SETS, Sheet(("", *columns), tuple(
        (what.replace("_", " "), *(str(counted[name][what]) for name in columns))
        for what in next(iter(counted.values())))).to_markdown(), ""]
    for name in of_sets:
        wrong = [p.case for p in columns[name] if p.channel == "wrong"]
        overlaps = [p.overlap for p in columns[name] if p.overlap is not None]
        regions = [p.region for p in columns[name] if p.region is not None]
        lines.append(
            f"{name}: channel wrong in {', '.join(wrong) or 'none'}"
            + (f"; mean IoU {np.mean(overlaps):.2f} of {len(overlaps)}" if overlaps else "")
            + (f"; mean F1 {np.mean(regions):.2f} of {len(regions)}" if regions else "") + ".\n")
    return "\n".join(lines)


def places(folder: Path) -> list[tuple[str, Place]]:
    """Class and place of every case of a set that is diagnosed, and whose mismatch was noticed."""
    found = []
    for case in json.loads((folder / "truth.json").read_text())["cases"]:
        kept = folder / "answers" / f"{case['id']}.json"
        if not kept.exists():
            continue
        rows = np.genfromtxt(folder / "recordings" / case["files"]["train"], delimiter=",",
                             skip_header=1)
        scored = place(case, json.loads(kept.read_text()), truth_of(case, experiment_of(rows)))
        if scored is not None:
            found.append((str(case["class"]), scored))
    return found


SETS = """Every case that hides something and whose mismatch was noticed. *Channel*: right if it is
given for every hidden effect that can be told (a twin in another channel cannot), part if for some,
wrong if nothing hides in one that is given. *States*: of laws in the equation alone. *Time* and
*region*: of laws that act in one regime, found if half of the union is shared (IoU) or F1 is at
least one half; *invented* is a region where no law acts in one. Background vibration, a wrong
clock, a length that wobbles, a second resonance: of a law of no catalogue a force over time, an
input and a sensor often do the same, and then no channel is said.
"""
