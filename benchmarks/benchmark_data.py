"""The trials of the study, as the report needs them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from pikanid.storage.outputs import atomically
from pikanid.validation.benchmark import export
from pikanid.validation.benchmark.cells import Group, groups
from pikanid.validation.benchmark.files import GROUPS

KEPT = "benchmark.parquet"
Key = tuple[str, str, str]  # scenario, strategy, protocol
NAMES = {"l_theta": "l", "d_theta": "d"}
UNITS = {"l_theta": "m", "d_theta": "N s/m"}
SCENARIOS = GROUPS["paper"]
FIVE = ("nls", "pda", "ipda", "pinn", "pikan")


def gathered(folder: Path, stores: Sequence[str]) -> tuple[dict[str, str], pd.DataFrame]:
    """Trials of the stores, which are exported to the folder; without any, those exported before.
    """
    kept = folder / KEPT
    if stores:
        abouts, frames = zip(*(export.from_parquet(one) if one.is_file() else export.table(one)
                               for one in map(Path, stores)), strict=True)
        whole = pd.concat(frames).drop_duplicates(
            ["scenario", "strategy", "protocol", "seed", "parameter"], ignore_index=True)
        scenarios = {k: v for a in reversed(abouts) for k, v in json.loads(a["scenarios"]).items()}
        atomically(kept, export.parquet(
            abouts[0] | {"scenarios": json.dumps(scenarios)}, whole))
    return export.from_parquet(kept)


def first(g: Group, seeds: int) -> Group:
    """The group with its first seeds only, to be compared with one that has no more."""
    return replace(g, cells={p: replace(c, estimates=c.estimates[:seeds], std=c.std[:seeds])
                             for p, c in g.cells.items()}, seeds=min(seeds, g.seeds))


def keyed(frame: pd.DataFrame) -> dict[Key, Group]:
    """Groups by scenario, strategy and protocol."""
    return {(g.scenario, g.strategy, g.protocol): g for g in groups(frame)}
