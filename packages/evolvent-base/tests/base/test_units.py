"""Values with units, against the units library and by hand."""

import math

import pint
import pytest
from pydantic import BaseModel, ValidationError

from evolvent_base import units


class Thing(BaseModel):
    length: units.Length = 1.0
    mass: units.MassOrZero = 1.0
    rate: units.AngularRate = 1.0
    rates: units.AngularRates = 1.0
    density: units.LineDensity = 1.0
    inertia: units.Inertia = 1.0
    damping: units.DampingOrZero = 1.0
    share: units.Fraction = 1.0
    step: units.DurationOrAuto = "auto"


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [
        ("length", "5 m", 5.0),
        ("length", "5m", 5.0),
        ("length", " 1 cm ", 0.01),
        ("length", "1 ft", 0.3048),
        ("length", "2", 2.0),
        ("length", "1e-3 km", 1.0),
        ("mass", "0.5 g", 5e-4),
        ("mass", "0 kg", 0.0),
        ("rate", "60 rpm", 2.0 * math.pi),
        ("rate", "90 deg/s", 0.5 * math.pi),
        ("rate", "-6 rad/s", -6.0),
        ("rate", "6 1/s", 6.0),
        ("density", "0.735 g/m", 7.35e-4),
        ("density", "0.735 mg / mm", 7.35e-4),
        ("inertia", "0.004 kg m^2", 0.004),
        ("inertia", "0.004  kg*m**2", 0.004),
        ("inertia", "0.004 kg m2", 0.004),
        ("inertia", "40 kg cm^2", 0.004),
        ("damping", "1e-3 N s/m", 1e-3),
        ("damping", "1e-3 kg/s", 1e-3),
        ("step", "auto", "auto"),
        ("step", "2 ms", 0.002),
    ],
)
def test_reads(key, text, value):
    found = getattr(Thing(**{key: text}), key)
    assert found == pytest.approx(value, rel=1e-15) if isinstance(value, float) else found == value


@pytest.fixture(scope="module")
def registry():
    """The library's units, which take a quarter of a second to be read."""
    return pint.UnitRegistry()


@pytest.mark.slow
@pytest.mark.parametrize("unit", [unit for unit in units.COMMON if unit])
def test_units_read_without_the_library_agree_with_it(unit, registry):
    for name, factor in units.COMMON[unit].items():
        wanted = registry.Quantity(1.0, registry.parse_units(name)).to(registry.parse_units(unit)).magnitude
        assert factor == pytest.approx(wanted, rel=1e-15)


@pytest.mark.parametrize("text", ["3 N/m^n", "3 N/m", "3 N/m^1.5", "3"])
def test_a_contact_stiffness_has_a_power_of_the_length(text):
    assert units.parse(text, "N/m^n") == 3.0
    with pytest.raises(units.UnitError, match="'N/mm' is a unit of something else, or not of SI"):
        units.parse("3 N/mm", "N/m^n")


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("length", "5 kg", ["a length above 0", "'kg' is a unit of something else"]),
        ("length", "5 furlng", ["'furlng' is not a known unit"]),
        ("length", "five", ["not a number"]),
        ("length", 0, ["above 0"]),
        ("length", float("nan"), ["not finite"]),
        ("length", float("inf"), ["not finite"]),
        ("length", 10**400, ["not finite"]),
        ("mass", -(10**400), ["not finite"]),
        ("length", 1e-31, ["its size is not between 1e-30 and 1e+30"]),
        ("length", "1e31 m", ["its size is not between"]),
        ("length", True, ["not a number"]),
        ("length", None, ["not a number"]),
        ("length", [1], ["not a number"]),
        ("mass", "-0.5 g", ["a mass of 0 or above"]),
        ("rate", "3 Hz", ["hertz"]),
        ("rate", "3 kHz", ["hertz"]),
        ("rate", "3 m/s", ["an angular rate"]),
        ("rates", [1.0, "x"], ["an angular rate", "one per blade", "not a number with a unit"]),
        ("rates", [1.0, 10**400], ["one per blade", "not finite"]),
        ("share", 1.5, ["up to 1"]),
        ("step", "atuo", ["'auto'"]),
        ("step", "2**99999999 s", ["a time"]),
    ],
)
def test_refuses_with_what_is_allowed(key, value, words):
    with pytest.raises(ValidationError) as caught:
        Thing(**{key: value})
    (error,) = caught.value.errors()
    for word in words:
        assert word in error["msg"]


def test_writes_what_it_reads_exactly():
    thing = Thing(length=0.1 + 0.2, rate="33 rpm", rates=["1 rad/s", "20 deg/s"], step="0.3 s")
    assert Thing.model_validate(thing.model_dump(mode="json")) == thing
    written = thing.model_dump(mode="json")
    assert (written["length"], written["rate"]) == ("0.30000000000000004 m", "33 rpm")


def test_one_or_more_keeps_one_as_one():
    assert Thing(rates="2 rad/s").rates == 2.0
    assert Thing(rates=["2 rad/s", 3]).rates == (2.0, 3.0)


@pytest.mark.parametrize(
    ("head", "parted"),
    [
        ("angle [deg]", ("angle", "deg")),
        (" torque (N m) ", ("torque", "N m")),
        ("left(mm)", ("left", "mm")),
        ("ratio (left) [1/s]", ("ratio (left)", "1/s")),
        ("spread [ mm ]", ("spread", "mm")),
        ("time", ("time", "")),
        ("(mm)", ("(mm)", "")),
        ("x (a) b", ("x (a) b", "")),
        ("", ("", "")),
    ],
)
def test_heads_of_columns_hold_a_name_and_a_unit(head, parted):
    assert units.head_and_unit(head) == parted


@pytest.mark.parametrize("size", [1e-310, 1e-200, 1e-160, 1e-29, 1.0, 1e29])
def test_directions_of_any_length_have_squares(size):
    """Those of usual length stay as they are written."""

    class Aimed(BaseModel):
        axis: units.Direction

    found = Aimed(axis=(3 * size, 0, -4 * size)).axis
    assert math.hypot(*found) ** 2 > 0.0
    assert found[2] / found[0] == pytest.approx(-4 / 3, rel=1e-9)
    if size == 1.0:
        assert found == (3.0, 0.0, -4.0)
