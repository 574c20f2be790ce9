"""Texts with units: parsed by Pint, and refused by one sentence."""

from __future__ import annotations

import functools
import math
import numbers
import re
from collections.abc import Callable, Mapping, Set
from typing import Any

from evolvent_base import startup

_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)", re.DOTALL)


#: Longest text of a unit, and what none needs: a power of a power, of a number but 10, or above 99, each of which may
#: take the units library forever.
_LONGEST_UNIT = 100


_TOWER = re.compile(
    r"(?:\*\*|\^)(?:[\s(+-]*\d{3}|[\s(+-]*[\d.]+[\s)]*(?:\*\*|\^))"  # m^100, m^2^3
    r"|(?<![A-Za-z_])(?!10\b)\d+[\d.]*\s*(?:\*\*|\^)"  # 9^9
    r"|\d\s*(?:\*\*|\^)\s*\("  # 10^(9*9)
    r"|\)\s*(?:\*\*|\^).*\)\s*(?:\*\*|\^)"  # ((m)^9)^9
)


#: Digits of exponents that stand high.
_RAISED, _LOWERED = re.compile("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+"), str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


#: Units that are read without the units library, which takes a moment to load: factor to the SI unit of the key.
COMMON: dict[str, dict[str, float]] = {
    "": {},
    "m": {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0},
    "s": {"s": 1.0, "ms": 0.001, "min": 60.0, "h": 3600.0},
    "kg": {"kg": 1.0, "g": 0.001},
    "rad": {"rad": 1.0, "deg": math.pi / 180.0},
    "rad/s": {"rad/s": 1.0, "deg/s": math.pi / 180.0, "rpm": math.pi / 30.0},
    "kg m^2": {"kg m^2": 1.0, "g m^2": 0.001},
    "kg/m": {"kg/m": 1.0, "g/m": 0.001},
    "N/m": {"N/m": 1.0, "kN/m": 1000.0},
    "N s/m": {"N s/m": 1.0},
    "Pa": {"Pa": 1.0, "uPa": 1e-6, "MPa": 1e6, "GPa": 1e9},
    "kg/m^3": {"kg/m^3": 1.0, "g/cm^3": 1000.0},
    "m^2": {"m^2": 1.0, "cm^2": 1e-4, "mm^2": 1e-6},
    "m^4": {"m^4": 1.0, "cm^4": 1e-8, "mm^4": 1e-12},
    "N m/rad": {"N m/rad": 1.0, "N m": 1.0},
    "N m s/rad": {"N m s/rad": 1.0, "N m s": 1.0},
    "1/s": {"1/s": 1.0},
    "1/K": {"1/K": 1.0},
    "K": {"K": 1.0},
    "K/m": {"K/m": 1.0},
    "1/m": {"1/m": 1.0},
}


#: SI unit -> units in which people go on reading a value that was written in them.
READ_AS_WRITTEN = {"rad/s": ("rpm",)}
#: Units of contact laws, whose dimension other keys decide (exponent n, law): what may stand for them.
OF_CONTACT = {"N/m^n": r"N/m(\^\d+(\.\d+)?)?", "s/m": "s/m|N s/m"}


#: Largest size of a value, in SI units, and the inverse of the least: far beyond any that can be meant, and near enough
#: for products of several to be finite.
LARGEST = 1e30


#: Deviation of the length of a quaternion from 1 that is taken for rounding; it is then normalised.
UNIT_LENGTH = 1e-3


class UnitError(ValueError):
    """A text that is no value of the wanted kind; the message says why."""


class Measured(float):
    """A value whose unit was given: where another key decides which quantity it must be, or people read that unit.

    Parameters
    ----------
    value : float, in SI units
    unit : str, the SI unit of its quantity
    text : str, as it was written, such as "30 rpm", where its unit is one of `READ_AS_WRITTEN`; else ""
    """

    unit: str
    text: str

    def __new__(cls, value: Any, unit: str = "", text: str = "") -> Measured:
        """The value, which knows its unit."""
        found = super().__new__(cls, value)
        found.unit, found.text = unit, text
        return found

    def __reduce__(self) -> tuple[Any, ...]:
        """How it is copied."""
        return Measured, (float(self), self.unit, self.text)


def is_list(value: Any) -> bool:
    """Whether a value is a list, a tuple or an array: no text, and nothing whose entries have no order."""
    return hasattr(value, "__len__") and not isinstance(value, (str, bytes, Mapping, Set))


def to_float(value: numbers.Real) -> float:
    """`value` as a float; infinite where it is too large for one."""
    try:
        return float(value)
    except OverflowError:
        return math.inf if value == abs(value) else -math.inf


