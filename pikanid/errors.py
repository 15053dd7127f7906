"""Every failure that a user can meet, in one place.

Each function returns one sentence that says what is wrong, where, and what to do about it.  The
exceptions carry that sentence; the command line prints it and exits with `exit_code`.
"""

from __future__ import annotations

import functools
import reprlib
from collections.abc import Callable, Iterable, Sequence
from types import FunctionType
from typing import Any

EXIT_MISFIT = 3  # of the command line, where a fit is done but explains nothing


class PikanidError(Exception):
    """Base of every error that the user can mend; the command line turns it into exit code 2."""

    exit_code = 2


class BadModel(PikanidError):
    """The model (Python or TOML) is inconsistent or says something that cannot be read."""


class BadRecording(PikanidError):
    """The recording cannot be read or cannot be used with this model."""


class BadUnit(PikanidError):
    """A unit is unknown or does not fit."""


class BadSetting(PikanidError):
    """An option has a value that cannot work."""


class DatasetUnavailable(PikanidError):
    """A real recording is neither on disk nor can it be fetched."""


class SimulationFailed(PikanidError):
    """The model cannot be simulated at the given parameters."""


def _listed(names: Iterable[str]) -> str:
    every = list(names)
    more = [f"... ({len(every)} in all)"] if len(every) > 41 else []  # 41: `brief` has said so
    return ", ".join([_short(str(name), 60) for name in every[:41 - len(more)]] + more) or "(none)"


def _did_you_mean(close: Sequence[str]) -> str:
    return f" Did you mean '{close[0]}'?" if close else ""


# --- formulas ------------------------------------------------------------------------------------


def no_model(kind: str) -> str:
    return (
        f"A model is needed, not a {kind}: give a Model (Model.load(path), Model.from_dict(...), "
        "pikanid.model.systems); the model comes before the recordings."
    )


def bad_name(name: str, what: str) -> str:
    return f"'{name}' cannot name a {what}: use letters, digits and '_', starting with a letter."


def reserved_name(name: str, what: str) -> str:
    return f"'{name}' cannot name a {what}: it is a built-in of the formula language. Rename it."


def formula_too_long(where: str, limit: int) -> str:
    return f"The formula of {where} is longer than {limit} characters; split it up."


def formula_syntax(text: str, where: str, detail: str) -> str:
    return f"The formula of {where} cannot be read ({detail}): '{_short(text)}'."


def formula_work(text: str, where: str) -> str:
    return (
        f"The formula of {where} makes the model too complicated: '{_short(text)}'; nest fewer "
        "functions and write shorter products."
    )


def formula_forbidden(part: str, where: str) -> str:
    return (
        f"'{_short(part)}' in the formula of {where} is not allowed: use numbers, names, "
        "+ - * / **, parentheses and the listed functions."
    )


def unknown_symbol(name: str, where: str, known: Sequence[str], close: Sequence[str]) -> str:
    return (
        f"'{name}' in the formula of {where} is neither a state, an input nor a parameter "
        f"(known: {_listed(known)}).{_did_you_mean(close)}"
    )


def unknown_function(name: str, where: str, known: Sequence[str], close: Sequence[str]) -> str:
    return (
        f"The function '{name}' in the formula of {where} is unknown "
        f"(known: {_listed(known)}).{_did_you_mean(close)}"
    )


def wrong_argument_count(name: str, wanted: int, given: int, where: str) -> str:
    return f"{name}() in the formula of {where} takes {wanted} argument(s), not {given}."


def caret_power(text: str, where: str) -> str:
    return f"'^' in the formula of {where} is not a power: write '**' in '{_short(text)}'."


def division_by_zero(text: str, where: str) -> str:
    return f"The formula of {where} divides by zero: '{_short(text)}'."


def _short(text: str, limit: int = 80) -> str:
    return text if len(text) <= limit else text[: limit - 1] + "…"


# --- units ---------------------------------------------------------------------------------------


def unknown_unit(text: str, where: str = "", close: Sequence[str] = ()) -> str:
    return (
        f"The unit '{_short(text)}'{f' of {where}' if where else ''} is unknown: write products "
        "and powers of SI units such as 'm/s^2', 'rad', 'deg/s', 'mV', or '' for none."
        f"{_did_you_mean(close)}"
    )


def units_differ(source: str, target: str, where: str = "") -> str:
    hint = " ('g' is gram; standard gravity is 'g_0')" if "g" in (source, target) else ""
    return (
        f"{f'{where}: ' if where else ''}'{source or 'dimensionless'}' cannot be converted to "
        f"'{target or 'dimensionless'}': they measure different things{hint}."
    )


def unit_without_size(text: str) -> str:
    return (
        f"The unit '{_short(text)}' is logarithmic, so that no formula can be written in it: "
        "convert the signal first."
    )


def units_meet(
    where: str, formula: str, found: str, wanted: str, unknown: Sequence[str]
) -> str:
    advice = (
        f"declare the unit of {_listed(unknown)}"
        if unknown
        else "declare units that fit, and a parameter for every number that has a unit"
    )
    return (
        f"{where}: '{_short(formula)}' comes out in '{found or 'dimensionless'}' where "
        f"'{wanted or 'dimensionless'}' is needed, and no factor turns one into the other: "
        f"{advice}."
    )


def number_between_units(where: str, number: str) -> str:
    return (
        f"{where} adds '{_short(number)}', which has no unit, to terms in different units: declare "
        "its unit, for a number as a parameter with a value."
    )


