"""What the methods return: exact on clean signals, consistent with its own model, gaps and unequal sensors."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from book import Book
from evolvent_massprops.identification import (
    IdentifiedModes,
    esprit,
    frequencies_in,
    identify,
    matrix_pencil,
    mode_variables,
    prony,
    recorded,
    tls_prony,
    varpro,
)
from evolvent_massprops.identification.signals import exponentials
from massprops.identification.setups import DURATION, SETUPS, Setup, stand, three_modes


@pytest.mark.parametrize("method", [varpro, esprit, matrix_pencil, tls_prony, prony])
@pytest.mark.parametrize("length", [128, 1000])
def test_exact_without_noise(method: object, length: int, book: Book) -> None:
    setup = three_modes()
    modes = method(setup.clean(length), 3, rate=length / DURATION)
    np.testing.assert_allclose(modes.frequency, setup.frequency, rtol=1e-8)
    np.testing.assert_allclose(modes.decay_rate, setup.decay_rate, rtol=1e-6)
    np.testing.assert_allclose(modes.complex_amplitude, setup.amplitude, atol=1e-7)
    np.testing.assert_allclose(modes.offset, [0.5, -0.2, 0.1, 0.0], atol=1e-7)
    if length == 1000:
        book(
            "Inertia stand and identification",
            f"Three modes without noise, {method.__name__}, {length} samples: frequencies", reference="put in",
            source="there and back", error=np.abs(modes.frequency / setup.frequency - 1.0).max(), allowed=1e-8,
        )  # fmt: skip


@pytest.mark.parametrize("setup", [build() for build in SETUPS.values()], ids=list(SETUPS))
def test_order_found_without_noise(setup: Setup) -> None:
    modes = identify(setup.clean(400), rate=400 / DURATION)
    assert modes.order == len(setup.frequency)
    np.testing.assert_allclose(modes.frequency, setup.frequency, rtol=1e-10)


def test_stand_setup_is_the_papers() -> None:
    """Energies of the knocked body's modes add up to 3 F^2 / 8 k, and each is F / 2 times its amplitude there."""
    setup, k, F = stand(), 740250.0, 9806.65
    energy = 0.5 * k * (np.abs(setup.amplitude) ** 2).sum(axis=1)
    assert energy.sum() == pytest.approx(3.0 * F**2 / (8.0 * k), rel=1e-12)
    np.testing.assert_allclose(energy, 0.5 * F * np.abs(setup.amplitude[:, 0]), rtol=1e-10)
    np.testing.assert_allclose(stand(0.0, 0.0).frequency, [13.962, 16.422, 24.59], rtol=3e-4)


def test_result_follows_its_own_model(rng: np.random.Generator) -> None:
    setup = three_modes()
    data = setup.samples(300, rng)
    modes = varpro({"a": data[:, 0], "b": data[:, 1]}, 3, time=7.0 + DURATION / 300 * np.arange(300))
    t = modes.time
    x = modes.offset + sum(
        modes.amplitude[k] * np.exp(-modes.decay_rate[k] * t)[:, None] * np.cos(modes.frequency[k] * t[:, None] + phase)
        for k, phase in enumerate(modes.phase)
    )
    np.testing.assert_allclose(modes.fitted, x, atol=1e-12)
    np.testing.assert_allclose(modes.predict(t), x, atol=1e-12)
    np.testing.assert_allclose(modes.data - modes.fitted, modes.residual, atol=1e-15)
    np.testing.assert_allclose(modes.natural_frequency, np.abs(modes.pole))
    np.testing.assert_allclose(modes.damping_ratio, modes.decay_rate / np.abs(modes.pole))
    assert modes.names == ("a", "b")
    assert np.all(np.diff(modes.frequency) > 0.0)
    assert "14" in str(modes)
    assert "varpro" in str(modes)
    with pytest.raises(dataclasses.FrozenInstanceError):
        modes.order = 2  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        modes.frequency[0] = 1.0


