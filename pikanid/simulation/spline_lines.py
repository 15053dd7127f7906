"""Lines of generated source that evaluate a model's splines."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from pikanid.model import Model
from pikanid.simulation.lowering import spline_value
from pikanid.simulation.printing import printed


class Splines:
    """The spline evaluations that a function needs: basis values and sums, once per argument."""

    def __init__(self, model: Model, exprs: Sequence[sp.Expr]):
        self.model = model
        atoms = set().union(*(e.atoms(spline_value) for e in exprs)) if exprs else set()
        keys = {(int(a.args[0]), a.args[2]) for a in atoms}
        self.keys = sorted(keys, key=lambda key: (key[1].count_ops(), sp.default_sort_key(key[1])))
        self.orders = {
            key: sorted({0} | {int(a.args[1]) for a in atoms
                               if (int(a.args[0]), a.args[2]) == key})
            for key in self.keys}
        self.arguments = [z for _, z in self.keys]

    def swap(self, expr: sp.Expr) -> sp.Expr:
        """The expression with spline evaluations replaced by the local names that hold them."""
        table = {
            spline_value(i, o, z): sp.Symbol(f"_e{n}_{o}", real=True)
            for n, (i, z) in enumerate(self.keys) for o in self.orders[(i, z)]}
        return expr.subs(table) if table else expr

    def lines(self, n: int) -> list[str]:
        """Lines that evaluate the n-th basis and its sums."""
        i, z = self.keys[n]
        spline = self.model.splines[i]
        d, first = spline.degree, self._offset(i)
        out = [f"_z{n} = {printed(self.swap(z))}"]
        for o in self.orders[(i, z)]:
            out += [f"_b{n}_{o} = b[{n * 3 + o}, :{d + 1}]",
                    f"_k{n} = {first} + spline_basis(KNOTS_{i}, {d}, _z{n}, {o}, _b{n}_{o})",
                    f"_e{n}_{o} = 0.0",
                    f"for r in range({d + 1}):",
                    f"    _e{n}_{o} += _b{n}_{o}[r] * p[_k{n} + r]"]
        return out

    def coefficient_columns(
        self, exprs: Sequence[sp.Expr]
    ) -> tuple[list[tuple[str, sp.Expr]], list[str], list[str]]:
        """∂e/∂c_k for the coefficients: needed derivatives, lines that clear and that add."""
        targets: list[tuple[str, sp.Expr]] = []
        clear: list[str] = []
        lines: list[str] = []
        for r, e in enumerate(exprs):
            for i in {i for i, _ in self.keys}:
                first, size = self._offset(i), self.model.splines[i].size
                if e.atoms(spline_value):
                    clear.append(f"fp[{r}, {first}:{first + size}] = 0.0")
            for n, (i, z) in enumerate(self.keys):
                for o in self.orders[(i, z)]:
                    handle = sp.Dummy(real=True)
                    derivative = e.subs(spline_value(i, o, z), handle).diff(handle)
                    if derivative == 0:
                        continue
                    derivative = derivative.subs(handle, spline_value(i, o, z))
                    targets.append((f"_w{r}_{n}_{o}", derivative))
                    d = self.model.splines[i].degree
                    lines += [f"for r in range({d + 1}):",
                              f"    fp[{r}, _k{n} + r] += _w{r}_{n}_{o} * _b{n}_{o}[r]"]
        return targets, clear, lines

    def _offset(self, i: int) -> int:
        first = self.model.splines[i].coefficient_names[0]
        return self.model.parameter_names.index(first)
