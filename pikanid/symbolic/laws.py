"""Named edges of an equation as one sum of laws, with names for all constants."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.formula import units
from pikanid.formula.expressions import symbol
from pikanid.model import Model, Parameter
from pikanid.model import units as model_units
from pikanid.symbolic.composed import Place
from pikanid.symbolic.curve import Curve
from pikanid.symbolic.fitting import FormFit
from pikanid.symbolic.library import NOTHING, X
from pikanid.symbolic.named import NO_SIMPLE_FORM, NamedEdge
from pikanid.symbolic.reading import Reading
from pikanid.symbolic.settings import USUAL, SymbolicSettings
from pikanid.symbolic.significance import Contribution

POINTS = 100  # numerical: that tell apart what is inside a law


@dataclass(frozen=True, eq=False)
class Laws:
    """One law on every edge that has one; the parameters' values are those of `fits`.

    Attributes:
        fits: The laws, by place.
        expression: Their sum, in the model's names.
        parameters: Its free constants.
        fixed: Units by which arguments are divided that have to be numbers, and zeros of
            temperature scales that powers count from.
    """

    fits: Mapping[Place, FormFit]
    expression: sp.Expr
    parameters: tuple[Parameter, ...]
    fixed: tuple[Parameter, ...] = ()

    @property
    def numeric(self) -> sp.Expr:
        """The sum in which arguments are numbers in their units."""
        return self.expression.xreplace({
            symbol(p.name): sp.Integer(int(p.value)) for p in self.fixed})

    @property
    def label(self) -> str:
        """The laws' names."""
        return "; ".join(f.form.name for f in self.fits.values())

    @property
    def covariance(self) -> np.ndarray:
        """Of all constants, edge by edge."""
        from scipy.linalg import block_diag

        blocks = [f.covariance[:-1, :-1] for f in self.fits.values()]
        return np.asarray(block_diag(*blocks)) if blocks else np.zeros((0, 0))


def sum_of_laws(model: Model, arguments: Sequence[str], fits: Mapping[Place, FormFit],
                ranges: Sequence[tuple[float, float]], unit: str = "") -> Laws:
    """The sum without the laws' offsets, which the equation's own constant part holds.

    Args:
        model: In whose names the arguments are, and whose names the constants must not take.
        arguments: Of every edge, by its number.
        fits: The laws, by place (0, number, 0).
        ranges: Of every edge's argument, which bound the parameters inside a law.
        unit: Of the sum, from which the units of the parameters follow; left open if empty.
    """
    terms, parameters, fixed = [], [], []
    taken = set(model.symbols)
    for (_, k, _), fit in fits.items():
        tail = re.sub(r"\W+", "_", arguments[k]).strip("_")
        swap: dict[sp.Symbol, sp.Expr] = {}
        names = [*fit.form.amplitudes, *(q.name for q in fit.form.knobs)]
        bounds = [(-np.inf, np.inf)] * len(fit.amplitudes)
        bounds += [q.limits(*ranges[k], POINTS) for q in fit.form.knobs]
        argument = model.formula(arguments[k], f"argument '{arguments[k]}'")
        measured = [""] * len(names)
        if unit:
            own = model_units.of_formula(model, argument)
            if own and units.begins_elsewhere(own):
                fixed.append(Parameter(_free_name(f"zero_{tail}", taken), 0.0, own, free=False))
                argument = argument - symbol(fixed[-1].name)
            if fit.form.takes_number and own:
                fixed.append(Parameter(_free_name(f"one_{tail}", taken), 1.0,
                                       model_units.of_difference(own), free=False))
                argument, own = argument / symbol(fixed[-1].name), ""
            measured = _units(fit, unit, own)
        for name, value, reach, each in zip(
                names, [*fit.amplitudes, *fit.inside], bounds, measured, strict=True):
            full = _free_name(f"{name}_{tail}", taken)
            swap[symbol(name)] = symbol(full)
            inside = float(np.clip(value, *reach))
            parameters.append(Parameter(full, inside, each, bounds=reach,
                                        description=f"of {arguments[k]}"))
        bare = fit.form.expression - symbol("d")
        terms.append(bare.xreplace({**swap, X: argument}))
    return Laws(fits, sp.Add(*terms), tuple(parameters), tuple(fixed))


