"""The Cramér-Rao bound against closed forms and against the Fisher information by differences."""

from __future__ import annotations

import numpy as np
import pytest

from book import Book
from evolvent_massprops.identification import cramer_rao, varpro
from massprops.identification.setups import DURATION, stand


def test_one_undamped_mode(book: Book) -> None:
    """24 noise^2 / (A^2 T^2 N (N^2 - 1)) with an unknown decay rate; both poles' coordinates alike, and apart."""
    T, N, A, noise = 0.02, 4000, 1.7, 0.1
    bound = cramer_rao(70.0, 0.0, A, phase=0.4, rate=1.0 / T, length=N, noise=noise)
    closed = 24.0 * noise**2 / (A**2 * T**2 * N * (N**2 - 1.0))
    assert bound[0, 0] == pytest.approx(closed, rel=5e-4)
    assert bound[1, 1] == pytest.approx(closed, rel=5e-4)
    assert abs(bound[0, 1]) < 1e-3 * closed
    book(
        "Inertia stand and identification", "Cramer-Rao bound, one undamped mode",
        reference="24 s^2/(A^2 T^2 N (N^2 - 1))", source="closed form", error=abs(bound[0, 0] / closed - 1.0),
        allowed=5e-4,
    )  # fmt: skip


@pytest.mark.parametrize("decay", [0.05, 0.5, 3.0])
def test_one_damped_mode(decay: float, book: Book) -> None:
    """2 noise^2 / (A^2 T^2) S0 / (S0 S2 - S1^2), S_j = sum n^j exp(-2 decay T n), once the mode is fast."""
    T, N, A, noise = 0.002, 4000, 1.7, 0.1
    bound = cramer_rao(700.0, decay, A, phase=0.4, rate=1.0 / T, length=N, noise=noise)
    n = np.arange(N)
    S0, S1, S2 = (float((n**j * np.exp(-2.0 * decay * T * n)).sum()) for j in range(3))
    closed = 2.0 * noise**2 / (A**2 * T**2) * S0 / (S0 * S2 - S1**2)
    assert bound[0, 0] == pytest.approx(closed, rel=5e-3)
    book(
        "Inertia stand and identification", f"Cramer-Rao bound, one mode of decay {decay:g} 1/s",
        reference="2 s^2/(A^2 T^2) S0/(S0 S2 - S1^2)", source="closed form", error=abs(bound[0, 0] / closed - 1.0),
        allowed=5e-3,
    )  # fmt: skip


def test_sensors_add_up() -> None:
    """Information of sensors adds: four alike quarter the variance, and a noisy one adds nearly nothing."""
    one = cramer_rao([14.0, 22.0], [0.1, 0.2], [1.0, 2.0], rate=50.0, length=300, noise=0.1)
    amplitude = np.repeat([[1.0], [2.0]], 4, axis=1)
    four = cramer_rao([14.0, 22.0], [0.1, 0.2], amplitude, rate=50.0, length=300, noise=0.1)
    mixed = cramer_rao([14.0, 22.0], [0.1, 0.2], amplitude[:, :2], rate=50.0, length=300, noise=[0.1, 1e4])
    np.testing.assert_allclose(four, one / 4.0, rtol=1e-10)
    np.testing.assert_allclose(mixed, one, rtol=1e-8)


@pytest.mark.parametrize("detrend", ["constant", "linear"])
def test_all_parameters_against_differences(detrend: str) -> None:
    """The fit's full covariance is the inverse of the information of all parameters, from central differences."""
    setup, length = stand(), 120
    data = setup.samples(length, np.random.default_rng(3)) / setup.noise
    data[40:60, 1] = np.nan
    data[3, :] = np.nan
    modes = varpro(data, 3, rate=length / DURATION, noise=[1.0, 1.0, 2.0, 1.0], detrend=detrend)
    m, c = modes.order, 4
    a = modes.complex_amplitude
    start = np.concatenate(
        [modes.frequency, modes.decay_rate, a.real.ravel(), a.imag.ravel(), modes.offset, modes.drift]
    )
    drifts = detrend == "linear"

    def model(p: np.ndarray) -> np.ndarray:
        poles = -p[m : 2 * m] + 1j * p[:m]
        amplitude = (p[2 * m :][: m * c] + 1j * p[2 * m + m * c :][: m * c]).reshape(m, c)
        x = (np.exp(np.multiply.outer(modes.time, poles)) @ amplitude).real + p[2 * m + 2 * m * c :][:c]
        if drifts:
            x = x + np.multiply.outer(modes.time, p[-c:])
        return (x / modes.noise)[~np.isnan(data)]

    size = len(start) - (0 if drifts else c)
    J = np.empty((np.count_nonzero(~np.isnan(data)), size))
    for i in range(size):
        step = np.zeros(len(start))
        step[i] = 1e-6 * max(1.0, abs(start[i]))
        J[:, i] = (model(start + step) - model(start - step)) / (2.0 * step[i])
    kept = len(modes.covariance)
    expected = np.linalg.inv(J.T @ J)[:kept, :kept]
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(modes.covariance / np.outer(scale, scale), expected / np.outer(scale, scale), atol=2e-6)
