"""How late the samples of outputs are: by a delay that may change while a recording runs."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, cast

import numpy as np
import sympy as sp

from pikanid.formula.expressions import TIME, symbol
from pikanid.model import Model
from pikanid.problem.evaluated import TOOLS, number, slopes
from pikanid.problem.problem import Experiment, Samples


def sample_delays(model: Model, samples: Sequence[Samples], p: np.ndarray
                  ) -> list[np.ndarray | float]:
    """The delay [s] of each output's samples at parameters p (P,): (N,) where it changes.

    >>> from pikanid.model import systems
    >>> late = systems.sloshing().map_output("theta", delay="0.25 - 0.5*t")
    >>> sample_delays(late, [Samples(0, np.array([0.0, 2.0]), np.zeros(2), None)], np.zeros(4))
    [array([ 0.25, -0.75])]
    """
    table = dict(zip(model.parameter_names, p, strict=True))
    return [_at(model.outputs[s.output].delay, table, s.t) for s in samples]


def sample_delay_jacobian(model: Model, samples: Sequence[Samples], p: np.ndarray,
                          active: np.ndarray) -> np.ndarray:
    """∂delay/∂p (rows, A) of all samples, one output after the other, by the parameters of these
    indices (A,).
    """
    table = dict(zip(model.parameter_names, p, strict=True))
    names = tuple(model.parameter_names[k] for k in active)
    return np.concatenate([np.empty((0, len(names))), *(
        np.stack([np.broadcast_to(_at(slope, table, s.t), s.t.shape)
                  for slope in slopes(model.outputs[s.output].delay, names)], axis=1)
        for s in samples)])


def shown_within(experiment: Experiment) -> Iterator[tuple[np.ndarray, Samples]]:
    """The times (N,) that samples show, by the model's own parameter values, and those samples,
    but those that show what comes after the recording.
    """
    model, samples = experiment.model, experiment.samples
    p = np.array(list(model.values.values()))
    for one, late in zip(samples, sample_delays(model, samples, p), strict=True):
        shown = np.maximum(one.t - late, experiment.t0)
        within = shown <= experiment.t1
        yield shown[within], one.part(within)


def _at(expr: sp.Expr, table: Mapping[str, float], t: np.ndarray) -> np.ndarray | float:
    if TIME not in expr.free_symbols:
        return number(expr, table)
    names = tuple(sorted(q.name for q in expr.free_symbols if q != TIME))
    return np.asarray(_of_time(expr, names)(t, *(table[n] for n in names)), float)


@functools.lru_cache(maxsize=64)
def _of_time(expr: sp.Expr, names: tuple[str, ...]) -> Callable[..., Any]:
    each = {name: np.vectorize(tool, otypes=[float]) for name, tool in TOOLS.items()}
    return cast(Callable[..., Any], sp.lambdify(
        [TIME, *map(symbol, names)], expr, [each, "numpy"]))
