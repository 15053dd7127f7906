"""What is said of outliers that were left out."""

from __future__ import annotations

from pikanid.mismatch.data.left_out import LeftOut, left_out_sentences


def of(output: str, recording: str, *times: float) -> list[LeftOut]:
    return [LeftOut(output, recording, t) for t in times]


def test_of_few_outliers_the_times_are_told_in_order() -> None:
    assert left_out_sentences(of("q", "b", 2.5) + of("q", "a", 3.0, 1.0), "held-out") == [
        "Held-out recording 'a': 2 outliers of 'q' left out, at 1 and 3 s.",
        "Held-out recording 'b': 1 outlier of 'q' left out, at 2.5 s."]


def test_of_many_outliers_the_span_is_told_and_of_many_recordings_the_counts() -> None:
    many = left_out_sentences(of("q", "a", *range(7)) + of("p", "a", 0.5))
    assert many == ["Recording 'a': 1 outlier of 'p' left out, at 0.5 s.",
                    "Recording 'a': 7 outliers of 'q' left out, between 0 and 6 s."]
    several = left_out_sentences([one for name in "abcd" for one in of("q", name, 1.0, 2.0)])
    assert several == ["8 outliers of 'q' left out in 4 recordings: 2 in 'a', 2 in 'b', 2 in 'c', "
                       "2 in 'd'."]
    assert left_out_sentences([]) == []
