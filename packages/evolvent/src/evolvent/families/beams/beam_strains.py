"""What the sections of beams carry in a state: strains, forces, moments and energy per length along their elements.

A beam's section with the forces N, Q_y, Q_z and moments M_y, M_z conjugate to `ancf.STRAINS` carries the force
dW/da = N a + Q_y b + Q_z c + M_y b' + M_z c' (a = r,x, b = r,y and c = r,z): results are its parts along a, b and c.
A cable's moment is EI |r' x r''|/|r'|^2. Its force is EA E |r'| + EI |r''|^2/|r'|, since its energy of bending is that
of r'' whatever the stretch; with engineering strain EA (|r'| - 1).

Strain and force at Gauss's two points are moved so that their mean is the element's mean by the three points of the
strain: of a slack beam that is bent, the cubic stretches between its points by more than the beam does.
"""

import math

from numba import types, void

from evolvent.compiled.jit import VECTOR, indirect, inlined
from evolvent.families.beams.cable import slope_factors
from evolvent.kernels import ancf
from evolvent.kernels.ancf_beams import BEAM, NODE_VECTORS, beam_energies, beam_momenta
from evolvent.kernels.rotations import cross
from evolvent.model import MODEL

USED_FOR = "elements"
#: Points of an element: the two of the results, the three of the means, of which the middle has moments; weights.
_TWO, _THREE = 0.5 / math.sqrt(3.0), 0.5 * math.sqrt(0.6)
POINTS = (0.5 - _TWO, 0.5 + _TWO, 0.5 - _THREE, 0.5, 0.5 + _THREE)
_WEIGHTS, MIDDLE = (0.0, 0.0, 5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0), 3
#: Parameters of a point (`parts.beam`): stiffness (9 x 9) and strains without stress; EA, EI and strain without stress.
OF_BEAM, OF_CABLE = 90, 3


@indirect(void(VECTOR, MODEL))
def evaluate_beams(y, model):
    """Evaluate all elements in a state into their records, with the free strains that stand there (`thermal`)."""
    for k in range(model.elements.size):
        row, extra, pull = model.elements[k], 0.0, 0.0
        strain, force = row.strain, row.axial_force
        for i in range(len(POINTS)):
            if model.beams[row.beam].kind == BEAM:
                e, N = _evaluate_beam(y, row, i, model)
            else:
                e, N = _evaluate_cable(y, row, i, model)
            extra, pull = extra + _WEIGHTS[i] * e, pull + _WEIGHTS[i] * N
            if i < 2:
                strain[i], force[i], row.free_strain[i] = e, N, row.free[i, 0]
                row.free_curvature_y[i], row.free_curvature_z[i] = row.free[i, 2], row.free[i, 1]
        extra, pull = extra - 0.5 * (strain[0] + strain[1]), pull - 0.5 * (force[0] + force[1])
        for i in range(2):
            strain[i] += extra
            force[i] += pull


@indirect(void(VECTOR, MODEL))
def evaluate_sums(y, model):
    """Energies and momenta of all beams in a state into their records; overwrites `Model.sums`."""
    rows, out = model.beams, model.sums[1]
    for k in range(rows.size):
        first, linear, angular = rows[k].first_element, rows[k].linear, rows[k].angular
        for i in range(9):
            out[i] = 0.0
        beam_energies(y, first, first + rows[k].elements, model, out[:3])
        beam_momenta(y, first, first + rows[k].elements, model, out[3:6], out[6:9])
        rows[k].kinetic, rows[k].elastic, rows[k].bending = out[0], out[1], out[2]
        for i in range(3):
            linear[i], angular[i] = out[3 + i], out[6 + i]


@indirect(void(types.int64, VECTOR, MODEL))
def evaluate_nodes(n, y, model):
    """Motion, deflection and curvature of all nodes of beams at sample n, and axes of their roots, into the records.

    Notes
    -----
    The deflection is the position less that of the shape without stress, carried by the root and its axes. The
    curvature |r' x r''|/|r'|^3 is the mean of those of the cubic elements that meet at the node.
    """
    for k in range(model.beams.size):
        row, size, e = model.beams[k], 3 * NODE_VECTORS[model.beams[k].kind], model.e[0]
        _note_axes(n, y, k, model)
        for i in range(row.nodes):
            node, iq, iv = model.beam_nodes[row.first_node + i], row.iq + size * i, row.iv + size * i
            for c in range(3):
                node.x[c], node.v[c], node.slope[c] = y[iq + c], y[iv + c], y[iq + 3 + c]
                e[c] = y[iq + c] - y[row.iq + c]
            for c in range(3):
                axis = row.axes[c]
                node.deflection[c] = axis[0] * e[0] + axis[1] * e[1] + axis[2] * e[2] - node.undeformed[c]
            low, high, first = max(i - 1, 0), min(i, row.elements - 1), row.first_element
            node.curvature = 0.0
            for j in range(low, high + 1):
                at, h = row.iq + size * j, model.elements[first + j].length
                a, b, sign = (4.0, 2.0, 1.0) if j == i else (2.0, 4.0, -1.0)
                for c in range(3):
                    step, s0, s1 = y[at + size + c] - y[at + c], y[at + 3 + c], y[at + size + 3 + c]
                    e[c] = sign * (6.0 * step - h * (a * s0 + b * s1)) / (h * h)
                x, yy, z = cross(node.slope[0], node.slope[1], node.slope[2], e[0], e[1], e[2])
                s = node.slope[0] * node.slope[0] + node.slope[1] * node.slope[1] + node.slope[2] * node.slope[2]
                node.curvature += math.sqrt(x * x + yy * yy + z * z) / (s * math.sqrt(s)) / (high - low + 1.0)


