"""How small changes of forces, inputs and sensors would show, to first order about a fit.

    δx' = f_x δx + f_u δu + force,   δy = h_x δx + seen

solved along the fitted motion.  One pass over a recording serves every entry of the catalogue.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pikanid.expressions import symbol
from pikanid.mismatch.candidate import Candidate, Sign, View
from pikanid.mismatch.whitened import Whitened
from pikanid.model import Model
from pikanid.problem import HeldInput
from pikanid.recording import Recording
from pikanid.simulation.vectorfield import VectorField

TOGETHER = 100  # signs integrated at once


@dataclass(frozen=True)
class Directions:
    """Signs of all candidates: whitened columns D (rows, m) and what each stands for."""

    D: np.ndarray
    candidates: tuple[Candidate, ...]
    owner: np.ndarray
    signs: tuple[Sign, ...]

    @property
    def one_sided(self) -> np.ndarray:
        """(m,) whether only positive amplitudes make sense."""
        return np.array([s.one_sided for s in self.signs], bool)


def directions(whitened: Whitened, theta: np.ndarray, candidates: Sequence[Candidate]
               ) -> Directions:
    """The columns of every candidate's signs at θ; recordings below each other."""
    blocks: list[np.ndarray] = []
    kept: list[tuple[int, Sign]] = []
    several = len(whitened.simulators) > 1
    chosen = [c for c in candidates if not (several and c.per_recording)]
    for r, response in enumerate(whitened.responses(theta, states=True)):
        line = Tangent(whitened, theta, r, response.states)
        listed = [(k, s) for k, c in enumerate(chosen) for s in c.signs(line.view)]
        if not kept:
            kept = listed
        blocks.append(whitened.whiten(r, line.columns(
            [(chosen[k], s) for k, s in listed[:len(kept)]])))
    D = np.concatenate(blocks) if blocks else np.empty((0, 0))
    return Directions(D, tuple(chosen), np.array([k for k, _ in kept], int),
                      tuple(s for _, s in kept))


class Tangent:
    """The motion in one recording and its linearisation."""

    def __init__(self, whitened: Whitened, theta: np.ndarray, r: int, states: np.ndarray):
        self.model: Model = whitened.problem.model
        self.simulator = whitened.simulators[r]
        experiment = whitened.problem.experiments[r]
        p = whitened.problem.parameters(theta, r)
        grid = self.simulator.grid(p)
        self.t, self.x, self.u, self.p = grid.T, states, grid.U, p
        field = VectorField(self.model)
        self.fx, self.fp = field.rhs_jacobians(self.t, self.x, self.u, p)
        self.hx, _ = field.output_jacobians(self.t, self.x, self.u, p)
        self.fu = self._by_input(field)
        seen = grid.seen
        counts = np.diff(seen.first)
        self.stop = np.empty(grid.rows, int)
        self.stop[seen.row] = np.repeat(np.arange(len(self.t)), counts)
        self.output = np.empty(grid.rows, int)
        self.output[seen.row] = seen.output
        self.view = self._view(field, whitened.records.recordings[r], experiment.held)

    def _by_input(self, field: VectorField) -> np.ndarray:
        """∂f/∂u (L, n, m) by differences: exact where f is linear in u."""
        columns = []
        for j in range(self.u.shape[1]):
            size = max(float(np.abs(self.u[:, j]).max(initial=0.0)), 1e-3) * 1e-4
            up, down = self.u.copy(), self.u.copy()
            up[:, j] += size
            down[:, j] -= size
            columns.append((field.rhs(self.t, self.x, up, self.p)
                            - field.rhs(self.t, self.x, down, self.p)) / (2 * size))
        n = self.x.shape[1]
        return np.stack(columns, axis=2) if columns else np.zeros((len(self.t), n, 0))

    def _view(self, field: VectorField, recording: Recording, held: Sequence[HeldInput]) -> View:
        names = self.model.state_names
        y = field.outputs(self.t, self.x, self.u, self.p)
        f = field.rhs(self.t, self.x, self.u, self.p)
        rate = np.einsum("lqn,ln->lq", self.hx, f)
        known = {h.name for h in held}
        extra = {}
        for name in recording.names:
            if name not in known and name not in self.model.output_names:
                c = recording[name]
                if np.all(np.isfinite(c.values)):
                    extra[name] = HeldInput(name, c.time, c.values, "zero").at(self.t)
        force = {}
        for name in self.model.free_names:
            k = self.model.parameter_names.index(name)
            touched = [i for i, s in enumerate(names)
                       if self.model.equations[s].has(symbol(name))]
            if touched:
                force[name] = self.fp[:, touched[0], k] * self.p[k]
        return View(self.t, {s: self.x[:, i] for i, s in enumerate(names)},
                    {s: f[:, i] for i, s in enumerate(names)},
                    {h.name: self.u[:, j] for j, h in enumerate(held)}, extra,
                    {o.name: y[:, i] for i, o in enumerate(self.model.outputs)},
                    {o.name: rate[:, i] for i, o in enumerate(self.model.outputs)}, force)

    def columns(self, listed: Sequence[tuple[Candidate, Sign]]) -> np.ndarray:
        """δy (rows, m) of every sign; a few at a time, to keep long recordings in memory."""
        parts = [self._columns(listed[k:k + TOGETHER]) for k in range(0, len(listed), TOGETHER)]
        return np.concatenate(parts, axis=1) if parts else np.empty((len(self.stop), 0))

    def _columns(self, listed: Sequence[tuple[Candidate, Sign]]) -> np.ndarray:
        L, n, m = len(self.t), self.x.shape[1], len(listed)
        force, start = np.zeros((L, n, m)), np.zeros((n, m))
        held = np.zeros((L, n, m))
        seen = np.zeros((L, len(self.model.outputs), m))
        places = {s: i for i, s in enumerate(self.model.state_names)}
        inputs = {i: j for j, i in enumerate(self.model.input_names)}
        for k, (candidate, sign) in enumerate(listed):
            if sign.force is not None:
                force[:, places[candidate.site.v], k] += sign.force
            for name, du in sign.push.items():
                held[:, :, k] += self.fu[:, :, inputs[name]] * du[:, None]
            if sign.seen is not None:
                o = self.model.output_names.index(candidate.site.output.name)
                seen[:, o, k] += sign.seen
            for name, value in sign.initial.items():
                start[places[name], k] = value
        state = self._integrated(force, held, start)
        y = np.einsum("lqn,lnm->lqm", self.hx, state) + seen
        return y[self.stop, self.output]

    def _integrated(self, force: np.ndarray, held: np.ndarray, start: np.ndarray) -> np.ndarray:
        """δx (L, n, m): exponential steps with the mean f_x; forces in straight lines or held."""
        h = np.diff(self.t)[:, None, None]
        A = 0.5 * (self.fx[1:] + self.fx[:-1]) * h
        eye = np.eye(A.shape[1])
        A2 = A @ A
        over = eye + A + A2 / 2 + A2 @ A / 6 + A2 @ A2 / 24
        whole = h * (eye + A / 2 + A2 / 6)
        later = h * (eye / 2 + A / 6 + A2 / 24)
        gain = ((whole - later) @ force[:-1] + later @ force[1:] + whole @ held[:-1])
        out = np.empty((len(self.t), *start.shape))
        out[0] = start
        for k in range(len(h)):
            out[k + 1] = over[k] @ out[k] + gain[k]
        return out