def temperatures_meet(where: str, first: str, second: str) -> str:
    return (
        f"{where} adds temperatures in '{first}' and '{second}', which begin at different zeros: "
        "declare all of them in one unit, and differences in 'delta_degC'."
    )


def converted_twice(where: str, number: float, factor: str, value: float) -> str:
    return (
        f"{where} needs the factor {value:.6g} {factor}, which is put there by itself, and holds "
        f"the number {number:.6g}, which looks like it: leave the number out."
    )


# --- recordings ----------------------------------------------------------------------------------


def channel_name(name: object) -> str:
    return f"A channel cannot be called {name!r}: give it a name of one or more letters."


def channel_twice(name: str, where: str) -> str:
    return f"'{where}' would have two channels called '{name}': rename one of them."


def no_recording(kind: str) -> str:
    return (
        f"A recording is needed, not a {kind}: give a Recording, the path of its file, or a "
        "DataFrame with a column or an index of times; a model comes before its recordings."
    )


def no_channel_table(kind: str) -> str:
    return (
        f"A recording is made of a dictionary: name -> Channel, not of a {kind}; see "
        "Recording.from_arrays, Recording.from_frame and Recording.read."
    )


def detail_no_path(kind: str) -> str:
    return f"the path of a file is needed, not a {kind}"


def no_path(kind: str) -> str:
    return f"The path of a file is needed, not a {kind}."


def not_of_kind(what: str, kind: str, wanted: str) -> str:
    return f"{what} must be {wanted}, not {kind}."


def split_outside(where: str, at: float, begin: float, end: float) -> str:
    return (
        f"'{where}' cannot be split at {at:g} s, which leaves nothing on one side: it runs from "
        f"{begin:g} s to {end:g} s."
    )


def outside_the_record(where: str, start: float, stop: float, begin: float, end: float) -> str:
    return (
        f"'{where}' has nothing from {start:g} s to {stop:g} s: it runs from {begin:g} s to "
        f"{end:g} s."
    )


def no_channels(where: str) -> str:
    return f"'{where}' has no numeric column besides time: there is nothing to identify from."


def missing_channel(where: str, name: str, known: Iterable[str], close: Sequence[str] = ()) -> str:
    return (
        f"'{where}' has no column '{name}'; it has: {_listed(known)}.{_did_you_mean(close)} "
        "Map it with --column NAME=COLUMN (in Python columns={'name in the model': 'its header'})."
    )


def unknown_channel_setting(what: str, name: str, known: Iterable[str]) -> str:
    return f"{what} names '{name}', which is not a channel (channels: {_listed(known)})."


def not_numbers(name: str, what: str) -> str:
    return f"The {what} of channel '{name}' are not all numbers."


def not_one_dimensional(name: str, what: str, shape: object) -> str:
    return f"The {what} of channel '{name}' have shape {shape}; they must be one-dimensional."


def lengths_differ(name: str, times: int, values: int, what: str = "values") -> str:
    return f"Channel '{name}' has {times} samples but {values} {what}; they must be as many."


def bad_sigma(name: str) -> str:
    return f"The sigma of channel '{name}' must be positive and finite wherever it has a sample."


def unknown_hold(name: str, hold: object) -> str:
    return f"The hold of channel '{name}' is {hold!r}; it must be 'zero', 'first' or None."


def bad_stride(n: object) -> str:
    return f"Cannot keep every {n!r}-th sample: give a whole number, 1 or more."


def filter_needs_uniform(where: str, name: str) -> str:
    return (
        f"'{where}': the anti-alias filter needs channel '{name}' evenly sampled and without gaps; "
        "decimate without filter, or window it to a whole stretch first."
    )


def too_short(where: str, name: str, n: int) -> str:
    return f"'{where}': channel '{name}' has {n} usable sample(s); at least 2 are needed."


def bad_time(where: str, place: str, value: float) -> str:
    return f"'{where}', {place}: the time is {value:g}; every sample needs a finite time."


def time_not_rising(where: str, place: str, now: float, before: float) -> str:
    how = "repeats" if now == before else "goes back from"
    return (
        f"'{where}', {place}: the time {now:.9g} s {how} {before:.9g} s; times must rise from "
        "sample to sample. Sort the rows and remove repeated ones."
    )


def absurd_value(where: str, place: str, name: str, value: float) -> str:
    return (
        f"'{where}', {place}: '{name}' is {value:g}, beyond 1e300; leave a missing sample empty "
        "instead."
    )


def missing_input(where: str, name: str, sample: int, time: float) -> str:
    return (
        f"'{where}', sample {sample} (t = {time:g} s): input '{name}' is missing (NaN); only "
        "outputs may have gaps. Fill it or window the recording."
    )


def rounded_repeats(where: str, name: str, count: int) -> str:
    return (
        f"Recording '{where}': '{name}' is rounded and often does not change; {count} samples "
        "that repeat their neighbours are left out."
    )


def constant_output(where: str, name: str, value: float) -> str:
    return (
        f"'{where}': output '{name}' is {value:g} throughout; a signal that never changes (a dead "
        "sensor, a wrong column?) identifies nothing."
    )


# --- reading and writing files -------------------------------------------------------------------


def no_file(path: str) -> str:
    return f"There is no file '{_short(path, 200)}'."


def is_folder(path: str) -> str:
    return f"'{path}' is a folder; give one of the files in it."


def cannot_open(where: str, reason: str) -> str:
    return f"'{where}' cannot be opened: {reason or 'the system refuses'}."


def cannot_write(path: str, reason: str) -> str:
    return f"'{path}' cannot be written: {reason or 'the system refuses'}."


