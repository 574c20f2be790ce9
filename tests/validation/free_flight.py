"""References of a flexible beam in free flight: a plane beam in finite volumes under SciPy, apart from the engine.

As `flexible_pendulum.py`, by Reissner's strains; nothing holds it, and a dead force pulls its root for a while. Run as
a script it prints root and tip at 0.5 and 1 s, extrapolated from two meshes.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

Array = np.ndarray
SIDE, E, NU, DENSITY = 0.02, 2e7, 0.3, 7200.0
#: Force on the root, N, and until when, s.
FORCE, END = (2.0, 4.0), 0.2


def ends(n: int) -> Array:
    """Root and tip at 0.5 and 1 s of n volumes of a beam of 1 m along x at rest, m : (2, 2, 2)."""
    h, area, second = 1.0 / n, SIDE**2, SIDE**4 / 12.0
    EA, EI = E * area, E * second
    GA = 10.0 * (1.0 + NU) / (12.0 + 11.0 * NU) * E / (2.0 * (1.0 + NU)) * area
    mass, inertia = np.full(n + 1, DENSITY * area * h), np.full(n + 1, DENSITY * second * h)
    mass[[0, -1]] *= 0.5
    inertia[[0, -1]] *= 0.5

    def rates(_: float, state: Array, pull: Array) -> Array:
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
        forces[:2, 0] += pull
        return np.concatenate([*v, forces[0] / mass, forces[1] / mass, forces[2] / inertia])

    y = np.zeros((6, n + 1))
    y[0] = np.linspace(0.0, 1.0, n + 1)
    y, found = y.ravel(), []
    for span, pull in (((0.0, END), FORCE), ((END, 0.5), (0.0, 0.0)), ((0.5, 1.0), (0.0, 0.0))):
        y = solve_ivp(rates, span, y, "DOP853", rtol=1e-7, atol=1e-9, args=(np.array(pull),)).y[:, -1]
        found.append([[y[0], y[n + 1]], [y[n], y[2 * n + 1]]])
    return np.array(found[1:])


if __name__ == "__main__":
    coarse, fine = (ends(n) for n in (40, 80))
    print((fine + (fine - coarse) / 3.0).round(6).tolist(), np.abs(fine - coarse).max())
