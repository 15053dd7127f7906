"""The networks of a PINN: one tanh network a chain and recording, scaled to what it must follow."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pikanid import errors
from pikanid.approximators import Array
from pikanid.approximators.mlp import MLP
from pikanid.approximators.tables import gauss_nodes
from pikanid.objective.functional import Functional, bind
from pikanid.objective.shooting import Shooting
from pikanid.problem.chains import Chains
from pikanid.problem.problem import Experiment, Problem
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.grids import fastest_rate

MOST_KINKS = 32  # limit: of a network: each is a unit more
NODES_A_RADIAN = 4.0  # numerical: of the fastest linearised motion
FEWEST_NODES, MOST_NODES = 64, 2000  # limit: Gauss nodes of a recording
STEEPEST = 1.5  # numerical: first-layer slope per unit: steeper steps leave gaps


@dataclass(frozen=True)
class Architecture:
    """What every network of a fit has in common.

    `spread` is the steepness of the first layer in units of the fastest motion, `hidden` None lets
    that motion choose the width.
    """

    hidden: tuple[int, ...] | None
    spread: float
    anchored: bool
    exact_switches: bool
    collocation: int | None  # evenly spaced points, each of weight 1; None: Gauss nodes
    device: str


@dataclass(frozen=True, eq=False)
class Networks:
    """Networks (recordings, chains) and the steepness (recordings,) that they start with."""

    nets: tuple[tuple[MLP, ...], ...]
    steepness: tuple[float, ...]
    rates: Array  # [1/s], one a recording
    notes: tuple[str, ...]

    def start(self, seed: int) -> tuple[Array, ...]:
        """Starting coefficients, one vector a recording."""
        return tuple(
            np.concatenate([net.initial(seed + 1009 * r + i, steep) for i, net in enumerate(own)])
            for r, (own, steep) in enumerate(zip(self.nets, self.steepness, strict=True)))


@dataclass(frozen=True, eq=False)
class NetworkTrajectories:
    """The fitted curves: `networks[r][i]` with `coefficients[r][i]` for chain i of recording r."""

    state_names: tuple[str, ...]
    chains: Chains
    networks: tuple[tuple[MLP, ...], ...]
    coefficients: tuple[tuple[Array, ...], ...]

    def states(self, t: Array, recording: int = 0) -> Array:
        """Approximated states (M, n) of a recording at times t (M,) [s]."""
        pairs = list(zip(self.networks[recording], self.coefficients[recording], strict=True))
        return np.column_stack([pairs[i][0].values(t, pairs[i][1], q) for i, q
                                in zip(self.chains.root, self.chains.order, strict=True)])


def make_networks(problem: Problem, field: VectorField, chains: Chains, plan: Architecture
                  ) -> Networks:
    """Networks whose input is scaled to [-1, 1] and whose output has the size of the data."""
    rates = []
    for r, e in enumerate(problem.experiments):
        rates.append(max(fastest_rate(problem, field, r), 1.0 / (e.t1 - e.t0)))
    nets, steepness, notes = [], [], []
    for r, e in enumerate(problem.experiments):
        turns = 0.5 * rates[r] * (e.t1 - e.t0)
        hidden = plan.hidden or (int(np.clip(round(turns), 16, 64)), 16)
        steepness.append(min(plan.spread * max(turns, 2.0), STEEPEST * hidden[0]))
        switches = tuple(float(t) for t in e.breakpoints()) if plan.exact_switches else ()
        if len(switches) > MOST_KINKS:
            notes.append(errors.network_smears_switches(len(switches), MOST_KINKS))
            switches = ()
        # Slower than a hundredth of the recording, so that gates and kinks are seen at all.
        rate = min(rates[r], 100.0 / (e.t1 - e.t0))
        nets.append(tuple(
            MLP(e.t0, e.t1, m, hidden, 0.0 if plan.anchored else offset, scale, rate,
                plan.anchored, switches, plan.device)
            for m, (offset, scale) in zip(
                chains.lengths, _sizes(problem, field, chains, r, rates[r]), strict=True)))
    return Networks(tuple(nets), tuple(steepness), np.array(rates), tuple(dict.fromkeys(notes)))


def functional_of(problem: Problem, field: VectorField, chains: Chains, networks: Networks,
                  plan: Architecture, *, weighted: bool) -> Functional:
    """Eq. (2) for networks; an initial state that they hold exactly is eliminated."""
    nodes = [_nodes(e, rate, plan.collocation)
             for e, rate in zip(problem.experiments, networks.rates, strict=True)]
    made = bind(problem, field, chains, networks.nets, nodes, given_start=False, weighted=weighted)
    if not plan.anchored:
        return made
    # Leading coefficients of a network are its initial jet: chain states in order.
    order = np.lexsort((chains.order, chains.root))
    hold = np.eye(len(chains.root))[order]
    parts = []
    for part in made.parts:
        held = np.concatenate([table.part.start + np.arange(m) for table, m in zip(
            part.physics.tops, chains.lengths, strict=True)])
        parts.append(replace(part, held=held, hold=hold))
    return replace(made, parts=tuple(parts))


def _nodes(e: Experiment, rate: float, collocation: int | None) -> tuple[Array, Array]:
    """Collocation times and weights; Gauss nodes stay clear of the switches."""
    if collocation is not None:
        return np.linspace(e.t0, e.t1, collocation), np.ones(collocation)
    duration = e.t1 - e.t0
    count = np.clip(NODES_A_RADIAN * rate * duration, FEWEST_NODES, MOST_NODES)
    breakpoints = [np.array([e.t0])]
    for begin, end in pairwise([e.t0, *e.breakpoints(), e.t1]):
        panels = max(1, int(np.ceil((end - begin) / duration * count / 4.0)))
        breakpoints.append(np.linspace(begin, end, panels + 1)[1:])
    return gauss_nodes(np.concatenate(breakpoints), 4)


def _sizes(problem: Problem, field: VectorField, chains: Chains, r: int, rate: float
           ) -> list[tuple[float, float]]:
    """Mean and size of each chain's first state: from an output that shows it, or a simulation."""
    e = problem.experiments[r]
    p = problem.parameters(problem.guess, r)
    at = np.array([e.t0])
    shows, _ = field.output_jacobians(at, e.initial(p)[None], e.inputs(at), p)
    found: dict[int, tuple[int, float, float]] = {}
    for samples in e.samples:
        for state, slope in enumerate(shows[0, samples.output]):
            size = float(np.max(np.abs(samples.y), initial=0.0))
            if not np.isfinite(slope) or abs(slope) < 1e-9 or size == 0.0:
                continue
            chain, q = chains.root[state], chains.order[state]
            entry = (q, float(np.mean(samples.y)) / slope if q == 0 else 0.0,
                     size / abs(slope) / rate**q)
            found[chain] = min(found.get(chain, entry), entry)
    missing = [i for i in range(len(chains.top)) if i not in found]
    simulated = _simulated(problem, r) if missing else None
    for i in missing:
        state = list(zip(chains.root, chains.order, strict=True)).index((i, 0))
        size = 0.0 if simulated is None else float(np.max(np.abs(simulated[:, state])))
        found[i] = (0, 0.0, size if np.isfinite(size) and size > 0.0 else 1.0)
    return [found[i][1:] for i in range(len(chains.top))]


def _simulated(problem: Problem, r: int) -> Array | None:
    """States at the guess; None where the model cannot be simulated there."""
    shooting = Shooting(problem)
    try:
        shooting.choose_steps(problem.guess, "coarse")
        response = shooting.responses(problem.guess)[r]
    except errors.SimulationFailed:
        return None
    return response.states if response.finished else None
