"""The thread as a continuum that grows (ALE), with Legendre modes: an independent reference, by SciPy.

Source: shared/models/thread.md, "Continuum with continuous mass injection" and "Free spool". alpha(xi) = sum a_k
P_k(2 xi - 1) is the inertial angle of the tangent, xi = arc / l; everything is linear in a_k'', psi'' and l''. Planar,
two blades.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.polynomial import legendre

from evolvent_papers.papers.thread_variants import Data

Array = np.ndarray
_DATA = Data()
J, W0, L0, R, V = _DATA.inertia, _DATA.rate, _DATA.offset, _DATA.radius, _DATA.speed
RHO, L, TIP = _DATA.line_density, _DATA.length, _DATA.tip_mass


class Continuum:
    """Blade of length l(t) on a body of inertia J / 2, fed at the rate V or by a free spool.

    Parameters
    ----------
    modes : int
    start : float, m, straight at the start and turning with the body
    carried : bool, whether wound thread acts on the body (as in the source, evenly wound, its r^2 / 2 about a diameter
        of the spool added) or not (as in the paper)
    spool : (float, float), kg m2 and N m, inertia and torque of a free spool that starts at the rate of the drive
    """

    def __init__(
        self,
        modes: int = 6,
        start: float = 0.005,
        carried: bool = False,
        spool: tuple[float, float] | None = None,
        points: int = 16,
    ) -> None:
        self.modes, self.start, self.carried, self.spool = modes, start, carried, spool
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
        """d/dt of (a, psi, l, a', psi', l')."""
        n = self.modes
        a, psi, length = z[:n], z[n], z[n + 1]
        b, rate, speed = z[n + 2 : 2 * n + 2], z[2 * n + 2], z[2 * n + 3]
        xi = self.xi
        lam = speed / length
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
        base = -L0 * rate**2 * hub + speed * (2.0 * a0_t + lam * a0_xi) * f[-2]
        A = base + length * self.integral @ (f[inner] * Dw[:, None] - e[inner] * (w**2)[:, None])
        # accelerations by a'', psi'' and l''; each equation is what A does along the first two, and along e(a0)
        along, by = np.empty((2, n + 2, *A.shape))
        along[:n] = by[:n] = length * np.einsum("qp,pk,pc->kqc", self.integral, self.P[inner], f[inner])
        along[n] = by[n] = L0 * across
        along[n + 1] = e[-2]
        by[n + 1] = e[-2] + self.integral @ (f[inner] * (rest * a_xi[inner])[:, None])
        weights = np.full(xi.size + 1, TIP)
        weights[:-1] = RHO * length * self.weights
        M = np.einsum("q,jqc,kqc->jk", weights, along, by)
        r = -np.einsum("q,kqc,qc->k", weights, along, A)
        M[n, n] += 0.5 * J
        wound = RHO * (L - length) if self.carried else 0.0
        if self.carried:
            M[n, n] += wound * (L0**2 + 0.5 * R**2)
            r[n] -= RHO * speed**2 * L0 * np.sin(alpha[-2] - psi) - RHO * speed * 0.5 * R**2 * rate
        result = np.zeros(n + 2)
        if self.spool is None:
            result[: n + 1] = np.linalg.solve(M[: n + 1, : n + 1], r[: n + 1])
        else:
            M[n + 1, n + 1] += self.spool[0] / R**2 + wound
            r[n + 1] += self.spool[1] / R
            result[:] = np.linalg.solve(M, r)
        return np.concatenate([b, [rate, speed], result])

    def solve(self, t: Array, rtol: float = 1e-8) -> tuple[Array, Array, Array]:
        """Tip lag (degrees), body rate (rad/s) and length out (m) at times t.

        Raises
        ------
        RuntimeError
            Where SciPy does not reach the last time.
        """
        n = self.modes
        z = np.zeros(2 * n + 4)
        z[n + 1], z[n + 2], z[2 * n + 2], z[2 * n + 3] = self.start, W0, W0, V
        found = scipy.integrate.solve_ivp(self, (0.0, t[-1]), z, "DOP853", t, rtol=rtol, atol=1e-2 * rtol)
        if not found.success:
            raise RuntimeError(f"the continuum was not solved: {found.message}")
        lag = []
        for y in found.y.T:
            alpha = self.P[: self.xi.size] @ y[:n] - y[n]
            x, across = self.weights @ np.cos(alpha), self.weights @ np.sin(alpha)
            lag.append(np.degrees(np.arctan2(-across, x)))
        return np.array(lag), found.y[2 * n + 2], found.y[n + 1]