@inlined
def _note_axes(n, y, k, model):
    """Axes of the root of beam k at sample n: x along, y and z across it.

    Of a cable, which has no twist, y is in the plane across z at first where that is possible, and turns from sample to
    sample with x by the shortest way: y - 2 (y . (x0 + x))/|x0 + x|^2 (x0 + x), since y . x0 = 0.
    """
    row, iq = model.beams[k], model.beams[k].iq
    axes = row.axes
    if row.kind == BEAM:
        bx, by, bz = y[iq + 6], y[iq + 7], y[iq + 8]
        x0, x1, x2 = cross(bx, by, bz, y[iq + 9], y[iq + 10], y[iq + 11])
    else:
        x0, x1, x2 = y[iq + 3], y[iq + 4], y[iq + 5]
    size = math.sqrt(x0 * x0 + x1 * x1 + x2 * x2)
    x0, x1, x2 = x0 / size, x1 / size, x2 / size
    if row.kind != BEAM:
        if n == 0:
            steep = abs(x2) >= 0.9
            bx, by, bz = (x2, 0.0, -x0) if steep else (-x1, x0, 0.0)
        else:
            bx, by, bz = axes[1, 0], axes[1, 1], axes[1, 2]
            ux, uy, uz = axes[0, 0] + x0, axes[0, 1] + x1, axes[0, 2] + x2
            square = ux * ux + uy * uy + uz * uz
            if square > 1e-12:
                s = 2.0 * (bx * ux + by * uy + bz * uz) / square
                bx, by, bz = bx - s * ux, by - s * uy, bz - s * uz
    s = bx * x0 + by * x1 + bz * x2
    bx, by, bz = bx - s * x0, by - s * x1, bz - s * x2
    size = math.sqrt(bx * bx + by * by + bz * bz)
    bx, by, bz = bx / size, by / size, bz / size
    axes[0, 0], axes[0, 1], axes[0, 2] = x0, x1, x2
    axes[1, 0], axes[1, 1], axes[1, 2] = bx, by, bz
    axes[2, 0], axes[2, 1], axes[2, 2] = cross(x0, x1, x2, bx, by, bz)


@inlined
def _evaluate_beam(y, row, i, model):
    """Results of point i of a beam's element but for strain and axial force, which are returned."""
    p, at, e, work = model.parameters, row.section + OF_BEAM * i, y[row.iq : row.iq + 24], model.work
    off, S, free = work[:9], work[9:18], row.free
    ancf.line_strains(e, row.length, POINTS[i], off)
    for r in range(9):
        off[r] -= p[at + 81 + r]
    off[0], off[4], off[5] = off[0] - free[i, 0], off[4] - free[i, 1], off[5] - free[i, 2]
    energy = N = shear_y = shear_z = square = 0.0
    for r in range(9):
        S[r] = 0.0
        for c in range(9):
            S[r] += p[at + 9 * r + c] * off[c]
        energy += 0.5 * S[r] * off[r]
    for r in range(3):
        a, b, b1, c, c1 = ancf.line_vectors(e, row.length, POINTS[i], r)
        g = S[0] * a + S[1] * b + S[2] * c + S[4] * b1 + S[5] * c1
        N, shear_y, shear_z, square = N + g * a, shear_y + g * b, shear_z + g * c, square + a * a
    if i < 2:
        row.shear_force_y[i], row.shear_force_z[i], row.energy_density[i] = shear_y, shear_z, energy
    elif i == MIDDLE:
        row.torsional_moment, row.bending_moment_y, row.bending_moment_z = S[3], S[5], -S[4]
    return off[0], N / math.sqrt(square)


@inlined
def _evaluate_cable(y, row, i, model):
    """Results of point i of a cable's element but for strain and axial force, which are returned."""
    p, at, xi, L = model.parameters, row.section + OF_CABLE * i, POINTS[i], row.length
    half = 3 * NODE_VECTORS[model.beams[row.beam].kind]
    e = y[row.iq : row.iq + half + 6]
    A = slope_factors(L, xi)
    B = ((6.0 * xi - 4.0) / L, (6.0 - 12.0 * xi) / (L * L), (6.0 * xi - 2.0) / L)
    ax, ay, az = _combined(e, half, A)
    bx, by, bz = _combined(e, half, B)
    x, yy, z = cross(ax, ay, az, bx, by, bz)
    square = ax * ax + ay * ay + az * az
    size, bend = math.sqrt(square), math.sqrt(x * x + yy * yy + z * z) / square
    strain = size - 1.0 if row.stretch != 0 else 0.5 * (square - 1.0)
    strain -= p[at + 2] + row.free[i, 0]
    force = p[at] * strain
    if i < 2:
        row.bending_moment[i] = p[at + 1] * bend
        row.energy_density[i] = 0.5 * (force * strain + p[at + 1] * bend * bend)
    if row.stretch == 0:
        force = force * size + p[at + 1] * (bx * bx + by * by + bz * bz) / size
    return strain, force


@inlined
def _combined(e, half, S):
    """S . (r_p,x, r_q - r_p, r_q,x) of a cable's element, whose nodes have `half` coordinates."""
    return (
        S[0] * e[3] + S[1] * (e[half] - e[0]) + S[2] * e[half + 3],
        S[0] * e[4] + S[1] * (e[half + 1] - e[1]) + S[2] * e[half + 4],
        S[0] * e[5] + S[1] * (e[half + 2] - e[2]) + S[2] * e[half + 5],
    )
