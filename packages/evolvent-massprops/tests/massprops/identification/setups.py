"""The three set-ups in which the methods are measured: 12.24 s at four sensors, 1 % white noise.

N samples over 12.24 s: N = 100 gives 8.17 Hz, half of which is 25.67 rad/s, still above the fastest mode (24.6 rad/s,
2.1 samples a period); N = 1000 gives 81.7 Hz. The noise is 1 % of the largest amplitude of any mode at any sensor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

Array = np.ndarray

DURATION = 12.24
NOISE = 0.01
OFFSET = np.array([0.5, -0.2, 0.1, 0.0])
#: Signs of heave, pitch and roll at the corners (+, +), (+, -), (-, +), (-, -) of (x, z).
CORNERS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])


class Setup(NamedTuple):
    """Modes (m,) at sensors (c,): amplitudes are complex, (m, c); the noise is in the same units."""

    name: str
    frequency: Array
    decay_rate: Array
    amplitude: Array

    @property
    def noise(self) -> float:
        return NOISE * float(np.abs(self.amplitude).max())

    def clean(self, length: int) -> Array:
        t = DURATION / length * np.arange(length)
        E = np.exp(np.multiply.outer(t, -self.decay_rate + 1j * self.frequency))
        return (E @ self.amplitude).real + OFFSET * np.abs(self.amplitude).max()

    def samples(self, length: int, rng: np.random.Generator) -> Array:
        return self.clean(length) + self.noise * rng.standard_normal((length, self.amplitude.shape[1]))


def three_modes() -> Setup:
    """Heave, pitch and roll of equal amplitude at every corner."""
    x, z = CORNERS.T
    shapes = np.array([np.ones(4), x, z]) * np.exp(1j * np.array([0.0, 0.4, 0.8]))[:, np.newaxis]
    return Setup("14, 22, 24.6 rad/s", np.array([14.0, 22.0, 24.6]), np.array([0.05, 0.08, 0.10]), shapes)


def stand(ex: float = 0.4, ez: float = 0.1, damping: float = 0.002) -> Setup:
    """The body of Belyakov (2002) with its centre of mass at (ex, ez), let go from a load at one spring."""
    M, Ixx, Izz, k, a, b, F = 15190.0, 3703.0, 43920.0, 740250.0, 2.0, 0.8696, 9806.65
    K = 4.0 * k * np.array([[1.0, ez, -ex], [ez, b**2 + ez**2, -ex * ez], [-ex, -ex * ez, a**2 + ex**2]])
    mass = np.diag([M, Ixx, Izz])
    # displacement of a point: y + gamma r_x - alpha r_z, r from the centre of mass
    rx, rz = CORNERS[:, 0] * a - ex, CORNERS[:, 1] * b - ez
    at_springs = np.column_stack((np.ones(4), -rz, rx))
    rest = np.linalg.solve(K, -F * at_springs[0])
    square, T = np.linalg.eig(np.linalg.solve(mass, K))
    order = np.argsort(square)
    frequency, T = np.sqrt(square[order]), T[:, order]
    share = np.linalg.solve(T, rest)
    amplitude = (at_springs @ T * share).T
    return Setup("stand, ex 0.4 m, ez 0.1 m", frequency, damping * frequency, amplitude.astype(complex))


def close_modes() -> Setup:
    """Two modes 2 % apart: 0.55 of the record's resolution 2 pi / 12.24 s."""
    x, _ = CORNERS.T
    shapes = np.array([np.ones(4), x]) * np.exp(1j * np.array([0.0, 0.4]))[:, np.newaxis]
    return Setup("14 and 14.28 rad/s", np.array([14.0, 14.28]), np.array([0.05, 0.06]), shapes)


SETUPS = {"three": three_modes, "stand": stand, "close": close_modes}
