"""References of the flexible pendulum: a plane beam in finite volumes under SciPy, apart from the engine.

Places at nodes, turns of sections beside them, strains between nodes; with shear and rotary inertia. Run as a script it
prints the tip at 0.5 and 1 s, extrapolated from two meshes, with Reissner's strains and with Green's.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

Array = np.ndarray
SIDE, E, NU, DENSITY, G = 0.02, 2e7, 0.3, 7200.0, 9.81


def tips(n: int, green: bool) -> Array:
    """Tip at 0.5 and 1 s of n volumes of a beam of 1 m, m : (2, 2)."""
    h, area, second = 1.0 / n, SIDE**2, SIDE**4 / 12.0
    EA, EI = E * area, E * second
    GA = 10.0 * (1.0 + NU) / (12.0 + 11.0 * NU) * E / (2.0 * (1.0 + NU)) * area
    mass, inertia = np.full(n + 1, DENSITY * area * h), np.full(n + 1, DENSITY * second * h)
    mass[-1] *= 0.5
    inertia[[0, -1]] *= 0.5

    def rates(_: float, state: Array) -> Array:
        x, y, turn, *v = state.reshape(6, n + 1)
        dx, dy, k, middle = np.diff(x) / h, np.diff(y) / h, np.diff(turn) / h, 0.5 * (turn[1:] + turn[:-1])
        c, s = np.cos(middle), np.sin(middle)
        along, across = c * dx + s * dy, c * dy - s * dx
        if green:  # EA/2 [(r'.r' - 1)/2]^2 + EI/2 (along k)^2
            strain = 0.5 * (dx * dx + dy * dy - 1.0)
            normal, shear = EA * strain * along + EI * along * k * k, EA * strain * across + GA * across
            moment = EI * along**2 * k
        else:
            normal, shear, moment = EA * (along - 1.0), GA * across, EI * k
        couple = 0.5 * h * (shear * along - normal * across)
        forces = np.zeros((3, n + 1))
        for f, inner in zip(forces, (c * normal - s * shear, s * normal + c * shear, moment), strict=True):
            f[:-1] += inner
            f[1:] -= inner
        forces[2, :-1] += couple
        forces[2, 1:] += couple
        ax, ay = forces[0] / mass, forces[1] / mass - G
        ax[0] = ay[0] = 0.0
        return np.concatenate([*v, ax, ay, forces[2] / inertia])

    start = np.zeros((6, n + 1))
    start[0] = np.linspace(0.0, 1.0, n + 1)
    found = solve_ivp(rates, (0.0, 1.0), start.ravel(), "DOP853", [0.5, 1.0], rtol=1e-7, atol=1e-9)
    return found.y[[n, 2 * n + 1]].T


if __name__ == "__main__":
    for name, green in (("Reissner", False), ("Green", True)):
        coarse, fine = (tips(n, green) for n in (40, 80))
        print(name, (fine + (fine - coarse) / 3.0).round(6).tolist())
