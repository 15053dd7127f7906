"""Formulas in the places of a network's edges: values, exact Jacobian, and the SymPy of the whole.

    v_s = d_s + Σ_i Σ_k a_k f_k(u_i; p),   node = Π of its subnodes v_s (one for a sum)

layer after layer, as pykan's networks are; an absent edge is zero.  Parameters are ordered layer by
layer: of every edge the amplitudes, then the p; of every subnode the d.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy as sp

from pikanid.formula.expressions import symbol
from pikanid.symbolic.library import NOTHING, Form, X
from pikanid.symbolic.numeric import Array

Place = tuple[int, int, int]  # layer, source node, target subnode
Groups = tuple[tuple[tuple[int, ...], ...], ...]


@dataclass(frozen=True, eq=False)
class Composition:
    """A network of forms with one output.

    Attributes:
        groups: Layer by layer, the subnodes that every node multiplies.
        forms: The form of every edge that is there.
        inputs: Formulas of the inputs.
    """

    groups: Groups
    forms: Mapping[Place, Form]
    inputs: tuple[sp.Expr, ...]

    @cached_property
    def edges(self) -> tuple[tuple[Place, Form, slice], ...]:
        """Edges in order, each with the positions of its parameters."""
        found, at = [], 0
        for layer in range(len(self.groups)):
            for place in sorted(p for p in self.forms if p[0] == layer):
                form = self.forms[place]
                if form is not NOTHING:
                    count = form.count - 1
                    found.append((place, form, slice(at, at + count)))
                    at += count
            at += self.subnodes(layer)
        return tuple(found)

    def subnodes(self, layer: int) -> int:
        """Number of subnodes that a layer's edges enter."""
        return sum(len(g) for g in self.groups[layer])

    @cached_property
    def offsets(self) -> tuple[int, ...]:
        """Position of the first d of every layer."""
        found, at = [], 0
        for layer in range(len(self.groups)):
            at += sum(f.count - 1 for p, f in self.forms.items()
                      if p[0] == layer and f is not NOTHING)
            found.append(at)
            at += self.subnodes(layer)
        return tuple(found)

    @property
    def count(self) -> int:
        """Number of parameters."""
        return self.offsets[-1] + self.subnodes(len(self.groups) - 1)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of the parameters: form's own name, where from, and where to if that is not clear."""
        names = [""] * self.count
        for (layer, i, s), form, at in self.edges:
            many = self.subnodes(layer) > 1
            tail = f"{self._node(layer, i)}{f'_{s + 1}' if many else ''}"
            own = [*form.amplitudes, *(k.name for k in form.knobs)]
            names[at] = [f"{n}_{tail}" for n in own]
        for layer, first in enumerate(self.offsets):
            last = layer == len(self.groups) - 1
            for s in range(self.subnodes(layer)):
                names[first + s] = "d" if last else f"d_h{layer + 1}_{s + 1}"
        return tuple(names)

    def _node(self, layer: int, i: int) -> str:
        if layer:
            return f"h{layer}_{i + 1}" if len(self.groups[layer - 1]) > 1 else f"h{layer}"
        text = str(self.inputs[i])
        return text if text.isidentifier() else f"u{i + 1}"

    def evaluate(self, theta: Array, x: Array) -> tuple[Array, Array]:
        """Output (M,) and its Jacobian (M, count) at inputs x (M, n); not finite off a domain."""
        with np.errstate(all="ignore"):
            return self._evaluate(np.asarray(theta, float), x)

    def stages(self, theta: Array, x: Array) -> list[tuple[Array, Array]]:
        """What enters the nodes (M, nodes) and the sums (M, subnodes) of every layer, outputs last.

        The last entry's first part is the output.
        """
        u, found = x, []
        for layer, groups in enumerate(self.groups):
            first, size = self.offsets[layer], self.subnodes(layer)
            v = np.tile(theta[first:first + size], (len(x), 1))
            for (depth, i, s), form, at in self.edges:
                if depth == layer:
                    k = len(form.columns)
                    a, p = theta[at][:k], theta[at][k:]
                    v[:, s] += a @ np.array(form.values(u[:, i], *p))
            found.append((u, v))
            u = np.column_stack([np.prod(v[:, list(g)], axis=1) for g in groups])
        return [*found, (u, np.empty((len(x), 0)))]

    def _evaluate(self, theta: Array, x: Array) -> tuple[Array, Array]:
        rows, stages = len(x), self.stages(theta, x)
        u = stages[-1][0]
        J = np.zeros((rows, self.count))
        upper = np.ones((rows, u.shape[1]))
        for layer in range(len(self.groups) - 1, -1, -1):
            before, v = stages[layer]
            lower = np.zeros_like(v)
            for j, g in enumerate(self.groups[layer]):
                for s in g:
                    lower[:, s] = upper[:, j] * np.prod(v[:, [q for q in g if q != s]], axis=1)
            first = self.offsets[layer]
            J[:, first:first + v.shape[1]] = lower
            upper = np.zeros_like(before)
            for (depth, i, s), form, at in self.edges:
                if depth != layer:
                    continue
                k, q = len(form.columns), len(form.knobs)
                a, p = theta[at][:k], theta[at][k:]
                J[:, at.start:at.start + k] = (lower[:, s] * np.array(
                    form.values(before[:, i], *p))).T
                if q:
                    table = np.array(form.derivatives(before[:, i], *p)).reshape(k, q, rows)
                    J[:, at.start + k:at.stop] = np.einsum("m,k,kqm->mq", lower[:, s], a, table)
                if layer:
                    upper[:, i] += lower[:, s] * (a @ np.array(form.rates(before[:, i], *p)))
        return u[:, 0], J

    def expression(self, values: Sequence[sp.Expr]) -> sp.Expr:
        """The whole, with these for its parameters (numbers or symbols)."""
        nodes: list[sp.Expr] = list(self.inputs)
        for layer, groups in enumerate(self.groups):
            first = self.offsets[layer]
            v = [values[first + s] for s in range(self.subnodes(layer))]
            for (depth, i, s), form, at in self.edges:
                if depth == layer:
                    own = [*form.amplitudes, *(k.name for k in form.knobs)]
                    swap = {symbol(n): w for n, w in zip(own, values[at], strict=True)}
                    bare = form.expression - symbol("d")
                    v[s] = v[s] + bare.xreplace({**swap, X: nodes[i]})
            nodes = [sp.Mul(*(v[s] for s in g)) for g in groups]
        return nodes[0]

    def swapped(self, place: Place, form: Form) -> Composition:
        """The same with another form in one place."""
        return Composition(self.groups, {**self.forms, place: form}, self.inputs)

    def carried(self, theta: Array, other: Composition, place: Place, own: Array) -> Array:
        """Parameters of `other`, which differs in one place: `own` there, θ everywhere else."""
        result = np.zeros(other.count)
        mine = {p: at for p, _, at in self.edges}
        for p, _, at in other.edges:
            result[at] = own if p == place else theta[mine[p]]
        for layer, (a, b) in enumerate(zip(self.offsets, other.offsets, strict=True)):
            n = self.subnodes(layer)
            result[b:b + n] = theta[a:a + n]
        return result
