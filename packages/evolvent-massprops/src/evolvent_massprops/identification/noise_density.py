"""Noise that is not white: its spectral density near each mode, and modes that do not stand out of it."""

from __future__ import annotations

import numpy as np

from evolvent_massprops.identification.modes import IdentifiedModes
from evolvent_massprops.identification.signals import Array, Signal, power

#: Lines of the residual's spectrum on each side of a mode that show the noise there.
NEAR = 12


def density(modes: IdentifiedModes, signal: Signal) -> Array:
    """(m, c) variance that white noise of the spectral density near each mode would have, over that of the sensor."""
    return density_near(modes.frequency, modes.residual, modes.noise, signal)


def density_near(frequency: Array, residual: Array, noise: Array, signal: Signal) -> Array:
    """As `density`, near frequencies (m,), rad/s, for a residual (N, c) and the noise (c,) of the sensors.

    Notes
    -----
    The mean of 2 `NEAR` + 1 lines of the residual's spectrum. What a fit has taken off is added: a mode takes its two
    parameters of each sensor and its share of two common ones, or 1 + 1/c lines.
    """
    sensors = len(noise)
    lines = power(residual, signal.cells) / (signal.counts * noise**2)
    step = 2.0 * np.pi / (signal.extent * signal.step)
    found = np.empty((len(frequency), sensors))
    places = np.round(frequency / step).astype(int)
    for k, place in enumerate(places):
        near = lines[max(1, place - NEAR) : place + NEAR + 1]
        taken = np.count_nonzero(np.abs(places - place) <= NEAR) * (1.0 + 1.0 / sensors)
        found[k] = near.sum(axis=0) / max(len(near) - taken, 0.5 * len(near))
    return found


def energy(modes: IdentifiedModes, signal: Signal) -> Array:
    """(m, c) sum of the squares of each mode's samples, over the noise of the sensor."""
    growth = -2.0 * modes.decay_rate * float(modes.time[-1])
    mean = np.where(np.abs(growth) > 1e-9, np.expm1(growth) / np.where(growth == 0.0, 1.0, growth), 1.0)
    return np.asarray(0.5 * signal.counts * (modes.amplitude / modes.noise) ** 2 * mean[:, None])


def faint(modes: IdentifiedModes, signal: Signal) -> Array:
    """Indices of modes that noise of the density near them may well be, the weakest first.

    Notes
    -----
    A mode must shorten the description, as in `orders.criteria`, with the noise near it in place of its mean: half its
    energy over the density against (c + 3) log n.
    """
    gain = 0.5 * (energy(modes, signal) / np.maximum(density(modes, signal), 1.0)).sum(axis=1)
    limit = (len(modes.names) + 3.0) * np.log(len(modes.time))
    order = np.argsort(gain)
    return np.asarray(order[gain[order] < limit])
