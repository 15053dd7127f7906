"""Multiple shooting for long or chaotic recordings (Bock 1981): an optimum to start shooting from.

The recording is cut into segments whose initial states s_j are unknowns of their own; the gaps
x(t_{j+1}; s_j, θ) - s_{j+1} join the residual with a weight that rises from step to step.  While
the gaps are open errors cannot grow over the whole record, which is what traps single shooting.
The θ found is only a start: the strategy closes the last gaps by single shooting from it.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.formula.expressions import symbol
from pikanid.model import Model, Output, Parameter
from pikanid.objective.shooting import Shooting
from pikanid.optimise.minpack import minimise
from pikanid.problem.problem import Experiment, Problem, Samples
from pikanid.simulation.simulator import Simulator, Steps
from pikanid.strategies.nodes import state_near

CLOSING = (1.0, 10.0, 100.0)  # numerical: weights of the gaps, relative to a typical sample's


@dataclass(frozen=True)
class Segment:
    """One piece of a recording: its simulator, its rows among the samples, its node.

    `node` is the position of its initial state among the nodes, None where it starts the recording.
    """

    simulator: Simulator
    rows: np.ndarray
    recording: int
    node: int | None


def multiple_shooting(shooting: Shooting, theta: np.ndarray, count: int) -> np.ndarray | None:
    """θ (n_free,) from `count` segments a recording, starting at θ; None if it cannot be simulated.

    Nodes start from the data: a measured state from a local cubic through the samples, its
    derivative where that is a state too, all others from the model's initial values.
    """
    problem = shooting.problem
    model = _open_ended(problem.model)
    segments, nodes = _cut(problem, model, count)
    residuals = _Residuals(shooting, segments, len(theta), nodes.shape)
    start = np.concatenate([theta, nodes.ravel()])
    lower = np.concatenate([problem.lower, np.full(nodes.size, -np.inf)])
    upper = np.concatenate([problem.upper, np.full(nodes.size, np.inf)])
    for weight in CLOSING:
        residuals.closing = weight
        try:
            residuals.choose_steps(start)
        except errors.SimulationFailed:
            return None
        start = minimise(residuals.value, residuals.jacobian, start, lower, upper, 1e-6, 60).theta
    return start[:len(theta)]


def _open_ended(model: Model) -> Model:
    """The model with every state as an extra output, and a free initial state per segment."""
    ends = tuple(Output(f"{s.name}_end", symbol(s.name), s.unit) for s in model.states)
    nodes = [Parameter(f"{s.name}_node", 0.0, s.unit) for s in model.states]
    return model.with_parameters(*nodes).replace(outputs=(*model.outputs, *ends))


def _cut(problem: Problem, model: Model, count: int) -> tuple[list[Segment], np.ndarray]:
    segments: list[Segment] = []
    nodes: list[np.ndarray] = []
    free_start = model.replace(states=tuple(
        dataclasses.replace(s, initial=symbol(f"{s.name}_node")) for s in model.states))
    offset, n_outputs = 0, len(problem.model.outputs)
    for r, e in enumerate(problem.experiments):
        firsts = np.cumsum([offset, *(len(s.t) for s in e.samples)])
        edges = np.linspace(e.t0, e.t1, count + 1)
        for k in range(count):
            low, high, last = edges[k], edges[k + 1], k == count - 1
            masks = [(s.t >= low) & ((s.t < high) | last) for s in e.samples]
            samples = [s.part(m) for s, m in zip(e.samples, masks, strict=True)]
            end = np.array([high])
            samples += [Samples(n_outputs + i, end, np.zeros(1), None)
                        for i in range(len(model.states))]
            owner = model if k == 0 else free_start
            piece = Experiment(owner, e.name, low, high, e.held, tuple(samples))
            rows = np.concatenate([f + np.flatnonzero(m) for f, m in zip(
                firsts[:-1], masks, strict=True)])
            node = None if k == 0 else len(nodes)
            if k:
                nodes.append(state_near(problem.model, e, low)[0])
            segments.append(Segment(Simulator(owner, piece), rows, r, node))
        offset = int(firsts[-1])
    return segments, np.array(nodes).reshape(len(nodes), len(model.states))


class _Residuals:
    """[data; gaps] and its Jacobian as functions of [θ; nodes]."""

    def __init__(self, shooting: Shooting, segments: list[Segment], n_theta: int,
                 shape: tuple[int, int]):
        self.shooting, self.segments, self.n_theta, self.shape = shooting, segments, n_theta, shape
        self.closing = 1.0
        self.steps: list[Steps] = []
        self.sizes = np.ones(shape[1])
        outputs = shooting.problem.model.outputs
        sizes = np.maximum(np.ptp(np.array([_span(shooting, k) for k in range(len(outputs))]),
                                  axis=1), 1e-300)
        self.scale = float(np.median(shooting.weights)) * float(np.median(sizes))
        self.spans = np.concatenate([np.full(len(s.t), sizes[s.output])
                                     for e in shooting.problem.experiments for s in e.samples])
        self._at: np.ndarray | None = None
        self._kept: tuple[np.ndarray, np.ndarray] | None = None

    def parameters(self, z: np.ndarray, g: Segment) -> np.ndarray:
        p = self.shooting.problem.parameters(z[:self.n_theta], g.recording)
        nodes = z[self.n_theta:].reshape(self.shape)
        start = np.zeros(self.shape[1]) if g.node is None else nodes[g.node]
        return np.concatenate([p, start])

    def choose_steps(self, z: np.ndarray) -> None:
        """Choose integration steps of every segment at z, for 1e-5 of each signal.

        From here on a gap counts relative to how large that state is anywhere at z: a size that
        moved along could be made large instead of a gap small.
        """
        self._at = None
        nodes = np.abs(z[self.n_theta:].reshape(self.shape)).max(axis=0, initial=0.0)
        self.sizes = np.maximum(nodes, 1e-9)
        states = np.where(nodes > 0, nodes, np.inf)
        self.steps = [g.simulator.choose_steps(
            self.parameters(z, g), 1e-5, self.shooting.method,
            scale=np.concatenate([self.spans[g.rows], states])) for g in self.segments]

    def value(self, z: np.ndarray) -> np.ndarray:
        return self._evaluate(z)[0]

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        return self._evaluate(z)[1]

    def _evaluate(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self._kept is None or self._at is None or not np.array_equal(z, self._at):
            self._at, self._kept = z.copy(), self._simulate(z)
        return self._kept

    def _simulate(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        sh, (count, n) = self.shooting, self.shape
        base = len(sh.problem.model.parameters)
        nodes = z[self.n_theta:].reshape(self.shape)
        weight = self.closing * self.scale / self.sizes
        r, J = np.zeros(sh.rows + count * n), np.zeros((sh.rows + count * n, len(z)))
        for g, following, h in zip(self.segments, [*self.segments[1:], None], self.steps,
                                   strict=True):
            inside, outside = sh.columns[g.recording]
            own = np.arange(n) if g.node is not None else np.empty(0, int)
            response = g.simulator.run(
                self.parameters(z, g), np.concatenate([inside, base + own]).astype(np.int64), h)
            if not response.finished:
                return np.full(len(r), 1e10), J
            columns = outside if g.node is None else np.concatenate(
                [outside, self.n_theta + g.node * n + np.arange(n)])
            data = len(g.rows)
            r[g.rows] = (response.y[:data] - sh.y[g.rows]) * sh.weights[g.rows]
            J[np.ix_(g.rows, columns)] = response.sensitivity[:data] * sh.weights[g.rows, None]
            if following is not None and following.node is not None:
                gap = sh.rows + following.node * n + np.arange(n)
                r[gap] = (response.y[data:] - nodes[following.node]) * weight
                J[np.ix_(gap, columns)] = response.sensitivity[data:] * weight[:, None]
                J[gap, self.n_theta + following.node * n + np.arange(n)] = -weight
        return r, J


def _span(shooting: Shooting, output: int) -> tuple[float, float]:
    values = [s.y for e in shooting.problem.experiments for s in e.samples if s.output == output]
    joined = np.concatenate([np.zeros(1), *values])
    return float(joined.min()), float(joined.max())