def empty_file(where: str) -> str:
    return f"'{where}' is empty."


def unknown_ending(where: str, known: Iterable[str]) -> str:
    return f"'{where}': the ending of the name tells no known format (known: {_listed(known)})."


def wrong_ending(where: str, actual: str, wanted: str) -> str:
    return f"'{where}' is {actual}, not {wanted} as its name says: rename it."


def damaged(where: str, kind: str) -> str:
    return f"'{where}' cannot be read as {kind}: it is damaged or cut off."


def cannot_unpack(where: str, reason: str) -> str:
    return f"'{where}' cannot be unpacked: {reason}."


def binary_junk(where: str) -> str:
    return f"'{where}' is not text: it holds binary data, so it is no CSV."


def extra_missing(what: str, module: str, extra: str) -> str:
    return f"Reading {what} needs {module}, which is missing: pip install 'pikanid[{extra}]'."


def no_rows(where: str) -> str:
    return f"'{where}' holds no rows of data."


def no_vectors(where: str) -> str:
    return f"'{where}' holds no numeric vector of two or more values."


def too_many_cells(where: str, most: int) -> str:
    return f"'{where}' holds more than {most} cells: save what you need as CSV or Parquet."


def no_sheet(where: str, sheet: str, known: Iterable[str]) -> str:
    return f"'{where}' has no sheet '{sheet}' (sheets: {_listed(known)})."


def ragged_row(where: str, row: int, cells: int, wanted: int) -> str:
    return (
        f"'{where}', row {row}: {cells} cell(s) where the header has {wanted}; the file may be cut "
        "off, or its delimiter be another (delimiter=)."
    )


def not_a_number(where: str, row: int, header: str, cell: str) -> str:
    return f"'{where}', row {row}, column '{header}': '{_short(cell, 40)}' is not a number."


def header_twice(where: str, header: str) -> str:
    return f"'{where}' has two columns called '{header}': rename one of them."


def no_time(where: str, known: Iterable[str]) -> str:
    return (
        f"'{where}' has no time column among: {_listed(known)}. Name it "
        "(--column t=COLUMN, in Python columns={'t': 'its header'}) or give the sampling rate "
        "in Hz (--rate, in Python rate=)."
    )


def time_length(where: str, name: str, n: int, wanted: int) -> str:
    return f"'{where}': '{name}' has {n} values but its time column has {wanted}."


def bad_rate(rate: float) -> str:
    return f"A sampling rate of {rate:g} Hz cannot be: it must be positive and finite."


def rate_disagrees(where: str, rate: float, name: str, actual: float) -> str:
    return (
        f"'{where}' has the time column '{name}' sampled at {actual:.6g} Hz, not at {rate:g} Hz: "
        "leave out the rate, or map another column to 't'."
    )


def bad_delimiter(text: str) -> str:
    return f"{text!r} cannot delimit cells: give one character, such as ';'."


def bad_decimal(text: str) -> str:
    return f"{text!r} cannot be the decimal sign here: it must be '.' or ',', not the delimiter."


# --- motions and noise ---------------------------------------------------------------------------


def derivative_order(order: object) -> str:
    return f"Only first and second derivatives can be taken, not order {order!r}."


def derivative_short(name: str, n: int, wanted: int) -> str:
    return f"Channel '{name}' has {n} samples; this derivative needs at least {wanted}."


def savgol_uneven(name: str) -> str:
    return f"Channel '{name}' is not evenly sampled: use method='spline'."


def savgol_window(window: float | None) -> str:
    return f"method='savgol' needs a window in seconds, such as window=0.1, not {window!r}."


def bad_smoothing(smoothing: float) -> str:
    return f"smoothing = {smoothing:g} must be finite and not negative, or None."


def bad_quaternion(sample: int) -> str:
    return f"The attitude quaternion of sample {sample} is zero or not finite."


def pose_times(where: str) -> str:
    return f"'{where}': the channels of the pose do not share one time base."


def nothing_moves(where: str, names: Sequence[str]) -> str:
    return f"'{where}': nothing moves in {_listed(names)}."


def signal_short(where: str, name: str, span: float, motion: float) -> str:
    return (
        f"'{where}': '{name}' lasts {span:.3g} s, and the motion {motion:.3g} s: it must cover the "
        f"whole motion."
    )


def noise_short(name: str, n: int) -> str:
    return (
        f"Channel '{name}' has only {n} samples to estimate its noise from; give sigma yourself, "
        "with with_sigma or --sigma."
    )


def noise_none(name: str) -> str:
    return f"Channel '{name}' shows no noise to estimate sigma from; give it yourself."


def noise_interval(model: float, given: float) -> str:
    return (
        f"The noise model belongs to samples every {model:g} s, not every {given:g} s: estimate "
        "it from the thinned signal."
    )


# --- datasets ------------------------------------------------------------------------------------


def dataset_missing(local: str, url: str, variable: str) -> str:
    return (
        f"The recording '{local}' is not on this machine and cannot be downloaded: connect to the "
        f"network, or fetch {url} yourself and set {variable} to the folder that holds '{local}'."
    )


def dataset_altered(path: str, url: str) -> str:
    return f"'{path}' is not the original file (its checksum differs): fetch it again from {url}."


def no_such_data(what: str, given: str, known: Iterable[str]) -> str:
    return f"There is no {what} '{given}' (known: {_listed(known)})."


# --- excitations ---------------------------------------------------------------------------------


def bad_grid(duration: float, dt: float) -> str:
    return f"duration = {duration:g} s and dt = {dt:g} s make no grid: both positive, dt smaller."


