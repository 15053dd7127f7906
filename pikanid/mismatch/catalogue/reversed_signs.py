"""Catalogue: a channel that was wired, or written down, with the opposite sign.

A temperature in degC has no sign to reverse.
"""

from __future__ import annotations

from pikanid.formula import units
from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site


def input_sign(site: Site) -> list[Candidate]:
    """Each input, its sign reversed."""
    def one(u: str) -> Candidate:
        def directions(view: View) -> list[TangentDirection]:
            return [TangentDirection(
                {}, push={u: -2 * view.u[u]}, one_sided=True, scales=False)]

        return Candidate(
            ("input_sign",), f"{u} acts in the opposite direction", f"-{u}", "input", site, (),
            lambda m: m.map_input(u, function=f"-{u}"), directions,
            site.variant(u), twin="sign")

    return [one(u) for u in site.inputs
            if not units.begins_elsewhere(site.model.input(u).unit)]


def sensor_sign(site: Site) -> list[Candidate]:
    """The output, its sign reversed."""
    o = site.output.name

    def directions(view: View) -> list[TangentDirection]:
        return [TangentDirection({}, seen=-2 * view.y[o], one_sided=True, scales=False)]

    return [] if units.begins_elsewhere(site.output.unit) else [Candidate(
        ("sensor_sign",), f"{o} counts in the opposite direction", f"-{o}", "sensor", site, (),
        lambda m: m.map_output(o, function=f"-{o}"), directions, twin="sign")]
