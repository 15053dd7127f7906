"""What an answer is compared with before it is sure, whatever the search has passed by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import cast

import pytest
from opened import case, hypothesis, keys

from pikanid.mismatch.case import Case
from pikanid.mismatch.search.neighbours import with_walls

__all__ = ["case"]  # the fixture


@pytest.mark.parametrize("limit", ["sensor_saturation[above]", "sensor_saturation"])
def test_where_a_reading_stops_the_motion_may(case: Case, limit: str) -> None:
    h = hypothesis(case, limit, limit=0.05)
    jobs = [*with_walls(h, case.candidates)]
    found = set[str]().union(*(keys(effects) for effects, _ in jobs))
    assert {"wall_impact", "wall_impact[both sides]", "dissipating_wall"} <= found
    starts = [cast(Mapping[str, float], s) for _, some in jobs
              for s in cast(Sequence[object], some)]
    assert {start["wall"] for start in starts} == {h.values["limit"]}
    assert len({start["k_wall"] for start in starts}) > 1
    assert not list(with_walls(hypothesis(case, "cubic_stiffness"), case.candidates))


def test_one_effect_has_others_for_rivals_though_the_noise_was_read_anew(case: Case) -> None:
    search = case.begin_search().carried_over(case.records)
    assert set(search.fits) == {frozenset()}
    alone = hypothesis(case, "sensor_offset", offset=0.001)
    assert search.refine([(alone.effects, [alone.point])])
    assert search.closer([search.fits[alone.key]])
    assert {frozenset({"cubic_stiffness"}), frozenset({"sensor_gain"})} & set(search.fits)
