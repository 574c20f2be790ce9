"""Reference of the slider-crank with a flexible rod: a plane Reissner beam in finite volumes under SciPy.

Data of Simeon (1996): crank of 0.15 m at 150 rad/s, rod of 0.3 m and 8 x 8 mm of steel, slider of 75.552 g. Run as a
script it prints the slider's place and the deflection of the rod's middle, extrapolated from two meshes.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

Array = np.ndarray
CRANK, ROD, SIDE, E, NU, DENSITY, SLIDER, RATE = 0.15, 0.3, 0.008, 2e11, 0.3, 7870.0, 0.075552, 150.0
TIMES = (0.01, 0.02, 0.03, 0.04)


def places(n: int) -> Array:
    """Slider's place and deflection of the middle at `TIMES`, of n volumes, m : (times, 2)."""
    h, area, second = ROD / n, SIDE**2, SIDE**4 / 12.0
    EA, EI = E * area, E * second
    GA = 10.0 * (1.0 + NU) / (12.0 + 11.0 * NU) * E / (2.0 * (1.0 + NU)) * area
    mass, inertia = np.full(n + 1, DENSITY * area * h), np.full(n + 1, DENSITY * second * h)
    mass[[0, -1]] *= 0.5
    inertia[[0, -1]] *= 0.5
    mass[-1] += SLIDER

    def rates(t: float, state: Array) -> Array:
        x, y, turn, *v = state.reshape(6, n + 1)
        dx, dy, k, middle = np.diff(x) / h, np.diff(y) / h, np.diff(turn) / h, 0.5 * (turn[1:] + turn[:-1])
        c, s = np.cos(middle), np.sin(middle)
        along, across = c * dx + s * dy, c * dy - s * dx
        normal, shear, moment = EA * (along - 1.0), GA * across, EI * k
        couple = 0.5 * h * (shear * along - normal * across)
        forces = np.zeros((3, n + 1))
        for f, inner in zip(forces, (c * normal - s * shear, s * normal + c * shear, moment), strict=True):
            f[:-1] += inner
            f[1:] -= inner
        forces[2, :-1] += couple
        forces[2, 1:] += couple
        a, b = forces[0] / mass, forces[1] / mass
        a[0], b[0] = -(RATE**2) * CRANK * np.cos(RATE * t), -(RATE**2) * CRANK * np.sin(RATE * t)
        b[-1] = 0.0
        return np.concatenate([*v, a, b, forces[2] / inertia])

    start = np.zeros((6, n + 1))
    start[0] = CRANK + np.linspace(0.0, ROD, n + 1)
    start[4] = RATE * CRANK * np.linspace(1.0, 0.0, n + 1)
    start[5] = -RATE * CRANK / ROD
    found = solve_ivp(rates, (0.0, TIMES[-1]), start.ravel(), "DOP853", TIMES, rtol=1e-7, atol=1e-10)
    x, y = found.y.reshape(6, n + 1, -1)[:2]
    chord = np.array([x[-1] - x[0], y[-1] - y[0]])
    middle = np.array([x[n // 2] - x[0], y[n // 2] - y[0]])
    bend = (chord[0] * middle[1] - chord[1] * middle[0]) / np.hypot(*chord)
    return np.stack([x[-1], bend], axis=1)


if __name__ == "__main__":
    coarse, fine = (places(n) for n in (20, 40))
    print((fine + (fine - coarse) / 3.0).round(8).tolist())