def test_residual_is_orthogonal_to_every_derivative(rng: np.random.Generator) -> None:
    """At the least-squares fit the residual has no part along any derivative of the model."""
    modes = varpro(three_modes().samples(200, rng), 3, rate=200 / DURATION, noise=0.01)
    E = np.exp(np.multiply.outer(modes.time, modes.pole))
    for columns in (E.real, E.imag, np.ones((200, 1))):
        assert np.abs(columns.T @ modes.residual).max() < 1e-10
    slope = modes.time[:, None, None] * E[:, :, None] * modes.complex_amplitude
    for derivative in (slope.real, slope.imag):
        gradient = np.einsum("nkc,nc->k", derivative, modes.residual) / modes.noise[0] ** 2
        assert np.abs(gradient * modes.frequency_std).max() < 1e-3


@pytest.mark.slow
def test_deviations_scatter_as_stated() -> None:
    """Amplitude, phase, offset, natural frequency, damping ratio, and real shapes: standard scores of 200 trials."""
    setup = three_modes()
    scores: dict[str, list[np.ndarray]] = {}
    natural = np.hypot(setup.frequency, setup.decay_rate)
    rng = np.random.default_rng(8)
    truth = {
        "amplitude": np.abs(setup.amplitude),
        "phase": np.angle(setup.amplitude),
        "offset": np.array([0.5, -0.2, 0.1, 0.0]),
        "natural_frequency": natural,
        "damping_ratio": setup.decay_rate / natural,
    }
    shapes = (setup.amplitude * np.exp(-1j * np.angle(setup.amplitude[:, :1]))).real
    for _ in range(200):
        modes = varpro(setup.samples(100, rng), 3, rate=100 / DURATION)
        for name, value in truth.items():
            error = getattr(modes, name) - value
            if name == "phase":
                error = np.angle(np.exp(1j * error))
            scores.setdefault(name, []).append(error / getattr(modes, name + "_std"))
        found = modes.mode_shapes()
        sign = np.sign((found.real * shapes).sum(axis=1))[:, None]
        std = np.sqrt(np.diag(found.covariance)[6:]).reshape(3, 4)
        scores.setdefault("shape", []).append((sign * found.real - shapes) / std)
    for name, score in scores.items():
        spread = np.sqrt(np.mean(np.square(score), axis=0))
        assert 0.8 < spread.min(), name
        assert spread.max() < 1.2, name


def test_mode_shapes() -> None:
    """Signs of a standing shape are found from any phase; a travelling one is shown not to be real."""
    t = np.arange(400) / 20.0
    standing = np.array([0.5, -1.0, 0.2])
    travelling = np.exp(2j * np.pi * np.arange(3) / 3.0)
    E = np.exp((-0.05 + 7.0j) * t + 1.1j), np.exp((-0.02 + 11.0j) * t)
    data = np.outer(E[0], standing).real + np.outer(E[1], travelling).real
    modes = varpro(data + 1e-4 * np.random.default_rng(2).standard_normal(data.shape), 2, rate=20.0)
    shapes = modes.mode_shapes()
    np.testing.assert_allclose(shapes.real[0], -standing, atol=1e-3)
    np.testing.assert_allclose(np.abs(shapes.complex), modes.amplitude, rtol=1e-12)
    assert shapes.realness[0] > 1.0 - 1e-6
    assert shapes.realness[1] < 0.1
    assert shapes.covariance.shape == (10, 10)


def test_block_exponentials() -> None:
    poles = np.array([-0.1 + 14.0j, 2.0 + 3.0j, -4.0 + 80.0j])
    for length in (5, 32, 33, 1000):
        t = 0.01 * np.arange(length)
        np.testing.assert_allclose(exponentials(poles, t), np.exp(np.multiply.outer(t, poles)), rtol=1e-12)
    assert exponentials(poles[:0], t).shape == (1000, 0)


# ------------------------------------------------------------------------------------ gaps, unequal sensors, drift


