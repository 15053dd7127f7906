"""Recordings from files, as the options of a command want them; ``a.csv+b.mf4`` is one recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pikanid import errors
from pikanid.commands.options import (
    Columns,
    FileRate,
    OwnTimes,
    Rate,
    Sheet,
    Start,
    Stop,
    Stride,
    Units,
    assignments,
    by_output,
    quantity,
)

if TYPE_CHECKING:
    from pikanid.model import Model
    from pikanid.recording import Recording


@dataclass(frozen=True)
class Reading:
    """The options that say how files are read: see `pikanid.commands.grouped`."""

    column: Columns = field(default_factory=list)
    unit: Units = field(default_factory=list)
    rate: FileRate = None
    sheet: Sheet = None
    start: Start = None
    stop: Stop = None
    own_times: OwnTimes = False
    decimate: Stride = 1

    def recording(self, text: str, *models: Model, sigma: Sequence[str] = ()) -> Recording:
        """The recording in a file, or in several joined by ``+``, for models.

        Args:
            text: The file or files.
            models: Whose signals are read; names, holds and noise are those of the first.
            sigma: Texts of --sigma.

        Raises:
            BadRecording: If a file or a signal in it cannot be used.
            BadModel: If a signal is not one of the model's.
            BadSetting: If an option cannot work.
        """
        from pikanid.formula.units import check
        from pikanid.recording import Recording

        if self.start is not None and self.stop is not None and not self.start < self.stop:
            raise errors.BadSetting(errors.reversed_window(self.start, self.stop))
        columns = assignments("--column", self.column, "theta=angle")
        units = assignments("--unit", self.unit, "theta=deg")
        signals = list(dict.fromkeys(name for model in models for name in _signals(model)))
        known = [*signals, "t", "time"]
        for name in [*columns, *units]:
            if name not in known:
                raise errors.BadModel(errors.not_in_model("input or output", name, known))
        for name, unit in units.items():
            check(unit, f"--unit {name}")
        files = sources(text)
        rec = Recording.read(files if len(files) > 1 else text, columns, self.rate, self.sheet,
                             units, also=signals, by_date=not self.own_times)
        model = models[0]
        # Declared as held, an input keeps its meaning when the recording is cut.
        rec = rec.with_hold(**{i.name: i.hold for i in model.inputs
                               if i.name in rec and rec[i.name].hold is None})
        if self.start is not None or self.stop is not None:
            rec = rec.window(self.start, self.stop)
        if self.decimate > 1:
            rec = rec.decimate(self.decimate, channels=model.output_names)
        return _with_sigma(_units_taken(rec, model), model, sigma)


@dataclass(frozen=True)
class Driven(Reading):
    """Where a file drives a model: its outputs are not used, and a built-in excitation has a rate,
    too.
    """

    rate: Rate = None
    decimate: int = field(default=1, init=False)


@dataclass(frozen=True)
class Recorded(Reading):
    """Where ``--rate`` is that of a profile to be made."""

    rate: float | None = field(default=None, init=False)


def sources(text: str) -> list[str]:
    """The files that a text names: one, or several joined by ``+``.

    A file whose own name has a plus in it is that file.

    >>> sources("motion.csv+camera.mf4"), sources("run.csv")
    (['motion.csv', 'camera.mf4'], ['run.csv'])
    """
    parts = [part.strip() for part in text.split("+")]
    try:
        whole = len(parts) == 1 or not all(parts) or Path(text).exists()
    except (OSError, ValueError):  # too long a name, or a NUL in it
        whole = True
    return [text] if whole else parts


def every_source(*texts: str) -> list[str]:
    """The files that any of the texts name.

    >>> every_source("a.csv+b.csv", "model.toml")
    ['a.csv', 'b.csv', 'model.toml']
    """
    return [path for text in texts for path in sources(text)]


def files_read(*texts: str) -> list[str]:
    """As `every_source`, without the names of what comes with the package.

    >>> files_read("a.csv+b.csv", "pendulum")
    ['a.csv', 'b.csv']
    """
    return [path for path in every_source(*texts) if Path(path).suffix or Path(path).exists()]


def _signals(model: Model) -> list[str]:
    """What of a file a model may need: inputs, outputs, and channels that an effect lets act."""
    from pikanid.model.effect import Effect

    return [*model.input_names, *model.output_names, *(
        name for effect in model.effects if isinstance(effect, Effect) for name in effect.channels)]


def _units_taken(rec: Recording, model: Model) -> Recording:
    """With a note on the model's units that are taken because a file states none."""
    own = {u.name: u.unit for u in model.inputs} | {o.name: o.unit for o in model.outputs}
    taken = [n for n, unit in own.items() if unit and n in rec and not rec[n].unit]
    return rec if not taken else replace(rec, notes=(
        *rec.notes, errors.units_taken(taken, [own[n] for n in taken])))


def _with_sigma(rec: Recording, model: Model, texts: Sequence[str]) -> Recording:
    """The noise of the outputs: one for all, or one by name."""
    made = {}
    for name, text in by_output(model, texts).items():
        model.output(name)
        own = rec[name].unit
        # A bare number is in the model's unit, in which the results are printed too.
        asked = quantity(text, model.output(name).unit or own, f"--sigma {name}", difference=True)
        if not asked > 0:
            raise errors.BadSetting(errors.sigma_not_positive(text))
        made[name] = asked
        if own and model.output(name).unit:
            made[name] = quantity(f"{asked!r} {model.output(name).unit}", own, f"--sigma {name}",
                                  difference=True)
    return rec.with_sigma(made)
