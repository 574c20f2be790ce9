"""All beams of a model: their forces, tangents, energies and loads, element by element.

Generalised forces F stand by velocity (`iv` less the number of coordinates). They are those that the equations of
motion have on their left: M a + F = 0, so a force that acts on them is subtracted.
"""

import math

from numba import types, void

from evolvent.jit import (
    REAL,
    VECTOR,
    element_energy_at,
    element_force_at,
    element_tangent_at,
    indirect,
    inlined,
    kernel,
)
from evolvent.kernels import ancf
from evolvent.kernels.rotations import cross
from evolvent.kernels.sparse import SPARSE, add_block
from evolvent.model import MODEL

CABLE, BEAM = 0, 1
#: Vectors of a node: position and slope; position and three slopes.
NODE_VECTORS = (2, 4)
# kinds of beam loads
FIELD, LINE, POINT = 0, 1, 2


@inlined
def _add_inertia(M, n, alpha, x, u, f):
    """f += (M (x) I3) x; returns alpha u^T (M (x) I3) u, W. M : (n, n) float."""
    power = 0.0
    for i in range(n):
        px = py = pz = 0.0
        for j in range(n):
            px += M[i, j] * x[3 * j]
            py += M[i, j] * x[3 * j + 1]
            pz += M[i, j] * x[3 * j + 2]
        f[3 * i] += px
        f[3 * i + 1] += py
        f[3 * i + 2] += pz
    if alpha != 0.0:
        for i in range(n):
            for j in range(n):
                m = alpha * M[i, j]
                power += m * (u[3 * i] * u[3 * j] + u[3 * i + 1] * u[3 * j + 1] + u[3 * i + 2] * u[3 * j + 2])
    return power


@indirect(types.UniTuple(REAL, 2)(VECTOR, VECTOR, MODEL, VECTOR))
def add_elements(y, a, model, F):
    """Internal, damping and inertia forces of all elements into F; returns powers dissipated (mass, stiffness), W.

    Parameters
    ----------
    y : (ny,) float, state
    a : (nv,) float, accelerations of the coordinates
    """
    flexible, n_q = model.flexible, model.info.nq
    beams, elements, work = flexible.beams, flexible.elements, flexible.work
    by_mass = by_stiffness = 0.0
    for k in range(elements.size):
        iq, iv, beam, mass, form = elements[k].iq, elements[k].iv, elements[k].beam, elements[k].mass, elements[k].form
        alpha, at, force = elements[k].alpha, iv - n_q, element_force_at(model.addresses[elements[k].force])
        n = 12 if beams[beam].kind == CABLE else 24
        e, u, f, x = y[iq : iq + n], y[iv : iv + n], F[at : at + n], flexible.e[0, :n]
        for i in range(n):
            x[i] = a[at + i] + alpha * u[i]
        if n == 12:
            by_mass += _add_inertia(flexible.M12[mass], 4, alpha, x, u, f)
            by_stiffness += force(
                e, u, elements[k].beta, flexible.H12[form], flexible.h12[form], flexible.B12[form], work, f
            )
        else:
            by_mass += _add_inertia(flexible.M24[mass], 8, alpha, x, u, f)
            by_stiffness += force(e, u, elements[k].beta, flexible.H24[form], flexible.h24[form], flexible.B0, work, f)
    return by_mass, by_stiffness


