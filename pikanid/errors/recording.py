"""What can be wrong with a recording."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from pikanid.errors.wording import did_you_mean, listed


def channel_name(name: object) -> str:
    return f"A channel cannot be called {name!r}: give it a name of one or more letters."


def channel_twice(name: str, where: str) -> str:
    return f"'{where}' would have two channels called '{name}': rename one of them."


def no_recording(kind: str) -> str:
    return (f"A recording is needed, not a {kind}: give a Recording, the path of its file, or a "
            "DataFrame with a column or an index of times; a model comes before its recordings.")


def no_channel_table(kind: str) -> str:
    return (f"A recording is made of a dictionary: name -> Channel, not of a {kind}; see "
            "Recording.from_arrays, Recording.from_frame and Recording.read.")


def not_of_kind(what: str, kind: str, wanted: str) -> str:
    return f"{what} must be {wanted}, not {kind}."


def split_outside(where: str, at: float, begin: float, end: float) -> str:
    return (f"'{where}' cannot be split at {at:g} s, which leaves nothing on one side: it runs "
            f"from {begin:g} s to {end:g} s.")


def outside_the_record(where: str, start: float, stop: float, begin: float, end: float) -> str:
    return (f"'{where}' has nothing from {start:g} s to {stop:g} s: it runs from {begin:g} s to "
            f"{end:g} s.")


def no_channels(where: str) -> str:
    return f"'{where}' has no numeric column besides time: there is nothing to identify from."


def missing_channel(where: str, name: str, known: Iterable[str], close: Sequence[str] = ()) -> str:
    return (f"'{where}' has no column '{name}'; it has: {listed(known)}.{did_you_mean(close)} Map "
            "it with --column NAME=COLUMN (in Python columns={'name in the model': 'its header'}).")


def unknown_channel_setting(what: str, name: str, known: Iterable[str]) -> str:
    return f"{what} names '{name}', which is not a channel (channels: {listed(known)})."


def not_numbers(name: str, what: str) -> str:
    return f"The {what} of channel '{name}' are not all numbers."


def not_one_dimensional(name: str, what: str, shape: object) -> str:
    return f"The {what} of channel '{name}' have shape {shape}; they must be one-dimensional."


def lengths_differ(name: str, times: int, values: int, what: str = "values") -> str:
    return f"Channel '{name}' has {times} samples but {values} {what}; they must be as many."


def bad_sigma(name: str) -> str:
    return f"The sigma of channel '{name}' must be positive and finite wherever it has a sample."


def unknown_hold(name: str, hold: object) -> str:
    return f"The hold of channel '{name}' is {hold!r}; it must be 'zero', 'first', 'cubic' or None."


def bad_stride(n: object) -> str:
    return f"Cannot keep every {n!r}-th sample: give a whole number, 1 or more."


def filter_needs_uniform(where: str, name: str) -> str:
    return (f"'{where}': the anti-alias filter needs channel '{name}' evenly sampled and without "
            "gaps; decimate without filter, or window it to a whole stretch first.")


def too_short(where: str, name: str, n: int) -> str:
    return f"'{where}': channel '{name}' has {n} usable sample(s); at least 2 are needed."


def bad_time(where: str, place: str, value: float) -> str:
    return f"'{where}', {place}: the time is {value:g}; every sample needs a finite time."


def time_not_rising(where: str, place: str, now: float, before: float) -> str:
    how = "repeats" if now == before else "goes back from"
    return (f"'{where}', {place}: the time {now:.9g} s {how} {before:.9g} s; times must rise from "
            "sample to sample. Sort the rows and remove repeated ones.")


def absurd_value(where: str, place: str, name: str, value: float) -> str:
    return (f"'{where}', {place}: '{name}' is {value:g}, beyond 1e300; leave a missing sample "
            "empty instead.")


def missing_input(where: str, name: str, sample: int, time: float) -> str:
    return (f"'{where}', sample {sample} (t = {time:g} s): input '{name}' is missing (NaN); only "
            "outputs may have gaps. Fill it, window the recording, or give an input with a clock "
            "of its own in a file of its own (joined as run.csv+input.csv).")


def constant_output(where: str, name: str, value: float) -> str:
    return (f"'{where}': output '{name}' is {value:g} throughout; a signal that never changes (a "
            "dead sensor, a wrong column?) identifies nothing.")


def no_labelled_times(where: str) -> str:
    return (f"'{where}' has no variable of numbers over one or two dimensions with a coordinate of "
            "times along one of them.")


def no_sampling_time(where: str) -> str:
    return f"'{where}' does not say its sampling time: give the sampling rate in Hz (rate=)."


def not_as_many_names(what: str, given: int, wanted: int) -> str:
    return f"{given} names of {what} are given for {wanted} of them."


def note_warm_up(samples: int) -> str:
    return (f"The first {samples} samples are there to find the initial state; scores leave them "
            "out (--first, in Python first=).")


def note_gap(names: Sequence[str], start: float, stop: float, more: int) -> str:
    others = f", and in {more} shorter stretch{'es' if more > 1 else ''}" if more else ""
    return (f"No samples of {listed(names)} between {start:.6g} s and {stop:.6g} s{others}: inputs "
            "are held or interpolated there.")


def note_sentinels(name: str, values: Sequence[float], number: int) -> str:
    said = listed([f"{value:.12g}" for value in values])
    what = f"1 sample of '{name}' is" if number == 1 else f"{number} samples of '{name}' are"
    return f"{what} {said} and read as missing."


def note_undated(names: Sequence[str]) -> str:
    return ("Times are taken as they stand, each from the zero of its own file: when "
            f"{listed(names)} began is not known.")


def note_begins_later(name: str, first: str, seconds: float) -> str:
    return f"Recording '{name}' begins {seconds:.9g} s after '{first}' by the dates in their files."


def recorded_apart(names: Sequence[str], gap: float) -> str:
    return (f"By their dates {listed(names)} were not recorded together: {gap:.6g} s lie between "
            "them. If a clock was wrong, take their times as they stand (--own-times, in Python "
            "by_date=False).")
