"""Unit texts: their normal form, conversions, and everything that is not a unit."""

from __future__ import annotations

import subprocess
import sys
from math import pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pikanid.errors import BadUnit, PikanidError
from pikanid.formula import units

NAMES = ["m", "s", "rad", "deg", "kg", "V", "mV", "N", "Hz", "mm", "ohm", "A", "K", "um", "h"]
powers = st.dictionaries(st.sampled_from(NAMES), st.sampled_from([-3, -2, -1, 1, 2, 3]), max_size=4)


@pytest.mark.parametrize(
    ("text", "normal"),
    [
        ("", ""),
        ("1", ""),
        ("-", ""),
        ("rad", "rad"),
        ("°", "deg"),
        ("degree", "deg"),
        ("°/s", "deg/s"),
        ("meter/second**2", "m/s^2"),
        ("m/s2", "m/s^2"),
        ("m s⁻²", "m/s^2"),
        ("m·s^-2", "m/s^2"),
        ("1/(s^2*rad^2)", "1/(s^2*rad^2)"),
        ("1/s^2/rad^2", "1/(s^2*rad^2)"),
        ("s^-1", "1/s"),
        ("mV", "mV"),
        ("µm", "um"),
        ("Ω", "ohm"),
        ("%", "percent"),
        ("V/Hz^(1/2)", "V/Hz^0.5"),
        ("1/s^1.5", "1/s^1.5"),
        ("m/m", ""),
        ("N s/m", "N*s/m"),
    ],
)
def test_normal_form(text: str, normal: str) -> None:
    assert units.parse(text) == normal
    assert units.parse(normal) == normal


@pytest.mark.parametrize(
    "text",
    ["widget", "m//s", "2*m", "m^999", "(m", "m)", "m^", "*", "9**9**9", "m^(1/0)", "m s^",
     "__import__('os').system('true')", "lambda: 0", "x" * 500, "(" * 70, "\x00", "m^1e9", "3"],
)  # fmt: skip
def test_not_a_unit(text: str) -> None:
    with pytest.raises(BadUnit, match="unknown"):
        units.parse(text)
    assert not units.is_unit(text)


@given(st.text(max_size=40))
@settings(max_examples=300, deadline=None)
def test_any_text_is_a_unit_or_an_error(text: str) -> None:
    try:
        assert units.parse(units.parse(text)) == units.parse(text)
    except PikanidError as error:
        assert str(error).endswith(".")


@given(powers)
@settings(deadline=None)
def test_products_round_trip(exponents: dict[str, int]) -> None:
    text = units.product(*exponents.items())
    assert units.parse(text) == text
    assert units.product((text, 1), (text, -1)) == ""


@pytest.mark.parametrize(
    ("value", "source", "target", "wanted"),
    [
        (180.0, "deg", "rad", pi),
        (1.0, "1/(s^2*rad^2)", "1/s^2", 1.0),
        (90.0, "deg", "", pi / 2),
        (3.0, "mV", "V", 0.003),
        (60.0, "rpm", "rad/s", 2 * pi),
        (20.0, "degC", "K", 293.15),
        (20.0, "degC/s", "K/s", 20.0),
        (1.0, "g_0", "m/s^2", 9.80665),
        (1.0, "ms", "s", 1e-3),
        (1.0, "N*mm/m", "N", 1e-3),
        (1.0, "N*s^2/(mm*m)", "N*s^2/m^2", 1e3),
    ],
)
def test_conversion(value: float, source: str, target: str, wanted: float) -> None:
    assert units.convert(value, source, target) == pytest.approx(wanted, rel=1e-12)


def test_a_spread_has_no_offset() -> None:
    assert units.factor("degC", "K") == 1.0
    assert units.factor("degF", "K") == pytest.approx(5 / 9)


@pytest.mark.parametrize(("source", "target"), [("m", "s"), ("g", "m/s^2"), ("Hz", "rad/s")])
def test_different_things_do_not_convert(source: str, target: str) -> None:
    with pytest.raises(BadUnit, match="different things"):
        units.convert(1.0, source, target)


def test_plain_units_need_no_pint() -> None:
    code = (
        "import sys; from pikanid.formula import units; units.parse('m/s^2');"
        "units.convert(1.0, 'rad', 'rad'); assert 'pint' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
