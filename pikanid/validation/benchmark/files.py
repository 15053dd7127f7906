"""Scenarios in TOML: the ready-made ones and the user's own, read by the same code.

    [defaults]                       # entries of every scenario of the file that lacks them
    model = "rig.toml"               # fitted; or a ready-made one
    excitation = "motion.csv"        # or a built-in one, with duration [s] and rate [Hz]

    [scenarios.quiet]
    label = "quiet, every fifth sample"
    values = { k = 2.0 }             # true values; all others as in the model
    start = { k = 1.0 }              # guesses of the fit
    stride = 5
    noise = { sigma = "0.1deg", correlation = 0.5, outliers = 0.02, size = 10 }
    process = { theta_dot = 0.5 }    # force drawn anew at every sample of the drive
    effect = { name = "drag", add = { theta_dot = "-c*theta_dot*abs(theta_dot)" },
               parameters.c = { guess = 0.4, unit = "1/rad" },
               null = { c = 0.0 } }  # acts, but is not fitted; written as in a model file

`noise` may be a table of such tables by output, `truth` another model file that makes the data.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pikanid import errors
from pikanid.formula.quantity import quantity
from pikanid.model import Model, systems
from pikanid.model.effect_table import effect_of
from pikanid.recording import Recording
from pikanid.recording.excitation import EXCITATIONS, built_in
from pikanid.storage.entries import Entry
from pikanid.storage.limits import toml_content
from pikanid.validation.benchmark.noise import Noise
from pikanid.validation.benchmark.scenario import Scenario, check

READY_MADE = Path(__file__).with_name("scenarios.toml")
KEYS = ("label", "model", "truth", "values", "start", "excitation", "duration", "rate", "stride",
        "noise", "process", "effect")
NOISE = ("sigma", "correlation", "outliers", "size")
MOST = 200  # limit: scenarios in one file
LONGEST_NAME = 40  # limit: characters of a scenario's name
GROUPS = {
    "paper": ("dense_clean", "dense_low", "dense_high", "sparse_clean", "sparse_low",
              "sparse_high"),
    "beyond": ("dense_process", "sparse_process", "dense_drag", "sparse_drag", "dense_late",
               "dense_coloured", "dense_outliers", "sparse_outliers"),
}  # definition: Tables III and IV, and what Section II-B speaks of besides


def chosen(names: Sequence[str]) -> list[Scenario]:
    """Scenarios by their names, those of a group, and all of a TOML file, each once.

    Raises:
        BadSetting: No such scenario, or two different ones of one name.
        BadModel: A file that says something that cannot be used.

    >>> [s.label for s in chosen(["sparse_low", "paper"])][:2]
    ['sparse, 0.1°', 'dense, clean']
    """
    known = _tables(READY_MADE)
    found: dict[str, Scenario] = {}
    for name in names:
        if name.endswith(".toml"):
            own = read(name)
        elif name in GROUPS or name in known:
            own = [_made(n, known[n], READY_MADE) for n in GROUPS.get(name, (name,))]
        else:
            every = [*GROUPS, *known]
            close = difflib.get_close_matches(name, every, 1)
            raise errors.BadSetting(errors.unknown_scenario(name, every, close))
        for one in own:
            if found.setdefault(one.name, one).digest != one.digest:
                raise errors.BadSetting(errors.scenario_twice(one.name))
    return list(found.values())


def read(path: str | Path) -> list[Scenario]:
    """All scenarios of a TOML file.

    Raises:
        BadModel: Not such a file; the sentence says what is wrong, and where.
        PikanidError: What a scenario names cannot be read or simulated.
    """
    found = []
    for name, entries in _tables(Path(path)).items():
        found.append(_made(name, entries, Path(path)))
        check(found[-1])
    return found


def _tables(path: Path) -> dict[str, dict[str, Entry]]:
    """Name -> entries of every scenario in a file, defaults filled in."""
    def wrong(detail: str) -> errors.BadModel:
        return errors.BadModel(errors.unreadable("file of scenarios", str(path), detail))

    content = toml_content(path, wrong)
    top = Entry(content, f"The file '{path}'", errors.BadModel).table(
        ["scenarios"], ["defaults"])
    usual = top["defaults"].table([], KEYS) if "defaults" in top else {}
    tables = top["scenarios"].table([], None, MOST)
    for name in tables:
        if not name.isidentifier() or len(name) > LONGEST_NAME:
            raise Entry(name, "The name of a scenario", errors.BadModel).fail(
                f"letters, digits and _, {LONGEST_NAME} at most")
    return {name: usual | entry.called(f"Scenario '{name}'").table([], KEYS)
            for name, entry in tables.items()}


def _made(name: str, entries: Mapping[str, Entry], path: Path) -> Scenario:
    where = f"Scenario '{name}'"
    for needed in ("model", "excitation", "noise"):
        if needed not in entries:
            raise errors.BadModel(errors.entry_lacks(where, [needed]))
    fitted = _model(entries["model"].text(), path)
    truth = fitted if "truth" not in entries else _model(entries["truth"].text(), path)
    truth = truth.with_values(_values(truth, entries.get("values")))
    if "effect" in entries:
        truth = truth.with_effect(effect_of(
            f"{name}_effect", entries["effect"].called(f"{where}, effect")))
    drive = _drive(fitted, entries, path)
    stride = entries["stride"].integer(1, len(drive.t) // 2) if "stride" in entries else 1
    process = {n: e.number(low=0.0) for n, e in entries["process"].table(optional=None).items()
               } if "process" in entries else {}
    for state in process:
        truth.state(state)
    return Scenario(
        name, entries["label"].text(longest=80) if "label" in entries else name, truth,
        fitted.with_values(_values(fitted, entries.get("start"))), drive,
        _noises(fitted, entries["noise"]), stride, process)


def _model(name: str, path: Path) -> Model:
    beside = path.parent / name
    return systems.find(str(beside) if name.endswith(".toml") and beside.exists() else name)


def _values(model: Model, entry: Entry | None) -> dict[str, float]:
    return {} if entry is None else {
        n: _number(e, model.parameter(n).unit) for n, e in entry.table(optional=None).items()}


def _number(entry: Entry, unit: str, low: float = float("-inf"), difference: bool = False
            ) -> float:
    if isinstance(entry.value, str):
        value = quantity(entry.text(), unit, entry.where, difference)
        return Entry(value, entry.where, entry.wrong).number(low=low)
    return entry.number(low=low)


def _noises(model: Model, entry: Entry) -> dict[str, Noise]:
    tables = entry.table(optional=None)
    if set(tables) <= set(NOISE):
        return {o.name: _noise(entry, o.unit) for o in model.outputs}
    by_output = entry.table(required=model.output_names)
    return {o.name: _noise(by_output[o.name], o.unit) for o in model.outputs}


def _noise(entry: Entry, unit: str) -> Noise:
    e = entry.table(["sigma"], NOISE[1:])
    options: dict[str, Any] = {}
    for key, high in (("correlation", 0.999), ("outliers", 0.5), ("size", 1e6)):
        if key in e:
            options[key] = e[key].number(0.0, high)
    return Noise(_number(e["sigma"], unit, 0.0, True), **options)


def _drive(model: Model, entries: Mapping[str, Entry], path: Path) -> Recording:
    name = entries["excitation"].text()
    if name not in EXCITATIONS:
        beside = path.parent / name
        return Recording.read(beside if beside.exists() else name)
    duration = entries["duration"].number(low=1e-6) if "duration" in entries else 5.0
    rate = entries["rate"].number(low=1e-6) if "rate" in entries else 100.0
    required = [i for i in model.inputs if i.default is None] or list(model.inputs)
    made = built_in(name, duration, 1 / rate, [i.name for i in required] or ["u"])
    for item in required:
        if item.name in made and item.unit:
            made = made.with_unit(item.name, item.unit)
    return made
