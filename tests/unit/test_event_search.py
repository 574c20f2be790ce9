"""Events between the ends of a step: what the search finds, and how often it asks for the values."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np
import pytest

from evolvent.solvers.time.event_search import END, START, EventSearch, begin_search, next_row, room


def found(*values: Callable[[float], float], always: bool = False) -> tuple[float, float, int]:
    """Parts of a step between which the first event rises, NaN for none; and the number of evaluations."""
    search: EventSearch = room(np.full(len(values), always))
    for row in (START, END):
        search.values[row] = [one(float(search.place[row])) for one in values]
    begin_search(search)
    count = 0
    while (row := int(next_row(search))) >= 0:
        search.values[row] = [one(float(search.place[row])) for one in values]
        count += 1
    if int(search.state["high"]) < 0:
        return math.nan, math.nan, count
    return float(search.place[int(search.state["low"])]), float(search.place[int(search.state["high"])]), count


@pytest.mark.parametrize("width", [0.1, 1e-3, 1e-5])
def test_a_peak_of_any_place_is_found(width: float) -> None:
    """Kinks, parabolas and quartics that are above zero for a part `width` of the step; at most 200 evaluations."""
    rng = np.random.default_rng(7)
    for _ in range(60):
        at, half = rng.uniform(0.05, 0.95), 0.5 * width
        for value in (
            lambda u, at=at, half=half: half - abs(u - at),
            lambda u, at=at, half=half: half**2 - (u - at) ** 2,
            lambda u, at=at, half=half: half**2 - (u - at) ** 2 * (1.0 + 3.0 * (u - at) ** 2),
            lambda u, at=at, half=half: (half - abs(u - at)) / (1.0 + abs(u - at)),
        ):
            low, high, count = found(value)
            assert low <= at - half <= high
            assert value(high) >= 0.0 > value(low)
            assert count < 200


def test_a_dip_is_found_where_it_ends() -> None:
    """A value that falls below zero and rises again in the step, from above zero: the rise is the event."""
    for at in np.linspace(0.03, 0.97, 48):
        low, high, _ = found(functools.partial(lambda at, u: abs(u - at) - 1e-4, float(at)))
        assert low <= at + 1e-4 <= high
        assert abs(low - at) < 1e-4
    assert math.isnan(found(lambda u: abs(u - 0.4321) + 1e-9)[0])


def test_every_period_is_seen() -> None:
    """The first rise of a value with up to three periods in the step."""
    for rate in np.linspace(6.5, 19.0, 26):
        low, high, _ = found(functools.partial(lambda rate, u: math.sin(rate * u + 1.3) - 0.9, float(rate)))
        first = (math.asin(0.9) - 1.3 + 2.0 * math.pi * (math.asin(0.9) < 1.3)) / rate
        assert low <= first <= high


def test_values_far_from_zero_cost_three_evaluations() -> None:
    """As does one that approaches zero from afar; one that stays at zero, or is not a number, is no event."""
    for value in (lambda u: -1.0, lambda u: math.sin(u) - 2.0, lambda u: u - 1.2, lambda u: 1.0 + u * u):
        assert found(value)[2] == 3
    assert math.isnan(found(lambda u: 0.0)[0])
    assert math.isnan(found(lambda u: math.nan)[0])


def test_the_first_of_several_events_is_found() -> None:
    """Two events that rise and fall in one step, the second of them before the first."""
    low, high, _ = found(lambda u: 1e-3 - abs(u - 0.7), lambda u: 1e-3 - abs(u - 0.3))
    assert low <= 0.299 <= high


def test_an_event_that_is_always_due() -> None:
    """Events of threads fire from zero on, also where their values jump."""
    low, high, _ = found(lambda u: -1.0 if u < 0.37 else 0.5 - abs(u - 0.4), always=True)
    assert low < 0.37 <= high
