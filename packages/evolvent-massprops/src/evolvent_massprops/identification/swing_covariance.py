"""The covariance of a fit of modes and swings, from the Fisher information."""

from __future__ import annotations

import numpy as np

from evolvent_massprops.identification import swing_model as model
from evolvent_massprops.identification.signals import Array, Signal
from evolvent_massprops.identification.swing_model import Component, Found


def summary(components: tuple[Component, ...], coefficients: Array) -> Array:
    """Frequency (m), decay rate (m), Re and Im of complex amplitudes (m c each), offsets (c)."""
    m = len(components)
    w = np.array([one.pole.imag for one in components])
    d = np.array([-one.pole.real if one.rates is None else one.rates[0] for one in components])
    undamped = [one.is_swing and not one.sinusoidal for one in components]
    frequency = np.where(undamped, np.sqrt(np.maximum(w**2 - d**2, 1e-30)), w)
    a = np.array(
        [one.phasors()[0] * coefficients[2 * k] + one.phasors()[1] * coefficients[2 * k + 1]
         for k, one in enumerate(components)]
    )  # fmt: skip
    return np.concatenate([frequency, d, a.real.ravel(), a.imag.ravel(), coefficients[2 * m]])


def covariance(found: Found, signal: Signal) -> tuple[Array, Array]:
    """Covariance of `summary`, and of the nonlinear parameters, from the Fisher information."""
    now = found.solution
    components, C = now.components, now.coefficients
    values = np.concatenate([one.values() for one in components])
    length = float(signal.time[-1])
    steps = model.DIFFERENCE * np.concatenate([one.resolution(length) for one in components])
    base = model.columns(components, signal)
    slopes = []
    penalties = []
    for k, h in enumerate(steps):
        moved = values.copy()
        moved[k] += h
        other = model.split(components, moved)
        ahead = model.columns(other, signal) - base
        moved[k] -= 2.0 * h
        back = base - model.columns(model.split(components, moved), signal)
        # an acceleration jumps where dry friction turns: no jump that passes a sample is a slope
        slopes.append(np.where(np.abs(ahead) <= np.abs(back), ahead, back) / h)
        penalties.append((model.penalty(other, signal) - now.penalty) / h)
    groups = model.groups(components, signal)
    p = len(values)
    places: list[tuple[Array, Array]] = []
    size = p + sum(len(used) * len(sensors) for _, sensors, used in groups)
    F = np.zeros((size, size))
    first = p
    position = np.full(C.shape, -1)
    for rows, sensors, used in groups:
        for c in sensors.tolist():
            J = np.column_stack([D[rows] @ C[:, c] for D in slopes]) / found.noise[c]
            B = base[rows][:, used] / found.noise[c]
            at = np.arange(first, first + len(used))
            position[used, c] = at
            F[:p, :p] += J.T @ J
            F[:p, at] += J.T @ B
            F[at, :p] += B.T @ J
            F[np.ix_(at, at)] += B.T @ B
            first += len(used)
            places.append((at, used))
    P = np.array(penalties).reshape(p, -1)
    F[:p, :p] += P @ P.T
    scale = 1.0 / np.sqrt(np.maximum(np.diag(F), 1e-300))
    full = scale[:, None] * np.linalg.pinv(F * np.outer(scale, scale), rcond=1e-14, hermitian=True) * scale
    start = summary(components, C)
    T = np.empty((len(start), size))
    for k, h in enumerate(steps):
        moved = values.copy()
        moved[k] += h
        T[:, k] = (summary(model.split(components, moved), C) - start) / h
    for row, c in zip(*np.nonzero(position >= 0), strict=True):
        changed = C.copy()
        h = 1e-6 * max(abs(C[row, c]), found.noise[c])
        changed[row, c] += h
        T[:, position[row, c]] = (summary(components, changed) - start) / h
    return T @ full @ T.T, full[:p, :p]
