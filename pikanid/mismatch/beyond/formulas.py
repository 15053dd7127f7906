"""Laws that no catalogue holds: read out of the missing force's edges, refitted by simulation.

An edge of the missing force is compared with the library of forms.  The most probable ones become
candidates `symbolic:<expression>`, with a constant beside them or not, whose constants are
estimated anew inside the equation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import sympy as sp

from pikanid.formula.expressions import symbol
from pikanid.mismatch.beyond.force_shape import Edge, ForceShape
from pikanid.mismatch.catalogue.candidate import SYMBOLIC, Candidate
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.settings.settings import Settings
from pikanid.model.parts import Parameter
from pikanid.symbolic.fitting import FormFit
from pikanid.symbolic.laws import sum_of_laws
from pikanid.symbolic.library import NOTHING
from pikanid.symbolic.naming import name_curve
from pikanid.symbolic.search import shortlist
from pikanid.symbolic.settings import SymbolicSettings

LINEAR = "linear"  # what free parameters do already, as a rule
CONSTANT = ("constant", "")
Entries = Mapping[tuple[str, str], str]  # form and argument -> key in the catalogue


def symbolic_candidates(shape: ForceShape, site: Site, entries: Sequence[Candidate],
                        settings: Settings) -> list[Candidate]:
    """Formulas for what an edge shows, as effects, of the edges that explain most alone.

    Args:
        shape: The missing force.
        site: Where it acts.
        entries: The catalogue: a form that is an entry of it is no formula of its own.
        settings: How much an edge must explain, how it is named, and how many
            formulas are read of it.
    """
    named = {(e.form, e.argument): e.key for e in entries if e.form and e.site.v == site.v}
    best, asks = max((e.alone for e in shape.edges), default=0.0), settings.beyond
    edges = [e for e in shape.edges if e.alone > max(asks.read, asks.read_beside * best)]
    return [_candidate(site, edge, fit, constant, named)
            for edge in edges for fit in _forms(edge, settings)
            for constant in (False, True)
            if constant or (fit.form.name, edge.argument) not in named]


def _forms(edge: Edge, settings: Settings) -> list[FormFit]:
    asks = SymbolicSettings(**asdict(settings.formulas))
    fits = shortlist(name_curve(edge.curve, settings=asks))
    laws = [f for f in fits if f.form is not NOTHING and f.form.family != LINEAR]
    return laws[:settings.budget.forms]


def _candidate(site: Site, edge: Edge, fit: FormFit, constant: bool, named: Entries) -> Candidate:
    law = sum_of_laws(site.model, [edge.argument], {(0, 0, 0): fit},
                      [(edge.curve.low, edge.curve.high)], site.force_unit)
    parameters, force = law.parameters, sp.Integer(0)
    if constant:
        parameters = (*parameters, Parameter(site.name("force_0"), 0.0, site.force_unit))
        force = symbol(parameters[-1].name)
    expression, text = law.expression + force, str(law.numeric + force)
    alone = named.get((fit.form.name, edge.argument))
    covers: dict[str, dict[str, float]] = {alone: {}, named[CONSTANT]: {}} if alone else {}
    return Candidate((SYMBOLIC + text,), f"a law {text}", text, "dynamics", site, parameters,
                     lambda m: site.pushed(m.with_parameters(*law.fixed), expression),
                     lambda view: (),
                     covers=covers, static=True)
