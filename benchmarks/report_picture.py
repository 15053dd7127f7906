"""The picture on the README's first screen: `reports/figures/diagnosis_pendulum.png`.

    python benchmarks/report_picture.py [FOLDER]

It is the diagnosis of the README's first command, of the recordings that come with the package.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pikanid as pk
from pikanid.figures import save_figure

DATA = Path(pk.__file__).parent / "recording" / "data"


def main(folder: Path) -> None:
    """Diagnose, draw, write."""
    train, held_out = (pk.Recording.read(DATA / f"single_pendulum_{part}.csv")
                       for part in ("train", "held_out"))
    found = pk.diagnose(pk.systems.pendulum(), train, held_out=held_out)
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    save_figure(found.plot(), folder / "figures" / "diagnosis_pendulum.png")
    print(found.sentence())


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "reports"))
