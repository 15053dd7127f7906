"""What a Runge-Kutta step of a smooth model calls: its formulas on tuples, which stay in registers.

The state goes through the stages first and leaves there what its sensitivities need: `by`, the
partial derivatives that are not constant, and `fp`, those by parameters.  Then one column of S
after the other goes through the same stages.
"""

from __future__ import annotations

from collections.abc import Iterable

from pikanid.simulation.codegen import Writer


def step_functions(w: Writer) -> str:
    """Source of `inputs`, `state`, `moved`, `slope` and `column_slope`, which `rk4_smooth` calls.

    `by` (n·(n + m),) and `fp` (n, P + 1) are scratch of one stage.
    """
    n, m = range(len(w.x)), range(len(w.u))
    body, by_x, by_u = w.linearised(w.lowered.rhs, "_f{}")
    kept: list[str] = []
    rows = []
    for r in n:
        terms = []
        for partials, factor in ((by_x[r], "z[{}]"), (by_u[r], "ud[{}, a]")):
            for j, name in partials:
                if name == "1":
                    terms.append(factor.format(j))
                else:
                    terms.append(f"by[{len(kept)}]*{factor.format(j)}")
                    kept.append(name)
        rows.append(" + ".join([*terms, f"fp[{r}, k]"]))
    body += [f"by[{i}] = {name}" for i, name in enumerate(kept)]
    body.append(f"return {_tuple(f'_f{r}' for r in n)}")
    return "".join((
        _function("inputs(ua, v, dt)", [f"return {_tuple(f'ua[{j}] + v[{j}]*dt' for j in m)}"]),
        _function("state(x)", [f"return {_tuple(f'x[{i}]' for i in n)}"]),
        _function("moved(x, h, f)", [f"return {_tuple(f'x[{i}] + h*f[{i}]' for i in n)}"]),
        _function("slope(b, t, x, u, p, s, by, fp)", body),
        _function("column_slope(z, ud, a, k, by, fp)", [f"return {_tuple(rows)}"])))


def _tuple(entries: Iterable[str]) -> str:
    return "(" + "".join(f"{entry}, " for entry in entries) + ")"


def _function(head: str, body: list[str]) -> str:
    return f"@inlined\ndef {head}:\n" + "".join(f"    {line}\n" for line in body) + "\n\n"
