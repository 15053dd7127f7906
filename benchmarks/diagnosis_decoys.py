"""Are laws outside the catalogue noticed only because each has a decoy of its own?

    python benchmarks/diagnosis_decoys.py [--work build/diagnosis] [--workers 2] [--sets outside]

Decoys keep wrong names away.  Each is taken out of the catalogue in turn, and so are the forms next
to an entry's, all at once; what was diagnosed with one of them among the hypotheses that were given
or came close is diagnosed again without it.  Other cases keep their answers.
"""

from __future__ import annotations

import argparse
import functools
import json
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pikanid as pk
from pikanid.mismatch.catalogue import catalogue
from pikanid.mismatch.catalogue.candidate import SYMBOLIC
from pikanid.storage.outputs import atomically
from pikanid.validation.concealed.score import Share, judge

FORMS = "neighbouring_forms"
DECOYS = (*(make.__name__ for make, _ in catalogue.DECOYS), FORMS)


@dataclass(frozen=True)
class Job:
    """A case to be diagnosed without a decoy: its files, where the answer is kept."""

    folder: Path
    case: str
    decoy: str

    @property
    def kept(self) -> Path:
        """The answer's file."""
        return self.folder / "decoys" / f"{self.case}_{self.decoy}.json"


def section(work: Path, workers: int, sets: Sequence[str]) -> str:
    """The table: outcomes with each decoy removed in turn.

    Args:
        work: Folder of `report_diagnosis.py`, with the answers of the sets.
        workers: Processes.
        sets: Whose cases hide laws outside the catalogue.
    """
    cases = [(work / name, case) for name in sets if (work / name / "truth.json").exists()
             for case in json.loads((work / name / "truth.json").read_text())["cases"]]
    before = {(folder, case["id"]): _read(folder / "answers" / f"{case['id']}.json")
              for folder, case in cases}
    jobs = [Job(folder, case["id"], decoy) for folder, case in cases for decoy in DECOYS
            if decoy in _close(before[folder, case["id"]])]
    with ProcessPoolExecutor(workers) as pool:
        again = dict(zip([(j.folder, j.case, j.decoy) for j in jobs],
                         pool.map(_answer, jobs), strict=True))
    rows, wrong = [], []
    for decoy in ("", *DECOYS):
        scores = [judge(case, again.get((folder, case["id"], decoy), before[folder, case["id"]]))
                  for folder, case in cases]
        count = sum(j.decoy == decoy for j in jobs)
        named = [s for s in scores if s.nameable]
        rows.append(f"| {decoy or 'none'} | {count} | "
                    f"{Share(sum(s.outcome == 'wrong' for s in scores), len(scores))} | "
                    f"{Share(sum(s.outcome == 'right' for s in named), len(named))} |")
        wrong += [f"{s.case} without {decoy} ({s.reason}, nominal {s.nominal:.0f} sigma)"
                  for s in scores if s.outcome == "wrong" and decoy]
    return "\n".join([
        f"\n## Each decoy removed in turn, {len(cases)} cases of {', '.join(sets)}\n", TEXT,
        "| removed | diagnosed again | wrong of all | right of nameable |",
        "| --- | --- | --- | --- |", *rows, "", f"Wrong: {'; '.join(wrong) or 'none'}."]) + "\n"


TEXT = """Most laws that the generator has outside the catalogue have a decoy in the tool, so that
the score of the set says little about laws that nobody thought of. Here each decoy is taken out in
turn, and so are the forms next to entries', all at once; the cases in which it stood among the
hypotheses given, or came close, are diagnosed again.
"""


def _close(answer: Mapping[str, Any]) -> set[str]:
    """Decoys among the hypotheses that are given, or came close."""
    effects = [*(e["ids"] for h in answer["hypotheses"] for e in h["effects"]),
               *(ids for h in answer["rejected"] for ids in h["effects"])]
    formulas = {i.removeprefix(SYMBOLIC) for ids in effects for i in ids if i.startswith(SYMBOLIC)}
    return {decoy for decoy, texts in _expressions().items() if formulas & texts}


@functools.cache
def _expressions() -> dict[str, set[str]]:
    """Formulas that every decoy may be reported as, for the rig of the sets."""
    from pikanid.mismatch.catalogue.sites import sites

    model = pk.systems.sloshing()
    [site] = sites(model, (pk.excitation.two_pulse(),))
    found = {make.__name__: {c.expression for c in make(site)} for make, _ in catalogue.DECOYS}
    found[FORMS] = {c.expression for c in catalogue.candidates((site,)) if c.next_to}
    return found


def _answer(job: Job) -> dict[str, Any]:
    if not job.kept.exists():
        train, other = (pk.Recording.read(job.folder / "recordings" / f"{job.case}_{part}.csv")
                        for part in ("train", "held_out"))
        kept = tuple((make, families) for make, families in catalogue.DECOYS
                     if make.__name__ != job.decoy)
        forms = catalogue.neighbouring_forms if job.decoy != FORMS else lambda entry: []
        with patch.object(catalogue, "DECOYS", kept), \
                patch.object(catalogue, "neighbouring_forms", forms):
            answer = pk.diagnose(pk.systems.sloshing(), train, other, workers=1).to_dict()
        job.kept.parent.mkdir(exist_ok=True)
        atomically(job.kept, json.dumps(answer).encode())
    return _read(job.kept)


def _read(file: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(file.read_text())
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, default=Path("build/diagnosis"))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--sets", nargs="*", default=["outside"])
    chosen = parser.parse_args()
    print(section(chosen.work, chosen.workers, chosen.sets))
