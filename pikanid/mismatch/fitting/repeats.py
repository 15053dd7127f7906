"""Noise from repeated experiments: what differs between them is noise, whatever its colour.

The noise of one recording is told from missing physics by its frequency alone.  Where the same
experiment was made more than once it is told by what repeats (R. Pintelon and J. Schoukens, System
Identification, 2012, ch. 2): of m residuals r_i, each of its own fit, the mean holds what the model
leaves out, and the differences hold noise only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid.mismatch.data.noise_level import GRID, likeliest
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.detect.remainder import condensed
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.same_experiment import same_experiment
from pikanid.mismatch.settings.noise import NoiseSettings
from pikanid.mismatch.settings.settings import Settings
from pikanid.model import Model
from pikanid.noise.level import NoiseModel
from pikanid.recording import Recording
from pikanid.recording.channel import Array

KNOWN = 1e-4  # numerical: least relative standard error of a power: below, it counts as given
SHARED = 0.01  # numerical: of the largest singular value: less of a direction no fit takes up


@dataclass(frozen=True)
class Repeats:
    """What repeated experiments say about the noise.

    Attributes:
        p_value: That what the model leaves repeats as much as it does, if it is noise.
        levels: By output, read off the differences.
        notes: Sentences about what repeats and what does not.
    """

    p_value: float
    levels: dict[str, NoiseModel]
    notes: tuple[str, ...]


def repeats(model: Model, records: Records, later: Records | None) -> Repeats | None:
    """Noise from repeats, where all recordings repeat one experiment and what differs between them
    is more than the noise that was found; None elsewhere.

    Args:
        model: Nominal, at its estimates.
        records: To explain.
        later: Held out; None where the proof is not a recording of its own.
    """
    parts = [records] if later is None else [records, later]
    recordings = [r for part in parts for r in part.recordings]
    if len(recordings) < 2 or not same_experiment(
            model, recordings, records.settings.noise):
        return None
    fits = [_residuals(model, r, records.levels[0], records.settings) for r in recordings]
    if any(fit is None for fit in fits):
        return None
    found: dict[str, NoiseModel] = {}
    notes, p_values, refused = [], [], False
    for k, output in enumerate(model.outputs):
        own = [fit[k] for fit in fits if fit is not None]
        level = records.levels[0][output.name]
        spectra = Spectra.of([t for t, _, _ in own], [r for _, r, _ in own],
                             [J for _, _, J in own], level.interval, records.settings)
        refused |= spectra.beyond(level) < records.settings.noise_refusal / len(model.outputs)
        found[output.name] = spectra.level(level)
        p_values.append(spectra.p_value)
        notes.append(
            f"The recordings repeat one experiment: of what the model leaves of '{output.name}', "
            f"{spectra.total:.2g} {output.unit} r.m.s., {spectra.apart:.2g} differ from one to the "
            f"next and are noise (that nothing of the rest repeats: p = {spectra.p_value:.2g}).")
    if not refused:
        return None
    return Repeats(min(1.0, len(p_values) * min(p_values)), found, tuple(notes))


def _residuals(model: Model, recording: Recording, levels: dict[str, NoiseModel],
               settings: Settings) -> list[tuple[Array, Array, Array]] | None:
    """Of every output, times (N,) from the start, residual (N,) and Jacobian (N, n) of the
    recording's own fit; None where it cannot be fitted.
    """
    white = {o: replace(level, rho=0.0) for o, level in levels.items()}
    fit = fitted(model, (), Records((recording,), (white,), settings), [{}], 0)
    if fit is None:
        return None
    parts, first = [], 0
    for s in fit.whitened.problem.experiments[0].samples:
        rows = slice(first, first + len(s.t))
        sigma = white[model.outputs[s.output].name].sigma
        parts.append((s.t - recording.start, -sigma * fit.minimum.r[rows],
                      sigma * fit.minimum.J[rows]))
        first += len(s.t)
    return parts


@dataclass(frozen=True)
class Spectra:
    """Residuals of m repeats, by modes of rising frequency that no fit can take up.

    Attributes:
        omega: (K,) frequency of each mode [rad/sample].
        common: (K,) Σ r_i/√m; its square has the power of the noise where nothing repeats.
        power: (K,) of the noise: mean square of the m - 1 differences.
        freedom: m - 1.
        samples: N of each residual that is compared.
        noise: What counts as flat, and how much of a number of modes is believed.
    """

    omega: Array
    common: Array
    power: Array
    freedom: int
    samples: int
    noise: NoiseSettings

    @staticmethod
    def of(times: Sequence[Array], residuals: Sequence[Array], jacobians: Sequence[Array],
           interval: float, settings: Settings) -> Spectra:
        """From residuals (N_i,) at times (N_i,) and their Jacobians (N_i, n)."""
        stop = min(float(t[-1]) for t in times)
        count = int(stop / interval * (1 + 1e-9)) + 1
        grid = interval * np.arange(count)
        neighbours = -(-count // settings.budget.modes)

        def even(t: Array, column: Array) -> Array:
            return condensed(np.interp(grid, t, column), count, neighbours)

        r = np.stack([even(t, r) for t, r in zip(times, residuals, strict=True)])
        J = np.stack([even(t, column) for t, part in zip(times, jacobians, strict=True)
                      for column in part.T] or [np.zeros(r.shape[1])], axis=1)
        modes, omega = modes_beside(J)
        m = len(r)
        seen = r @ modes
        common = seen.sum(axis=0) / np.sqrt(m)
        # what is not common to all: m - 1 orthonormal differences
        power = (np.sum(seen**2, axis=0) - common**2) / (m - 1)
        return Spectra(omega / neighbours, common, power, m - 1, count, settings.noise)

    @property
    def blocks(self) -> np.ndarray:
        """First mode of each block in which a spectrum counts as flat."""
        edges = [1]
        while edges[-1] <= len(self.omega):
            edges.append(max(edges[-1] + 1, round(self.noise.flat * edges[-1])))
        return np.array(edges[:-1]) - 1

    @property
    def total(self) -> float:
        """Root mean square of what the model leaves."""
        power = (np.sum(self.common**2) + self.freedom * np.sum(self.power)) / (self.freedom + 1)
        return float(np.sqrt(power / len(self.omega)))

    @property
    def apart(self) -> float:
        """Root mean square of what differs from one repeat to the next."""
        return float(np.sqrt(np.mean(self.power)))

    @property
    def p_value(self) -> float:
        """That so much repeats, if all is noise, of any colour.

        The better of two, times two.  All power: F-distributed, with the number of modes that
        equal shares would need, (Σ P)²/Σ P², as that of rows (G. V. Bayley and J. M. Hammersley,
        J. R. Stat. Soc. Suppl. 8, 1946), of which some are believed.  Block for block: within
        one the ratio is F-distributed whatever the spectrum, and the logarithms of the p-values add
        up (R. A. Fisher).
        """
        from scipy.stats import f, gamma

        # each P is a χ² of m - 1 degrees: its square is too large by 1 + 2/(m - 1) on average
        equal = (1 + 2 / self.freedom) * np.sum(self.power) ** 2 / np.sum(self.power**2)
        many = self.noise.caution * float(equal)
        share = float(np.sum(self.common**2) / np.sum(self.power))
        whole = float(f.sf(share, many, self.freedom * many))
        sizes, common, power = self._by_block(np.ones(len(self.omega)))
        each = np.asarray(f.sf(common / power, sizes, self.freedom * sizes))
        joined = float(gamma.sf(-np.sum(np.log(np.maximum(each, 1e-300))), len(each)))
        return min(1.0, 2 * min(whole, joined))

    def beyond(self, level: NoiseModel) -> float:
        """p-value of the differences, if the noise has this level."""
        from scipy.stats import f

        shape = 1 - 2 * level.rho * np.cos(self.omega) + level.rho**2
        sizes, _, power = self._by_block(shape / (level.sigma**2 * (1 - level.rho**2)))
        known = 2 / max(level.spread, KNOWN) ** 2
        each = np.asarray(f.sf(power / sizes, self.freedom * sizes, known))
        return min(1.0, len(each) * float(np.min(each)))

    def level(self, old: NoiseModel) -> NoiseModel:
        """The noise of the differences, as AR(1); every octave counts the same, since a law that
        is missing shows where the modes are few.
        """
        weights = 1.0 / np.arange(1, len(self.omega) + 1)
        weights *= self.freedom * np.sum(weights) / np.sum(weights**2)
        total = float(np.sum(weights))
        shapes = 1 - 2 * np.outer(GRID, np.cos(self.omega)) + GRID[:, None] ** 2
        scales = shapes @ (weights * self.power) / total
        costs = total * (np.log(scales) + 1) - np.log(shapes) @ weights
        best = likeliest(costs, total)
        rho, curve = float(GRID[best]), 0.0
        if 0 < best < len(GRID) - 1:
            step = GRID[1] - GRID[0]
            curve = (costs[best + 1] - 2 * costs[best] + costs[best - 1]) / step**2
        rho_std = 1.0 / np.sqrt(curve) if curve > 0 else 0.0
        spread = float(np.hypot(1.0 / np.sqrt(total), 2 * rho_std / (1 - rho) if rho else 0.0))
        return NoiseModel(float(np.sqrt(scales[best] / (1 - rho**2))), rho, spread, old.interval,
                     "what differs between repeats", old.stretch)

    def _by_block(self, weights: Array) -> tuple[Array, Array, Array]:
        """Of each block, its number of modes and its sums of both weighted powers."""
        first = self.blocks
        sizes = np.diff([*first, len(self.omega)])
        return (sizes, np.add.reduceat(weights * self.common**2, first),
                np.add.reduceat(weights * self.power, first))


def modes_beside(J: Array) -> tuple[Array, Array]:
    """Orthonormal modes (N, K) beside the columns of J (N, n), slow ones first, and the frequency
    of each [rad/sample].

    Without J they are the cosines of the discrete cosine transform: noise of any smooth spectrum
    has hardly any correlation between them.

    >>> modes, omega = modes_beside(np.ones((4, 1)))
    >>> [round(float(w / np.pi), 3) for w in omega]
    [0.25, 0.5, 0.75]
    """
    norms = np.linalg.norm(J, axis=0)
    u, s, _ = np.linalg.svd(J / np.maximum(norms, 1e-300))
    taken = int(np.sum(s > SHARED * s[0])) if norms.any() else 0
    beside = u[:, taken:]
    steps = np.diff(beside, axis=0)
    roughness, turn = np.linalg.eigh(steps.T @ steps)
    return beside @ turn, np.arccos(np.clip(1 - roughness / 2, -1, 1))
