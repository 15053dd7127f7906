"""How the data of a trial are made, and which model is fitted to them from where."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.model import Model
from pikanid.model.parts import Input
from pikanid.recording import Channel, Recording
from pikanid.simulation import simulate
from pikanid.uncertainty import cramer_rao
from pikanid.uncertainty.information import covariance
from pikanid.validation.benchmark.noise import Array, Noise

PREFIX = "process_"  # definition: of the inputs that carry process noise


@dataclass(frozen=True, eq=False)
class Scenario:
    """An experiment that can be repeated with other noise.

    Attributes:
        name: Short, as on the command line.
        label: As in tables.
        truth: The model that makes the data, at its true values.
        fitted: The model that is fitted, at its guesses.
        drive: Recording of the inputs; its times are those of the simulation.
        noise: Output -> its noise.
        stride: Every so manieth sample of the outputs is recorded.
        process: State -> standard deviation of a force that stays for one sample of the drive and
            is then drawn anew, in the unit of the state's equation.
    """

    name: str
    label: str
    truth: Model
    fitted: Model
    drive: Recording
    noise: Mapping[str, Noise]
    stride: int = 1
    process: Mapping[str, float] = field(default_factory=dict)

    @property
    def true(self) -> dict[str, float]:
        """The true values of what is estimated, as far as the truth has the same parameter."""
        known = self.truth.values
        return {p.name: known[p.name] for p in self.fitted.parameters
                if p.free and p.name in known}

    @property
    def clean(self) -> bool:
        """Whether every seed makes the same recording."""
        return not self.process and all(n.sigma == 0.0 for n in self.noise.values())

    def recording(self, seed: int) -> Recording:
        """What is recorded with this seed."""
        made = self._still if not self.process else self._shaken(seed)
        rng = np.random.default_rng(seed)
        channels = []
        for name in self.fitted.output_names:
            y, noise = made[name], self.noise[name]
            channels.append(Channel(name, y.time, y.values + noise.drawn(rng, len(y)), y.unit,
                                    noise.sigma or None))
        return made.with_channels(*channels).decimate(
            self.stride, channels=self.fitted.output_names)

    @cached_property
    def bound(self) -> dict[str, float] | None:
        """Cramér-Rao standard deviations of `true`; None where they are not those of the fit.

        That is so without noise, with process noise, and where another model is fitted.
        """
        free = {p.name for p in self.fitted.parameters if p.free}
        other = set(self.truth.values) != set(self.fitted.values) or (
            self.truth.equations != self.fitted.equations)
        if self.process or other or set(self.true) != free or any(
                n.sigma == 0.0 for n in self.noise.values()):
            return None
        recording = self.recording(0)
        found = cramer_rao(self.truth, recording)
        pieces, first = [], 0
        for name in self.fitted.output_names:
            n, noise = len(recording[name]), self.noise[name]
            own = noise.sigma * found.jacobian[first:first + n]
            pieces.append(noise.whitened(own, self.stride))
            first += n
        jacobian = np.concatenate(pieces)
        std = np.sqrt(np.diag(covariance(jacobian, np.ones(len(found.names), bool))))
        names = (name.removesuffix("[0]") for name in found.names)  # of the only recording
        return dict(zip(names, map(float, std), strict=True))

    def content(self) -> dict[str, Any]:
        """All that decides what its trials find, as plain data."""
        drive = hashlib.sha256()
        for name in self.drive.names:
            channel = self.drive[name]
            drive.update(repr((name, channel.unit, channel.hold)).encode())
            drive.update(channel.time.tobytes() + channel.values.tobytes())
        return {"label": self.label, "truth": self.truth.to_dict(),
                "fitted": self.fitted.to_dict(), "drive": drive.hexdigest(),
                "noise": {n: asdict(one) for n, one in self.noise.items()},
                "stride": self.stride, "process": dict(self.process)}

    @cached_property
    def digest(self) -> str:
        """Short name of `content`."""
        text = json.dumps(self.content(), sort_keys=True, default=str)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    @cached_property
    def _still(self) -> Recording:
        return simulate(self.truth, self.drive)

    def _shaken(self, seed: int) -> Recording:
        """With process noise of a seed of its own kind, so that the sensor's noise stays the same.
        """
        rng = np.random.default_rng([seed, 1])
        model, inputs, channels = self.truth, [], []
        for state, size in self.process.items():
            unit = f"({self.truth.state(state).unit or '1'})/s"
            inputs.append(Input(PREFIX + state, unit))
            force: Array = rng.normal(0.0, size, len(self.drive.t))
            channels.append(Channel(PREFIX + state, self.drive.t, force, unit, hold="zero"))
        model = model.replace(inputs=(*model.inputs, *inputs))
        for state in self.process:
            model = model.with_term(state, PREFIX + state)
        made = simulate(model, self.drive.with_channels(*channels))
        return made.without(*(c.name for c in channels))


def check(scenario: Scenario) -> None:
    """Simulate it once.

    Raises:
        PikanidError: If it cannot be, or nothing of what is fitted is known to the truth.
    """
    if not scenario.true:
        raise errors.BadSetting(errors.scenario_compares_nothing(scenario.name))
    scenario.recording(0)