@functools.cache
def _registry() -> Any:
    found = startup.load("pint").UnitRegistry()
    found._units["px"] = found._units["pixel"]  # the library has it as a length, 1/96 in
    return found


def value_in(text: str, unit: str, meant: Callable[[str, str], str] = lambda given, unit: "") -> float:
    """The value of `text` in `unit`.

    Parameters
    ----------
    text : str, a number and a unit ('0.735 g/m', '0.004 kg m^2' or 'kg m2', '30 rpm'); a number alone is in `unit`
    unit : str, the wanted unit, '' for none
    meant : the end of a sentence on a text that is no such unit: the spelling that may be meant

    Raises
    ------
    UnitError
        If the text is not a number with a unit of the same dimension.
    """
    match = split(text)
    if match is None:
        raise UnitError("it is not a number with a unit")
    value, given = float(match[1]), " ".join(match[2].split())
    if not given:
        return value
    if given == unit:
        return value
    if given in COMMON.get(unit, {}):
        return value * COMMON[unit][given]
    if unit in OF_CONTACT:
        if re.fullmatch(OF_CONTACT[unit], given):
            return value
        raise UnitError(f"{given!r} is a unit of something else, or not of SI")
    if unit.startswith("rad") and re.search(r"hertz|Hz\b", given):
        raise UnitError("hertz does not say whether it counts turns or radians")
    if unit.startswith("rad") and re.search(
        r"(?<![A-Za-z])(counts?|percent|ppm|dB|decibel|bits?)(?![A-Za-z])|%", given
    ):
        raise UnitError(f"{cut(given)!r} is a unit of something else; an angle is in rad or deg")
    if unit == "Hz" and re.search(r"rpm|(?<![A-Za-z])(rad|deg|turn|rev)", given):
        raise UnitError(f"{cut(given)!r} is a unit of something else; a frequency is in Hz or 1/s")
    exponents = re.sub(r"(?<=[A-Za-z])(-?[2-6])(?![\w.])", r"^\1", given)  # "kg m2" and "m/s2" as well
    try:
        return float(_registry().Quantity(value, known(exponents)).to(known(unit)).magnitude)
    except startup.load("pint").DimensionalityError:
        raise UnitError(_wrong(given, "is a unit of something else", meant(exponents, unit))) from None
    except Exception:  # noqa: BLE001  (the units library raises many kinds of errors on what it cannot read)
        raise UnitError(_wrong(given, "is not a known unit", meant(exponents, unit))) from None


def _wrong(given: str, why: str, hint: str) -> str:
    """A sentence on a unit, with the spelling that may be meant; where this only has spaces, they are what is wrong."""
    spelt = re.search(r"'(.*)'", hint)
    joined = spelt is not None and spelt[1].replace(" ", "") == given.replace(" ", "")
    return f"{cut(given)!r} {'joins units without a space' if joined else why}{hint}"


def known(unit: str) -> Any:
    """A unit as the units library holds it.

    Raises
    ------
    UnitError
        If the library does not know it, or could take very long to read it.
    """
    try:
        plain = _RAISED.sub(lambda digits: f"^{digits[0]}".translate(_LOWERED), unit)
        if len(unit) <= _LONGEST_UNIT and not _TOWER.search(plain):
            return _registry().parse_units(unit)
    except Exception:  # noqa: BLE001  (see `value_in`)
        pass
    raise UnitError(f"{cut(unit)!r} is not a known unit")


def cut(text: str) -> str:
    """A text, the beginning alone of one that is longer than a unit."""
    return text if len(text) <= _LONGEST_UNIT else f"{text[:40]}..."


def split(text: Any) -> re.Match[str] | None:
    """A number in group 1 and what follows it in group 2; None of what begins with no number."""
    return _NUMBER.fullmatch(text.strip()) if isinstance(text, str) else None


def base_exponents(unit: str) -> dict[str, float] | None:
    """Exponents of base units, by their full names, in a coherent unit of SI; None of what is no such unit."""
    try:
        found = _registry().Quantity(1.0, known(unit)).to_base_units()
    except Exception:  # noqa: BLE001  (see `value_in`)
        return None
    return dict(found.units._units) if found.magnitude == 1.0 else None


def unit_text(unit: str) -> str:
    """A unit as a figure shows it: 'kg m2 s-1' -> 'kg m²/s'."""
    powers = str.maketrans("234", "²³⁴")
    above: list[str] = []
    below: list[str] = []
    for word in unit.split():
        letters = word.rstrip("-0123456789")
        power = word[len(letters) :]
        (below if power.startswith("-") else above).append(
            letters + power.lstrip("-").replace("1", "").translate(powers)
        )
    top = " ".join(above) or "1"
    if not below:
        return top if above else unit
    return f"{top}/{below[0]}" if len(below) == 1 else f"{top}/({' '.join(below)})"
