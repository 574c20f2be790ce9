"""Reference of Lee's frame: its two members as plane Reissner beams, integrated along their length by SciPy."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

Array = np.ndarray
SIDE, POINT, E, NU, THICKNESS, WIDTH = 120.0, 24.0, 720.0, 0.3, 2.0, 3.0


def _shoot(unknowns: Array, load: float) -> tuple[Array, Array]:
    """What the far end misses (place, moment), and the place of the load, of a turn and a force at the near end.

    Along a member with turn p and force f: r' = (1 + N/EA) t + Q/GA n, p' = M/EI, M' = -(r' x f).
    """
    area, second = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12.0
    EA, EI = E * area, E * second
    GA = 10.0 * (1.0 + NU) / (12.0 + 11.0 * NU) * E / (2.0 * (1.0 + NU)) * area
    state, f = np.array([0.0, 0.0, unknowns[0], 0.0]), unknowns[1:].copy()
    ends = []
    for length, turn, down in ((SIDE, 0.0, 0.0), (POINT, -0.5 * np.pi, 0.0), (SIDE - POINT, 0.0, load)):
        state[2] += turn
        f[1] += down

        def rates(_: float, y: Array, f: Array = f.copy()) -> list[float]:  # noqa: B008
            c, s = np.cos(y[2]), np.sin(y[2])
            normal, shear = f[0] * c + f[1] * s, f[1] * c - f[0] * s
            a, b = 1.0 + normal / EA, shear / GA
            return [a * c - b * s, a * s + b * c, y[3] / EI, b * normal - a * shear]

        state = solve_ivp(rates, (0.0, length), state, "DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
        ends.append(state[:2])
    return np.array([state[0] - SIDE, state[1] - SIDE, 1e-3 * state[3]]), ends[1]


def displacement(load: float) -> Array:
    """Of the place of the load, along x and y, on the way up to the limit load of 1.8552 : (2,) float."""
    unknowns = np.array([0.5 * np.pi, 0.0, -0.04])
    for part in np.linspace(0.05, 1.0, 20):
        unknowns = fsolve(lambda u, p=part * load: _shoot(u, p)[0], unknowns, xtol=1e-12)
    missed, place = _shoot(unknowns, load)
    assert np.abs(missed).max() < 1e-7
    return place - (POINT, SIDE)
