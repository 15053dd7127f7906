"""What can be wrong on a command line."""

from __future__ import annotations

from collections.abc import Sequence

from pikanid.errors.wording import listed, short


def left_out_as_slow() -> str:
    return ("Left out of the sparse scenarios and the real recording, where a fit takes long: try "
            "it with pikanid identify.")


def usage(message: str, command: str) -> str:
    return f"{message.rstrip('.')}; see '{command} --help'."


def not_an_assignment(option: str, text: str, example: str) -> str:
    return f"{option} takes NAME=VALUE, such as '{example}', not '{short(text)}'."


def named_twice(option: str, name: str) -> str:
    return f"{option} names '{name}' more than once: keep one."


def free_and_fixed(name: str) -> str:
    return f"'{name}' cannot be both free and fixed: keep --free or --fix."


def sigma_not_positive(text: str) -> str:
    return f"--sigma is '{short(text)}'; the noise must be positive and finite."


def reversed_window(start: float, stop: float) -> str:
    return f"The stretch from {start:g} s to {stop:g} s is empty: --from must lie before --to."


def nothing_free(model: str) -> str:
    return f"Every parameter of '{model}' is fixed: free one to identify (--free NAME)."


def output_ending(option: str, path: str, endings: Sequence[str]) -> str:
    return f"{option}: '{short(path, 200)}' must end in {' or '.join(endings)}."


def output_folder(option: str, path: str, folder: str) -> str:
    return (f"{option}: '{short(path, 200)}' cannot be written, because there is no folder "
            f"'{short(folder, 200)}'.")


def output_refused(option: str, path: str, why: str) -> str:
    return f"{option}: '{short(path, 200)}' cannot be written: {why}."


def output_is_input(option: str, path: str) -> str:
    return f"{option} would overwrite the input '{short(path, 200)}': choose another name."


def output_twice(first: str, second: str, path: str) -> str:
    return f"{first} and {second} both name '{short(path, 200)}': choose another name for one."


def save_needs_one_strategy() -> str:
    return "--save keeps one estimate: choose one strategy, or use --json for several."


def nothing_to_simulate(name: str) -> str:
    return f"'{name}' drives the model with nothing: none of its columns is an input of the model."


def unforeseen(command: str, failure: str, place: str) -> str:
    return (f"pikanid itself failed while running '{short(command, 400)}': {short(failure, 200)}"
            f"{place}. What was written before is kept. Please report this line with the files; "
            "with --debug the same command shows the traceback.")


def out_of_memory() -> str:
    return "There is not enough memory for this: shorten the recording, or thin it with --decimate."


def note_excitation_short(seconds: float, needed: float) -> str:
    return (f"The built-in excitation lasts {seconds:.3g} s, and the model moves over about "
            f"{float(f'{needed:.2g}'):g} s: inputs that last longer (--excitation FILE; 'pikanid "
            "design' makes some) would show more.")


def note_input_at_rest(excitation: str, names: Sequence[str]) -> str:
    return (f"The excitation {excitation} drives one input: {listed(names)} "
            f"{'stays' if len(names) == 1 else 'stay'} at 0. A recording (--excitation FILE) can "
            "hold all.")


def units_taken(names: Sequence[str], units: Sequence[str]) -> str:
    """The units are the model's, of signals whose file states none."""
    told = ", ".join(f"'{name}' in {unit}" for name, unit in zip(names, units, strict=True))
    return (f"No unit is stated of what is read as the model has it: {told}; "
            f"'--unit {names[0]}={units[0]}' says which it is.")
