"""The catalogue as data: which physics can be missing, and what must not be mistaken for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pikanid.mismatch.catalogue import channels, decoys, forces, friction, late_inputs
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.cross_axis import cross_axis
from pikanid.mismatch.catalogue.second_mode import second_mode
from pikanid.mismatch.catalogue.site import Site

ENTRIES: tuple[Callable[[Site], list[Candidate]], ...] = (
    friction.coulomb_friction,
    friction.quadratic_drag,
    friction.power_drag,
    friction.amplitude_damping,
    forces.cubic_stiffness,
    forces.static_bias,
    forces.parameter_drift,
    second_mode,
    forces.wall_impact,
    cross_axis,
    forces.disturbance,
    friction.boundary_layer,
    friction.hysteresis,
    channels.delay,
    late_inputs.input_delay,
    channels.lags,
    channels.input_gain,
    channels.sensor_gain,
    channels.input_limits,
    channels.input_backlash,
    channels.sensor_offset,
    channels.sensor_drift,
    channels.sensor_saturation,
    channels.sensor_nonlinearity,
    forces.initial_state,
    channels.input_hold,
)
DECOYS: tuple[Callable[[Site], list[Candidate]], ...] = (
    decoys.even_stiffness,
    decoys.quintic_stiffness,
    decoys.one_way_friction,
    decoys.stribeck_friction,
    decoys.dissipating_wall,
    decoys.velocity_coupled_drive,
    decoys.soft_saturation,
    decoys.clock_error,
    decoys.wobble,
    decoys.rate_limit,
)


def candidates(sites: Sequence[Site]) -> tuple[Candidate, ...]:
    """Everything that can be missing in a model, entries first; equal keys once.  What is an
    explanation of its own `beside` others only is there as well.

    >>> from pikanid.recording import excitation
    >>> from pikanid.model import systems
    >>> from pikanid.mismatch.catalogue.site import sites
    >>> model, rec = systems.sloshing(), excitation.two_pulse()
    >>> found = candidates(sites(model, (rec,)))
    >>> sum(c.known and c.suits() for c in found), found[0].key
    (28, 'coulomb_friction')
    """
    made: dict[str, Candidate] = {}
    # two coordinates may be seen in one output, which has one sensor
    first = {s.output.name: s.q for s in reversed(sites)}
    for table in (ENTRIES, DECOYS):
        for site in sites:
            for entry in table:
                for candidate in entry(site):
                    if candidate.channel != "sensor" or first[site.output.name] == site.q:
                        made.setdefault(candidate.key, candidate)
    return tuple(made.values())
