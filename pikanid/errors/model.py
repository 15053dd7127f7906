"""What can be wrong with a model, and where it is bound to recordings."""

from __future__ import annotations

from collections.abc import Sequence

from pikanid.errors.wording import did_you_mean, listed


def no_model(kind: str) -> str:
    return (f"A model is needed, not a {kind}: give a Model (Model.load(path), "
            "Model.from_dict(...), pikanid.model.systems); the model comes before the recordings.")


def duplicate_name(name: str, first: str, second: str) -> str:
    return f"'{name}' names both {first} and {second}; every name may be used once."


def missing_equation(state: str) -> str:
    return f"State '{state}' has no equation: add '{state} = \"...\"' under [equations]."


def stray_equation(name: str, states: Sequence[str]) -> str:
    return f"There is an equation for '{name}', which is not a state (states: {listed(states)})."


def no_section(source: str, section: str) -> str:
    return f"'{source}': '{section}' is no table: begin a line with [{section}]."


def no_table_entry(source: str, section: str, name: str) -> str:
    first = 'expression = "...", ' if section == "outputs" else ""
    return (f"'{source}': '{name}' under [{section}] is no table: write a line like "
            f"{name} = {{ {first}unit = \"m\" }}.")


def misplaced_key(source: str, section: str, key: str) -> str:
    return (f"'{source}': '{key}' stands under [{section}], but is the model's own: move it to the "
            "top of the file, before the first [table].")


def not_in_model(what: str, name: str, known: Sequence[str], close: Sequence[str] = ()) -> str:
    return f"The model has no {what} '{name}' (it has: {listed(known)}).{did_you_mean(close)}"


def derivative_of_no_state(name: str, where: str, states: Sequence[str]) -> str:
    return (f"The {where} asks for the derivative of '{name}', which is no state (states: "
            f"{listed(states)}): name one of them, as in v' or derivative(v).")


def foreign_symbols(names: Sequence[str], where: str) -> str:
    return (f"{where} uses {listed(names)}, unknown to the model: declare it as a parameter "
            "(pass parameters=[...]) or mend the name.")


def spline_at_start(state: str, spline: str) -> str:
    return (f"The initial value of '{state}' uses {spline}: a spline function belongs in an "
            "equation or an output; write the initial value as a formula of parameters and inputs.")


def no_states() -> str:
    return "The model has no states: list at least one under [states]."


def no_outputs() -> str:
    return "The model has no outputs: list what was measured under [outputs]."


def bad_bounds(name: str, value: float, bounds: Sequence[float]) -> str:
    return (f"Parameter '{name}': its guess {value:g} must lie inside its bounds "
            f"[{bounds[0]:g}, {bounds[1]:g}], and the lower bound below the upper one.")


def bad_value(what: str, value: object, wanted: str) -> str:
    return f"{what} is {value!r}; it must be {wanted}."



def model_file_key(path: str, where: str, key: str, known: Sequence[str],
                   close: Sequence[str]) -> str:
    return (f"'{path}': {where} has the unknown key '{key}' (known: {listed(known)})."
            f"{did_you_mean(close)}")


def equation_of_state(path: str, where: str, key: str, state: str) -> str:
    return (f"'{path}': {where} has the unknown key '{key}': what a state's rate is stands under "
            f"[equations], as {state} = \"...\".")


def model_file_missing(path: str, where: str, wanted: str) -> str:
    return f"'{path}': {where} lacks {wanted}."


def effect_twice(key: str) -> str:
    return f"The effect '{key}' is there already: give it another id."


def unknown_catalogue(name: str, known: Sequence[str]) -> str:
    return f"'{name}' is neither a catalogue of pikanid ({listed(known)}) nor a .toml file."


def no_effects(model: str) -> str:
    return (f"'{model}' lists no effects: write them under [effects] in its file, give it a "
            "domain, or name a catalogue with --catalogue.")


def effect_name_taken(key: str, name: str, by: str) -> str:
    return f"The effect '{key}' adds '{name}', which {by} has already: give it another name."


def effect_without_size(where: str, parameters: Sequence[str]) -> str:
    return (f"{where}: 'null' must name one of its parameters ({listed(parameters)}) and the value "
            "at which the effect is not there, as null = { k = 0.0 }.")


def effect_changes_nothing(where: str, keys: Sequence[str]) -> str:
    return f"{where} changes nothing: give at least one of {listed(keys)}."


def unknown_system(name: str, known: Sequence[str], close: Sequence[str]) -> str:
    return (f"'{name}' is neither a ready-made model ({listed(known)}) nor a .toml file that "
            f"exists.{did_you_mean(close)}")


def path_twice(name: str, what: str) -> str:
    return (f"Input '{name}' has a {what} already: change the parameter that it names instead of "
            "adding a second one.")


def start_without_backlash(name: str) -> str:
    return (f"Input '{name}' has a backlash_start but no backlash: give the half play, or leave "
            "the start away.")


def no_recordings() -> str:
    return "No recording was given: pass at least one."


def too_few_samples(samples: int, parameters: int) -> str:
    return (f"There are {samples} usable samples for {parameters} free parameters; a fit needs "
            f"{parameters + 1} or more, since any model explains fewer: record more, or fix "
            "parameters.")


def too_few_of_its_own(where: str, samples: int, parameters: Sequence[str]) -> str:
    return (f"Recording '{where}' has {samples} usable samples for {len(parameters)} parameters of "
            f"its own ({listed(parameters)}); at least {len(parameters)} are needed: record more, "
            "or share or fix them.")


def guess_and_value(source: str, name: str) -> str:
    return (f"'{source}': parameter '{name}' has a 'guess' and a 'value': leave out the value if "
            "it is to be estimated, the guess if it is known.")


def initial_clash(source: str, state: str) -> str:
    return (f"'{source}': the free initial value of '{state}' is the parameter '{state}_0', which "
            f"[parameters] has as well: give that another name, or write initial = \"{state}_0\" "
            "if it is the same.")
