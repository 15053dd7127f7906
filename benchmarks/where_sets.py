"""How well the diagnoses of concealed sets say where: a section of `reports/where.md`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from pikanid.pieces.sheet import Sheet
from pikanid.validation.concealed.acting import experiment_of, truth_of
from pikanid.validation.concealed.where import Place, place, tally


def section(work: Path) -> str:
    """Scores of every set in the work folder of `report_diagnosis.py` whose cases are diagnosed."""
    found = {folder.name: places(folder) for folder in sorted(work.glob("*"))
             if (folder / "truth.json").exists() and (folder / "answers").is_dir()}
    found = {name: scored for name, scored in found.items() if scored}
    if not found:
        return ""
    counted = {name: tally(scored) for name, scored in found.items()}
    lines = ["\n## Concealed sets\n", SETS, Sheet(("", *found), tuple(
        (what.replace("_", " "), *(str(counted[name][what]) for name in found))
        for what in next(iter(counted.values())))).to_markdown(), ""]
    for name, scored in found.items():
        wrong = [p.case for p in scored if p.channel == "wrong"]
        overlaps = [p.overlap for p in scored if p.overlap is not None]
        regions = [p.region for p in scored if p.region is not None]
        lines.append(
            f"{name}: channel wrong in {', '.join(wrong) or 'none'}"
            + (f"; mean IoU {np.mean(overlaps):.2f} of {len(overlaps)}" if overlaps else "")
            + (f"; mean F1 {np.mean(regions):.2f} of {len(regions)}" if regions else "") + ".\n")
    return "\n".join(lines)


def places(folder: Path) -> list[Place]:
    """Of every case of a set that is diagnosed, and whose mismatch was noticed."""
    found = []
    for case in json.loads((folder / "truth.json").read_text())["cases"]:
        kept = folder / "answers" / f"{case['id']}.json"
        if not kept.exists():
            continue
        rows = np.genfromtxt(folder / "recordings" / case["files"]["train"], delimiter=",",
                             skip_header=1)
        scored = place(case, json.loads(kept.read_text()), truth_of(case, experiment_of(rows)))
        if scored is not None:
            found.append(scored)
    return found


SETS = """Every case that hides something and whose mismatch was noticed. *Channel*: right if it is
given for every hidden effect that can be told (a twin in another channel cannot), part if for some,
wrong if nothing hides in one that is given. *States*: of laws in the equation alone. *Time* and
*region*: of laws that act in one regime, found if half of the union is shared (IoU) or F1 is at
least one half; *invented* is a region where no law acts in one.
"""