def pulse_off_grid(start: float, stop: float, dt: float) -> str:
    return (
        f"A pulse from {start:g} s to {stop:g} s does not start and stop on the grid of "
        f"dt = {dt:g} s: choose a dt that divides both."
    )


def bad_band(frequencies: Sequence[float], dt: float) -> str:
    return (
        f"Frequencies {', '.join(f'{f:g}' for f in frequencies) or '(none)'} Hz: they must rise "
        f"and lie between 0 and half the sampling rate, {0.5 / dt:g} Hz."
    )


def bad_move_bounds(acceleration: float, velocity: float) -> str:
    return (
        f"A move needs positive bounds, not acceleration = {acceleration:g} m/s^2 and "
        f"velocity = {velocity:g} m/s."
    )


def move_too_long(distance: float, seconds: float) -> str:
    return (
        f"A move over {distance:g} m takes {seconds:.3g} s and does not fit: give more duration, "
        "fewer moves, or higher bounds."
    )


# --- models --------------------------------------------------------------------------------------


def duplicate_name(name: str, first: str, second: str) -> str:
    return f"'{name}' names both a {first} and a {second}; every name may be used once."


def missing_equation(state: str) -> str:
    return f"State '{state}' has no equation: add '{state} = \"...\"' under [equations]."


def stray_equation(name: str, states: Sequence[str]) -> str:
    return f"There is an equation for '{name}', which is not a state (states: {_listed(states)})."


def not_in_model(what: str, name: str, known: Sequence[str], close: Sequence[str] = ()) -> str:
    return f"The model has no {what} '{name}' (it has: {_listed(known)}).{_did_you_mean(close)}"


def foreign_symbols(names: Sequence[str], where: str) -> str:
    return (
        f"{where} uses {_listed(names)}, unknown to the model: declare it as a parameter "
        "(pass parameters=[...]) or mend the name."
    )


def spline_at_start(state: str, spline: str) -> str:
    return (
        f"The initial value of '{state}' uses {spline}: a spline function belongs in an equation "
        "or an output; write the initial value as a formula of parameters and inputs."
    )


def no_states() -> str:
    return "The model has no states: list at least one under [states]."


def no_outputs() -> str:
    return "The model has no outputs: list what was measured under [outputs]."


def bad_bounds(name: str, value: float, bounds: Sequence[float]) -> str:
    return (
        f"Parameter '{name}': its guess {value:g} must lie inside its bounds "
        f"[{bounds[0]:g}, {bounds[1]:g}], and the lower bound below the upper one."
    )


def bad_value(what: str, value: object, wanted: str) -> str:
    return f"{what} is {value!r}; it must be {wanted}."


def detail_too_large(given: int, most: int) -> str:
    return f"it holds {given / 2**20:.4g} MiB, more than the {most / 2**20:.4g} that are read"


def detail_unpacks(most: int) -> str:
    return (
        f"it would unpack to more than {most / 2**20:.4g} MiB of memory; unpack it yourself if "
        "you trust it"
    )


def detail_memory(most: int) -> str:
    return f"what it holds would take more than {most / 2**20:.4g} MiB of memory"


def too_many_entries(where: str, given: int, most: int) -> str:
    return f"{where} has {given} entries; more than {most} are not read."


def entry_lacks(where: str, missing: Sequence[str]) -> str:
    return f"{where} lacks {_listed(missing)}."


def entry_extra(where: str, extra: Sequence[str], known: Sequence[str]) -> str:
    return f"{where} holds {_listed(extra)}, which is unknown (known: {_listed(known)})."


def entry_negative(where: str) -> str:
    return f"{where[:1].upper()}{where[1:]} holds negative numbers."


def entry_too_deep(where: str) -> str:
    return f"{where} is nested too deeply: nothing of ours writes that."


def not_a_formula(where: str, value: object) -> str:
    return (
        f"{where} is {value!r}; it must be a formula as text, a finite number, or a SymPy "
        "expression."
    )


def model_file_unreadable(path: str, detail: str) -> str:
    return f"The model file '{path}' cannot be read: {detail}."


def model_file_key(path: str, where: str, key: str, known: Sequence[str]) -> str:
    return f"'{path}': {where} has the unknown key '{key}' (known: {_listed(known)})."


def model_file_missing(path: str, where: str, wanted: str) -> str:
    return f"'{path}': {where} lacks {wanted}."


def unknown_system(name: str, known: Sequence[str], close: Sequence[str]) -> str:
    return (
        f"'{name}' is neither a ready-made model ({_listed(known)}) nor a .toml file that exists."
        f"{_did_you_mean(close)}"
    )


# --- Kolmogorov-Arnold networks -------------------------------------------------------------------


def kan_not_installed(module: str) -> str:
    return f"KANs need '{module}', which is not installed: pip install 'pikanid[kan]'."


def kan_width(width: object) -> str:
    return (
        f"width = {width} cannot make a KAN: list the nodes of at least two layers, each 1 or more "
        "(or [sums, products]), the first without products."
    )


def kan_not_shallow(width: object) -> str:
    return f"A KAN of width {width} is not shallow: this needs one input and one layer of edges."


def kan_not_a_curve(width: object) -> str:
    return (
        f"A KAN of width {width} is no curve over time: it needs one input, one output and no "
        "masked edges, as in (1, 5, 1)."
    )


def kan_order(order: int, highest: int) -> str:
    return (
        f"A deep KAN carries time derivatives up to order {highest}, not {order}: give every state "
        'its own network with form="state", or use a shallow one, width=(1, 1).'
    )


