"""How well a diagnosis says where something is missing: channel, equation, states, time, region.

*Channels.* A hidden effect can be told to act in its channel unless a twin acts in another one. An
answer is `wrong` if it gives a channel in which nothing hides, `right` if it gives that of every
hidden effect that can be told (or none, where none can), otherwise `part`, or `undecided` if it
gives none.  Laws of a remainder may be said or left out.

*States.* Of the laws in the equation of motion: `right` if all that the effects depend on is said
and nothing else, but for what laws of a remainder depend on; `wrong` if nothing of what is said
counts there, otherwise `part`; `unsaid` if nothing is said.

*Time.* Intersection over union of the windows said and the true ones, P. Jaccard's coefficient
(Bull. Soc. Vaud. Sci. Nat. 37, 1901), where all that hides acts for a time only.  Windows less than
a natural period apart count as one on both sides: a force that follows the motion comes and goes in
each, and no recording of its integrals shows when.

*Region.* F₁ of the samples in which a hidden effect that acts in a regime does so, and those that
lie in the region said: twice what both hold over the sum of either (C. J. van Rijsbergen,
Information Retrieval, 1979), as localisation of a discrepancy is scored by Y. Wang, arXiv
2606.23215.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from pikanid import errors
from pikanid.storage.entries import Entry
from pikanid.validation.concealed.acting import Mask, Spans, Truth, closed, natural_period
from pikanid.validation.concealed.answers import MOST, check_case
from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.effects import CATALOGUE, NEAR, OUTSIDE, UNFORESEEN
from pikanid.validation.concealed.score import Share

Outcome = Literal["right", "part", "wrong", "undecided", "unsaid"]
CHANNELS = ("dynamics", "input", "sensor")
SAID = (*CHANNELS, "several", "undecided")
EQUATION = "theta_dot"  # definition: the only equation in which the rig can be wrong
# States that the force of a law in the equation of motion depends on; of memory and hidden modes,
# on those that drive them.
STATES: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("cubic_stiffness", "quintic_stiffness", "even_stiffness", "wall_impact",
                     "parameter_drift:length", "cogging", "cable_drag", "magnet",
                     "asymmetric_spring", "wobbling_length", "parametric_excitation",
                     "internal_resonance"), ("theta",)),
    **dict.fromkeys(("coulomb_friction", "stribeck_friction", "one_way_friction",
                     "smooth_friction", "stick_slip_friction", "quadratic_drag", "power_drag",
                     "parameter_drift:damping", "warming_damping", "boundary_layer",
                     "fluid_memory", "hysteresis:bouc_wen"), ("theta_dot",)),
    **dict.fromkeys(("amplitude_damping", "position_friction", "hard_stop"),
                    ("theta", "theta_dot")),
}
# A force with memory of the path has no state of the instant: saying none is right as well.
MEMORY = ("hysteresis:bouc_wen", "stick_slip_friction", "boundary_layer", "fluid_memory")


@dataclass(frozen=True)
class Region:
    """An interval of an argument in which a diagnosis says that something acts."""

    argument: str
    low: float
    high: float


@dataclass(frozen=True)
class Said:
    """The place that a diagnosis gives.

    Attributes:
        channels: In which something is missing; empty where it is not decided.
        equation: Whose right-hand side is incomplete.
        states: That the missing force depends on.
        windows: Seconds of the train recording.
        regions: Parts of the state; empty where it says of none.
    """

    channels: frozenset[str]
    equation: str
    states: frozenset[str]
    windows: Spans
    regions: tuple[Region, ...]


@dataclass(frozen=True)
class Place:
    """One place against the truth; None where there is nothing to compare.

    Attributes:
        case: Id.
        channel: Outcome.
        equation: Whether it is the right one.
        states: Outcome.
        overlap: Intersection over union of the windows.
        region: F₁.
        invented: Whether a region is said where no law acts in a regime.
    """

    case: str
    channel: Outcome
    equation: bool
    states: Outcome | None
    overlap: float | None
    region: float | None
    invented: bool


def read_where(diagnosis: Any, case: str) -> Said:
    """The part `where` of diagnosis.json.

    Raises:
        BadSetting: If anything in it that is compared is missing or of another type.
    """
    def wrong(detail: str) -> errors.BadSetting:
        return errors.BadSetting(errors.diagnosis_unreadable(case, detail.rstrip(".")))

    whole = Entry(diagnosis, "it", wrong).table(("where",), None)
    get = whole["where"].called("its where").table(
        ("channel", "equation", "depends_on", "time"), None)
    channel = get["channel"].text(SAID)
    channels = [e.text(CHANNELS) for e in get["channels"].items(most=len(CHANNELS))] if (
        "channels" in get) else [channel] if channel in CHANNELS else []
    spans = []
    for entry in get["time"].items():
        start, stop = entry.pair()
        spans.append((start.number(), stop.number(low=start.number())))
    regions = [_region(e) for e in get["region"].items(most=MOST)] if "region" in get else []
    return Said(frozenset(channels), get["equation"].text(longest=200),
                frozenset(e.text(longest=200) for e in get["depends_on"].items(most=MOST)),
                tuple(spans), tuple(regions))


def place(case: Mapping[str, Any], diagnosis: Mapping[str, Any],
          truth: Truth | None = None) -> Place | None:
    """Compare where a diagnosis finds something missing with the truth.

    Args:
        case: Entry of a truth file.
        diagnosis: Content of diagnosis.json.
        truth: Of that case, for windows and regions; without it neither is compared.

    Returns:
        The comparison; None where nothing hides, or nothing was noticed.

    Raises:
        BadSetting: If what is compared is missing in either, or of another type.
    """
    check_case(case)
    if not case["effects"] or not diagnosis.get("mismatch"):
        return None
    said = read_where(diagnosis, case["id"])
    entries, laws = case["effects"], case.get("remainder", [])
    overlap = region = None
    every = [] if truth is None else [a for a in truth.acting if a.regime is not None]
    local = [a for a in every if a.id in {effect["id"] for effect in entries}]
    if truth is not None and truth.windows is not None:
        gap = natural_period(case)
        overlap = intersection_over_union(closed(said.windows, gap), closed(truth.windows, gap))
    if truth is not None and local:
        region = f1(inside(said.regions, truth.motion),
                    np.any([a.mask for a in local], axis=0))
    return Place(case["id"], channel_outcome(said.channels, entries, laws),
                 said.equation == EQUATION,
                 states_outcome(said.states & {"theta", "theta_dot"}, entries, laws),
                 overlap, region, bool(said.regions) and truth is not None and not every)


def channel_outcome(said: frozenset[str], effects: Sequence[Mapping[str, Any]],
                    laws: Sequence[Mapping[str, Any]] = ()) -> Outcome:
    """Channels said against those of hidden effects and of the laws beside them."""
    apart = [_channels(effect) for effect in effects]
    possible = frozenset().union(*apart, *map(_channels, laws))
    told = frozenset().union(*(c for c in apart if len(c) == 1))
    if said - possible:
        return "wrong"
    if told <= said:
        return "right"
    return "part" if said else "undecided"


def states_outcome(said: frozenset[str], effects: Sequence[Mapping[str, Any]],
                   laws: Sequence[Mapping[str, Any]] = ()) -> Outcome | None:
    """States said against those that the laws in the equation of motion depend on.

    None where something hides in another channel, whose states are those of the motion that it
    distorts, and where rightly none is said.
    """
    if any(_channels(entry) != {"dynamics"} for entry in (*effects, *laws)):
        return None
    needed = frozenset(s for e in effects if _name(e) not in MEMORY for s in _states(e))
    fine = frozenset(s for e in (*effects, *laws) for s in _states(e))
    if not fine and not said:
        return None
    if needed <= said <= fine:
        return "right"
    if not said:
        return "unsaid"
    return "part" if said & fine else "wrong"


def intersection_over_union(a: Spans, b: Spans) -> float:
    """|a ∩ b| / |a ∪ b| of unions of intervals, 0 to 1; each without overlaps in itself.

    >>> intersection_over_union(((0.0, 2.0),), ((1.0, 3.0),))
    0.3333333333333333
    """
    shared = sum(max(0.0, min(p[1], q[1]) - max(p[0], q[0])) for p in a for q in b)
    together = sum(q - p for p, q in (*a, *b)) - shared
    return shared / together if together > 0.0 else 0.0


def f1(said: Mask, true: Mask) -> float:
    """F₁ = 2|said ∩ true| / (|said| + |true|) of samples (N,); 0 where both are empty.

    >>> round(f1(np.array([True, True, False]), np.array([True, False, False])), 3)
    0.667
    """
    total = int(said.sum()) + int(true.sum())
    return 2 * int((said & true).sum()) / total if total else 0.0


def inside(regions: Sequence[Region], motion: Mapping[str, Array]) -> Mask:
    """(N,) which samples of a motion, given by name (N,), lie in any of the regions."""
    found = np.zeros(len(next(iter(motion.values()))), dtype=bool)
    for region in regions:
        if region.argument in motion:
            values = motion[region.argument]
            found |= (values >= region.low) & (values <= region.high)
    return found


def tally(places: Iterable[Place]) -> dict[str, Share]:
    """Counts over a set: channels and equations of all cases, states of those that have any.

    `region_found` counts laws in a regime whose samples are found with F₁ ≥ ½, `time_found` windows
    of which half the union is shared; `region_invented` regions where nothing acts in one.
    """
    every = list(places)
    states = [p.states for p in every if p.states is not None]
    timed = [p.overlap for p in every if p.overlap is not None]
    local = [p.region for p in every if p.region is not None]
    rest = [p.invented for p in every if p.region is None]
    kinds: tuple[Outcome, ...] = ("right", "part", "wrong", "undecided")
    return {
        **{f"channel_{k}": Share(sum(p.channel == k for p in every), len(every)) for k in kinds},
        "equation_right": Share(sum(p.equation for p in every), len(every)),
        **{f"states_{k}": Share(states.count(k), len(states))
           for k in ("right", "part", "wrong", "unsaid")},
        "time_found": Share(sum(x >= 0.5 for x in timed), len(timed)),
        "region_found": Share(sum(x >= 0.5 for x in local), len(local)),
        "region_invented": Share(sum(rest), len(rest))}


def _region(entry: Entry) -> Region:
    get = entry.table(("state", "from", "to"), None)
    low = get["from"].number()
    return Region(get["state"].text(longest=200), low, get["to"].number(low=low))


def _channels(effect: Mapping[str, Any]) -> frozenset[str]:
    """Channels in which an effect may act as far as any recording tells."""
    found = {effect["channel"]}
    for twin in effect["twins"]:
        of_twin = {e.channel for e in (*CATALOGUE, *NEAR, *OUTSIDE, *UNFORESEEN) if e.id == twin}
        found |= set() if effect["channel"] in of_twin else of_twin
    return frozenset(found)


def _name(effect: Mapping[str, Any]) -> str:
    variant = effect.get("variant", "")
    return f"{effect['id']}:{variant}" if variant else str(effect["id"])


def _states(effect: Mapping[str, Any]) -> tuple[str, ...]:
    return STATES.get(_name(effect), ())
