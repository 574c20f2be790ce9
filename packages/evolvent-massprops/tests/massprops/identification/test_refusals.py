"""Signals that hold no answer are refused in one sentence that names what, where and what is allowed."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent_base.errors import InputError
from evolvent_massprops.identification import (
    IdentifiedModes,
    automatic,
    cramer_rao,
    esprit,
    identify,
    matrix_pencil,
    prony,
    tls_prony,
    varpro,
)
from evolvent_massprops.identification.signals import read_signal
from evolvent_massprops.identification.subspace import candidates
from evolvent_massprops.identification.variable_projection import evaluate

RATE = 50.0


def ringing(length: int = 600, noise: float = 0.01) -> np.ndarray:
    t = np.arange(length) / RATE
    x = np.exp(-0.1 * t) * np.cos(14.0 * t + 0.3) + np.exp(-0.05 * t) * np.cos(22.0 * t)
    return x + noise * np.random.default_rng(length).standard_normal(length)


X = ringing()
UNEVEN = np.arange(600) + 0.1 * np.sin(np.arange(600))
GAP = np.where(np.arange(600) == 7, np.nan, X)


@pytest.mark.parametrize(
    ("data", "options", "words"),
    [
        (X[:5], {}, "5 samples; at least 8"),
        ([[1.0, 2.0], [1.0]], {}, "unequal lengths"),
        (["a", "b"], {}, "not an array of numbers"),
        (np.zeros((4, 4, 4)), {}, r"shape \(4, 4, 4\)"),
        (np.array([X, X]), {}, r"must be \(samples, sensors\)"),
        ({"left": X, "right": X[:500]}, {}, "left: 600, right: 500"),
        ({"left": X, "right": np.full(600, 3.0)}, {}, r"right is constant \(3\): a dead sensor"),
        ({"left": X, "right": np.full(600, np.nan)}, {}, "right is NaN everywhere"),
        (np.full((600, 2), np.nan), {}, "data is NaN everywhere"),
        ({"left": np.where(np.arange(600) == 7, np.inf, X)}, {}, "left is infinite at sample 7"),
        ({"left": np.clip(X, -1.2, 1.2)}, {}, "left is clipped or held: .* highest value 1.2"),
        ({"left": np.clip(X, -1.2, 9.0)}, {}, "lowest value -1.2"),
        (X + 1j, {}, "data is complex; give real samples"),
        ({"left": X, "right": X + 1j}, {}, "data is complex"),
        (1e200 * X, {}, r"sensor 1 has values of up to .*e\+200; use a unit"),
        (1e-200 * X, {}, "sensor 1 has values of up to .*e-200; use a unit"),
        (X, {"order": "all"}, "order is 'all'; .* or 'auto'"),
        (X, {"names": ["a", "b"]}, "must be 1 different names"),
        (X, {"rate": 0.0}, "rate is 0.0"),
        (X, {"rate": 1e300}, r"rate is 1e\+300 .*between 1e-12 and 1e\+12"),
        (X, {"rate": 1e-300}, "rate is 1e-300 .*between"),
        (X, {"rate": None}, "either rate"),
        (X, {"time": np.arange(600)}, "not both"),
        (X, {"rate": None, "time": np.arange(500)}, "time has 500 values and data 600"),
        (X, {"rate": None, "time": np.arange(600)[::-1]}, "does not rise at sample 2 .*finite and rise"),
        (X, {"rate": None, "time": np.zeros(600)}, "all 600 samples have the same time, 0 s"),
        (X, {"rate": None, "time": np.minimum(np.arange(600), 300)}, "does not rise at sample 302"),
        (X, {"rate": None, "time": np.where(np.arange(600) == 7, np.nan, np.arange(600))}, "first at sample 8"),
        (X, {"rate": None, "time": 1e-300 * np.arange(600)}, "1e-300 s apart, where 1e-12 s to"),
        (X, {"rate": None, "time": 1e300 * np.arange(600)}, r"1e\+300 s apart, where 1e-12 s to"),
        (X, {"rate": None, "time": 1e305 * (np.arange(600) - 300)}, r"1e\+305 s apart"),
        (
            X,
            {"rate": None, "time": np.where(np.arange(600) < 300, 0.0, 1e6) + np.arange(600)},
            "sample 301 is 1e",
        ),
        (X, {"rate": None, "time": np.arange(600) % 400}, "at sample 401 .*the clock started again there"),
        (X, {"rate": None, "time": np.arange(600)[::-1]}, "it falls 599 times in all: sort"),
        (X, {"rate": None, "time": np.sort(np.append(np.arange(599), 7))}, "1 of 600 samples have the time of the one"),
        (X, {"rate": None, "time": UNEVEN, "method": "esprit"}, "the time is not even, but esprit needs even times"),
        (X, {"rate": None, "time": UNEVEN, "order": 2, "method": "prony"}, "not even, but prony needs even times"),
        (X, {"rate": None, "time": UNEVEN, "order": 2, "method": "tls_prony"}, "not even, but tls_prony needs"),
        (X, {"rate": None, "time": UNEVEN, "order": 2, "method": "matrix_pencil"}, "not even, but matrix_pencil needs"),
        (X, {"band": (10.0, 200.0)}, "nothing above 157.08 rad/s .*sample at 63.662 Hz or more"),
        (X, {"band": (20.0, 10.0)}, "0 <= low < high"),
        (X, {"band": (40.0, 80.0)}, "no mode is above the noise"),
        (X, {"noise": [1.0, 2.0]}, "one number or 1"),
        (X, {"noise": -1.0}, "finite and above 0"),
        (X, {"detrend": "lineal"}, "did you mean 'linear'"),
        (X, {"method": "espirt"}, "did you mean 'esprit'"),
        (X, {"order": 0}, "whole number of modes"),
        (X, {"order": 2.0}, "whole number of modes"),
        (X, {"order": 100}, "they allow 74 modes"),
        (X, {"highest_order": 0}, "highest_order is 0"),
        (GAP, {"order": 2, "method": "esprit"}, "misses 1 samples; esprit needs all"),
        (GAP, {"order": 2, "method": "prony"}, "prony needs all"),
        (GAP, {"order": 2, "method": "tls_prony"}, "tls_prony needs all"),
        (GAP, {"order": 2, "method": "matrix_pencil"}, "matrix_pencil needs all"),
        (X, {"order": 2, "band": (20.0, 30.0)}, "the data do not support 2 modes"),
    ],
)
def test_refused(data: object, options: dict, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        identify(data, **{"rate": RATE, **options})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("scale", [1e74, 1e-74])
def test_any_unit_within_reason_and_order_auto(scale: float) -> None:
    found = identify(scale * X, rate=RATE, order="auto")
    np.testing.assert_allclose(found.frequency, identify(X, rate=RATE).frequency, rtol=1e-9)
    assert np.all(np.isfinite(found.covariance))


def test_noise_alone_is_refused() -> None:
    rng = np.random.default_rng(7)
    for _ in range(5):
        with pytest.raises(InputError, match="no mode is above the noise"):
            identify(rng.standard_normal((300, 2)), rate=RATE)


@pytest.mark.parametrize("order", [3, None])
def test_equations_without_a_solution_are_refused(order: int | None, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*given: object, **options: object) -> None:
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setitem(automatic.METHODS, "esprit", fails)
    with pytest.raises(InputError, match=r"esprit cannot find .* modes: .*\(Singular matrix\); use fewer modes"):
        identify(X, rate=RATE, order=order, method="esprit")


def test_poles_that_grow_or_decay_beyond_the_record_are_no_candidates() -> None:
    """exp(700 s x 1.1 1/s) is no number; nor has a mode that is gone within a sample an amplitude."""
    signal = read_signal(np.tile(X, 70)[:35000], rate=RATE)
    poles = np.array([1.1 + 14.0j, -0.1 + 14.0j, 0.01 + 20.0j, -300.0 + 20.0j, -0.1 + 200.0j])
    assert candidates(poles, signal).tolist() == [-0.1 + 14.0j, 0.01 + 20.0j]


def test_a_pole_that_does_not_oscillate_has_a_finite_amplitude() -> None:
    """Its sine is nought at every sample."""
    point = evaluate(np.array([-0.1 + 0.0j]), read_signal(X, rate=RATE))
    assert np.all(np.isfinite(point.coefficients))
    with pytest.raises(InputError, match="the data do not support 1 modes"):
        identify(X, rate=RATE, order=1, band=(0.0, 1e-5))


def test_too_few_samples_of_one_sensor() -> None:
    data = np.column_stack([X[:60], X[:60]])
    data[25:, 1] = np.nan
    with pytest.raises(InputError, match="order 4 asks too much of sensor 2, which has 25 samples: they allow 2 modes"):
        varpro(data, 4, rate=RATE)


@pytest.mark.parametrize("start", [[14.0j], [14.0j, -22.0j], [14.0j, 200.0j], [14.0j, np.nan], [14.0j, 14.0j]])
def test_bad_start(start: list) -> None:
    with pytest.raises(InputError, match="start is"):
        varpro(X, 2, rate=RATE, start=start)


def test_prony_samples_per_period() -> None:
    with pytest.raises(InputError, match="must be above 2"):
        prony(X, 2, rate=RATE, samples_per_period=2.0)
    with pytest.raises(InputError, match="every 5-th sample leaves 20; prony of order 11 needs 46"):
        prony(ringing(96), 11, rate=RATE, samples_per_period=2.2, band=(0.0, 24.0))


def test_bound_arguments() -> None:
    with pytest.raises(InputError, match="at least 6 samples"):
        cramer_rao(14.0, 0.1, 1.0, rate=50.0, length=5, noise=0.1)
    with pytest.raises(InputError, match="detrend"):
        cramer_rao(14.0, 0.1, 1.0, rate=50.0, length=50, noise=0.1, detrend="none")
    with pytest.raises(InputError, match="amplitude has shape"):
        cramer_rao([14.0, 15.0], 0.1, np.ones((3, 2)), rate=50.0, length=50, noise=0.1)


def test_accepted_though_flat_here_and_there() -> None:
    """Coarse steps of a converter, and a sine sampled evenly over its period, are not taken for clipping."""
    t = np.arange(600) / RATE
    for data in (np.round(X, 1), np.round(X, 2), np.round(1000.0 * ringing(noise=0.0))):
        assert identify(data, rate=RATE).order == 2
    assert identify(np.cos(2.0 * np.pi * 6.25 * t), rate=RATE).order == 1


def test_what_the_data_do_not_support_is_said() -> None:
    def warned(modes: IdentifiedModes, words: str) -> bool:
        return any(words in sentence for sentence in modes.warnings)

    t = np.arange(600) / RATE
    noise = 0.01 * np.random.default_rng(5).standard_normal(600)
    assert not identify(X, rate=RATE).warnings
    assert warned(identify(X, rate=RATE, order=1), "not white")
    assert warned(identify(X, rate=RATE, order=3), "not above the noise")
    # two sensors that see the modes alike, and deviations of the frequencies near their distance
    beat = np.exp(-0.1 * t) * (np.cos(14.0 * t) + np.cos(14.1 * t + 1.5))
    few = varpro(beat + 20.0 * noise, 2, rate=RATE, start=[14.0j, 14.1j])
    assert warned(few, "cannot be distinguished") or warned(few, "not above the noise")
    assert warned(identify(np.exp(0.3 * t) * np.cos(14.0 * t) + noise, rate=RATE), "grows")
    assert warned(identify(X + np.cos(0.2 * t), rate=RATE), "less than one period")


@pytest.mark.parametrize("method", [esprit, matrix_pencil, tls_prony, prony])
def test_methods_without_covariance_give_no_deviations(method: object) -> None:
    modes = method(X, 2, rate=RATE)
    assert np.all(np.isnan(modes.frequency_std))
    assert np.all(np.isnan(modes.amplitude_std))