def kan_kinks(count: int, most: int) -> str:
    return (
        f"The inputs switch so often that a deep KAN would need {count} kinks beside it, more than "
        f"{most}: use a shallow one, width=(1, 1)."
    )


def kan_device(device: str, detail: str) -> str:
    return f"device = '{device}' cannot hold a KAN ({detail}): use device='cpu'."


def kan_symbolic(layer: int) -> str:
    return (
        f"Layer {layer} of the KAN has symbolic edges: only spline edges have coefficients to "
        "estimate; unfix_symbolic(...) them first."
    )


def kan_knots(layer: int) -> str:
    return f"The knots of layer {layer} of the KAN are not uniform: refit it on a uniform grid."


def kan_outside(low: float, high: float, start: float, stop: float) -> str:
    return (
        f"Times {low:g} to {high:g} s leave the KAN's grid [{start:g}, {stop:g}] s: build it with "
        "a grid_range that covers them."
    )


def kan_kink(time: float, start: float, stop: float) -> str:
    return f"A kink at t = {time:g} s does not lie inside the KAN's grid ({start:g}, {stop:g}) s."


def kan_kink_elsewhere(time: float) -> str:
    return (
        f"The kink at t = {time:g} s belongs to other knots than the KAN's: carry curve and kinks "
        "over together, with `refined`."
    )


def kan_file(path: str, detail: str) -> str:
    return f"'{path}' is not a saved KAN that can be read: {detail}."


def kan_points(x: object, y: object, inputs: int, outputs: int) -> str:
    return (
        f"A KAN with {inputs} inputs and {outputs} outputs cannot be fitted to x {x} and y {y}: "
        "give finite x (points, inputs) and y (points,) and a KAN with one output."
    )


def kan_coefficients(given: object, wanted: object) -> str:
    return f"The KAN takes coefficients of shape {wanted}, not {given}."


# --- simulation ----------------------------------------------------------------------------------


def not_finite(time: float, values: str) -> str:
    return (
        f"The simulation leaves the finite numbers near t = {time:g} s at {values}: "
        "start from other parameter values, or tighten the bounds."
    )


def too_many_events(time: float) -> str:
    return (
        f"The model switches without end near t = {time:g} s (over 1000 events in one step): "
        "a non-smooth term chatters; check its sign."
    )


# --- relaxation (PDA, iPDA) ----------------------------------------------------------------------


def spline_knots(degree: int, count: int) -> str:
    return (
        f"A spline of degree {degree} needs degree >= 1 and at least {2 * (degree + 1)} knots, "
        f"not {count}: ask for more intervals or a lower degree."
    )


def spline_knots_unsorted() -> str:
    return "The knots of a spline must be finite and must not decrease: sort them."


def outside_spline(start: float, stop: float) -> str:
    return (
        f"A spline from {start:g} to {stop:g} s has no value outside: ask for times between them."
    )


def degree_too_low(degree: int, order: int) -> str:
    return (
        f"Splines of degree {degree} have no derivative of order {order} to compare with the "
        f"model: choose degree >= {order + 1}, or form='state'."
    )


def path_twice(name: str, what: str) -> str:
    return (
        f"Input '{name}' has a {what} already: change the parameter that it names instead of "
        "adding a second one."
    )


def relaxation_cannot_see(names: Sequence[str], why: str) -> str:
    return (
        f"A relaxation cannot estimate {_listed(names)} ({why}): fix it, or fit with the "
        "strategy NLS, which simulates the model."
    )


def smoothing_undetermined(names: Sequence[str]) -> str:
    return (
        f"PDA fits splines to the data alone, but the outputs do not determine {_listed(names)}: "
        "use the strategy iPDA or NLS, which also use the physics there."
    )


def relaxation_locked(lam: float, kept: float) -> str:
    return (
        f"λ stays at {kept:.3g}: at {lam:.3g} these splines could no longer follow the physics. "
        "For less bias use more intervals (or IPDA, whose default knots do not lock)."
    )


def curve_follows_data(effective: float, count: int, lam: float) -> str:
    return (
        f"The curve uses {effective:.0f} degrees of freedom for {count} parameters, even at λ = "
        f"{lam:.3g}: it follows the data rather than the equations, which do not fit them. "
        "Estimates differ from those of NLS, and standard errors are too small; compare with NLS."
    )


def relaxation_smears() -> str:
    return (
        "The model is not smooth (sign, abs, clip ...): splines smear its switches, which biases "
        "the parameters. Compare with the strategy NLS."
    )


def relaxation_stuck(lam: float, kept: float) -> str:
    return (
        f"λ stays at {kept:.3g}: at {lam:.3g} the fit got no further. The estimate may still be "
        "biased towards the splines; compare it with the strategy NLS."
    )


def grid_not_settled(gap: float, intervals: int) -> str:
    return (
        f"With {intervals} intervals, the last halving still moved a parameter by {gap:.2g} "
        "standard errors: the discretisation bias is not negligible. Set more intervals."
    )


def estimate_not_simulated() -> str:
    return (
        "The model cannot be simulated at the estimate, so that residuals are those of the fitted "
        "splines: the parameters are not to be trusted."
    )


def not_converged(lam: float) -> str:
    return (
        f"Gauss-Newton stopped before it converged at λ = {lam:.3g}: start nearer, or tighten the "
        "bounds."
    )


# --- gradient descent (PINN) ---------------------------------------------------------------------


def torch_not_installed(module: str) -> str:
    return f"A PINN needs '{module}', which is not installed: pip install 'pikanid[kan]'."


def no_such_device(device: str) -> str:
    return f"There is no device '{device}' here: choose device='cpu'."


