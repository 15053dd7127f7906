"""Builds real pykan models, and makes their own methods safe to call.

The models are instances of pykan's `MultKAN` in float64: `plot()`, `prune()`, `refine()`,
`auto_symbolic()` and the rest work on them as on any pykan model, without writing into the working
directory, touching a random generator or asking for another default dtype.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial, wraps
from typing import Any, Literal

import numpy as np

from pikanid.approximators.kan.blank import blank_kan
from pikanid.approximators.kan.plan import Array, Base, KanPlan, PlannedKan, plan_kan
from pikanid.approximators.kan.plot import plot
from pikanid.approximators.kan.prune import prune
from pikanid.approximators.kan.quiet import pykan_module, undisturbed
from pikanid.approximators.kan.refine import refine
from pikanid.approximators.kan.state import KanState, restored, to_state
from pikanid.approximators.kan.tensors import tensor, write

# pykan methods that seed, make tensors of the default dtype or construct models.
_GUARDED = (
    "attribute",
    "auto_symbolic",
    "expand_depth",
    "expand_width",
    "feature_interaction",
    "fix_symbolic",
    "perturb",
    "prune_edge",
    "prune_input",
    "prune_node",
    "suggest_symbolic",
)


def build_kan(width: Sequence[int | Sequence[int]], grid: int | Sequence[int] = 5, k: int = 3,
              grid_range: Sequence[float] | Sequence[Sequence[float]] = (-1.0, 1.0), *,
              base: Base = "zero", mult_arity: int | Sequence[Sequence[int]] = 2, seed: int = 0,
              noise: float = 0.3, start: Literal["noise", "waves"] = "noise",
              device: str = "cpu") -> Any:
    """A pykan `MultKAN` in float64 on uniform knots, made without side effects.

    Args:
        width: Nodes of every layer; [sums, products] for a layer with multiplication nodes.
        grid: Intervals G, one number or one a layer of edges.
        k: Spline degree (order, in pykan's words).
        grid_range: (start, stop) of the grid, or one pair a layer of edges: hidden values rarely
            live on the range of the inputs, and outside its grid an edge fades to zero.
        base: "zero" for w_b = 0 in Eq. (3), "silu" for a trainable w_b.
        mult_arity: Factors of a product node.
        seed: Of the starting coefficients; the global generators are neither read nor moved.
        noise: Size of the starting coefficients, as pykan's `noise_scale`: they lie in
            ±noise / (2 G).
        start: "waves" lets the hidden edges begin as slow waves that fill the next layer's grid,
            so that no hidden node starts idle; the last layer starts at noise.
        device: Torch device.

    Raises:
        BadSetting: If an argument cannot make a KAN, or torch or pykan is missing.

    >>> kan = build_kan([1, 1], grid=10, grid_range=(0.0, 5.0))
    >>> kan.act_fun[0].coef.dtype, kan.act_fun[0].coef.shape
    (torch.float64, torch.Size([1, 1, 13]))
    """
    plan = plan_kan(width, grid, k, grid_range, base, mult_arity)
    kan = blank_kan(plan, kan_class(), device)
    generator = np.random.default_rng(seed)
    for layer in range(plan.depth):
        shape = (plan.nodes(layer), plan.subnodes(layer + 1), plan.knots[layer].shape[1] - k - 1)
        coef = noise / plan.intervals(layer) * generator.uniform(-0.5, 0.5, shape)
        if start == "waves" and layer < plan.depth - 1:
            coef += _waves(plan, layer, shape, generator)
        write(kan.act_fun[layer].coef, coef)
        if base == "silu":
            bound = 1.0 / np.sqrt(shape[0])
            write(kan.act_fun[layer].scale_base, generator.uniform(-bound, bound, shape[:2]))
    kan.cache_data = _default_batch(plan, device)
    return kan


def planned_kan(width: Sequence[int | Sequence[int]], grid: int, k: int,
                grid_range: Sequence[float], *, base: Base = "zero", seed: int = 0) -> PlannedKan:
    """The plan of `build_kan`, which makes the model when it is asked for.

    Raises:
        BadSetting: If an argument cannot make a KAN, or torch or pykan is missing.

    >>> planned_kan([1, 1], 10, 3, (0.0, 5.0)).make().act_fun[0].coef.shape
    torch.Size([1, 1, 13])
    """
    plan = plan_kan(width, grid, k, grid_range, base, 2)
    kan_class()  # whatever is missing is missed now
    return PlannedKan(plan, partial(build_kan, width, grid, k, grid_range, base=base, seed=seed))


def from_state(state: KanState, device: str = "cpu") -> Any:
    """A pykan model with this state, without pykan's side effects.

    Raises:
        BadSetting: If arrays do not fit together or a symbolic function is unknown to pykan.
    """
    return restored(state, kan_class(), device)


def _default_batch(plan: KanPlan, device: str) -> Any:
    """Inputs that span the grid, so that `plot()` and `prune()` work before the first forward."""
    knots, k, n = plan.knots[0], plan.k, plan.nodes(0)
    low, high = knots[:, k], knots[:, -k - 1]
    unit = (
        np.linspace(0.0, 1.0, 201)[:, None]
        if n == 1
        else np.random.default_rng(0).uniform(size=(500, n))
    )
    return tensor(low + (high - low) * unit, device)


def _waves(plan: KanPlan, layer: int, shape: tuple[int, ...],
           generator: np.random.Generator) -> Array:
    """Coefficients of slow cosines that together fill half of the next layer's grid."""
    inputs, outputs, size = shape
    target = plan.knots[layer + 1][0, plan.k : -plan.k or None]
    middle, half = 0.5 * (target[0] + target[-1]), 0.5 * (target[-1] - target[0])
    place = (np.arange(size) - 0.5 * (plan.k - 1)) / plan.intervals(layer)
    turns = generator.uniform(0.25, 1.0, (inputs, outputs, 1))
    phase = generator.uniform(0.0, 2.0 * np.pi, (inputs, outputs, 1))
    wave = middle / inputs + 0.5 * half / np.sqrt(inputs) * np.cos(
        2 * np.pi * turns * place + phase)
    return wave * np.sqrt(inputs)  # scale_sp is 1/sqrt(inputs)


@lru_cache(maxsize=1)
def kan_class() -> type:
    """pykan's `MultKAN` with its side effects taken out (made on first use, as pykan is slow)."""
    original: Any = pykan_module().MultKAN

    class QuietKAN(original):
        """A pykan model whose methods leave no traces; see `pikanid.approximators.kan`."""

        def refine(self, new_grid: int) -> Any:
            """The same function on a finer grid, exactly where the finer grid contains this one."""
            return refine(self, new_grid).kan

        def prune(self, node_th: float = 1e-2, edge_th: float = 3e-2) -> Any:
            """Without the nodes and edges that hardly matter on the batch last seen."""
            return prune(self, node_threshold=node_th, edge_threshold=edge_th)

        def plot(self, **options: Any) -> Any:
            """pykan's diagram as a matplotlib figure."""
            return plot(self, **options)

        def copy(self) -> Any:
            """A model of its own with the same state."""
            return from_state(to_state(self))

        def fit(self, dataset: Any, *args: Any, update_grid: bool = False, **options: Any) -> Any:
            """pykan's training, which here leaves the grid alone unless told otherwise."""
            with undisturbed(double=True, silent=False):
                return super().fit(dataset, *args, update_grid=update_grid, **options)

        def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
            return from_state, (to_state(self),)

    for name in _GUARDED:
        setattr(QuietKAN, name, _guarded(getattr(original, name)))
    return QuietKAN


def _guarded(method: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(method)
    def call(self: Any, *args: Any, **options: Any) -> Any:
        with undisturbed(double=True, silent=False):
            result = method(self, *args, **options)
        if hasattr(result, "auto_save"):
            result.auto_save = False
        return result

    return call
