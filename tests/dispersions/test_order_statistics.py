"""Bounds and quantiles from order statistics: their confidence is what they state."""

import math

import numpy as np
import pytest

from evolvent.design.dispersions import order


def test_59_runs_are_the_fewest_for_95_95():
    assert order.least_runs(0.95, 0.95) == 59
    assert order.confidence(59, 59, 0.95) == pytest.approx(1.0 - 0.95**59, rel=1e-12)
    assert order.confidence(58, 58, 0.95) < 0.95 < order.confidence(59, 59, 0.95)
    assert order.least_runs(0.90, 0.95) == 29
    assert order.least_runs(0.99, 0.95) == 299
    assert order.least_runs(0.5, 0.5) == 1


def test_ranks_are_the_lowest_that_suffice():
    # published sample sizes of 95/95 by the second and third most extreme value: 93 and 124
    for runs, rank in ((59, 59), (92, 92), (93, 92), (123, 122), (124, 122)):
        assert order.upper_rank(runs, 0.95, 0.95) == rank
    for n in (59, 200, 1000):
        rank = order.upper_rank(n, 0.95, 0.95)
        assert order.confidence(n, rank, 0.95) >= 0.95 > order.confidence(n, rank - 1, 0.95)
    assert order.upper_rank(58, 0.95, 0.95) is None
    assert order.upper_rank(0, 0.95, 0.95) is None


@pytest.mark.parametrize("upper", [True, False])
def test_a_bound_covers_as_often_as_it_states(upper):
    """Of 1000 bounds from 59 runs, 95.15 % lie beyond the quantile of the closed form, within its spread."""
    rng = np.random.default_rng(11)
    quantile = -math.log(1.0 - 0.95) if upper else -math.log(0.95)  # of an exponential distribution
    hits = 0
    for _ in range(1000):
        found = order.bound(rng.exponential(size=59), 0, upper=upper, coverage=0.95, wanted=0.95)
        assert found.rank == 1
        hits += found.value >= quantile if upper else found.value <= quantile
    assert 930 <= hits <= 970
    assert found.confidence == pytest.approx(0.9515, abs=5e-5)


def test_fewer_runs_give_no_bound_and_say_what_they_give():
    found = order.bound(np.arange(30.0), 0, upper=True, coverage=0.95, wanted=0.95)
    assert math.isnan(found.value)
    assert found.confidence == pytest.approx(1.0 - 0.95**30)
    assert found.why == "30 runs give a confidence of 78.5 %; 59 are needed for 95 %"


def test_a_run_without_a_value_is_beyond_every_bound():
    values = np.arange(92.0)
    whole = order.bound(np.arange(93.0), 0, upper=True, coverage=0.95, wanted=0.95)
    assert (whole.value, whole.rank) == (91.0, 2)
    upper = order.bound(values, 1, upper=True, coverage=0.95, wanted=0.95)
    lower = order.bound(values, 1, upper=False, coverage=0.95, wanted=0.95)
    assert (upper.value, upper.rank) == (91.0, 2)
    assert (lower.value, lower.rank) == (0.0, 2)
    none = order.bound(values, 2, upper=True, coverage=0.95, wanted=0.95)
    assert math.isnan(none.value)
    assert "2 of 94 runs have no value and count as beyond the bound" in none.why
    assert none.confidence < 0.95


def test_intervals_of_quantiles_cover_as_often_as_they_state():
    rng = np.random.default_rng(5)
    inside = 0
    for _ in range(500):
        (found,) = order.quantiles(rng.uniform(size=80), 0, (0.5,), 0.95, independent=True)
        assert found.low <= found.value <= found.high
        inside += found.low <= 0.5 <= found.high
    assert inside >= 465  # at least 95 %, within its spread
    (edge,) = order.quantiles(np.arange(20.0), 0, (0.99,), 0.95, independent=True)
    assert edge.high == math.inf
    (dependent,) = order.quantiles(np.arange(20.0), 0, (0.5,), 0.95, independent=False)
    assert math.isnan(dependent.low)


def test_the_interval_of_a_probability_of_failure():
    low, high = order.failure_interval(0, 59, 0.95)
    assert low == 0.0
    assert high == pytest.approx(1.0 - 0.025 ** (1.0 / 59.0), rel=1e-9)
    low, high = order.failure_interval(3, 100, 0.95)
    assert (low, high) == (pytest.approx(0.00623, abs=1e-4), pytest.approx(0.08518, abs=1e-4))  # Clopper and Pearson
    assert order.failure_interval(10, 10, 0.95)[1] == 1.0