def descent_diverged(steps: int) -> str:
    return (
        f"The loss left the finite numbers after {steps} steps: the best iterate until then is "
        "kept. Lower the learning rate, or tighten the bounds."
    )


def newton_stopped(iterations: int, move: float) -> str:
    return (
        f"The fit still moved a parameter by {move:.2g} standard errors when its {iterations} "
        "iterations were used up: allow more, or another seed."
    )


def network_smears_switches(count: int, most: int) -> str:
    return (
        f"The inputs switch {count} times, more than the {most} kinks that a network is given: it "
        "smears them, which biases the parameters. Compare with the strategy NLS."
    )


def covariance_unknown() -> str:
    return (
        "The network can follow the data whatever the parameters are, so that standard errors are "
        "not known: use fewer units, or more data."
    )


def curve_misleads(name: str, value: float, reference: float, std: float, residual: float,
                   unit: str) -> str:
    share = abs(value - reference) / max(abs(reference), 1e-300)
    errors_apart = abs(value - reference) / std if std > 0 else float("inf")
    # On clean data every difference is any number of standard errors.
    how = (f"{errors_apart:.2g} standard errors" if errors_apart < 1e4 else f"{100 * share:.2g} %")
    return (
        f"The loss is low (the curve is within {residual:.2g} of the data) but '{name}' is not "
        f"where the data want it: {value:.5g} {unit}".rstrip()
        + f" here, {reference:.5g} by simulation from here (NLS), {how} apart. The curve has "
        "absorbed the difference: trust NLS."
    )


# --- binding a model to recordings ---------------------------------------------------------------


def no_recordings() -> str:
    return "No recording was given: pass at least one."


def too_few_samples(samples: int, parameters: int) -> str:
    return (
        f"There are {samples} usable samples for {parameters} free parameters; a fit needs "
        f"{parameters + 1} or more, since any model explains fewer: record more, or fix parameters."
    )


def too_few_of_its_own(where: str, samples: int, parameters: Sequence[str]) -> str:
    return (
        f"Recording '{where}' has {samples} usable samples for {len(parameters)} parameters of "
        f"its own ({_listed(parameters)}); at least {len(parameters)} are needed: record more, or "
        "share or fix them."
    )


def undetermined(name: str, value: float, std: float) -> str:
    return (
        f"The recording does not determine '{name}': its standard error ({std:.2g}) is far larger "
        f"than its value ({value:.3g}).  Fix it, or excite what depends on it."
    )


def too_few_to_diagnose(samples: int, parameters: int, needed: int) -> str:
    return (
        f"There are {samples} usable samples for {parameters} free parameters, and a diagnosis "
        f"needs at least {needed}: record more, or fix parameters."
    )


def too_rough_to_diagnose(model: str) -> str:
    return (
        f"Model '{model}' cannot be simulated as exactly as the recording's noise asks: check its "
        "units, its initial values and the given sigma."
    )


# --- discrepancy ---------------------------------------------------------------------------------


def edge_argument_still(argument: str, value: float) -> str:
    return (
        f"The argument '{argument}' of the discrepancy stays at {value:.4g} in every recording: "
        "leave it out, or add a recording that moves it."
    )


def no_static_law(arguments: Sequence[str]) -> str:
    return (
        f"No static law of {', '.join(arguments)} explains the recording: what is missing depends "
        "on something else, on the past, or sits in a sensor or an input."
    )


def discrepancy_not_simulated() -> str:
    return (
        "The model with its discrepancy cannot be simulated along the whole recording: use fewer "
        "arguments, or a nominal model that follows the recording more closely."
    )


# --- formulas of edges ---------------------------------------------------------------------------


def edge_points(x: int, y: int, fewest: int) -> str:
    return (
        f"An edge of {x} arguments and {y} values cannot be named: give at least {fewest} finite "
        "points (x, y) over which x moves."
    )


def candidate_without_argument(text: str, argument: str) -> str:
    return f"The candidate '{_short(text)}' does not contain its argument '{argument}'."


def reading_inputs(given: int, names: Sequence[str]) -> str:
    return (
        f"{given} inputs do not fit the names {', '.join(names) or '(none)'}: give one name an "
        "input, and no formulas where the reading is to be evaluated."
    )


def network_without_inputs() -> str:
    return "The network has seen no inputs yet: give x, the inputs over which it is to be read."


def edge_sticks(arguments: Sequence[str]) -> str:
    return (f"The jump in {' and '.join(arguments)} brings the model to rest, which the edge alone "
            "cannot judge: give the recordings too, and the laws are compared inside the ODE.")


def no_law_simulated() -> str:
    return "None of the laws tried can be simulated along the recording: read without recordings."


def no_edges(model: str) -> str:
    return (
        f"The estimate of '{model}' holds no edges to read: give one that kan_discrepancy made, or "
        "a KAN."
    )


def not_a_network(path: str) -> str:
    return f"'{path}' is neither a saved KAN (.npz, .json) nor a saved estimate (.json, .json.gz)."


def extract_columns(names: Sequence[str], known: Sequence[str]) -> str:
    return (
        f"The data have no columns {', '.join(names)}; they have {', '.join(known)}. Name the "
        "inputs with --input and the output with --output."
    )


def nothing_to_push() -> str:
    return "This reading is not that of a KAN: there is no pykan model to put it into."


def nothing_read() -> str:
    return "No formula of the library is finite over the network's inputs: add forms that are."


# --- estimates -----------------------------------------------------------------------------------


