"""Highest frequency of an assembled model, and the largest step at which an explicit method is stable on it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import owner
from evolvent.kernels.impulse import prepare
from evolvent.model.registry import asked, is_by_rates
from evolvent.solvers.time.explicit.fastest_modes import fastest_explicit_mode
from evolvent.solvers.time.explicit.methods import Method


class Mode(NamedTuple):
    """The fastest mode: bounds of frequency (rad/s) and damping rate (1/s), where it is, and the largest rate."""

    frequency: float
    damping_rate: float
    where: str
    largest_damping_rate: float


def fastest_mode(assembly: Assembly) -> Mode:
    """A bound of the highest frequency of the springs and threads of a model, all nodes taken as released.

    Beams, contacts and penalties count with what they have (see `evolvent.solvers.time.explicit.fastest_modes`).

    Notes
    -----
    A spring k between a and b holds k (x_a - x_b)^2 <= 2 k (x_a^2 + x_b^2), so that the stiffness matrix is bounded by
    its diagonal blocks, counted twice where both ends move: omega^2 <= max over a of the largest eigenvalue of
    M_a^-1 K_aa. A uniform chain reaches this bound, 4 c / m. Damping is bounded in the same way.
    """
    best = bounds_of_families(assembly)
    squared, damping, name, k = max(best, key=lambda bound: (bound[0], -bound[1]))
    where = owner(assembly, name, k) if name else "nothing"
    largest = max(bound[1] for bound in best)
    if is_by_rates(assembly.model):
        square, rate, place, fastest = fastest_explicit_mode(assembly)
        largest = max(largest, rate, fastest)
        if (square, -rate) > (squared, -damping):
            squared, damping, where = square, rate, place
    return Mode(math.sqrt(squared), damping, where, largest)


def bounds_of_families(assembly: Assembly) -> list[tuple[float, float, str, int]]:
    """Bounds that families state: squared frequency, rad2/s2, damping rate, 1/s, family and record; one is zero."""
    model, y, s = assembly.model, assembly.y.copy(), assembly.s.copy()
    needs.load(model, prepare)
    prepare(0.0, y, s, model)
    own = asked("stability.felt")
    felt = {name: np.zeros((2, getattr(model, name).size, one.size, one.size)) for name, one in own.items()}
    best: list[tuple[float, float, str, int]] = [(0.0, 0.0, "", 0)]
    for name, bound in asked("stability.bound").items():
        best += [(square, rate, name, k) for k, square, rate in bound(model, y, felt)]
    moved = list[tuple[str, int]]()
    for name, one in own.items():  # what feels nothing has no bound
        feels = np.any(felt[name], axis=(0, 2, 3)) & one.which(getattr(model, name))
        moved += [(name, k) for k in np.flatnonzero(feels).tolist()]
    values = _largest([own[name].answer(model, k, felt[name][:, k]) for name, k in moved])
    return best + [(*both, *at) for both, at in zip(values, moved, strict=True)]


def _largest(blocks: list[np.ndarray]) -> list[tuple[float, float]]:
    """Largest absolute eigenvalues of both matrices of each of the `blocks`, (2, n, n) float of various n."""
    found = np.zeros((len(blocks), 2))
    for size in {one.shape[-1] for one in blocks}:  # one call takes all that are as large
        own = [k for k, one in enumerate(blocks) if one.shape[-1] == size]
        found[own] = np.abs(np.linalg.eigvals(np.array([blocks[k] for k in own]))).max(axis=-1)
    return [(float(square), float(rate)) for square, rate in found]


def stability_polynomial(method: Method) -> list[float]:
    """Coefficients of R(z) = 1 + z b^T (I - z A)^-1 1 of an explicit method, from the highest power on."""
    power, found = np.ones(method.b.size), [1.0]
    for _ in range(method.b.size):
        found.append(float(method.b @ power))
        power = method.A @ power
    return found[::-1]


def amplification(coefficients: list[float], z: Any) -> Any:
    """|R(z)| of a complex number or an array, by Horner's rule."""
    found = 0.0 * z
    for coefficient in coefficients:
        found = found * z + coefficient
    return abs(found)


def stability_limit(method: Method, mode: Mode, duration: float) -> float:
    """Largest step (s) at which the fastest mode does not grow, damping included, and no smaller step lets it grow.

    Notes
    -----
    Heun's method has no stable step for an undamped mode, |R|^2 = 1 + z^4 / 4 on the imaginary axis: growth by a
    twentieth over the whole `duration` is accepted of any method.
    """
    if mode.frequency == 0.0 and mode.largest_damping_rate == 0.0:
        return math.inf
    half = 0.5 * mode.damping_rate
    root = np.sqrt(complex(half * half - mode.frequency**2))
    poles = {complex(-half + root), complex(-half - root), complex(-mode.largest_damping_rate)}
    poles = {pole for pole in poles if pole and pole.imag >= 0.0}  # |R| is 1 at 0, and the same of a conjugate
    polynomial = stability_polynomial(method)

    def stable(h: Any) -> Any:
        found = h > 0.0
        for pole in poles:
            found = found & (amplification(polynomial, h * pole) <= 1.0 + 0.05 * h / duration)
        return found

    scale = max(mode.frequency, mode.largest_damping_rate)
    if not stable(0.01 / scale):
        scale *= 100.0 * max(1.0, (mode.frequency * duration) ** (1 / 3))
    grows = np.flatnonzero(~stable(0.01 * np.arange(1, 801) / scale))
    low = 0.01 * (int(grows[0]) if grows.size else 800) / scale
    high = low + 0.01 / scale
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


def stable_radius(method: Method, step: float, duration: float) -> float:
    """Radius of half a disc about 0, left of the imaginary axis, in which a method is stable, as of `stability_limit`.

    Notes
    -----
    R is analytic, so that |R| is largest on the edge of the half disc.
    """
    polynomial, at = stability_polynomial(method), np.linspace(0.0, 1.0, 201)
    edge = np.concatenate([1j * at, np.exp(0.5j * np.pi * (1.0 + at))])  # and the same of their conjugates
    allowed, low, high = 1.0 + 0.05 * step / duration, 0.0, 8.0
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        stable = bool(np.all(amplification(polynomial, middle * edge) <= allowed))
        low, high = (middle, high) if stable else (low, middle)
    return low


def energy_change(method: Method) -> tuple[int, float]:
    """(k, c) of the share c omega T (omega h)^k of its energy that an undamped mode loses or gains over a time T.

    Notes
    -----
    |R(i z)|^2 = 1 + sum_k c_k z^(k + 1) of the stability polynomial R, with the first c_k that is not 0.
    """
    R = np.asarray(stability_polynomial(method), dtype=float)[::-1]  # from z^0 on
    turned = R * 1j ** np.arange(R.size)
    square = np.convolve(turned, turned.conj()).real
    powers = np.flatnonzero(np.abs(square[1:]) > 1e-12)
    return int(powers[0]), float(abs(square[1 + powers[0]]))
