"""Noise that sensors share: intervals hold, it is said, and the copy of a sensor is refused."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent_base.errors import InputError
from evolvent_massprops.identification import identify, varpro
from massprops.identification.setups import DURATION, stand, three_modes


@pytest.mark.slow
@pytest.mark.parametrize("setup", [three_modes(), stand()], ids=["three", "stand"])
def test_intervals_hold_under_shared_noise(setup) -> None:
    """Independent noise assumed, heave's scores would scatter by 1.6 to 2.0 and the others' by 0.3."""
    length, rng = 200, np.random.default_rng(12)
    scores, amplitudes = [], []
    for _ in range(60):
        shared = 3.0 * setup.noise * rng.standard_normal((length, 1))
        modes = varpro(setup.samples(length, rng) + shared, 3, rate=length / DURATION)
        scores.append((modes.frequency - setup.frequency) / modes.frequency_std)
        amplitudes.append((modes.amplitude - np.abs(setup.amplitude)) / modes.amplitude_std)
        assert len(modes.warnings) == 1
        assert "share noise: all sensors were weighted by the joint covariance" in modes.warnings[0]
        np.testing.assert_allclose(modes.fitted, modes.predict(modes.time), atol=1e-12)
    for values in (scores, amplitudes):
        spread = np.sqrt(np.mean(np.square(values), axis=0))
        assert 0.7 < spread.min()
        assert spread.max() < 1.35


def test_shared_noise_misleads_no_order() -> None:
    setup, rng = three_modes(), np.random.default_rng(13)
    for _ in range(5):
        data = setup.samples(200, rng) + 3.0 * setup.noise * rng.standard_normal((200, 1))
        modes = identify(data, rate=200 / DURATION)
        assert modes.order == 3
        assert not any("white" in sentence for sentence in modes.warnings)


def test_independent_noise_is_not_taken_for_shared() -> None:
    setup, rng = three_modes(), np.random.default_rng(14)
    for _ in range(50):
        assert not varpro(setup.samples(100, rng), 3, rate=100 / DURATION).warnings


def test_with_gaps_shared_noise_is_told() -> None:
    setup, rng = three_modes(), np.random.default_rng(15)
    data = setup.samples(200, rng) + 3.0 * setup.noise * rng.standard_normal((200, 1))
    data[50, 1] = np.nan
    assert any(
        "assume it to be independent and are too small" in said
        for said in varpro(data, 3, rate=200 / DURATION).warnings
    )


@pytest.mark.parametrize("copy", [lambda x: x, lambda x: 2.0 - 3.0 * x], ids=["same", "scaled"])
@pytest.mark.parametrize("order", [3, None])
def test_a_copy_of_a_sensor_is_refused(copy, order) -> None:
    """It would make the deviations smaller by up to sqrt 2."""
    x = three_modes().samples(200, np.random.default_rng(16))
    with pytest.raises(InputError, match="sensor 5 is a copy of sensor 2, including its noise, and would count twice"):
        identify(np.column_stack([x, copy(x[:, 1])]), rate=200 / DURATION, order=order)


def test_like_signals_without_noise_are_no_copies() -> None:
    """Sensors that move alike, as all do in pure heave."""
    t = np.arange(300) / 25.0
    x = np.exp(-0.1 * t) * np.cos(14.0 * t)
    assert identify(np.column_stack([x, x]), rate=25.0, order=1).frequency[0] == pytest.approx(14.0, rel=1e-9)
