"""Values as people write them on the command line."""

import copy
import math
import pickle
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechlab.cli.arguments import split_tokens
from mechlab.errors import MechlabError
from mechlab.units import UNITS
from mechlab.values import Quantity, Range, parse_number, parse_value


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.4", 0.4),
        (".5", 0.5),
        ("-1e-3", -1e-3),
        ("+1", 1.0),
        ("5.", 5.0),
        ("17", 17.0),
        ("1e-300", 1e-300),
        ("37deg", math.radians(37)),
        ("180deg", math.pi),
        ("5mm", 0.005),
        ("300rpm", 10 * math.pi),
        ("1 rev", 2 * math.pi),
        ("9.81m/s^2", 9.81),
        ("9.81m/s²", 9.81),
        ("2 N m", 2.0),
        ("36km/h", 10.0),
        ("5%", 0.05),
        ("1/4mm", 0.00025),
        ("elbow-up", "elbow-up"),
        ("abc", "abc"),
        ("my.py:rocker", "my.py:rocker"),
        ("-", "-"),
    ],
)
def test_one_value(text: str, value: object) -> None:
    parsed = parse_value("x", text)
    assert parsed == (pytest.approx(value, rel=3e-16) if isinstance(value, float) else value)
    assert isinstance(parsed, float | str)


def test_a_decimal_length_is_the_float_one_would_write_in_si() -> None:
    assert parse_value("x", "5mm") == 0.005  # exactly: 5 * 0.001 rounds twice
    assert parse_value("x", "0.3mm") == 0.0003


def test_a_ratio_stays_exact() -> None:
    value = parse_value("k_bevel", "17/22")
    assert isinstance(value, Fraction) and value == Fraction(17, 22)


