"""Where finished trials are kept: one SQLite file (WAL), each trial in a transaction of its own.

A process that is killed loses what it has not added; another one may read meanwhile, and only one
may write: it holds a lock that the system takes away with the process, however that ends.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, suppress
from dataclasses import astuple
from pathlib import Path
from typing import Any

from pikanid import errors
from pikanid.validation.benchmark.trial import Outcome, Trial, strategies

FILE, LOCK = "trials.sqlite", "trials.lock"
FORMAT = 1  # definition: of the tables below
TABLES = """
create table about (key text primary key, value text not null);
create table scenarios (name text primary key, digest text not null, content text not null,
    true_values text not null, bound text);
create table trials (id integer primary key, scenario text not null references scenarios (name),
    strategy text not null, protocol text not null, seed integer not null, reason text not null,
    verdict text not null, converged integer not null, warnings integer not null,
    seconds real not null, cpu real not null,
    unique (scenario, strategy, protocol, seed));
create table estimates (trial integer not null references trials (id), parameter text not null,
    value real, std real, primary key (trial, parameter));
"""


class Store:
    """The trials of one study; a context manager.

    Args:
        folder: Of the file; made if it is missing.
        resume: Whether a store that is there is continued; else it is refused.
        versions: Of what computes: a store made with others is refused.

    Raises:
        BadSetting: A store is there and is not to be continued, another process writes to it, or it
            was made with other versions.
        BadRecording: The file is damaged or cannot be written to.
    """

    def __init__(self, folder: Path, resume: bool, versions: Mapping[str, str]) -> None:
        self.path = folder / FILE
        folder.mkdir(parents=True, exist_ok=True)
        self._lock = sqlite3.connect(folder / LOCK, timeout=0.0, isolation_level=None)
        try:
            self._lock.execute("begin exclusive")
            fresh = not self.path.exists() or self.path.stat().st_size == 0
            self._file = sqlite3.connect(self.path, isolation_level=None)
            if fresh:
                self._create(versions)
            else:
                self._check(resume, versions)
        except sqlite3.Error as failure:
            self.close()
            if "locked" in str(failure):
                raise errors.BadSetting(errors.store_in_use(str(folder))) from None
            raise errors.BadRecording(errors.store_unreadable(
                str(self.path), str(failure))) from None
        except errors.PikanidError:
            self.close()
            raise

    def _create(self, versions: Mapping[str, str]) -> None:
        self._file.execute("pragma journal_mode = wal")
        self._file.executescript(f"begin; {TABLES} commit;")
        self._tell({"format": str(FORMAT), "versions": json.dumps(dict(versions))})

    def _check(self, resume: bool, versions: Mapping[str, str]) -> None:
        about = dict(self._file.execute("select key, value from about"))
        count = self._file.execute("select count(*) from trials").fetchone()[0]
        if not resume:
            raise errors.BadSetting(errors.store_taken(str(self.path), count))
        if about.get("format") != str(FORMAT):
            raise errors.BadSetting(errors.store_of_other_format(str(self.path)))
        made = json.loads(about["versions"])
        if other := [f"{k} {made.get(k)}, here {v}" for k, v in versions.items()
                     if made.get(k) != v]:
            raise errors.BadSetting(errors.store_of_other_versions(str(self.path), other))

    def _tell(self, entries: Mapping[str, str]) -> None:
        self._file.executemany("insert or replace into about values (?, ?)", entries.items())

    def declare(self, name: str, digest: str, content: Mapping[str, Any],
                true: Mapping[str, float], bound: Mapping[str, float] | None) -> None:
        """Record a scenario.

        Raises:
            BadSetting: The store holds another one of that name.
        """
        row = self._file.execute(
            "select digest from scenarios where name = ?", (name,)).fetchone()
        if row is not None and row[0] != digest:
            raise errors.BadSetting(errors.store_of_other_scenario(str(self.path), name))
        if row is None:
            self._file.execute("insert into scenarios values (?, ?, ?, ?, ?)", (
                name, digest, json.dumps(content, default=str), json.dumps(dict(true)),
                None if bound is None else json.dumps(dict(bound))))

    def ran(self, settings: Mapping[str, Any]) -> None:
        """Add what a run was asked for."""
        row = self._file.execute("select value from about where key = 'runs'").fetchone()
        runs = [*json.loads(row[0] if row else "[]"), dict(settings)]
        self._tell({"runs": json.dumps(runs)})

    def done(self) -> set[Trial]:
        """The trials that are in the store."""
        return {Trial(*row) for row in self._file.execute(
            "select scenario, strategy, protocol, seed from trials")}

    def add(self, outcomes: Iterable[Outcome]) -> None:
        """Keep outcomes: all of them or, if the process ends, none."""
        try:
            self._file.execute("begin immediate")
            for o in outcomes:
                row = (*astuple(o.trial), o.reason, o.verdict, o.converged, o.warnings, o.seconds,
                       o.cpu)
                made = self._file.execute(
                    "insert into trials (scenario, strategy, protocol, seed, reason, verdict, "
                    "converged, warnings, seconds, cpu) values (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", row)
                self._file.executemany(
                    "insert into estimates values (?, ?, ?, ?)",
                    [(made.lastrowid, p, *map(_known, pair)) for p, pair in o.values.items()])
            self._file.execute("commit")
        except sqlite3.Error as failure:
            with suppress(sqlite3.Error):
                self._file.execute("rollback")
            raise errors.BadRecording(errors.cannot_write(str(self.path), str(failure))) from None

    def close(self) -> None:
        """Give the files back."""
        for connection in (getattr(self, "_file", None), self._lock):
            if connection is not None:
                connection.close()

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *failure: object) -> None:
        self.close()


def read(folder: Path) -> tuple[dict[str, str], list[dict[str, Any]]]:
    """What a store says about itself, and a row for every trial and parameter.

    A trial without an estimate has one row, whose parameter is empty.

    Raises:
        BadRecording: There is no store, or it is damaged.
    """
    path = folder / FILE
    if not path.exists():
        raise errors.BadRecording(errors.no_file(str(path)))
    try:
        with closing(sqlite3.connect(path)) as file:
            file.row_factory = sqlite3.Row
            about = {row["key"]: row["value"] for row in file.execute("select * from about")}
            kinds = {row["name"]: row
                     for row in file.execute("select * from scenarios order by rowid")}
            about["scenarios"] = json.dumps({n: json.loads(r["content"]) for n, r in kinds.items()})
            return about, list(_rows(file, kinds))
    except sqlite3.Error as failure:
        raise errors.BadRecording(errors.store_unreadable(str(path), str(failure))) from None


def _rows(file: sqlite3.Connection, kinds: Mapping[str, sqlite3.Row]) -> Iterator[dict[str, Any]]:
    true = {n: json.loads(r["true_values"]) for n, r in kinds.items()}
    bound = {n: json.loads(r["bound"]) if r["bound"] else {} for n, r in kinds.items()}
    label = {n: json.loads(r["content"])["label"] for n, r in kinds.items()}
    found = file.execute(
        "select t.*, e.parameter, e.value, e.std from trials t left join estimates e "
        "on e.trial = t.id order by t.seed, e.rowid").fetchall()
    place = {name: k for k, name in enumerate((*true, *strategies()))}
    for row in sorted(found, key=lambda r: (
            place[r["scenario"]], place.get(r["strategy"], len(place)), r["protocol"])):
        name, p = row["scenario"], row["parameter"] or ""
        yield {"scenario": name, "label": label[name], "strategy": row["strategy"],
               "protocol": row["protocol"], "seed": row["seed"], "parameter": p,
               "true": true[name].get(p, math.nan), "estimate": _or_nan(row["value"]),
               "std": _or_nan(row["std"]), "bound": bound[name].get(p, math.nan),
               "reason": row["reason"], "verdict": row["verdict"],
               "converged": bool(row["converged"]), "warnings": row["warnings"],
               "seconds": row["seconds"], "cpu": row["cpu"]}


def _known(value: float) -> float | None:
    """SQLite keeps no NaN."""
    return value if math.isfinite(value) else None


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
