"""`Estimate`: what every strategy returns."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pikanid import errors
from pikanid.comparison import ResidualAnalysis, Validation, resid, validate
from pikanid.comparison.predict import predict
from pikanid.estimate import file as estimate_file
from pikanid.estimate.data import EstimateData, Fit
from pikanid.estimate.rounding import rounded
from pikanid.model import Model
from pikanid.objective.settings import USUAL
from pikanid.recording import Recording

if TYPE_CHECKING:
    import matplotlib.figure
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Estimate(EstimateData):
    """Estimated parameters with everything that says how far to trust them.

    Attributes:
        model: The model that was fitted, at its guesses; `fitted_model` holds the estimates.
        strategy: "nls", "pda", "ipda", ...
        free, theta, covariance: Layout, values (n_free,) and covariance (n_free, n_free) of θ.
        fits, trajectories: Fitted outputs and states, recording by recording.
        cost: Half the sum of squared residuals, in output units.
        adequacy: The χ² verdict.
        converged: Whether the optimiser stopped at a stationary point.
        settings, history: Options as used, and the iterations.
        warnings: Sentences that the user should read.
        seconds, seed, version: Provenance.
        approximator: The fitted curve of a relaxation strategy, else None.
    """

    def index(self, name: str, recording: int | None = None) -> int:
        """Position in θ of a parameter.

        Raises:
            BadModel: It was not estimated.
        """
        for k, f in enumerate(self.free):
            if f.name == name and f.recording in (None, recording if recording is not None else 0):
                return k
        labels = [f.label for f in self.free]
        raise errors.BadModel(errors.not_in_model("estimated parameter", name, labels))

    def value(self, name: str, recording: int | None = None) -> float:
        """The estimate of a parameter, or the value of a fixed one."""
        fixed = [p for p in self.model.parameters if p.name == name and not p.free]
        return fixed[0].value if fixed else float(self.theta[self.index(name, recording)])

    def __getitem__(self, name: str) -> float:
        """The value of a parameter by its name, or by its label: ``est["theta_0[1]"]``.

        >>> import pikanid as pk
        >>> model = pk.systems.sloshing()
        >>> est = pk.NLS().fit(model, pk.simulate(model, pk.excitation.two_pulse(), sigma=1e-3))
        >>> est["l_theta"] == est.value("l_theta")
        True
        """
        labels = {f.label: k for k, f in enumerate(self.free)}
        return float(self.theta[labels[name]]) if name in labels else self.value(name)

    def std(self, name: str, recording: int | None = None) -> float:
        """The standard error of a parameter; 0 for a fixed one."""
        if any(p.name == name and not p.free for p in self.model.parameters):
            return 0.0
        k = self.index(name, recording)
        return float(np.sqrt(self.covariance[k, k]))

    @property
    def correlation(self) -> np.ndarray:
        """Correlation matrix of the estimates (n_free, n_free)."""
        s = np.sqrt(np.diag(self.covariance))
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.covariance / np.outer(s, s)

    def interval(self, name: str, level: float = 0.95, recording: int | None = None
                 ) -> tuple[float, float]:
        """Confidence interval from the standard error (Student's t with the fit's dof)."""
        from scipy.stats import t

        half = self.std(name, recording) * float(t.ppf(0.5 + level / 2, self.adequacy.dof))
        return self.value(name, recording) - half, self.value(name, recording) + half

    @property
    def fitted_model(self) -> Model:
        """The model at the estimates (of the first recording, where each has its own)."""
        return self.model.with_values({
            f.name: float(v) for f, v in zip(self.free, self.theta, strict=True)
            if f.recording in (None, 0)})

    # --- goodness --------------------------------------------------------------------------------

    @property
    def ok(self) -> bool:
        """Converged, and not a misfit."""
        return self.converged and self.adequacy.verdict != "misfit"

    @property
    def n(self) -> int:
        """Number of samples fitted."""
        return sum(len(f.t) for f in self.fits)

    @property
    def rmse_by_output(self) -> dict[str, float]:
        """Root mean square residual of each output over all recordings, in its unit, by name.

        >>> import pikanid as pk
        >>> model = pk.systems.sloshing_2d()
        >>> rec = pk.simulate(model, pk.excitation.two_pulse(), sigma={"theta": 2e-3, "phi": 1e-3})
        >>> {name: round(v, 3) for name, v in pk.NLS().fit(model, rec).rmse_by_output.items()}
        {'theta': 0.002, 'phi': 0.001}
        """
        found: dict[str, list[np.ndarray]] = {}
        for f in self.fits:
            found.setdefault(f.output, []).append(f.residual)
        return {name: float(np.sqrt(np.mean(np.concatenate(own) ** 2)))
                for name, own in found.items() if sum(map(len, own))}

    @property
    def _units(self) -> dict[str, str]:
        return {f.output: f.unit for f in self.fits}

    @property
    def rmse(self) -> float:
        """Root mean square residual of the first output, in its unit."""
        return next(iter(self.rmse_by_output.values()), 0.0)

    # --- other recordings -------------------------------------------------------------------------

    def predict(self, recording: Recording, **options: Any) -> Recording:
        """The recording with its outputs as the fitted model predicts them.

        Args:
            recording: With the model's inputs; outputs are needed for a start or a horizon alone.
            options: `first`, `initial`, `horizon`, `window`, `origins` of `pikanid.validate`.

        Raises:
            BadRecording: An input is missing or unusable.
        """
        return predict(self, recording, **options)

    def validate(self, recordings: Recording | Sequence[Recording], **options: Any) -> Validation:
        """How well the fitted model predicts recordings: see `pikanid.validate`.

        Args:
            recordings: One or several; best such as the fit has not seen.
            options: Of `pikanid.validate`: `training` (for the linear baseline), `first`,
                `horizon`, ...

        Raises:
            BadRecording: A channel is missing or unusable.

        >>> import pikanid as pk
        >>> model = pk.systems.sloshing()
        >>> seen = pk.simulate(model, pk.excitation.two_pulse(), sigma=2e-3, seed=0)
        >>> new = pk.simulate(model, pk.excitation.multisine(), sigma=2e-3, seed=1)
        >>> score = pk.NLS().fit(model, seen).validate(new, training=seen).score("sloshing")
        >>> score.held_out, round(score.fit, 1)
        (True, 98.6)
        """
        return validate(self, recordings, **options)

    def resid(self, recordings: Recording | Sequence[Recording], **options: Any
              ) -> tuple[ResidualAnalysis, ...]:
        """Residual analysis, one a recording and output: see `pikanid.resid`.

        Raises:
            BadRecording: A channel is missing or unusable.
        """
        return resid(self, recordings, **options)

    # --- showing and keeping ---------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """The content of the JSON that `pikanid identify --json` writes."""
        return {
            "schema_version": 1,
            "model": self.model.name,
            "strategy": self.strategy,
            "parameters": {f.label: {"value": float(v), "std": _plain(s), "unit": f.unit}
                           for f, v, s in zip(self.free, self.theta,
                                              np.sqrt(np.diag(self.covariance)), strict=True)},
            "cost": self.cost,
            "chi2": {k: _plain(v) for k, v in self.adequacy.to_dict().items()},
            "n": self.n,
            "rmse": self.rmse,
            **({"outputs": {name: {"rmse": value, "unit": self._units[name]}
                            for name, value in self.rmse_by_output.items()}}
               if len(self.rmse_by_output) > 1 else {}),
            "converged": self.converged,
            "warnings": list(self.warnings),
            "seconds": self.seconds,
            "seed": self.seed,
            "version": self.version,
            "settings": dict(self.settings),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row a parameter: value, standard error, 95 % interval, unit."""
        import pandas as pd

        rows = []
        for f in self.free:
            low, high = self.interval(f.name, recording=f.recording)
            rows.append((f.label, self.value(f.name, f.recording), self.std(f.name, f.recording),
                         low, high, f.unit))
        columns = ["parameter", "value", "std", "lower", "upper", "unit"]
        return pd.DataFrame(rows, columns=columns).set_index("parameter")

    def plot(self, narrow: bool = False) -> matplotlib.figure.Figure:
        """Measured against fitted, and the residual, a row an output and recording; `narrow`: for
        a phone.
        """
        from pikanid.estimate.plots import plot_fits

        return plot_fits(self.fits, f"{self.model.name}: {self.strategy}", narrow)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write everything but the approximator's object to one file (JSON, gzip if *.gz)."""
        estimate_file.save(self, path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Estimate:
        """Read what `save` wrote."""
        return estimate_file.load(path, cls)

    def __str__(self) -> str:
        lines = [f"{self.strategy} estimate of {self.model.name} ({self.n} samples, "
                 f"{self.seconds:.3g} s)"]
        width = max([len(f.label) for f in self.free], default=0)
        for f, v, s in zip(self.free, self.theta, np.sqrt(np.diag(self.covariance)), strict=True):
            lines.append(f"  {f.label:<{width}} = {rounded(v, s)} {f.unit}".rstrip())
        lines.append(f"  {self.sentence()}")
        return "\n".join([*lines, *(f"  warning: {w}" for w in self.warnings)])

    def sentence(self) -> str:
        """The verdict as a sentence."""
        a = self.adequacy
        stop = "converged" if self.converged else "stopped before it converged"
        if a.verdict == "unknown" and not self.n:
            return f"The fit {stop}; nothing was measured that could judge it."
        if a.verdict == "unknown":
            return (f"The fit {stop}; whether the model explains the recording cannot be judged: "
                    f"{self.n} samples for {len(self.free)} free parameters are too few.")
        ratio = np.sqrt(a.value / a.dof)
        what = ("explains the recording" if a.verdict == "fits"
                else "does NOT explain the recording")
        noise = "the stated noise" if a.source == "given" else "the recording's own noise"
        found = self.rmse_by_output.items()
        sizes = [f"{value:.3g} {self._units[name]}".rstrip() + (
            f" of '{name}'" if len(found) > 1 else "") for name, value in found]
        # noise that is read off the samples may be coloured: a test of white noise is no verdict
        more = (", which is more than white noise leaves by chance: a diagnosis tells whether "
                "anything is missing" if a.verdict == "fits" and a.p_value < USUAL.alpha else "")
        return (f"The fit {stop} and {what}: residual {', '.join(sizes)}, "
                f"{ratio:.3g} times {noise}{more}.")

    __repr__ = __str__

    def _repr_html_(self) -> str:
        from pikanid.figures import unit_text
        from pikanid.pieces.html import tabled, text
        from pikanid.pieces.sheet import Sheet

        sheet = Sheet(("parameter", "estimate ± std. error", "unit"), tuple(
            (f.label, rounded(self.value(f.name, f.recording), self.std(f.name, f.recording)),
             unit_text(f.unit) or "-") for f in self.free))
        notes = "".join(f"<p>warning: {text(w)}</p>" for w in self.warnings)
        return (f"<b>{text(self.strategy)}</b> estimate of {text(self.model.name)}"
                f"{tabled(sheet)}<p>{text(self.sentence())}</p>{notes}")


def _plain(value: Any) -> Any:
    """NaN and infinity have no JSON form: they become null."""
    return None if isinstance(value, float) and not np.isfinite(value) else value


def total_cost(fits: Sequence[Fit]) -> float:
    """Half the sum of squared residuals."""
    return 0.5 * float(sum(r @ r for r in (f.residual for f in fits)))
