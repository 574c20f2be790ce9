"""Temperatures and long times as people read them."""

from __future__ import annotations

import pytest

from evolvent_base.scales import YEAR, celsius, named_times, shown_time


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0, "0 s"), (61.0, "61 s"), (60.0, "1 min"), (600.0, "10 min"), (3600.0, "1 h"), (1e5, "27.78 h"),
        (86400.0, "1 day"), (30 * 86400.0, "30 days"), (YEAR, "1 year"), (10.0 * YEAR, "10 years"),
        (YEAR * (1.0 - 1e-12), "1 year"), (-1.0, "-1 s"),
    ],
)  # fmt: skip
def test_times_are_said_in_the_largest_unit(seconds: float, text: str) -> None:
    assert shown_time(seconds) == text


def test_temperatures_are_said_in_celsius() -> None:
    assert celsius(293.15) == "20 degC"


def test_an_axis_of_times_names_those_on_it() -> None:
    assert list(named_times(3.6, 10.0 * YEAR).values()) == [
        "10 s", "1 min", "10 min", "1 h", "1 day", "10 days", "1 year", "10 years",
    ]  # fmt: skip
    assert len(named_times(1e-9, 1e6 * YEAR)) <= 12
    assert named_times(11.0, 50.0) == {}