def estimate_file(path: str, detail: str) -> str:
    return f"The estimate file '{path}' cannot be read: {detail}."


def left_out_as_slow() -> str:
    return (
        "Left out of the sparse scenarios and the real recording, where a fit takes long: try it "
        "with pikanid identify."
    )


def bad_start() -> str:
    return (
        "The model cannot be simulated from any starting point: give other guesses or narrower "
        "bounds."
    )


def sigma_unknown(output: str) -> str:
    return f"The noise of output '{output}' is not known: pass sigma, in the output's unit."


def no_influence(name: str) -> str:
    return f"'{name}' has no influence on what was measured: fix it, or measure something else."


def unidentifiable(combination: str, condition: float) -> str:
    return (
        f"The data do not determine the combination {combination} (condition {condition:.1g}): "
        "fix one of these parameters or excite the system differently."
    )


# --- command line --------------------------------------------------------------------------------


def usage(message: str, command: str) -> str:
    return f"{message.rstrip('.')}; see '{command} --help'."


def not_an_assignment(option: str, text: str, example: str) -> str:
    return f"{option} takes NAME=VALUE, such as '{example}', not '{_short(text)}'."


def named_twice(option: str, name: str) -> str:
    return f"{option} names '{name}' more than once: keep one."


def free_and_fixed(name: str) -> str:
    return f"'{name}' cannot be both free and fixed: keep --free or --fix."


def not_a_quantity(text: str, where: str) -> str:
    return f"{where} is '{_short(text)}'; write a number, with a unit if it needs one, as '0.1deg'."


def sigma_not_positive(text: str) -> str:
    return f"--sigma is '{_short(text)}'; the noise must be positive and finite."


def reversed_window(start: float, stop: float) -> str:
    return f"The stretch from {start:g} s to {stop:g} s is empty: --from must lie before --to."


def nothing_free(model: str) -> str:
    return f"Every parameter of '{model}' is fixed: free one to identify (--free NAME)."


def output_ending(option: str, path: str, endings: Sequence[str]) -> str:
    return f"{option}: '{_short(path, 200)}' must end in {' or '.join(endings)}."


def output_folder(option: str, path: str, folder: str) -> str:
    return (
        f"{option}: '{_short(path, 200)}' cannot be written, because there is no folder "
        f"'{_short(folder, 200)}'."
    )


def output_refused(option: str, path: str, why: str) -> str:
    return f"{option}: '{_short(path, 200)}' cannot be written: {why}."


def output_is_input(option: str, path: str) -> str:
    return f"{option} would overwrite the input '{_short(path, 200)}': choose another name."


def output_twice(first: str, second: str, path: str) -> str:
    return f"{first} and {second} both name '{_short(path, 200)}': choose another name for one."


def save_needs_one_strategy() -> str:
    return "--save keeps one estimate: choose one strategy, or use --json for several."


def unknown_excitation(name: str, known: Sequence[str], close: Sequence[str]) -> str:
    return (
        f"'{_short(name, 200)}' is neither an excitation ({_listed(known)}) nor a file that exists."
        f"{_did_you_mean(close)}"
    )


def nothing_to_simulate(name: str) -> str:
    return f"'{name}' drives the model with nothing: none of its columns is an input of the model."


def unforeseen(command: str, failure: str, place: str) -> str:
    return (
        f"pikanid itself failed while running '{_short(command, 400)}': {_short(failure, 200)}"
        f"{place}. What was written before is kept. Please report this line with the files; "
        "with --debug the same command shows the traceback."
    )


def out_of_memory() -> str:
    return "There is not enough memory for this: shorten the recording, or thin it with --decimate."


def fit_diverged(where: str) -> str:
    return (
        f"The fit broke down {where}, where the model's right-hand side or its cost was not "
        "finite: the best iterate before that is kept. Try other guesses or bounds, or a larger "
        "first grid."
    )


def lbfgs_stopped(steps: int, gradient: float) -> str:
    return (
        f"L-BFGS stopped after {steps} steps with a gradient of norm {gradient:.2g}: it is not at "
        "a minimum, and the estimate depends on where it stopped."
    )

# --- the next experiment -------------------------------------------------------------------------


def bad_drive_bound(name: str, given: float) -> str:
    return f"The bound of {name} is {given:g}; give a positive number, inf for none."


def no_room_for_profile(duration: float, quiet: float, frequency: float, dt: float) -> str:
    return (
        f"No profile fits into {duration:g} s with {quiet:g} s of rest and samples every {dt:g} s "
        f"for a model that rings at {frequency:.3g} Hz: leave two periods of motion, and ten "
        "samples a period."
    )


def not_in_catalogue(effect: str, known: Iterable[str]) -> str:
    return f"The experiment could not show an effect '{_short(effect)}' (known: {_listed(known)})."


def too_few_hypotheses(given: int) -> str:
    return f"There are {given} hypotheses; an experiment can separate two or more."


def nothing_to_learn(model: str) -> str:
    return f"Model '{_short(model)}' has no free parameter that an experiment could determine."


def nothing_to_drive(models: str) -> str:
    return f"{_short(models, 200)}: no input that an experiment could drive."


def too_rough_to_plan(model: str, excitation: str) -> str:
    return (
        f"'{_short(model)}' moves too wildly under '{_short(excitation)}' to be planned with: make "
        "the excitation smaller, or its samples denser."
    )


def no_profile_simulated(candidates: int) -> str:
    return (
        f"None of {candidates} profiles can be simulated with every hypothesis within the limits: "
        "offer smaller ones."
    )


def limits_not_kept(profile: str) -> str:
    return f"Profile '{_short(profile)}' exceeds the limits however small it is made."