def scattered(x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return np.where(rng.random(x.shape) < 0.2, np.nan, x)


def one_long(x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    x = x.copy()
    x[int(0.4 * len(x)) : int(0.65 * len(x))] = np.nan
    return x


def bursts(x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    x = x.copy()
    for c in range(x.shape[1]):
        for first in rng.integers(0, len(x), 4):
            x[first : first + len(x) // 25, c] = np.nan
    return x


def half_a_sensor(x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    x = x.copy()
    x[len(x) // 2 :, 2] = np.nan
    return x


def unequal(x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A sensor with ten times the noise, and others in other units."""
    noise = 0.1 * np.abs(x).max() * np.outer(rng.standard_normal(len(x)), [0.0, 1.0, 0.0, 0.0])
    return (x + noise) * np.array([1.0, 1.0, 1e3, 1e-3])


@pytest.mark.slow
@pytest.mark.parametrize("spoil", [scattered, one_long, bursts, half_a_sensor, unequal])
@pytest.mark.parametrize("key", SETUPS)
def test_spoilt_signals(spoil: object, key: str) -> None:
    """The order is found and the standard scores stay those of a normal variable."""
    setup, length = SETUPS[key](), 200
    rng = np.random.default_rng(4)
    scores = []
    for _ in range(6):
        modes = identify(spoil(setup.samples(length, rng), rng), rate=length / DURATION)
        assert modes.order == len(setup.frequency)
        scores.append((modes.frequency - setup.frequency) / modes.frequency_std)
    assert 0.5 < np.sqrt(np.mean(np.square(scores))) < 1.6
    assert np.isnan(modes.residual).sum() == np.isnan(modes.data).sum()


def test_noise_of_each_sensor_is_estimated() -> None:
    setup = three_modes()
    noise = np.array([0.01, 0.03, 0.1, 0.01])
    rng = np.random.default_rng(6)
    data = setup.clean(1000) + noise * rng.standard_normal((1000, 4))
    modes = varpro(data, 3, rate=1000 / DURATION)
    np.testing.assert_allclose(modes.noise, noise, rtol=0.1)
    given = varpro(data, 3, rate=1000 / DURATION, noise=noise)
    np.testing.assert_allclose(given.noise, noise)
    np.testing.assert_allclose(modes.frequency, given.frequency, atol=0.3 * given.frequency_std.max())
    alike = varpro(data, 3, rate=1000 / DURATION, noise=0.03)
    assert np.all(given.frequency_std < alike.frequency_std)


def test_drift_is_fitted_when_asked(rng: np.random.Generator) -> None:
    setup = three_modes()
    slope = np.array([0.3, -0.1, 0.0, 0.2])
    t = DURATION / 300 * np.arange(300)
    modes = identify(setup.samples(300, rng) + np.outer(t, slope), rate=300 / DURATION, detrend="linear")
    assert modes.order == 3
    np.testing.assert_allclose(modes.drift, slope, atol=2e-3)
    np.testing.assert_allclose(modes.predict(modes.time), modes.fitted, atol=1e-12)
    assert np.abs(modes.frequency - setup.frequency).max() < 5.0 * modes.frequency_std.max()


def test_band_limits_what_is_fitted(rng: np.random.Generator) -> None:
    setup = three_modes()
    modes = identify(setup.samples(600, rng), rate=600 / DURATION, band=(18.0, 30.0))
    np.testing.assert_allclose(modes.frequency, [22.0, 24.6], rtol=2e-3)
    assert any("not white" in sentence for sentence in modes.warnings)


def test_one_sensor_and_start_values(rng: np.random.Generator) -> None:
    setup = three_modes()
    x = setup.samples(500, rng)[:, 0]
    found = identify(x, rate=500 / DURATION)
    started = varpro(x, 3, rate=500 / DURATION, start=[24.4j, 14.2j, 22.1j])
    assert found.order == 3
    assert found.criteria is not None
    assert started.criteria is None
    np.testing.assert_allclose(started.frequency, found.frequency, rtol=1e-8)


@pytest.mark.parametrize("method", ["esprit", "matrix_pencil", "tls_prony", "prony"])
def test_other_methods_by_name(method: str, rng: np.random.Generator) -> None:
    setup = three_modes()
    modes: IdentifiedModes = identify(setup.samples(300, rng), rate=300 / DURATION, method=method)
    assert modes.method.replace(" ", "_") == method
    assert modes.order == 3
    np.testing.assert_allclose(modes.frequency, setup.frequency, rtol=0.02)


def test_covariances_of_parts_are_blocks_of_the_whole(rng: np.random.Generator) -> None:
    modes = varpro(three_modes().samples(400, rng), 3, rate=400 / DURATION)
    std = np.sqrt(np.diag(modes.natural_frequency_covariance))
    np.testing.assert_allclose(std, modes.natural_frequency_std, rtol=1e-10)
    shapes, m = modes.mode_shapes(), modes.order
    sensors = shapes.real.shape[1]
    for k in range(m):
        at = slice(2 * m + k * sensors, 2 * m + (k + 1) * sensors)
        np.testing.assert_array_equal(shapes.shape_covariance[k], shapes.covariance[at, at])


def test_modes_as_variables(rng: np.random.Generator) -> None:
    modes = varpro(three_modes().samples(400, rng), 3, rate=400 / DURATION)
    found = mode_variables(modes, unit="mm")
    assert found["mode_frequency"][:1] == (("mode",),)
    np.testing.assert_array_equal(found["mode_amplitude_std"][1], modes.amplitude_std)
    assert found["mode_amplitude"][0] == ("mode", "sensor")
    assert found["mode_amplitude"][2] == "mm"
    blank = mode_variables(None, unit="m", order=2, sensors=4)
    assert {name: values.shape for name, (_, values, _, _) in blank.items()} == {
        name: (2, 4) if "sensor" in dims else (2,) for name, (dims, _, _, _) in found.items()
    }
    assert all(np.all(np.isnan(values)) for _, values, _, _ in blank.values())


def test_frequencies_of_the_same_modes_in_other_signals() -> None:
    setup = three_modes()
    modes = varpro(setup.clean(400), 3, rate=400 / DURATION)
    faster = setup.clean(400)
    found = frequencies_in(modes, faster, rate=1.001 * 400 / DURATION)
    assert found is not None
    np.testing.assert_allclose(found, 1.001 * modes.frequency, rtol=1e-8)
    assert frequencies_in(modes, np.zeros((400, 4)), rate=400 / DURATION) is None


def test_what_sensors_read() -> None:
    clean = np.zeros((20000, 2))
    read = recorded(clean, noise=(1.0, 0.1), seed=3)
    np.testing.assert_allclose(read.std(axis=0), [1.0, 0.1], rtol=0.02)
    assert abs(np.corrcoef(read.T)[0, 1]) < 0.03
    np.testing.assert_array_equal(read, recorded(clean, noise=(1.0, 0.1), seed=3))
    rounded = recorded(clean, noise=(1.0, 0.1), quantisation=0.25, seed=3)
    np.testing.assert_allclose(rounded, 0.25 * np.round(4.0 * read), atol=1e-12)
    np.testing.assert_array_equal(recorded(clean), clean)


@pytest.mark.parametrize("more", [-1e-6, 1e-6])
def test_of_equal_amplitudes_the_first_is_positive(more):
    """Whichever round-off or noise makes the larger one, and whichever sign the motion began with."""
    t = np.arange(500) / 50.0
    for sign in (1.0, -1.0):
        swing = sign * 0.2 * np.cos(21.0 * t)
        found = identify({"left": swing, "right": -(1.0 + more) * swing}, rate=50.0, order=1)
        assert found.mode_shapes().real[0] == pytest.approx([0.2, -0.2], abs=1e-5)


@pytest.mark.parametrize("noise", [0.0, 1e-9, 1e-3])
def test_prony_counts_samples_a_period_of_the_highest_mode(noise: float, rng: np.random.Generator) -> None:
    """Not of a weak harmonic, nor of what a spectrum without noise shows far above the modes."""
    rate, w = 500.0 / 3.0, np.array([13.96, 16.42, 24.59])
    time = np.arange(2041) / rate
    data = np.cos(time[:, None] * w).sum(axis=1) + 1e-6 * np.cos(3.0 * w[2] * time)
    data += noise * rng.standard_normal(time.size)
    found = prony(data, 3, rate=rate)
    every = prony(data[::17], 3, rate=rate / 17.0, samples_per_period=None)  # 2 pi 500 / (3 * 24.59 * 2.5) = 17.03
    np.testing.assert_allclose(found.frequency, every.frequency, rtol=1e-12)
    np.testing.assert_allclose(found.frequency, w, rtol=max(1e-7, 0.2 * noise))
