"""Units as files write them: what they stand for, by their size in SI, and what is refused."""

from __future__ import annotations

import math

import pytest

from evolvent_base import units
from evolvent_base.units import UnitError, file_unit

INCH, LBF, OZF, G0, DEG = 0.0254, 4.4482216152605, 0.27801385095378, 9.80665, math.pi / 180.0
#: Size in the unit wanted, and spellings of that unit.
SIZES = {
    ("m/s^2", 1.0): "m/s2 m/s² m·s⁻² m·s^-2 m*s-2 m/s**2 m/s/s m/sec^2 m/(s^2) m/(s·s) [m/s²] m.s-2 M/S2",
    ("m/s^2", G0): "g G gs gee g0 g_0 gn",
    ("m/s^2", G0 / 1000): "mg milli-g mg_0",
    ("m/s^2", 0.01): "Gal cm/s²",
    ("kg", 0.001): "g gram grams Gramm",
    ("kg", 1.0): "kg KG kilogram kilograms",
    ("kg", 0.45359237): "lb lbs lbm pounds",
    ("N", 1.0): "N Newton Newtons NEWTONS",
    ("N", 1000.0): "kN KN kNewtons kilonewton",
    ("N", LBF): "lbf lb lbs pounds",
    ("N", G0): "kgf kp",
    ("N m", 1.0): "Nm N-m N*m N·m N⋅m N.m NM J newton-metres",
    ("N m", 0.001): "Nmm mNm N·mm mN·m",
    ("N m", LBF * INCH): "in-lbf in-lb lb-in lbf·in in.-lb. inlb lbin in*lbf",
    ("N m", OZF * INCH): "oz-in ozf·in in-oz ozin ozf-in",
    ("N m", LBF * 12 * INCH): "ft-lb ft-lbf lb-ft ft·lbs FT-LB lbf*ft",
    ("N m", G0 / 100): "kgf·cm kgf-cm",
    ("N m/rad", 1.0): "N·m/rad Nm/rad Nm",
    ("N m/rad", 1.0 / DEG): "Nm/deg N·m/°",
    ("N m s/rad", 1.0): "Nms/rad N·m·s/rad Nm/(rad/s)",
    ("kg m^2", 1.0): "kgm2 kg·m² kg-m^2 kg*m**2",
    ("kg m^2", 0.45359237 * INCH**2): "lb-in2 lbm·in² lb*in^2",
    ("kg m^2", 1e-7): "gcm2 g·cm²",
    ("N/m", LBF / INCH): "lb/in lbf/in lbf/inch",
    ("kg/m^3", 1000.0): "g/cc g/cm3 g/cm³ gm/cc",
    ("Pa", 1e6): "MPa MPA N/mm² N/mm2",
    ("Pa", LBF / INCH**2): "psi PSI lbf/in² psia",
    ("rad", 1.0): "rad radian radians Radians",
    ("rad", DEG): "deg degree degrees Degrees ° º Grad",
    ("rad", 2.0 * math.pi): "rev revs turn turns revolutions Umdrehungen",
    ("rad/s", DEG): "deg/s dps DPS °/s deg/sec degrees/s degrees°per°second °·s⁻¹",
    ("rad/s", DEG / 1000): "mdps mdeg/s",
    ("rad/s", math.pi / 30.0): "rpm RPM U/min rev/min r/min turns/min upm",
    ("m", 0.001): "mm MM millimeter millimeters Millimetre",
    ("m", 1e-6): "um µm \u03bcm micron microns micrometer",
    ("m", INCH): 'in inch inches Inch in. " Zoll',
    ("m", INCH / 1000): "mil mils thou",
    ("m", 12 * INCH): "ft feet foot Feet",
    ("s", 1.0): "s sec secs second seconds Sekunden Sek. S",
    ("s", 1e-3): "ms msec millisecond milliseconds",
    ("s", 1e-6): "us µs \u03bcs usec microseconds",
    ("s", 60.0): "min minute minutes Minuten",
    ("V", 1.0): "V Volt Volts VOLTS Vdc",
    ("V", 0.001): "mV mVolts millivolts",
    ("A", 0.001): "mA milliamps mAmps",
    ("ohm", 1.0): "ohm Ohms Ω \u2126",
    ("", 0.01): "% percent pct",
    ("", 1.0): "counts Counts LSB digits a.u. ADC",
    ("T", 1e-6): "uT µT",
    ("Hz", 1000.0): "kHz KHZ khz",
    ("m/s", INCH): "in/s ips in/sec",
}  # fmt: skip


