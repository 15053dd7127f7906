"""Residual analysis, as MATLAB's `resid`: is what a model leaves noise, independent of inputs?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pikanid.comparison.correlations import Correlation, Joint
from pikanid.comparison.dependence import Dependence
from pikanid.comparison.spectrum import Spectrum
from pikanid.comparison.whitened import White

if TYPE_CHECKING:
    import matplotlib.figure

SMALLEST = 1e-99  # layout: p-values below are not told apart


@dataclass(frozen=True, eq=False)
class ResidualAnalysis:
    """What a model leaves of one output of one recording.

    Attributes:
        model, recording, output, unit: What.
        white: The whitened residual, from which all tests are made.
        residual: (N,) measured - simulated, in the output's unit.
        autocorrelation: At lags 1 to K.
        crosscorrelation: Input -> at lags -K to K, positive where the residual follows the input.
        spectrum: Power and coherence; None for short recordings.
        dependences: On every state and input.
        tests: Joint tests: "whiteness", "mean", "independence" of each input, "dependence" on each
            state and input, "normality", and "feedback" into each input.
        alpha: Rate of false alarms of each joint test, and of each band.
    """

    model: str
    recording: str
    output: str
    unit: str
    white: White
    residual: np.ndarray
    autocorrelation: Correlation
    crosscorrelation: Mapping[str, Correlation]
    spectrum: Spectrum | None
    dependences: tuple[Dependence, ...]
    tests: tuple[Joint, ...]
    alpha: float

    def test(self, kind: str, of: str = "") -> Joint:
        """A joint test by its kind, and by what it is about.

        Raises:
            KeyError: There is none: an input that never moves, or that the fit takes up wholly.
        """
        for t in self.tests:
            if (t.kind, t.of) == (kind, of):
                return t
        raise KeyError((kind, of))

    @property
    def failed(self) -> tuple[Joint, ...]:
        """Tests of the model that reject it; together they do so falsely at a rate of `alpha`."""
        about = [t for t in self.tests if t.kind != "feedback"]
        return tuple(t for t in about if t.p_value * len(about) < self.alpha)

    @property
    def feedback(self) -> tuple[str, ...]:
        """Inputs that the residual precedes: they may be driven by what is measured."""
        return self._feedback(self.alpha)

    def _feedback(self, rate: float) -> tuple[str, ...]:
        """Likewise, at a rate of false alarms.

        A misfit of a periodic motion knows a little of its drive's future, too: where the residual
        is no noise, far more is asked for.
        """
        about = [t for t in self.tests if t.kind == "feedback"]
        rate = rate if self.ok else rate**3
        return tuple(t.of for t in about if t.p_value * len(about) < rate)

    @property
    def ok(self) -> bool:
        """Whether the residual is what a right model leaves."""
        return not self.failed

    def sentence(self) -> str:
        """The answer in a sentence."""
        noise = f"AR(1) noise (ρ = {self.white.rho:.2f})" if self.white.rho else "white noise"
        where = f"'{self.model}' leaves of '{self.output}' in '{self.recording}'"
        if self.ok:
            return f"What {where} is {noise}, and independent of the inputs."
        said = {"whiteness": "correlated with itself", "mean": "off zero on average",
                "independence": "correlated with the past of {}", "dependence": "dependent on {}",
                "normality": "not normally distributed"}
        found = [said[t.kind].format(f"'{t.of}'") + f" ({_p(t.p_value)})" for t in self.failed]
        return f"What {where} is no noise: it is {', '.join(found)}."

    def warnings(self, rate: float | None = None) -> tuple[str, ...]:
        """Sentences that the user should read; false ones at that rate, `alpha` by default."""
        return tuple(
            f"The residual of '{self.output}' precedes the input '{name}' in '{self.recording}': "
            "the input seems to depend on what is measured (feedback), which biases what is read "
            "off such data; model the controller too, or excite by an independent signal."
            for name in self._feedback(self.alpha if rate is None else rate))

    def to_dict(self) -> dict[str, Any]:
        """Plain content for JSON."""
        return {"model": self.model, "recording": self.recording, "output": self.output,
                "sentence": self.sentence(), "rho": self.white.rho,
                "tests": [asdict(t) for t in self.tests], "feedback": list(self.feedback)}

    def plot(self, narrow: bool = False) -> matplotlib.figure.Figure:
        """All of it in one figure; `narrow`: for a phone."""
        from pikanid.comparison.residual_drawing import plot_residual

        return plot_residual(
            f"{self.model}: residual of {self.output}, {self.recording}", self.white,
            self.autocorrelation, self.crosscorrelation, self.spectrum, self.dependences,
            self.alpha, self.unit, narrow)


def _p(value: float) -> str:
    """A p-value in words; nobody computes the smallest ones.

    >>> _p(0.0123), _p(0.0)
    ('p = 0.012', 'p < 1e-99')
    """
    return f"p = {value:.2g}" if value >= SMALLEST else f"p < {SMALLEST:.0e}"
