"""How small changes of forces, inputs and sensors would show, to first order about a fit.

    δx' = f_x δx + f_u δu + force,   δy = h_x δx + seen

solved along the fitted motion.  One pass over a recording serves every entry of the catalogue.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.detect.own_signs import (
    added_forces,
    equations_alone,
    simulated_signs,
)
from pikanid.model import Model
from pikanid.model.parts import Parameter
from pikanid.problem.evaluated import paths
from pikanid.problem.held import HeldInput
from pikanid.recording import Recording
from pikanid.simulation.input_paths import combined
from pikanid.simulation.vectorfield import VectorField

SMALL, MOVED = 1e-3, 1e-4  # numerical: least size of an input, and share moved for a difference
SIGNS = 96  # numerical: signs integrated at once
CELLS = 400_000  # numerical: signs times steps at once, to keep memory small
STABLE = 1.5  # numerical: rate times step that the Runge-Kutta method follows well enough
MOST_PARTS = 64  # numerical: of a step of that method: stiffer motions are followed implicitly
STIFF_PARTS = 4  # numerical: of a step then


@dataclass(frozen=True)
class Directions:
    """Signs of all candidates: whitened columns D (rows, m) and what each stands for."""

    D: np.ndarray
    candidates: tuple[Candidate, ...]
    owner: np.ndarray
    directions: tuple[TangentDirection, ...]

    @property
    def one_sided(self) -> np.ndarray:
        """(m,) whether only positive amplitudes make sense."""
        return np.array([s.one_sided for s in self.directions], bool)


def directions(whitened: Whitened, theta: np.ndarray, candidates: Sequence[Candidate]
               ) -> Directions:
    """The columns of every candidate's signs at θ; recordings below each other.

    A recording in which an effect has fewer signs, or none, shows nothing of the others.
    """
    blocks: list[np.ndarray] = []
    places: list[list[tuple[int, int]]] = []
    known: dict[tuple[int, int], TangentDirection] = {}
    several = len(whitened.simulators) > 1
    # what is described as text and in the model already shows as a column of its Jacobian
    model = whitened.problem.model
    listed = [c for c in candidates if not (several and c.per_recording)
              and not (c.probes and c.parameters[0].name in model.parameter_names)]
    alone = {c.key: equations_alone(model, c) for c in listed if c.probes}
    chosen = [c for c in listed if not c.probes or alone[c.key] is not None]
    simulated = {k: simulated_signs(whitened, theta, c) for k, c in enumerate(chosen)
                 if c.probes and not alone[c.key]}
    for r, response in enumerate(whitened.responses(theta, states=True)):
        line = Tangent(whitened, theta, r, response.states)
        with np.errstate(over="ignore", invalid="ignore"):  # a motion gone wild: no sign of use
            signs = {(k, n): s for k, c in enumerate(chosen) for n, s in enumerate(
                c.directions(line.view))}
            for k, c in enumerate(chosen):
                if c.probes and k not in simulated:
                    for n, force in enumerate(added_forces(model, c, line)):
                        signs[k, n] = replace(signs[k, n], forces=force)
            blocks.append(line.columns([(chosen[k], s) for (k, _), s in signs.items()],
                                       functools.partial(whitened.whiten, r)))
        for column, (k, n) in enumerate(signs):
            if k in simulated:
                blocks[-1][:, column] = simulated[k][r][:, n]
        places.append(list(signs))
        # what they do along the motion is as large as the columns, and not needed again
        known = {**{at: replace(s, force=None, forces=None, push={}, seen=None)
                    for at, s in signs.items()}, **known}
    every = {place: column for column, place in enumerate(sorted(known))}
    return Directions(blocks[0] if len(blocks) == 1 else _below(blocks, places, every),
                      tuple(chosen), np.array([k for k, _ in every], int),
                      tuple(known[p] for p in every))


def _below(blocks: list[np.ndarray], places: Sequence[Sequence[tuple[int, int]]],
           every: Mapping[tuple[int, int], int]) -> np.ndarray:
    """Columns (rows, m) of all recordings, each sign's in its own; zeros where it has none."""
    D, first = np.zeros((sum(map(len, blocks)), len(every))), 0
    for own in places:
        block = blocks.pop(0)  # of long recordings there is no room for two
        D[first:first + len(block), [every[place] for place in own]] = block
        first += len(block)
    return D


