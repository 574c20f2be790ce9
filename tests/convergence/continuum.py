"""The thread as a continuum that grows (ALE), with Legendre modes: an independent reference, by SciPy.

Source: shared/models/thread.md, "Continuum with continuous mass injection". alpha(xi) = sum a_k P_k(2 xi - 1) is the
inertial angle of the tangent, xi = arc / l; everything is linear in a_k'' and psi''. Planar, two blades.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from scipy.integrate import solve_ivp

from helpers import L0, RHO, TIP, W0, J, L, V

Array = np.ndarray


class Continuum:
    """Blade of length l(t) = start + V t on a body of inertia J / 2.

    Parameters
    ----------
    modes : int
    start : float, m, straight at the start and turning with the body
    carried : bool, whether wound thread acts on the body (as in the source) or not (as in the paper)
    """

    def __init__(self, modes: int = 6, start: float = 0.005, carried: bool = False, points: int = 16) -> None:
        self.modes, self.start, self.carried = modes, start, carried
        nodes, weights = legendre.leggauss(points)
        self.xi, self.weights = 0.5 * (nodes + 1.0), 0.5 * weights
        at = np.concatenate([nodes, [-1.0, 1.0]])  # quadrature points, then xi = 0 and xi = 1
        unit = np.eye(modes)
        P = [legendre.legval(at, legendre.legder(unit, d)).T * 2.0**d for d in range(3)]
        self.P, self.P1, self.P2 = P
        # integrals from 0 to xi and to 1 of the interpolant through the quadrature points
        vandermonde = np.linalg.inv(legendre.legvander(nodes, points - 1))
        integrals = (
            0.5
            * np.array([legendre.legval(np.append(nodes, 1.0), legendre.legint(c, lbnd=-1)) for c in np.eye(points)]).T
        )
        self.integral = integrals @ vandermonde

    def __call__(self, t: float, z: Array) -> Array:
        """d/dt of (a, psi, a', psi')."""
        n = self.modes
        a, psi, b, rate = z[:n], z[n], z[n + 1 : 2 * n + 1], z[2 * n + 1]
        length, xi = self.start + V * t, self.xi
        lam = V / length
        rest = 1.0 - xi
        alpha, a_t = self.P @ a, self.P @ b
        a_xi, a_xixi, a_xit = self.P1 @ a, self.P2 @ a, self.P1 @ b
        inner = slice(0, xi.size)
        e = np.array([np.cos(alpha), np.sin(alpha)]).T
        f = np.array([-e[:, 1], e[:, 0]]).T
        w = a_t[inner] + lam * rest * a_xi[inner]
        Dw = 2.0 * lam * rest * a_xit[inner] + lam**2 * rest**2 * a_xixi[inner] - 2.0 * lam**2 * rest * a_xi[inner]
        hub = np.array([np.cos(psi), np.sin(psi)])
        across = np.array([-hub[1], hub[0]])
        a0_t, a0_xi = a_t[-2], a_xi[-2]
        base = -L0 * rate**2 * hub + V * (2.0 * a0_t + lam * a0_xi) * f[-2]
        A = base + length * self.integral @ (f[inner] * Dw[:, None] - e[inner] * (w**2)[:, None])
        Phi = length * np.einsum("qp,pk,pc->kqc", self.integral, self.P[inner], f[inner])
        Phi = np.concatenate([Phi, np.broadcast_to(L0 * across, (1, *Phi.shape[1:]))])
        weights = np.append(RHO * length * self.weights, TIP)
        M = np.einsum("q,jqc,kqc->jk", weights, Phi, Phi)
        r = -np.einsum("q,kqc,qc->k", weights, Phi, A)
        M[n, n] += 0.5 * J
        if self.carried:
            M[n, n] += RHO * (L - length) * L0**2
            r[n] -= RHO * V**2 * L0 * np.sin(alpha[-2] - psi)
        return np.concatenate([b, [rate], np.linalg.solve(M, r)])

    def solve(self, t: Array, rtol: float = 1e-8) -> tuple[Array, Array]:
        """Tip lag (degrees) and body rate (rad/s) at times t."""
        n = self.modes
        z = np.zeros(2 * n + 2)
        z[n + 1] = z[2 * n + 1] = W0
        found = solve_ivp(self, (0.0, t[-1]), z, "DOP853", t, rtol=rtol, atol=1e-2 * rtol)
        assert found.success, found.message
        lag = []
        for time, y in zip(t, found.y.T, strict=True):
            alpha = self.P[: self.xi.size] @ y[:n] - y[n]
            x, across = self.weights @ np.cos(alpha), self.weights @ np.sin(alpha)
            lag.append(np.degrees(np.arctan2(-across, x)))
            assert time >= 0.0
        return np.array(lag), found.y[2 * n + 1]
