"""VARPRO reaches the Cramér-Rao bound, its intervals cover, and the order is found, in seeded trials."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from book import Book
from evolvent_massprops.identification import cramer_rao, identify, varpro
from massprops.identification.setups import DURATION, SETUPS, three_modes

TRIALS = 500
#: Worst frequency RMSE over its bound, and what 500 trials leave open of an RMSE (two deviations, 1 / sqrt(2 n) each).
GOAL, OPEN = 1.08, 2.0 / np.sqrt(2 * TRIALS)
CASES = [(key, length) for key in SETUPS for length in (100, 1000)]


@functools.cache
def trials(key: str, length: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n, m) errors of frequency, (n, 2 m) standard scores of the poles, (m,) bounds; any failure would raise."""
    setup = SETUPS[key]()
    m, rate = len(setup.frequency), length / DURATION
    amplitude = np.abs(setup.amplitude)
    bound = cramer_rao(
        setup.frequency,
        setup.decay_rate,
        amplitude,
        phase=np.angle(setup.amplitude),
        rate=rate,
        length=length,
        noise=setup.noise,
    )
    rng = np.random.default_rng(2002)
    errors, scores = [], []
    for _ in range(TRIALS):
        modes = varpro(setup.samples(length, rng), m, rate=rate)
        frequency, decay = modes.frequency - setup.frequency, modes.decay_rate - setup.decay_rate
        errors.append(frequency)
        scores.append(np.concatenate((frequency / modes.frequency_std, decay / modes.decay_rate_std)))
    return np.array(errors), np.array(scores), np.sqrt(np.diag(bound)[:m])


@pytest.mark.slow
@pytest.mark.parametrize(("key", "length"), CASES)
def test_frequencies_reach_the_bound(key: str, length: int, book: Book) -> None:
    errors, _, bound = trials(key, length)
    ratio = np.sqrt(np.mean(errors**2, axis=0)) / bound
    assert ratio.max() <= GOAL + OPEN
    assert ratio.min() >= 1.0 - 2.0 * OPEN
    assert np.all(np.abs(errors.mean(axis=0)) < 4.0 * bound / np.sqrt(TRIALS))
    book(
        "Inertia stand and identification", f"Frequencies by VARPRO, {key}, {length} samples: RMSE over the bound",
        reference="1 (500 trials leave 6 % open)", source="Cramer-Rao bound", error=abs(ratio - 1.0).max(),
        allowed=GOAL + OPEN - 1.0,
    )  # fmt: skip


@pytest.mark.parametrize(("key", "length"), CASES)
def test_intervals_cover(key: str, length: int, book: Book) -> None:
    """95 % intervals of frequency and decay rate hold 93 to 97 % of the trials, all modes of a set-up together."""
    _, scores, _ = trials(key, length)
    m = scores.shape[1] // 2
    inside = np.abs(scores) < 1.959964
    assert 0.93 <= inside[:, :m].mean() <= 0.97
    assert 0.93 <= inside[:, m:].mean() <= 0.97
    book(
        "Inertia stand and identification", f"Intervals of 95 %, {key}, {length} samples: coverage", reference="0.95",
        source="500 seeded trials", error=abs(inside[:, :m].mean() - 0.95), allowed=0.02,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("length", "records"), [(100, 30), *(pytest.param(n, 100, marks=pytest.mark.release) for n in (100, 1000))]
)
@pytest.mark.parametrize("key", SETUPS)
def test_order_is_found(key: str, length: int, records: int) -> None:
    """In at least 99 of 100 records."""
    setup = SETUPS[key]()
    rng = np.random.default_rng(77)
    found = [identify(setup.samples(length, rng), rate=length / DURATION).order for _ in range(records)]
    assert np.mean(np.array(found) == len(setup.frequency)) >= 0.99


@pytest.mark.slow
@pytest.mark.parametrize("length", [100, 1000])
def test_a_weak_fourth_mode_is_found(length: int) -> None:
    """A mode of 2 % of the others' amplitude, two deviations of the noise, is found; without it another is off."""
    setup = three_modes()
    t = DURATION / length * np.arange(length)
    weak = 0.02 * np.outer(np.exp(-0.06 * t) * np.cos(15.0 * t + 1.0), [1.0, -1.0, -1.0, 1.0])
    rng = np.random.default_rng(78)
    for _ in range(10):
        data = setup.samples(length, rng) + weak
        modes = identify(data, rate=length / DURATION)
        assert modes.order == 4
        assert abs(modes.frequency[1] - 15.0) < 5.0 * modes.frequency_std[1]
    three = varpro(data, 3, rate=length / DURATION)
    assert any("not white" in sentence for sentence in three.warnings)


def test_a_mode_left_out_biases_another() -> None:
    """At one sensor, a weak neighbour that is left out moves a frequency by 40 to 200 parts in a million."""
    length = 1000
    t = DURATION / length * np.arange(length)
    clean = three_modes().clean(length)[:, 0] + 0.02 * np.exp(-0.06 * t) * np.cos(15.0 * t + 1.0)
    off = varpro(clean, 3, rate=length / DURATION).frequency[0] / 14.0 - 1.0
    assert 40e-6 < abs(off) < 200e-6
    assert abs(varpro(clean, 4, rate=length / DURATION).frequency[0] / 14.0 - 1.0) < 1e-9
