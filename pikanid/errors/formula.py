"""What can be wrong with a formula or a unit."""

from __future__ import annotations

from collections.abc import Sequence

from pikanid.errors.wording import did_you_mean, listed, short


def bad_name(name: str, what: str) -> str:
    return f"'{name}' cannot name a {what}: use letters, digits and '_', starting with a letter."


def reserved_name(name: str, what: str) -> str:
    return f"'{name}' cannot name a {what}: it is a built-in of the formula language. Rename it."


def formula_too_long(where: str, limit: int) -> str:
    return f"The formula of {where} is longer than {limit} characters; split it up."


def formula_syntax(text: str, where: str, detail: str) -> str:
    return f"The formula of {where} cannot be read ({detail}): '{short(text)}'."


def formula_work(text: str, where: str) -> str:
    return (f"The formula of {where} makes the model too complicated: '{short(text)}'; nest fewer "
            "functions and write shorter products.")


def formula_forbidden(part: str, where: str, functions: Sequence[str],
                      compares: bool = False) -> str:
    hint = (" A threshold is step(x - level), which is 1 above the level and 0 below it."
            if compares else "")
    return (f"'{short(part)}' in the formula of {where} is not allowed: use numbers, names, "
            f"+ - * / **, parentheses and the functions {', '.join(functions)}.{hint}")


def formula_overflows(part: str, where: str) -> str:
    return (f"'{short(part)}' in the formula of {where} overflows: no number beyond 1.8e308, or "
            "fraction of such numbers, can be computed with.")


def formula_exponent(part: str, where: str, limit: int) -> str:
    return (f"'{short(part)}' in the formula of {where} has an exponent beyond {limit}, the "
            "largest that is read.")


def formula_not_real(part: str, where: str) -> str:
    return f"'{short(part)}' in the formula of {where} is not a real number."


def formula_not_finite(part: str, where: str) -> str:
    return f"'{short(part)}' in the formula of {where} is infinite or undefined."


def unknown_symbol(name: str, where: str, known: Sequence[str], close: Sequence[str]) -> str:
    return (f"'{name}' in the formula of {where} is neither a state, an input nor a parameter "
            f"(known: {listed(known)}).{did_you_mean(close)}")


def unknown_function(name: str, where: str, known: Sequence[str], close: Sequence[str]) -> str:
    return (f"The function '{name}' in the formula of {where} is unknown "
            f"(known: {listed(known)}).{did_you_mean(close)}")


def wrong_argument_count(name: str, wanted: int, given: int, where: str) -> str:
    return f"{name}() in the formula of {where} takes {wanted} argument(s), not {given}."


def caret_power(text: str, where: str) -> str:
    return f"'^' in the formula of {where} is not a power: write '**' in '{short(text)}'."


def division_by_zero(text: str, where: str) -> str:
    return f"The formula of {where} divides by zero: '{short(text)}'."


def unknown_unit(text: str, where: str = "", close: Sequence[str] = ()) -> str:
    return (f"The unit '{short(text)}'{f' of {where}' if where else ''} is unknown: write products "
            "and powers of SI units such as 'm/s^2', 'rad', 'deg/s', 'mV', or '' for none."
            f"{did_you_mean(close)}")


def units_differ(source: str, target: str, where: str = "") -> str:
    hint = " ('g' is gram; standard gravity is 'g_0')" if "g" in (source, target) else ""
    return (f"{f'{where}: ' if where else ''}'{source or 'dimensionless'}' cannot be converted to "
            f"'{target or 'dimensionless'}': they measure different things{hint}.")


def unit_of_recording(recording: str, channel: str, detail: str) -> str:
    return (f"'{short(recording)}', {detail} If the file is wrong, say the right one: --unit "
            f"{channel}=UNIT (in Python units={{'{channel}': 'UNIT'}}).")


def unit_without_size(text: str) -> str:
    return (f"The unit '{short(text)}' is logarithmic, so that no formula can be written in it: "
            "convert the signal first.")


def units_meet(where: str, formula: str, found: str, wanted: str, unknown: Sequence[str]) -> str:
    advice = (
        f"declare the unit of {listed(unknown)}"
        if unknown
        else "declare units that fit, and a parameter for every number that has a unit"
    )
    return (f"{where}: '{short(formula)}' comes out in '{found or 'dimensionless'}' where "
            f"'{wanted or 'dimensionless'}' is needed, and no factor turns one into the other: "
            f"{advice}.")


def units_disagree(where: str, formula: str, found: str, wanted: str) -> str:
    needed = f"'{wanted}'" if wanted else "a pure number"
    return (f"{where}: '{short(formula)}' comes out in '{found or 'dimensionless'}' where {needed} "
            "is needed; its numbers are used as they are: check the formula and its units.")


def number_between_units(where: str, number: str) -> str:
    return (f"{where} adds '{short(number)}', which has no unit, to terms in different units: "
            "declare its unit, for a number as a parameter with a value.")


def temperatures_meet(where: str, first: str, second: str) -> str:
    return (f"{where} adds temperatures in '{first}' and '{second}', which begin at different "
            "zeros: declare all of them in one unit (columns of recordings in another one are "
            "converted), and differences in 'delta_degC'.")


def converted_twice(where: str, number: float, factor: str, value: float) -> str:
    return (f"{where} needs the factor {value:.6g} {factor}, which is put there by itself, and "
            f"holds the number {number:.6g}, which looks like it: leave the number out.")


def not_a_formula(where: str, value: object) -> str:
    return (f"{where} is {value!r}; it must be a formula as text, a finite number, or a SymPy "
            "expression.")


def not_a_quantity(text: str, where: str) -> str:
    return f"{where} is '{short(text)}'; write a number, with a unit if it needs one, as '0.1deg'."
