"""Values with a standard uncertainty, as texts."""

from __future__ import annotations

import math

import pytest
from pydantic_core import PydanticCustomError

from evolvent_base import units
from evolvent_massprops.rounding import rounded, shown
from evolvent_massprops.uncertain import Measured, Uncertain

STIFFNESS = Measured(
    quantity=units.Quantity(what="a stiffness", unit="N/m", example="740 kN/m", above=0.0), unknown=True
)


@pytest.mark.parametrize(
    ("text", "value", "std"),
    [
        (740250, 740250.0, 0.0),
        ("740250 N/m", 740250.0, 0.0),
        ("740250 +- 740 N/m", 740250.0, 740.0),
        ("740.25 kN/m ± 740 N/m", 740250.0, 740.0),
        ("740.25 kN/m +/- 0.74", 740250.0, 740.0),
        ("740250 N/m +- 0.1 %", 740250.0, 740.25),
        ("740250 +- 0.1%", 740250.0, 740.25),
        ("7.4e5 +- 1e+2 N/m", 7.4e5, 100.0),
        ({"value": "740 kN/m", "std": "1 kN/m"}, 740e3, 1e3),
        ({"value": 740e3}, 740e3, 0.0),
    ],
)
def test_ways_to_write(text: object, value: float, std: float) -> None:
    found = STIFFNESS.read(text)
    assert (found.value, found.std, found.unknown) == (pytest.approx(value), pytest.approx(std), False)
    assert STIFFNESS.read(STIFFNESS.write(found)) == found


def test_unknowns() -> None:
    assert math.isnan(STIFFNESS.read("unknown").value)
    assert STIFFNESS.read("unknown near 740 +- 1 kN/m") == Uncertain(740e3, 1e3, True)
    assert STIFFNESS.write(STIFFNESS.read("unknown")) == "unknown"
    assert STIFFNESS.read(STIFFNESS.write(Uncertain(740e3, 1e3, True))) == Uncertain(740e3, 1e3, True)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("740 kg", "'kg' is a unit of something else"),
        ("740 N/m +- 1 kg", "'kg' is a unit of something else"),
        ("740 +- -1 N/m", "a standard uncertainty is 0 or above"),
        ("740 +- 1 +- 2 N/m", "more than one +-"),
        ("-3 N/m", "above 0"),
        ("+- 3", "both sides of"),
        ({"value": 1, "sigma": 2}, "value and std only"),
        (True, "not a number"),
        ([1, 2], "not a number"),
        ("unknown perhaps", "not a number"),
    ],
)
def test_what_is_refused(text: object, said: str) -> None:
    with pytest.raises(PydanticCustomError) as error:
        STIFFNESS.read(text)
    assert said in str(error.value)
    assert "740 kN/m" in str(error.value)


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        (0.2348635, 0.000109, "0.23486 ± 0.00011"),
        (43917.56, 28.17, "43918 ± 28"),
        (43917.56, 283.0, "43920 ± 280"),
        (1.0, 0.0996, "1.00 ± 0.10"),
        (0.0, 0.0005, "0.00000 ± 0.00050"),
        (3.5, 0.0, "3.5"),
        (float("nan"), 1.0, "-"),
    ],
)
def test_numbers_are_rounded_to_their_deviation(value: float, std: float, text: str) -> None:
    assert shown(value, std) == text


def test_tiny_deviations_keep_their_digits() -> None:
    assert float(rounded(1.23456789012e-12, 1.2e-16)) == pytest.approx(1.23456789012e-12, abs=1e-16)
