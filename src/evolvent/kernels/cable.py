"""The thin ANCF cable: position and slope, e = (r_p, r_p,x, r_q, r_q,x); Green strain at 3 points, constant bending.

Its energy is a quadratic form like the beam's (`kernels.ancf`), in the 6 products of r_p,x, r_q - r_p and r_q,x. Mass
and loads are those of `kernels.ancf` with 4 shape functions.

Notes
-----
U = 1/2 int EA eps^2 dx (3 Gauss points) + 1/2 int EI r,xx . r,xx dx, eps = (r,x . r,x - 1)/2. Two points would leave
a motion without stiffness; more lock where an element spans a large angle. The second integral is the bending energy as
long as the stretch is small: the curvature is |r,x x r,xx|/|r,x|^3.

Damping proportional to the stiffness takes b H g' of the membrane, as the beam's does. Bending is linear in g and would
not be damped by it, so its damping acts on the rate of the curvature k = |r,xx|: power b int EI k'^2 dx, at 2 points
(exact for r,xx, which is linear in x). With q = B_p v, the root of the weight times EI and r,xx at a point p, the
force is B_p^T q b (q . q')/(q . q + eps_p). That is objective and keeps both momenta. A cable knows no directors, so
that a curvature which only turns about the tangent is not damped, as it is not in a rigid rotation. eps_p keeps the
direction q/|q| defined near the straight shape; it belongs to an element bent by `evolvent.elements.STRAIGHT` rad.
"""

from evolvent.jit import inlined, kernel
from evolvent.kernels.ancf import (
    damped_force_of,
    damped_tangent_of,
    energy_of,
    force_of,
    paper_damped_force_of,
    paper_damped_tangent_of,
    tangent_of,
)

#: Vectors and products of the cable.
N, PRODUCTS = 3, 6


@kernel
def cable_energy(e, H, h, U0, work):
    """Strain energy of a cable element, J.

    Parameters
    ----------
    e : (12,) float, coordinates (module docstring); m and 1
    H : (6, 6) float; h : (6,) float; U0 : float, the element's form (`evolvent.elements.cable_form`)
    work : (ancf.WORK,) float, scratch
    """
    return energy_of(e, H, h, U0, N, work)


@kernel
def cable_force(e, H, h, work, f):
    """f += dU/de, the force that the element resists with; f : (12,). Arguments as of `cable_energy`."""
    force_of(e, H, h, N, work, f)


@kernel
def cable_tangent(e, H, h, work, K):
    """K = d2U/de2 : (12, 12). Arguments as of `cable_energy`."""
    tangent_of(e, H, h, N, work, K)


@kernel
def cable_damped_force(e, u, b, H, h, work, f):
    """f += dU/de + b J^T H J u, damping of the membrane alone; returns the power that it takes, W.

    `add_bending_damping` adds that of the bending.

    Parameters
    ----------
    u : (12,) float, rates of the coordinates
    b : float, s
    """
    return damped_force_of(e, u, b, H, h, N, work, f)


@kernel
def cable_damped_tangent(e, u, b, c, H, h, work, K):
    """K = derivative of `cable_damped_force` with respect to e plus c (1/s) times that with respect to u : (12, 12)."""
    damped_tangent_of(e, u, b, c, H, h, N, work, K)


@inlined
def _curvature(B, p, e):
    """q = B_p v : (x, y, z)."""
    x = B[p, 0] * e[3] + B[p, 1] * (e[6] - e[0]) + B[p, 2] * e[9]
    y = B[p, 0] * e[4] + B[p, 1] * (e[7] - e[1]) + B[p, 2] * e[10]
    z = B[p, 0] * e[5] + B[p, 1] * (e[8] - e[2]) + B[p, 2] * e[11]
    return x, y, z


@kernel
def add_bending_damping(e, u, b, B, f):
    """f += objective damping of the bending, proportional to its stiffness; returns the power that it takes, W.

    Parameters
    ----------
    e, u : (12,) float, coordinates and their rates
    b : float, s
    B : (2, 4) float, curvature at two points and eps (`evolvent.elements.cable_bending`)
    f : (12,) float
    """
    power = 0.0
    for p in range(2):
        q, qt = _curvature(B, p, e), _curvature(B, p, u)
        rate = q[0] * qt[0] + q[1] * qt[1] + q[2] * qt[2]
        k = b * rate / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + B[p, 3])
        power += k * rate
        a = (-B[p, 1], B[p, 0], B[p, 1], B[p, 2])
        for i in range(4):
            for c in range(3):
                f[3 * i + c] += k * a[i] * q[c]
    return power


@kernel
def add_bending_damping_tangent(e, u, b, c, B, K):
    """K += derivative of `add_bending_damping` with respect to e plus c (1/s) times that with respect to u : (12, 12).

    Notes
    -----
    Sum over p of B_p^T D B_p, D = b/Q (q . q' I + q (q' + c q - 2 (q . q')/Q q)^T), Q = q . q + eps_p.
    """
    for p in range(2):
        q, qt = _curvature(B, p, e), _curvature(B, p, u)
        rate = q[0] * qt[0] + q[1] * qt[1] + q[2] * qt[2]
        Q = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + B[p, 3]
        a = (-B[p, 1], B[p, 0], B[p, 1], B[p, 2])
        for r in range(3):
            for s in range(3):
                D = q[r] * (qt[s] + (c - 2.0 * rate / Q) * q[s])
                if r == s:
                    D += rate
                for i in range(4):
                    for j in range(4):
                        K[3 * i + r, 3 * j + s] += b / Q * D * a[i] * a[j]


@kernel
def cable_paper_damped_force(e, u, b, H, h, work, f):
    """f += dU/de + b K_e(e) u, damping by the secant stiffness, bending included; returns the power it takes, W.

    For comparison, not objective: as of `ancf.beam_paper_damped_force`.
    """
    return paper_damped_force_of(e, u, b, H, h, N, work, f)


@kernel
def cable_paper_damped_tangent(e, u, b, c, H, h, work, K):
    """K = derivative of `cable_paper_damped_force` with respect to e plus c (1/s) times that to u : (12, 12)."""
    paper_damped_tangent_of(e, u, b, c, H, h, N, work, K)