def _free_name(name: str, taken: set[str]) -> str:
    """The name, with underscores behind it until it is free; it is `taken` from then on."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def _units(fit: FormFit, unit: str, argument: str) -> list[str]:
    """Units of a law's amplitudes and of the constants inside it."""
    outside = [units.product((unit, 1), (argument, -(power or 0))) for power in fit.form.powers]
    inside = ["" if knob.power is None else model_units.of_difference(argument)
              if knob.power == 1 else units.product((argument, knob.power))
              for knob in fit.form.knobs]
    return [*outside, *inside]


def chosen(named: Mapping[Place, NamedEdge]) -> dict[Place, FormFit]:
    """The named law of every edge that has one."""
    return {p: e.best.fit for p, e in named.items()
            if e.name not in (NO_SIMPLE_FORM, NOTHING.name)}


def reading_of_laws(laws: Laws, named: Mapping[Place, NamedEdge], arguments: Sequence[str],
                    ranges: Sequence[tuple[float, float]],
                    contributions: Sequence[Contribution], share: np.ndarray,
                    labels: Sequence[str], covariance: np.ndarray,
                    estimate: Estimate | None = None,
                    settings: SymbolicSettings = USUAL) -> Reading:
    """The answer; `estimate` is of the model with the laws in it, where they were refitted."""
    off, size, adequate = 0.0, 0.0, [1.0]
    for place, edge in named.items():
        fit = laws.fits.get(place)
        shown = _apart(edge.curve, edge.curve.y)
        size += float(np.mean(shown**2))
        if fit is None:
            off += float(np.mean(shown**2)) if edge.name == NO_SIMPLE_FORM else 0.0
            adequate.append(0.0 if edge.name == NO_SIMPLE_FORM else 1.0)
            continue
        off += float(np.mean(_apart(edge.curve, edge.curve.y - fit.values) ** 2))
        adequate.append(next(c.adequacy for c in edge.candidates if c.form is fit.form))
    p_value = min(adequate) if estimate is None else estimate.adequacy.p_value
    if estimate is not None and estimate.adequacy.verdict == "fits":
        p_value = max(p_value, settings.adequate)  # the verdict counts where no noise was stated
    return Reading(
        laws.expression, tuple(p.name for p in laws.parameters),
        np.array([p.value for p in laws.parameters]), covariance, tuple(arguments), tuple(ranges),
        dict(named), tuple(contributions), float(share[0]),
        tuple(zip(labels[1:], map(float, share[1:]), strict=False)), float(np.sqrt(off)),
        None if estimate is None else estimate.rmse, float(np.sqrt(size)), float(p_value),
        {place: laws.fits[place].form.name if place in laws.fits else edge.name
         for place, edge in named.items()},
        {p.name: p.unit for p in laws.parameters}, laws.fixed, estimate=estimate,
        settings=settings)


def reading_unrefitted(laws: Laws, named: Mapping[Place, NamedEdge], arguments: Sequence[str],
                       ranges: Sequence[tuple[float, float]], contributions: Sequence[Contribution],
                       stuck: Sequence[str], settings: SymbolicSettings) -> Reading:
    """The answer of edges alone; those that may be `stuck` are not to be trusted."""
    share = np.array([float(np.prod([e.probability for e in named.values()]))])
    found = reading_of_laws(laws, named, arguments, ranges, contributions, share, [laws.label],
                            laws.covariance, settings=settings)
    return replace(found, caution=errors.edge_sticks(stuck) if stuck else "")


def _apart(curve: Curve, values: np.ndarray) -> np.ndarray:
    """Values (n,) without their constant and gauge parts."""
    columns = np.column_stack([np.ones(len(curve.x)), curve.free])
    return np.asarray(values - columns @ np.linalg.lstsq(columns, values, rcond=1e-10)[0])
