"""Units as engineers write them: the spelling that is meant is named, and it is one that is read."""

from __future__ import annotations

import pytest

from evolvent import InputError, parts
from evolvent_base.units import UnitError, parse

#: What is meant by a text, by the unit of the key.
MEANT = {
    "N m": {
        "Nm": "N m", "mNm": "mN m", "kNm": "kN m", "Nmm": "N mm", "Ncm": "N cm", "cNm": "cN m", "N-m": "N m",
        "nm": "N m", "NM": "N m", "in-lbf": "in lbf", "in-lb": "in lbf", "ft-lb": "ft lbf", "oz-in": "ozf in",
        "ozin": "ozf in", "kg-cm": "kgf cm", "Newton-meter": "N m", "Newton metres": "N m",
    },
    "N m s/rad": {"Nms/rad": "N m s/rad", "Nms": "N m s", "Nm/(rad/s)": "N m/(rad/s)", "mNms/rad": "mN m s/rad"},
    "N m/rad": {"Nm/rad": "N m/rad", "Nm/deg": "N m/deg", "in lb/rad": "in lbf/rad", "lbf-in/rad": "lbf in/rad"},
    "N s/m": {"Ns/m": "N s/m", "kNs/m": "kN s/m"},
    "kg m^2": {"kgm2": "kg m^2", "kg-m2": "kg m^2", "gcm2": "g cm^2", "slugft2": "slug ft^2", "lb-in2": "lb in^2"},
    "kg/m^3": {"kgm-3": "kg m^-3", "kg/M3": "kg/m^3"},
    "N/m": {"N/M": "N/m", "lb/in": "lbf/in"},
    "Pa": {"MPA": "MPa", "Gpa": "GPa", "kg/cm2": "kgf/cm^2"},
    "m": {"M": "m", "MM": "mm", "KM": "km"},
    "rad/s": {"RPM": "rpm", "rev/min": "turn/min", "dps": "deg/s"},
    "m/s^2": {"g": "g_0", "G": "g_0", "mg": "mg_0"},
    "V": {"Volts": "V", "mVolts": "mV"},
    "N": {"Newtons": "N", "KN": "kN", "lbs": "lbf", "kg": "kgf"},
}  # fmt: skip


@pytest.mark.parametrize(("unit", "given"), [(unit, given) for unit, row in MEANT.items() for given in row])
def test_the_spelling_that_is_meant(unit, given):
    with pytest.raises(UnitError) as caught:
        parse(f"5 {given}", unit)
    meant = MEANT[unit][given]
    assert str(caught.value).endswith(f"; did you mean {meant!r}?")
    assert parse(f"5 {meant}", unit) > 0.0


@pytest.mark.parametrize(
    ("unit", "given"),
    [("N m", "foo"), ("m", "Nm"), ("m", "s"), ("", "m"), ("N m", "q" * 99), ("N m", "m" * 40), ("N m", "Nm" * 30),
     ("N m", "N^m"), ("m", "mm^99^99")],
)  # fmt: skip
def test_nothing_is_guessed(unit, given):
    with pytest.raises(UnitError) as caught:
        parse(f"5 {given}", unit)
    assert "did you mean" not in str(caught.value)


def test_the_sentence_of_a_part():
    with pytest.raises(InputError, match=r"Load\.torque.*'5 Nm'.*'Nm' joins units without a space; did you mean 'N m'"):
        parts.Load(at="x", torque=(0, 0, "5 Nm"))
    with pytest.raises(InputError, match="did you mean 'N m s'"):
        parts.JointSpring(a="ground", b="x", damping="5 Nms")
