"""`make bench` finds its benchmarks."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_what_make_bench_runs_is_collected() -> None:
    """Other modules of the folder read environment variables, or need their own arguments."""
    [pattern] = re.findall(r"-m pytest (benchmarks\S*) .*--benchmark-only",
                           (ROOT / "Makefile").read_text())
    files = sorted(ROOT.glob(pattern))
    assert files
    alone = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_")}
    done = subprocess.run([sys.executable, "-m", "pytest", "--collect-only", "-q", "-m", "",
                           *map(str, files)], cwd=ROOT, env=alone, capture_output=True, text=True,
                          timeout=120)
    assert done.returncode == 0, done.stdout
    assert all(f.name in done.stdout for f in files)