def test_a_quantity_remembers_its_unit_and_is_a_plain_float_otherwise() -> None:
    value = parse_value("x", "300rpm")
    assert isinstance(value, Quantity) and value.unit == "rad/s"
    assert str(value) == str(float(value)) and type(value + 1) is float
    for twin in (copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
        assert twin == value and twin.unit == "rad/s"


def test_lists() -> None:
    assert parse_value("x", "1,2.5,-3") == (1.0, 2.5, -3.0)
    assert parse_value("x", "0,95deg") == (0.0, pytest.approx(math.radians(95)))
    assert parse_value("x", "1,") == (1.0,)
    assert parse_value("x", "a, b") == ("a", "b")
    assert parse_value("k", "1/2,3") == (Fraction(1, 2), 3.0)


def test_ranges() -> None:
    assert parse_value("x", "0:1") == Range(0.0, 1.0, None)
    assert parse_value("x", "0:90deg:7") == Range(0.0, pytest.approx(math.pi / 2), 7)
    low = parse_value("x", "10deg:90deg:9")
    assert isinstance(low, Range)
    assert low.points() == pytest.approx([math.radians(d) for d in range(10, 91, 10)])
    assert Range(0.1, 0.7, 4).points()[-1] == 0.7 and len(Range(0, 1).points(5)) == 5


@pytest.mark.parametrize(
    "text",
    [
        "nan",
        "-inf",
        "Infinity",
        "1e999",
        "1e-999999999",
        "9" * 500,
        "1/0",
        "",
        " ",
        ",",
        "1,,2",
        "5furlong",
        "5mmm",
        "1,2deg",
        "10:90deg",
        "1:2:3:4",
        "1:2:1",
        "1:2:x",
        "1:",
        "1:nan",
        "1,nan",
        "1e308km/h2",
    ],
)
def test_refused_in_the_name_of_the_key(text: str) -> None:
    with pytest.raises(MechlabError, match="^rod_length: "):
        parse_value("rod_length", text)


def test_an_unknown_unit_lists_the_units() -> None:
    with pytest.raises(MechlabError, match=r"unit 'degr' does not exist. Did you mean 'deg'\? Existing: .*mm.*rpm"):
        parse_value("x", "5degr")


def test_a_number_option_refuses_another_unit() -> None:
    assert parse_number("--duration", "500ms", "s") == 0.5
    assert parse_number("--max-error", "0.1mm", "m", "rad") == 1e-4
    assert parse_number("--max-error", "1e-6", "m", "rad") == 1e-6
    with pytest.raises(MechlabError, match="m or rad"):
        parse_number("--max-error", "1kg", "m", "rad")
    with pytest.raises(MechlabError, match="^ratio: expected a number, got 'two'"):
        parse_number("ratio", "two", "")
    for text in ("5mm", "soon", "inf"):
        with pytest.raises(MechlabError, match="^--duration: "):
            parse_number("--duration", text, "s")


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_float_reads_back(number: float) -> None:
    assert parse_value("x", repr(number)) == number


@given(st.text(max_size=12))
def test_any_text_is_a_value_or_one_clear_error(text: str) -> None:
    try:
        value = parse_value("key", text)
    except MechlabError as error:
        assert str(error).startswith("key: ")
    else:
        assert not isinstance(value, float) or math.isfinite(value)


TURN = 2.0 * math.pi
TRUTH = {
    "rad": (1.0, "rad"), "mrad": (1e-3, "rad"), "deg": (TURN / 360.0, "rad"), "°": (TURN / 360.0, "rad"), "rev": (TURN, "rad"),
    "rad/s": (1.0, "rad/s"), "deg/s": (TURN / 360.0, "rad/s"), "rev/s": (TURN, "rad/s"), "rpm": (TURN / 60.0, "rad/s"),
    "rad/s2": (1.0, "rad/s2"), "deg/s2": (TURN / 360.0, "rad/s2"),
    "m": (1.0, "m"), "cm": (1e-2, "m"), "mm": (1e-3, "m"), "um": (1e-6, "m"),
    "m/s": (1.0, "m/s"), "mm/s": (1e-3, "m/s"), "km/h": (1000.0 / 3600.0, "m/s"), "m/s2": (1.0, "m/s2"), "mm/s2": (1e-3, "m/s2"),
    "s": (1.0, "s"), "ms": (1e-3, "s"), "us": (1e-6, "s"), "min": (60.0, "s"), "Hz": (1.0, "Hz"), "kHz": (1e3, "Hz"),
    "kg": (1.0, "kg"), "g": (1e-3, "kg"), "t": (1e3, "kg"),
    "kgm2": (1.0, "kg m2"), "gm2": (1e-3, "kg m2"), "kgmm2": (1e-3**2, "kg m2"),
    "N": (1.0, "N"), "mN": (1e-3, "N"), "kN": (1e3, "N"),
    "Nm": (1.0, "N m"), "mNm": (1e-3, "N m"), "Nmm": (1e-3, "N m"), "kNm": (1e3, "N m"),
    "N/m": (1.0, "N/m"), "N/mm": (1.0 / 1e-3, "N/m"), "kN/m": (1e3, "N/m"),
    "Nm/rad": (1.0, "N m/rad"), "Ns/m": (1.0, "N s/m"), "Nms/rad": (1.0, "N m s/rad"),
    "J": (1.0, "J"), "W": (1.0, "W"), "kW": (1e3, "W"), "V": (1.0, "V"), "A": (1.0, "A"), "ohm": (1.0, "ohm"), "%": (1e-2, ""),
}  # fmt: skip
"""What one of each unit is, and the unit of the SI brochure (BIPM, 9th edition 2019) that it is given in: prefixes of table 7;
degree, minute and tonne of table 8 (180 deg = pi rad, 1 min = 60 s, 1 t = 1000 kg); an hour is 3600 s, a revolution 2 pi rad."""


def test_the_table_of_truths_lists_every_unit() -> None:
    assert set(TRUTH) == set(UNITS)


@pytest.mark.parametrize("name", TRUTH)
def test_every_unit_is_what_the_si_says(name: str) -> None:
    factor, si = TRUTH[name]
    for number in (1, 2, 7.3):
        value = parse_value("x", f"{number}{name}")
        assert isinstance(value, Quantity) and value.unit == si
        assert float(value) == pytest.approx(number * factor, rel=1e-15)


def test_tokens() -> None:
    names, values = split_tokens(["delta6", "x=5mm", "file=a=b", "y=0"])
    assert names == ["delta6"] and values == {"x": 0.005, "file": "a=b", "y": 0.0}


@pytest.mark.parametrize("tokens", [["x=1", "x=2"], ["=1"], ["x="]])
def test_bad_tokens(tokens: list[str]) -> None:
    with pytest.raises(MechlabError):
        split_tokens(tokens)


@pytest.mark.parametrize("text", ["1/x", "2*x", "1/(1+x)", "2*sin(pi*x)", "3-x^2", "1e-3*x"])
def test_a_formula_in_x_that_begins_with_a_number_stays_a_text(text: str) -> None:
    assert parse_value("y", text) == text


def test_a_ratio_of_numbers_stays_a_number_and_a_wrong_unit_is_named() -> None:
    assert parse_value("y", "17/22") == Fraction(17, 22)
    for text in ("1/xy", "3*max", "2 x"):
        with pytest.raises(MechlabError, match="unit"):
            parse_value("y", text)