@indirect(void(VECTOR, REAL, REAL, MODEL, SPARSE))
def add_element_tangents(y, c_mass, c_rate, model, matrix):
    """Add c_mass M + c_rate C + K of all elements to a matrix."""
    flexible, n_q = model.flexible, model.info.nq
    beams, elements, work = flexible.beams, flexible.elements, flexible.work
    for k in range(elements.size):
        iq, iv, beam, mass, form = elements[k].iq, elements[k].iv, elements[k].beam, elements[k].mass, elements[k].form
        beta, at, tangent = elements[k].beta, iv - n_q, element_tangent_at(model.addresses[elements[k].tangent])
        factor = c_mass + c_rate * elements[k].alpha
        n = 12 if beams[beam].kind == CABLE else 24
        e, u = y[iq : iq + n], y[iv : iv + n]
        if n == 12:
            K, M = flexible.K12, flexible.M12[mass]
            tangent(e, u, beta, c_rate, flexible.H12[form], flexible.h12[form], flexible.B12[form], work, K)
        else:
            K, M = flexible.K24, flexible.M24[mass]
            tangent(e, u, beta, c_rate, flexible.H24[form], flexible.h24[form], flexible.B0, work, K)
        for i in range(n // 3):
            for j in range(n // 3):
                m = factor * M[i, j]
                for c in range(3):
                    K[3 * i + c, 3 * j + c] += m
        size = n // 2
        for r in range(0, n, size):
            for c in range(0, n, size):
                add_block(matrix, at + r, at + c, K, r, c, size, size, 1.0)


@indirect(void(VECTOR, MODEL, VECTOR))
def beam_energies(y, model, out):
    """out : (3,) += kinetic and elastic energy, and the bending energy of cables, J."""
    flexible = model.flexible
    beams, elements, work = flexible.beams, flexible.elements, flexible.work
    for k in range(elements.size):
        iq, iv, mass, form = elements[k].iq, elements[k].iv, elements[k].mass, elements[k].form
        energy = element_energy_at(model.addresses[elements[k].energy])
        if beams[elements[k].beam].kind == CABLE:
            e, u = y[iq : iq + 12], y[iv : iv + 12]
            out[0] += ancf.kinetic_energy(flexible.M12[mass], u)
            out[1] += energy(e, flexible.H12[form], flexible.h12[form], flexible.U12[form], work)
            v, g = work[:9], work[9:15]
            ancf.nodal_vectors(e, 3, v)
            ancf.products(v, 3, g)
            for i in range(6):
                out[2] -= flexible.bend12[form, i] * g[i]
        else:
            e, u = y[iq : iq + 24], y[iv : iv + 24]
            out[0] += ancf.kinetic_energy(flexible.M24[mass], u)
            out[1] += energy(e, flexible.H24[form], flexible.h24[form], flexible.U24[form], work)


@indirect(void(VECTOR, MODEL, VECTOR, VECTOR))
def beam_momenta(y, model, P, H):
    """Linear momentum P and angular momentum H about the inertial origin, (3,) each, added."""
    flexible = model.flexible
    beams, elements = flexible.beams, flexible.elements
    for k in range(elements.size):
        iq, iv, mass = elements[k].iq, elements[k].iv, elements[k].mass
        n = 2 * NODE_VECTORS[beams[elements[k].beam].kind]
        M = flexible.M12[mass] if n == 4 else flexible.M24[mass]
        half = n // 2
        for i in range(n):
            px = py = pz = 0.0
            for j in range(n):
                m, u = M[i, j], iv + 3 * j
                px += m * y[u]
                py += m * y[u + 1]
                pz += m * y[u + 2]
            hx, hy, hz = cross(y[iq + 3 * i], y[iq + 3 * i + 1], y[iq + 3 * i + 2], px, py, pz)
            H[0] += hx
            H[1] += hy
            H[2] += hz
            if i == 0 or i == half:
                P[0] += px
                P[1] += py
                P[2] += pz


# ---------------------------------------------------------------------------------------------- loads


@inlined
def strength(push, t):
    """Value of a push at time t: from its start it grows over `ramp`, smoothly, and ends at its end."""
    if t < push.start or t >= push.end:
        return 0.0
    if push.ramp > 0.0 and t < push.start + push.ramp:
        s = (t - push.start) / push.ramp
        return push.value * s * s * (3.0 - 2.0 * s)
    return push.value


@indirect(void(VECTOR, MODEL, VECTOR))
def add_gravity(gravity, model, P):
    """Weight of all beams into the loads P."""
    flexible, n_q = model.flexible, model.info.nq
    beams, elements = flexible.beams, flexible.elements
    for k in range(elements.size):
        at, mass = elements[k].iv - n_q, elements[k].mass
        n = 2 * NODE_VECTORS[beams[elements[k].beam].kind]
        M = flexible.M12[mass] if n == 4 else flexible.M24[mass]
        for i in range(n):
            m = M[i, 0] + M[i, n // 2]
            for c in range(3):
                P[at + 3 * i + c] += m * gravity[c]


@indirect(void(REAL, VECTOR, REAL, MODEL, VECTOR))
def add_beam_loads(t, y, factor, model, P):
    """All beam loads at time t, times `factor`, into the loads P.

    Notes
    -----
    FIELD, a torque T about the axis z through c: force per mass T z x (r - c)/J, J = int |z x (r - c)|^2 dm, of each
    beam. LINE, force per length along `axis`. POINT, force along `axis` at a vector of coordinates.
    """
    flexible, n_q = model.flexible, model.info.nq
    beams, elements, beam_loads = flexible.beams, flexible.elements, flexible.beam_loads
    for k in range(beam_loads.size):
        value = factor * strength(beam_loads[k], t)
        if value == 0.0:
            continue
        z, centre = beam_loads[k].axis, beam_loads[k].centre
        if beam_loads[k].kind == POINT:
            at = beam_loads[k].iv - n_q
            for c in range(3):
                P[at + c] += value * z[c]
            continue
        beam = beam_loads[k].beam
        first, last = beams[beam].first_element, beams[beam].first_element + beams[beam].elements
        n = 2 * NODE_VECTORS[beams[beam].kind]
        if beam_loads[k].kind == LINE:
            for element in range(first, last):
                at, length = elements[element].iv - n_q, elements[element].length
                weights = 0.5 * length, length * length / 12.0
                for c in range(3):
                    P[at + c] += value * z[c] * weights[0]
                    P[at + 3 + c] += value * z[c] * weights[1]
                    P[at + 3 * (n // 2) + c] += value * z[c] * weights[0]
                    P[at + 3 * (n // 2) + 3 + c] -= value * z[c] * weights[1]
            continue
        inertia = 0.0
        for element in range(first, last):
            inertia += _field(y, n_q, flexible, element, n, z, centre, 0.0, P)
        for element in range(first, last):
            _field(y, n_q, flexible, element, n, z, centre, value / inertia, P)


@kernel
def _field(y, n_q, flexible, k, n, z, centre, scale, P):
    """Forces scale M z x (e - c) of one element into P; returns its moment of inertia about the axis."""
    iq, at, mass = flexible.elements[k].iq, flexible.elements[k].iv - n_q, flexible.elements[k].mass
    M = flexible.M12[mass] if n == 4 else flexible.M24[mass]
    half = n // 2
    e = flexible.e
    for j in range(n):
        x, y0, z0 = y[iq + 3 * j], y[iq + 3 * j + 1], y[iq + 3 * j + 2]
        if j == 0 or j == half:
            x, y0, z0 = x - centre[0], y0 - centre[1], z0 - centre[2]
        e[1, 3 * j], e[1, 3 * j + 1], e[1, 3 * j + 2] = cross(z[0], z[1], z[2], x, y0, z0)
    inertia = 0.0
    for i in range(n):
        fx = fy = fz = 0.0
        for j in range(n):
            fx += M[i, j] * e[1, 3 * j]
            fy += M[i, j] * e[1, 3 * j + 1]
            fz += M[i, j] * e[1, 3 * j + 2]
        inertia += fx * e[1, 3 * i] + fy * e[1, 3 * i + 1] + fz * e[1, 3 * i + 2]
        P[at + 3 * i] += scale * fx
        P[at + 3 * i + 1] += scale * fy
        P[at + 3 * i + 2] += scale * fz
    return inertia


@inlined
def is_finite(x):
    """Whether all entries are finite (four sums, so that they overlap)."""
    a = b = c = d = 0.0
    last = x.size - x.size % 4
    for i in range(0, last, 4):
        a += 0.0 * x[i]
        b += 0.0 * x[i + 1]
        c += 0.0 * x[i + 2]
        d += 0.0 * x[i + 3]
    for i in range(last, x.size):
        a += 0.0 * x[i]
    return math.isfinite(a + b + c + d)
