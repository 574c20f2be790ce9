"""Loads on beams that follow the section or a law: moments, follower forces, forces by laws.

The axes of a section are those of its slopes b = r,y and c = r,z: e1 along b x c, e2 along b, e3 = e1 x e2. Its turn is
w = (n x n' + b* x b' + c* x c')/2, n = e1, with b*, c* the dual vectors of b and c in the section's plane: of a section
that moves as a rigid body its angular velocity. The generalised forces of a moment M do the work M . w. A cable has the
tangent t alone: w = t x t'/t.t, and M = t x Q with Q = M x t/t.t; the part of M along t does no work.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined, kernel
from evolvent.kernels.ancf_beams import BEAM, NODE_VECTORS
from evolvent.kernels.law_means import force_of, moment_of
from evolvent.kernels.rotations import cross
from evolvent.model import MODEL, having, nonzero

# kinds of beam loads: a torque spread over the mass, a force per length, a force at a vector, a moment on a node
FIELD, LINE, POINT, MOMENT = 0, 1, 2, 3
USED_FOR = tuple(having("beam_loads", **test) for test in ({"kind": MOMENT}, {"frame": nonzero}, {"law": nonzero}))
#: Points and weights of Gauss's rule on [0, 1], by which a force per length is integrated over an element.
GAUSS = (
    (0.5 - 0.5 * math.sqrt(0.6), 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.5 + 0.5 * math.sqrt(0.6), 5.0 / 18.0),
)

_I = types.int64


@inlined
def follows(beam_loads, k):
    """Whether load k depends on where its beam is: a moment, a follower force, or one by a law."""
    return beam_loads[k].kind == MOMENT or beam_loads[k].frame != 0 or beam_loads[k].law != 0


@inlined
def section_axes(y, iq):
    """Axes e1, e2, e3 of the section of a node of 24-coordinate elements: nine floats."""
    bx, by, bz = y[iq + 6], y[iq + 7], y[iq + 8]
    nx, ny, nz = cross(bx, by, bz, y[iq + 9], y[iq + 10], y[iq + 11])
    a, b = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz), 1.0 / math.sqrt(bx * bx + by * by + bz * bz)
    nx, ny, nz, bx, by, bz = a * nx, a * ny, a * nz, b * bx, b * by, b * bz
    cx, cy, cz = cross(nx, ny, nz, bx, by, bz)
    return nx, ny, nz, bx, by, bz, cx, cy, cz


@inlined
def section_duals(y, iq):
    """Normal n of a section, and the dual vectors of its slopes: nine floats."""
    bx, by, bz = y[iq + 6], y[iq + 7], y[iq + 8]
    cx, cy, cz = y[iq + 9], y[iq + 10], y[iq + 11]
    nx, ny, nz = cross(bx, by, bz, cx, cy, cz)
    a = math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / a, ny / a, nz / a
    px, py, pz = cross(cx, cy, cz, nx, ny, nz)
    qx, qy, qz = cross(nx, ny, nz, bx, by, bz)
    return nx, ny, nz, px / a, py / a, pz / a, qx / a, qy / a, qz / a


@inlined
def section_turn(y, iq, iv, is_cable):
    """Angular velocity of the section of a node: three floats."""
    if is_cable:
        x, yy, z = y[iq + 3], y[iq + 4], y[iq + 5]
        wx, wy, wz = cross(x, yy, z, y[iv + 3], y[iv + 4], y[iv + 5])
        s = 1.0 / (x * x + yy * yy + z * z)
        return s * wx, s * wy, s * wz
    nx, ny, nz, px, py, pz, qx, qy, qz = section_duals(y, iq)
    ux, uy, uz = y[iv + 6], y[iv + 7], y[iv + 8]
    vx, vy, vz = y[iv + 9], y[iv + 10], y[iv + 11]
    b, c = nx * ux + ny * uy + nz * uz, nx * vx + ny * vy + nz * vz
    ax, ay, az = cross(nx, ny, nz, -b * px - c * qx, -b * py - c * qy, -b * pz - c * qz)
    bx, by, bz = cross(px, py, pz, ux, uy, uz)
    cx, cy, cz = cross(qx, qy, qz, vx, vy, vz)
    return 0.5 * (ax + bx + cx), 0.5 * (ay + by + cy), 0.5 * (az + bz + cz)


@inlined
def couple_on(nx, ny, nz, px, py, pz, mx, my, mz):
    """Force on a slope whose dual vector is p: (M x p - (M . (n x p)) n)/2."""
    fx, fy, fz = cross(mx, my, mz, px, py, pz)
    gx, gy, gz = cross(nx, ny, nz, px, py, pz)
    s = mx * gx + my * gy + mz * gz
    return 0.5 * (fx - s * nx), 0.5 * (fy - s * ny), 0.5 * (fz - s * nz)


@inlined
def node_vector(t, y, k, model):
    """Force or moment of load k on a node for a value of 1, inertial axes: three floats."""
    row, iq, iv = model.beam_loads[k], model.beam_loads[k].iq, model.beam_loads[k].iv
    fx, fy, fz = row.axis[0], row.axis[1], row.axis[2]
    if row.law != 0:
        x, v, p = model.scratch[1], model.scratch[2], model.parameters[row.first : row.last]
        for c in range(3):
            x[c], v[c] = y[iq + c], y[iv + c]
        if row.kind != MOMENT:
            fx, fy, fz = force_of(row.law, x, v, t, p, model)
        else:
            v[0], v[1], v[2] = section_turn(y, iq, iv, model.beams[row.beam].kind != BEAM)
            fx, fy, fz = moment_of(row.law, x, y[iv : iv + 3], v, t, p, model)
    if row.frame != 0:
        e = section_axes(y, iq)
        return (
            fx * e[0] + fy * e[3] + fz * e[6],
            fx * e[1] + fy * e[4] + fz * e[7],
            fx * e[2] + fy * e[5] + fz * e[8],
        )
    return fx, fy, fz


@kernel
def _node_forces(t, y, k, model, out):
    """Generalised forces of load k on the vectors of its node, for a value of 1, into out, all its coordinates."""
    iq = model.beam_loads[k].iq
    mx, my, mz = node_vector(t, y, k, model)
    for i in range(out.size):
        out[i] = 0.0
    if model.beam_loads[k].kind == POINT:
        out[0], out[1], out[2] = mx, my, mz
    elif model.beams[model.beam_loads[k].beam].kind != BEAM:
        x, yy, z = y[iq + 3], y[iq + 4], y[iq + 5]
        fx, fy, fz = cross(mx, my, mz, x, yy, z)
        s = 1.0 / (x * x + yy * yy + z * z)
        out[3], out[4], out[5] = s * fx, s * fy, s * fz
    else:
        nx, ny, nz, px, py, pz, qx, qy, qz = section_duals(y, iq)
        out[6], out[7], out[8] = couple_on(nx, ny, nz, px, py, pz, mx, my, mz)
        out[9], out[10], out[11] = couple_on(nx, ny, nz, qx, qy, qz, mx, my, mz)


@inlined
def _axis_weights(length, xi):
    """Shape functions of r_p, r_p,x, r_q, r_q,x on the axis (Hermite's)."""
    a, b = xi * xi, xi * xi * xi
    return 1.0 - 3.0 * a + 2.0 * b, length * (xi - 2.0 * a + b), 3.0 * a - 2.0 * b, length * (b - a)


@inlined
def line_point(y, element, xi, model):
    """Position and velocity of a point of an element's axis into model.scratch[1:]; returns the shape functions."""
    x, v = model.scratch[1], model.scratch[2]
    iq, iv = model.elements[element].iq, model.elements[element].iv
    half = 3 * NODE_VECTORS[model.beams[model.elements[element].beam].kind]
    S = _axis_weights(model.elements[element].length, xi)
    for c in range(3):
        x[c] = S[0] * y[iq + c] + S[1] * y[iq + 3 + c] + S[2] * y[iq + half + c] + S[3] * y[iq + half + 3 + c]
        v[c] = S[0] * y[iv + c] + S[1] * y[iv + 3 + c] + S[2] * y[iv + half + c] + S[3] * y[iv + half + 3 + c]
    return S


@indirect(void(REAL, VECTOR, _I, REAL, MODEL, VECTOR))
def add_following_load(t, y, k, value, model, P):
    """Load k (`follows`) times `value` into the loads P."""
    n_q = model.info.nq
    row = model.beam_loads[k]
    beam = row.beam
    half = 3 * NODE_VECTORS[model.beams[beam].kind]
    if row.kind != LINE:
        out = model.f[:half]
        _node_forces(t, y, k, model, out)
        for i in range(half):
            P[row.iv - n_q + i] += value * out[i]
        return
    p, first = model.parameters[row.first : row.last], model.beams[beam].first_element
    for element in range(first, first + model.beams[beam].elements):
        at, length = model.elements[element].iv - n_q, model.elements[element].length
        for xi, weight in GAUSS:
            S = line_point(y, element, xi, model)
            g = force_of(row.law, model.scratch[1], model.scratch[2], t, p, model)
            for c in range(3):
                s = value * weight * length * g[c]
                P[at + c] += s * S[0]
                P[at + 3 + c] += s * S[1]
                P[at + half + c] += s * S[2]
                P[at + half + 3 + c] += s * S[3]