# --- diagnosis -----------------------------------------------------------------------------------


def no_coordinate(model: str) -> str:
    return (
        f"'{model}' has no second-order coordinate that an output shows: a diagnosis needs a state "
        "whose derivative is another state, such as theta' = theta_dot."
    )


def held_out_channels(name: str, missing: Sequence[str]) -> str:
    return (
        f"The held-out recording '{_short(name)}' lacks {_listed(missing)}, which the recording to "
        "explain has: give one with the same columns."
    )


def held_out_same(train: str, name: str) -> str:
    return (
        f"'{_short(name)}' holds the same data as '{_short(train)}': nothing can be proved on what "
        "was fitted; give another recording."
    )


# --- concealed effects ---------------------------------------------------------------------------


def conceal_diverged() -> str:
    return "The reference rig leaves the finite numbers: the effect is too strong for this drive."


def conceal_cases(given: int, limit: int) -> str:
    return f"--cases is {given}; give 1 to {limit}."


def conceal_excitation(given: str, known: Iterable[str]) -> str:
    return f"'{_short(given)}' is no excitation of concealed recordings (known: {_listed(known)})."


def conceal_mix(text: str, known: Iterable[str]) -> str:
    return (
        f"--mix '{_short(text, 200)}' cannot be read: write shares that are not all zero, such as "
        f"'single=0.6,nothing=0.4' (classes: {_listed(known)})."
    )


def conceal_sigma(sigma: float) -> str:
    return f"--sigma is {sigma:g} rad; noise on an angle must lie between 1e-6 and 0.2 rad."


def conceal_truth_inside(truth: str, folder: str) -> str:
    return (
        f"The truth '{_short(truth, 200)}' would lie inside '{_short(folder, 200)}', which is to "
        "be given away: choose a place outside."
    )


def conceal_taken(place: str) -> str:
    return (
        f"'{_short(place, 200)}' already holds something else: choose another name, or remove it."
    )


def conceal_other_settings(place: str) -> str:
    return (
        f"'{_short(place, 200)}' belongs to an unfinished set made with other settings: repeat "
        "those to finish it, or remove it."
    )


def truth_unreadable(path: str, detail: str) -> str:
    return f"The truth file '{_short(path, 200)}' cannot be read: {detail}."


def truth_case(detail: str) -> str:
    return f"A case of the truth file cannot be compared with: {detail}."


def diagnosis_unreadable(case: str, detail: object) -> str:
    return (
        f"The diagnosis of case '{_short(case)}' cannot be scored: {_short(str(detail))} (wanted: "
        "verdict, mismatch, and hypotheses with effects' ids and a relative_weight)."
    )


# --- what others wrote, inside a sentence of ours ------------------------------------------------

LONGEST_PART = 300  # characters that one value may take in a sentence


def brief(value: Any) -> Any:
    """A value as it may stand in a sentence: of one line, printable, and not too long.

    A file may hold a formula of a million characters, a list of a million numbers, tables nested
    a thousand deep, an integer of a thousand digits, or characters that steer a terminal.

    >>> print(brief("a\\nb" + 400 * "x")[:6], len(brief(400 * "x")))
    a bxxx 300
    >>> brief(7), brief([1, "k"]), brief(10**400)
    (7, [1, 'k'], an integer of about 401 digits)
    """
    if isinstance(value, str):
        line = value if value.isprintable() else _printable(value[: 2 * LONGEST_PART])
        return _short(line, LONGEST_PART)
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**18:
        return _Huge(value)
    if isinstance(value, list | tuple) and all(isinstance(v, str | int | float) for v in value):
        kept = [brief(v) if not isinstance(v, str) else _short(brief(v), 60) for v in value[:40]]
        while len(kept) > 1 and sum(len(str(v)) for v in kept) > 3 * LONGEST_PART:
            kept = kept[:-1]
        more = [f"... ({len(value)} in all)"] if len(value) > len(kept) else []
        return tuple(kept + more) if isinstance(value, tuple) else kept + more
    if isinstance(value, list | tuple | dict | set | frozenset):
        return _AsIs(_short(_printable(_NESTED.repr(value)), LONGEST_PART))
    return value


def _printable(text: str) -> str:
    plain = " ".join(text.splitlines())
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in plain)


class _AsIs(str):
    """A text that has its own quotes."""

    def __repr__(self) -> str:
        return str(self)


class _Huge(float):
    """An integer that Python would print with all of its digits, or refuse to."""

    def __new__(cls, value: int) -> _Huge:
        return super().__new__(cls, "inf" if value > 0 else "-inf")

    def __init__(self, value: int) -> None:
        self.digits = int(value.bit_length() * 0.30103) + 1

    def __repr__(self) -> str:
        return f"an integer of about {self.digits} digits"

    __str__ = __repr__

    def __format__(self, form: str) -> str:
        return repr(self)


class _Nested(reprlib.Repr):
    def repr_int(self, x: int, level: int) -> str:
        return repr(brief(x))


_NESTED = _Nested()


def _made_brief(sentence: Callable[..., str]) -> Callable[..., str]:
    @functools.wraps(sentence)
    def told(*args: Any, **named: Any) -> str:
        return sentence(*map(brief, args), **{name: brief(v) for name, v in named.items()})

    return told


# One rule for all sentences, those of tomorrow too, instead of a call in each of them.
for _name, _member in list(globals().items()):
    if isinstance(_member, FunctionType) and not _name.startswith("_") and _name != "brief":
        globals()[_name] = _made_brief(_member)