@pytest.mark.parametrize(("wanted", "size"), SIZES)
def test_spellings(wanted: str, size: float) -> None:
    for text in SIZES[wanted, size].split():
        text = text.replace("°per°", " per ")
        found = file_unit(text, *([] if wanted is None else [wanted]))
        assert units.parse(f"1 {found}", wanted) == pytest.approx(size, rel=1e-9), (text, found)
        assert units.factor(text, wanted) == pytest.approx(size, rel=1e-9)


@pytest.mark.parametrize(
    ("text", "found"),
    [("g", "g_0"), ("mg", "mg_0"), ("mV/g", "mV/g_0"), ("Nm", "N m"), ("in-lb", "in lbf"), ("lb in^2", "lb in^2"),
     ("mils", "thou"), ('"', "in"), ("pixels", "px"), ("dps", "deg/s"), ("µε", "um/m"), ("°C", "degC"), ("mm", "mm"),
     ("nm", "nm"), ("1", "1"), ("-", ""), ("[-]", ""), ("", ""), ("none", ""), ("%", "percent"), ("kg", "kg"),
     ("m / s ** 2", "m/s^2"), ("V / ( m / s^2 )", "V/( m/s^2 )")],
)  # fmt: skip
def test_a_recording_of_any_quantity(text: str, found: str) -> None:
    assert file_unit(text) == found


@pytest.mark.parametrize(
    ("text", "wanted", "sentence"),
    [
        ("lb", None, "'lb' may be lbf or lb; write one of them"),
        ("oz", None, "'oz' may be ozf or oz"),
        ("NM", None, "'NM' may be nm or N m"),
        ("grad", "rad", "'grad' may be deg or gon"),
        ("tons", "kg", "'tons' may be t or ton"),
        ("mm", "rad", "'mm' is a unit of something else"),
        ("kg", "N", "'kg' is a unit of something else; did you mean 'kgf'"),
        ("nm", "N m", "'nm' is a unit of something else; did you mean 'N m'"),
        ("counts", "rad", "'counts' is a unit of something else"),
        ("1", "rad", "'1' is a unit of something else"),
        ("%", "rad", "'%' is a unit of something else"),
        ("1/min", "rad/s", "'1/min' does not say whether it counts turns or radians; write rpm"),
        ("Hz", "rad s^-1", "'Hz' does not say whether it counts turns or radians"),
        ("rpm", "Hz", "'rpm' is a unit of something else"),
        ("foo", "N m", "'foo' is not a known unit"),
        ("filtered", None, "'filtered' is not a known unit; known: .*mm"),
        ("m/s rms", None, "'m/s rms' is not a known unit; did you mean 'm/s'"),
        ("x" * 200, None, r"'x{40}\.\.\.' is not a known unit"),
        ("9^9^9^9", None, "is not a known unit"),
    ],
)  # fmt: skip
def test_what_is_refused(text: str, wanted: str | None, sentence: str) -> None:
    with pytest.raises(UnitError, match=sentence):
        file_unit(text, *([] if wanted is None else [wanted]))


def test_degrees_celsius_have_no_factor() -> None:
    assert file_unit("°C", "K") == "degC"
    with pytest.raises(UnitError, match="'°C' has another zero than 'K'; write the values in K"):
        units.factor("°C", "K")


@pytest.mark.parametrize(
    ("text", "wanted"),
    [("5 px", "m"), ("60 rpm", "Hz"), ("10 turn/s", "Hz"), ("5 count", "rad"), ("5 %", "rad"), ("5 ppm/s", "rad/s")],
)
def test_what_the_units_library_takes_for_another_quantity(text: str, wanted: str) -> None:
    with pytest.raises(UnitError, match="is a unit of something else"):
        units.parse(text, wanted)
