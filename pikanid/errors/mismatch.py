"""What can stop a diagnosis or the plan of an experiment."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from pikanid.errors.wording import did_you_mean, listed, of_all, short


def rounded_repeats(where: str, name: str, count: int) -> str:
    return (f"Recording '{where}': '{name}' is rounded and often does not change; {count} samples "
            "that repeat their neighbours are left out.")


def too_few_to_diagnose(samples: int, parameters: int, needed: int) -> str:
    return (f"There are {samples} usable samples for {parameters} free parameters, and a diagnosis "
            f"needs at least {needed}: record more, or fix parameters.")


def too_rough_to_diagnose(model: str) -> str:
    return (f"Model '{model}' cannot be simulated as exactly as the recording's noise asks: check "
            "its units, the signs of its inputs and outputs, its initial values, the guesses of "
            "its parameters and the given sigma.")


def bad_drive_bound(name: str, given: float) -> str:
    return f"The bound of {name} is {given:g}; give a positive number, inf for none."


def range_not_known(name: str, unit: str) -> str:
    how = f"in {unit}" if unit else "in the model's unit"
    return (f"How far may the input '{name}' go, {how}? Say it (--range {name}=LOW:HIGH, in Python "
            f"ranges={{'{name}': (low, high)}}), or give a recording in which it moves "
            "(--recorded, in Python recorded=).")


def no_range(name: str, low: float, high: float) -> str:
    return f"The input '{name}' cannot go from {low:g} to {high:g}: the second must be larger."


def range_of_nothing(name: str, known: Iterable[str]) -> str:
    return f"A range is given for '{short(name)}', which drives nothing (inputs: {listed(known)})."


def not_a_range(text: str, example: str) -> str:
    return f"{short(text)!r} is no range: give two values with a colon between them, as {example}."


def quiet_throughout(end: float, stop: float) -> str:
    return (f"The quiet stretch lasts until {end:g} s, and a recording ends at {stop:g} s: nothing "
            "would move in it.  Give a shorter one (--quiet-until).")


def no_room_for_profile(duration: float, quiet: float, frequency: float, dt: float) -> str:
    return (f"No profile fits into {duration:g} s with {quiet:g} s of rest and samples every "
            f"{dt:g} s for motion at {frequency:.3g} Hz: leave four periods of it, and "
            "ten samples a period.")


def profile_too_slow(frequency: float, dt: float, resolved: float) -> str:
    return (f"Samples every {dt:.3g} s can follow {resolved / dt:.3g} Hz, the model moves at "
            f"{frequency:.3g} Hz: at {frequency / resolved:.3g} Hz (--rate) or more the profile "
            "would reach it.")


def not_in_catalogue(effect: str, known: Iterable[str]) -> str:
    return f"The experiment could not show an effect '{short(effect)}' (known: {listed(known)})."


def too_few_hypotheses(given: int) -> str:
    return f"There are {given} hypotheses; an experiment can separate two or more."


def nothing_to_learn(model: str) -> str:
    return f"Model '{short(model)}' has no free parameter that an experiment could determine."


def nothing_to_drive(models: str) -> str:
    return f"{short(models, 200)}: no input that an experiment could drive."


def too_rough_to_plan(model: str, excitation: str) -> str:
    return (f"'{short(model)}' moves too wildly under '{short(excitation)}' to be planned with: "
            "make the excitation smaller, or its samples denser.")


def no_profile_simulated(candidates: int, models: int) -> str:
    whose = "the model" if models == 1 else "every hypothesis"
    return (f"None of {candidates} profiles can be simulated with {whose} within the limits: offer "
            "smaller ones.")


def limits_not_kept(profile: str) -> str:
    return f"Profile '{short(profile)}' exceeds the limits however small it is made."


def nothing_seen(model: str) -> str:
    return (f"'{model}' has no state that reaches an output: a diagnosis needs one whose equation "
            "shows in what is measured.")


def held_out_channels(name: str, missing: Sequence[str]) -> str:
    return (f"The held-out recording '{short(name)}' lacks {listed(missing)}, which the recording "
            "to explain has: give one with the same columns.")


def held_out_same(train: str, name: str) -> str:
    return (f"'{short(name)}' holds the same data as '{short(train)}': nothing can be proved on "
            "what was fitted; give another recording.")


def unknown_setting(name: str, close: Sequence[str]) -> str:
    return (f"There is no setting '{name}'.{did_you_mean(close)} pikanid.Settings describes all of "
            "them.")


def settings_unreadable(path: str, detail: str) -> str:
    return f"The settings '{path}' cannot be read: {detail}."


def columns_exchanged(a: str, b: str, left: float, other: float) -> str:
    return (f"With the columns of '{a}' and '{b}' exchanged the model leaves {100 * other:.2g} % "
            f"of what the outputs do, {of_all(left)} as they are: check which is which.")


def times_in_another_unit(word: str, left: float, other: float) -> str:
    return (f"With all times {word} by 1000 the model leaves {100 * other:.2g} % of what the "
            f"outputs do, {of_all(left)} as they are: check the unit of the time.")


def sampled_otherwise(name: str, one: float, other: float) -> str:
    return (f"The held-out recording has a sample of the input '{name}' every {other:.3g} s, the "
            f"recording one every {one:.3g} s: what it does between samples is another motion.")


def louder_than_read(p_value: str) -> str:
    return (f"By the noise as it was read at first something is missing ({p_value}), and "
            "nothing explains it; by what explains best, the noise is louder or has a colour, and "
            "nothing is. A quiet stretch, or the same recorded again, tells which it is.")


def may_be_noise(correlations: Sequence[float]) -> str:
    found = listed(f"{rho:.2f}" for rho in correlations)
    colour = f", with a correlation of {found} between neighbours" if correlations else ""
    return (f"it may be noise alone{colour}, which a quiet stretch or the same recorded again "
            "would tell")


def after_the_inputs() -> str:
    return ("Samples at the end are left out: by the delays that explain the recordings best they "
            "show what came after the inputs were recorded.")


def sizes_differ(name: str, unit: str, times: float, large: str, small: str) -> str:
    asked = f"is it in {unit} in both" if unit else "has it one unit in both"
    return f"'{name}' is {times:.3g} times as large in '{large}' as in '{small}': {asked}?"


def times_differ(one: str, other: str, step: float, other_step: float) -> str:
    return (f"'{one}' has a sample every {step:.3g} s, '{other}' one every {other_step:.3g} s, and "
            "they last accordingly: are the times of both in s?")


def samples_far_apart(step: float, period: float) -> str:
    return (f"Samples are {step:.3g} s apart, and by its guesses the model's slowest motion lasts "
            f"{period:.2g} s: are the times in s?")