class Tangent:
    """The motion in one recording and its linearisation."""

    def __init__(self, whitened: Whitened, theta: np.ndarray, r: int, states: np.ndarray):
        self.simulator = whitened.simulators[r]
        self.model: Model = self.simulator.acting
        experiment = whitened.problem.experiments[r]
        p = whitened.problem.parameters(theta, r)
        grid = self.simulator.grid(p)
        self.t, self.x, self.u, self.p = grid.T, states, grid.U, p
        field = VectorField(self.model)
        self.fx, self.fp = field.rhs_jacobians(self.t, self.x, self.u, p)
        self.hx, _ = field.output_jacobians(self.t, self.x, self.u, p)
        # over dozens of periods small errors of phase would look like damping, so that states that
        # forget within a step need shorter ones
        every = max(len(self.t) // 50, 1)
        few = np.diff(self.t)[::every, None, None] * self.fx[:-1:every]
        rate = np.abs(np.linalg.eigvals(np.where(np.isfinite(few), few, 0.0)))
        self.parts = max(math.ceil(float(rate.max(initial=0.0)) / STABLE), 1)
        self.thirds = self._thirds(field, grid.V)
        seen = grid.seen
        counts = np.diff(seen.first)
        self.stop = np.empty(grid.rows, int)
        self.stop[seen.row] = np.repeat(np.arange(len(self.t)), counts)
        self.output = np.empty(grid.rows, int)
        self.output[seen.row] = seen.output
        self.levers: dict[str, np.ndarray] = {}
        self.by_input: dict[str, np.ndarray] = {}
        self.view = self._view(field, whitened.records.recordings[r], experiment.held)

    def _thirds(self, field: VectorField, slopes: np.ndarray
                ) -> list[tuple[np.ndarray, np.ndarray]]:
        """(∂f/∂x (L-1, n, n), ∂f/∂u (L-1, n, m)) at the left end, the middle and the right end of
        each step, the inputs as they run in it; the middle state from a cubic through both ends.
        """
        t, x, h = self.t, self.x, np.diff(self.t)[:, None]
        left, right = self.u[:-1], self.u[:-1] + slopes[:-1] * h
        f0 = field.rhs(t[:-1], x[:-1], left, self.p)
        f1 = field.rhs(t[1:], x[1:], right, self.p)
        # a stiff state is not where its rates at both ends point to
        bend = h / 8 * (f0 - f1) if self.parts <= MOST_PARTS else 0.0
        middle = 0.5 * (x[:-1] + x[1:]) + bend
        places = [(t[:-1], x[:-1], left), (0.5 * (t[:-1] + t[1:]), middle, 0.5 * (left + right)),
                  (t[1:], x[1:], right)]
        return [(field.rhs_jacobians(at, state, u, self.p)[0], self._by_input(field, at, state, u))
                for at, state, u in places]

    def _by_input(self, field: VectorField, t: np.ndarray, x: np.ndarray, u: np.ndarray
                  ) -> np.ndarray:
        """∂f/∂u (L, n, m) by differences: exact where f is linear in u."""
        columns = []
        for j in range(u.shape[1]):
            size = max(float(np.abs(u[:, j]).max(initial=0.0)), SMALL) * MOVED
            up, down = u.copy(), u.copy()
            up[:, j] += size
            down[:, j] -= size
            columns.append((field.rhs(t, x, up, self.p)
                            - field.rhs(t, x, down, self.p)) / (2 * size))
        return np.stack(columns, axis=2) if columns else np.zeros((len(t), x.shape[1], 0))

    def _view(self, field: VectorField, recording: Recording, held: Sequence[HeldInput]) -> View:
        names = self.model.state_names
        y = field.outputs(self.t, self.x, self.u, self.p)
        f = field.rhs(self.t, self.x, self.u, self.p)
        rate = np.einsum("lqn,ln->lq", self.hx, f)
        extra = {}
        for name in recording.names:
            if name not in self.model.output_names:
                c = recording[name]
                if np.all(np.isfinite(c.values)):
                    extra[name] = HeldInput(name, c.time, c.values, "zero").at(self.t)
        nominal = self.simulator.model
        acting = combined(nominal, self.u, paths(nominal, self.p))
        force = {}
        for name in self.model.free_names:
            k = self.model.parameter_names.index(name)
            for i, s in enumerate(names):
                if self.model.equations[s].has(symbol(name)):
                    force[s, name] = self.fp[:, i, k] * self.p[k]
        return View(self.t, {s: self.x[:, i] for i, s in enumerate(names)},
                    {s: f[:, i] for i, s in enumerate(names)},
                    {h.name: acting[:, j] for j, h in enumerate(held)}, extra,
                    {o.name: y[:, i] for i, o in enumerate(self.model.outputs)},
                    {o.name: rate[:, i] for i, o in enumerate(self.model.outputs)}, force)

    def columns(self, listed: Sequence[tuple[Candidate, TangentDirection]],
                whiten: Callable[[np.ndarray], np.ndarray] = lambda rows: rows) -> np.ndarray:
        """δy (rows, m) of every sign, whitened; a few at a time, to keep long recordings in
        memory.
        """
        together = min(SIGNS, max(CELLS // len(self.t), 1))
        found = np.empty((len(self.stop), len(listed)))
        for k in range(0, len(listed), together):
            found[:, k:k + together] = whiten(self._columns(listed[k:k + together]))
        return found

    def _columns(self, listed: Sequence[tuple[Candidate, TangentDirection]]) -> np.ndarray:
        from pikanid.mismatch.detect.propagation import TOGETHER, add_forces, add_outputs

        L, n, m = len(self.t), self.x.shape[1], -(-len(listed) // TOGETHER) * TOGETHER
        M, B = self.steps
        G, start = np.zeros((m, n, L - 1)), np.zeros((m, n))
        seen = np.zeros((m, len(self.model.outputs), L))
        places = {s: i for i, s in enumerate(self.model.state_names)}
        forces: list[tuple[int, int | np.integer, np.ndarray]] = []  # sign, equation, values
        for k, (candidate, sign) in enumerate(listed):
            if sign.force is not None and candidate.site.lever:
                lever = self._lever(candidate.site)
                forces += [(k, i, sign.force * lever[:, i]) for i in np.flatnonzero(lever.any(0))]
            elif sign.force is not None:
                forces.append((k, places[candidate.site.v], sign.force))
            if sign.forces is not None:
                forces += [(k, i, sign.forces[:, i]) for i in np.flatnonzero(sign.forces.any(0))]
            if sign.seen is not None:
                seen[k, self.model.output_names.index(candidate.site.output.name)] = sign.seen
            for name, value in sign.initial.items():
                start[k, places[name]] = value
            for name, pushed in sign.push.items():
                du = np.broadcast_to(pushed, (3, L))[:, :-1]
                G[k] += np.einsum("pnl,pl->nl", self._input_steps(name), du)
        if forces:
            owner, row, values = zip(*forces, strict=True)
            add_forces(B, np.array(values, float), np.array(owner), np.array(row), G)
        add_outputs(M, G, start, self.hx, seen)
        return np.ascontiguousarray(seen[:len(listed), self.output, self.stop].T)

    @functools.cached_property
    def steps(self) -> tuple[np.ndarray, np.ndarray]:
        """`propagation.step_matrices` along the motion."""
        from pikanid.mismatch.detect.propagation import step_matrices, stiff_matrices

        h = np.diff(self.t)
        A = np.stack([fx for fx, _ in self.thirds])
        A = np.where(np.isfinite(A), A, 0.0)  # beyond all numbers nothing follows of a motion
        if self.parts > MOST_PARTS:
            return stiff_matrices(A, h, STIFF_PARTS)
        return step_matrices(A, h, self.parts)

    def _input_steps(self, name: str) -> np.ndarray:
        """(3, n, L-1) what an input of 1 at the left end, the middle and the right end of each step
        adds to the state at its end.
        """
        if name not in self.by_input:
            j = self.model.input_names.index(name)
            fu = np.stack([fu[:, :, j] for _, fu in self.thirds])
            self.by_input[name] = np.einsum("pnil,pli->pnl", self.steps[1], fu)
        return self.by_input[name]

    def _lever(self, site: Site) -> np.ndarray:
        """What a force of 1 adds to the rates of all states (L, n)."""
        if site.suffix not in self.levers:
            one = Parameter(site.name("unit_force"), 0.0, site.force_unit)
            pushed = self.model.with_parameters(one)
            self.levers[site.suffix] = VectorField(site.pushed(pushed, one.name)).rhs_by(
                one.name, self.t, self.x, self.u, np.append(self.p, 0.0))
        return self.levers[site.suffix]
