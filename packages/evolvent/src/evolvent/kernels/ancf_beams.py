"""All beams of a model: their forces, tangents, energies, momenta, weight and accelerations.

Generalised forces F stand by velocity (`iv` less the number of coordinates). They are those that the equations of
motion have on their left: M a + F = 0, so a force that acts on them is subtracted.
"""

import math

from numba import types, void

from evolvent.algebra.linalg import banded_solve_vectors
from evolvent.algebra.sparse import SPARSE, add_block
from evolvent.compiled.jit import MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.compiled.lookups import by_slot, element_energy_at, element_force_at, element_tangent_at
from evolvent.kernels import ancf
from evolvent.kernels.ancf import INTERVAL
from evolvent.kernels.rotations import cross
from evolvent.model import MODEL

USED_FOR = "elements"
#: Kinds of elements: a BEAM has sections, other nodes have an axis alone, without twist.
CABLE, BEAM = 0, 1
#: Vectors of a node: position and slope; position and three slopes.
NODE_VECTORS = (2, 4)
_I = types.int64
#: Signatures of functions of consecutive elements with equal constants.
GROUP_FORCES = void(VECTOR, VECTOR, REAL, _I, MATRIX, VECTOR, MATRIX, VECTOR, VECTOR)
GROUP_ENERGIES = void(VECTOR, VECTOR, _I, MATRIX, VECTOR, MATRIX, VECTOR, MATRIX, VECTOR, VECTOR)
_forces_at, _energies_at = by_slot(GROUP_FORCES), by_slot(GROUP_ENERGIES)


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


@inlined
def _count_equal(elements, first, last):
    """Number of consecutive elements in [first, last) with the constants of the first one and adjacent nodes."""
    n, own = 1, elements[first]
    size = elements[first + 1].iq - own.iq if first + 1 < last else 0
    while n < ancf.GROUP and first + n < last:
        other = elements[first + n]
        if other.form != own.form or other.mass != own.mass or other.bending != own.bending or other.beam != own.beam:
            return n
        if other.group_forces != own.group_forces or other.iq != own.iq + n * size:
            return n
        n += 1
    return n


@inlined
def _count_undamped(elements, first, n):
    """Number of elements without damping before the first damped one, of n elements from `first` on."""
    for k in range(first, first + n):
        if elements[k].alpha != 0.0 or elements[k].beta != 0.0:
            return k - first
    return n


@indirect(void(VECTOR, VECTOR, REAL, _I, _I, MODEL, VECTOR))
def add_group(y, a, scale, first, n, model, F):
    """F += elastic and inertia forces of n consecutive elements with equal constants, as `add_elements` at a state."""
    row, n_q = model.elements[first], model.info.nq
    size = 3 * NODE_VECTORS[model.beams[row.beam].kind] * (n + 1)
    iq, at = row.iq, row.iv - n_q
    _forces_at(model, row.group_forces)(
        y[iq : iq + size], a[at : at + size], scale, n, model.H[row.form], model.h[row.form], model.M[row.mass],
        model.work, F[at : at + size],
    )  # fmt: skip


@indirect(void(VECTOR, _I, _I, MODEL, VECTOR))
def add_group_energies(y, first, n, model, out):
    """out += energies of n consecutive elements with equal constants, as `beam_energies`."""
    row = model.elements[first]
    form, bending = row.form, row.bending
    size = 3 * NODE_VECTORS[model.beams[row.beam].kind] * (n + 1)
    out[1] += n * model.U0[form]
    out[2] += n * model.U0[bending]
    _energies_at(model, row.group_energies)(
        y[row.iq : row.iq + size], y[row.iv : row.iv + size], n, model.H[form], model.h[form], model.H[bending],
        model.h[bending], model.M[row.mass], model.work, out,
    )  # fmt: skip


@indirect(types.UniTuple(REAL, 2)(VECTOR, VECTOR, REAL, INTERVAL, MODEL, VECTOR))
def add_elements(y, a, scale, interval, model, F):
    """Internal, damping and inertia forces of all elements into F; returns powers dissipated (mass, stiffness), W.

    Parameters
    ----------
    y : (ny,) float, state; of a step means of both ends, with increments over its length as rates
    a : (nv,) float, accelerations of the coordinates, which are multiplied by `scale`; 0 where they are not known yet
    interval : of the forces (`ancf.INTERVAL`)
    """
    n_q = model.info.nq
    beams, elements, work = model.beams, model.elements, model.work
    by_mass = by_stiffness = 0.0
    k, is_state = 0, interval[0] == 0.0 and interval[2] == 0.0
    while k < elements.size:
        if is_state and elements[k].group_forces != 0:
            n = _count_undamped(elements, k, _count_equal(elements, k, elements.size))
            if n > 0:
                add_group(y, a, scale, k, n, model, F)
                k += n
                continue
        iq, iv, beam, mass, form = elements[k].iq, elements[k].iv, elements[k].beam, elements[k].mass, elements[k].form
        alpha, at, force = elements[k].alpha, iv - n_q, element_force_at(model, elements[k].force)
        n = 6 * NODE_VECTORS[beams[beam].kind]
        e, u, f, x, changes = y[iq : iq + n], y[iv : iv + n], F[at : at + n], model.e[0, :n], elements[k].changes
        if scale != 0.0 or alpha != 0.0:
            for i in range(n):
                x[i] = scale * a[at + i] + alpha * u[i]
            by_mass += _add_inertia(model.M[mass], n // 3, alpha, x, u, f)
        H, h, B = model.H[form], model.h[form], model.B[form]
        by_stiffness += force(e, u, interval, elements[k].beta, H, h, B, changes, work, f)
        k += 1
    return by_mass, by_stiffness


@inlined
def add_with_mass(matrix, at, n, K, factor, M):
    """Add K + factor M (x) I3 of an element, (n, n), to the unknowns from `at` on; K is changed."""
    for i in range(n // 3):
        for j in range(n // 3):
            m = factor * M[i, j]
            for c in range(3):
                K[3 * i + c, 3 * j + c] += m
    size = n // 2
    for r in range(0, n, size):
        for c in range(0, n, size):
            add_block(matrix, at + r, at + c, K, r, c, size, size, 1.0)


@indirect(void(VECTOR, REAL, REAL, INTERVAL, MODEL, SPARSE))
def add_element_tangents(y, c_mass, c_rate, interval, model, matrix):
    """Add c_mass M + c_rate C + K of all elements to a matrix; y, interval : as of `add_elements`."""
    n_q = model.info.nq
    beams, elements, work = model.beams, model.elements, model.work
    for k in range(elements.size):
        iq, iv, beam, mass, form = elements[k].iq, elements[k].iv, elements[k].beam, elements[k].mass, elements[k].form
        beta, at, tangent = elements[k].beta, iv - n_q, element_tangent_at(model, elements[k].tangent)
        factor = c_mass + c_rate * elements[k].alpha
        n = 6 * NODE_VECTORS[beams[beam].kind]
        e, u, changes = y[iq : iq + n], y[iv : iv + n], elements[k].changes
        K, M, H, h, B = model.K24, model.M[mass], model.H[form], model.h[form], model.B[form]
        tangent(e, u, interval, beta, c_rate, H, h, B, changes, work, K)
        add_with_mass(matrix, at, n, K, factor, M)


@indirect(void(VECTOR, _I, _I, MODEL, VECTOR))
def beam_energies(y, first, last, model, out):
    """out : (3,) += kinetic and elastic energy, and that of bending alone, J, of elements `first` to `last`."""
    beams, elements, work, k = model.beams, model.elements, model.work, first
    while k < last:
        row = elements[k]
        if row.group_energies != 0:
            n = _count_equal(elements, k, last)
            add_group_energies(y, k, n, model, out)
            k += n
            continue
        iq, iv, mass, form, bending = row.iq, row.iv, row.mass, row.form, row.bending
        energy = element_energy_at(model, row.energy)
        n = 6 * NODE_VECTORS[beams[row.beam].kind]
        e, u = y[iq : iq + n], y[iv : iv + n]
        out[0] += ancf.kinetic_energy(model.M[mass], u)
        out[1] += energy(e, model.H[form], model.h[form], model.U0[form], work)
        out[2] += energy(e, model.H[bending], model.h[bending], model.U0[bending], work)
        k += 1


@indirect(void(VECTOR, _I, _I, MODEL, VECTOR, VECTOR))
def beam_momenta(y, first, last, model, P, H):
    """Linear and angular momentum P and H about the inertial origin, (3,), of elements `first` to `last`, added."""
    beams, elements = model.beams, model.elements
    for k in range(first, last):
        iq, iv, mass = elements[k].iq, elements[k].iv, elements[k].mass
        n = 2 * NODE_VECTORS[beams[elements[k].beam].kind]
        M, half = model.M[mass], n // 2
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


@inlined
def _divide_by_mass(model, k, row, x, at):
    """Put M^-1 x in place of x of beam k, from index `at` on; row : of its first vector in `masses`."""
    n = NODE_VECTORS[model.beams[k].kind] * model.beams[k].nodes
    # of a constant width the loops of the solution are unrolled
    if model.beams[k].kind == CABLE:
        banded_solve_vectors(model.masses, row, n, 3, x, at)
    elif model.beams[k].kind != BEAM:
        banded_solve_vectors(model.masses, row, n, 2 * NODE_VECTORS[model.beams[k].kind] - 1, x, at)
    else:
        banded_solve_vectors(model.masses, row, n, 7, x, at)
    return n


@indirect(void(VECTOR, MODEL, VECTOR))
def beam_rates(y, model, dy):
    """Rates of the beams' coordinates and M^-1 (P - F), into dy."""
    n_q = model.info.nq
    row = 0
    for k in range(model.beams.size):
        iq, iv = model.beams[k].iq, model.beams[k].iv
        for i in range(3 * NODE_VECTORS[model.beams[k].kind] * model.beams[k].nodes):
            dy[iq + i] = y[iv + i]
            dy[iv + i] = model.P[iv - n_q + i] - model.F[iv - n_q + i]
        row += _divide_by_mass(model, k, row, dy, iv)


@inlined
def clear_held(model):
    """No forces F of rows of constraint on beams."""
    n_q = model.info.nq
    for k in range(model.beams.size):
        if model.beams[k].held != 0:
            at = model.beams[k].iv - n_q
            for i in range(at, at + 3 * NODE_VECTORS[model.beams[k].kind] * model.beams[k].nodes):
                model.F[i] = 0.0


@indirect(void(MODEL, types.boolean, VECTOR))
def move_held(model, places, x):
    """Add M^-1 F of the forces F of rows of constraint on beams to their velocities in x, or to their places."""
    n_q, row = model.info.nq, 0
    for k in range(model.beams.size):
        n = NODE_VECTORS[model.beams[k].kind] * model.beams[k].nodes
        if model.beams[k].held != 0:
            at, to = model.beams[k].iv - n_q, model.beams[k].iq if places else model.beams[k].iv
            _divide_by_mass(model, k, row, model.F, at)
            for i in range(3 * n):
                x[to + i] += model.F[at + i]
        row += n


@inlined
def kick_beams(y, model, dy):
    """Jumps dy of the velocities of all beams."""
    beams = model.beams
    for k in range(beams.size):
        iv = beams[k].iv
        for i in range(iv, iv + 3 * NODE_VECTORS[beams[k].kind] * beams[k].nodes):
            y[i] += dy[i]


@inlined
def copy_weight(model, P):
    """Weight of all beams, as it stands in `Model.G`, into the loads P."""
    n_q = model.info.nq
    for k in range(model.beams.size):
        at = model.beams[k].iv - n_q
        for i in range(at, at + 3 * NODE_VECTORS[model.beams[k].kind] * model.beams[k].nodes):
            P[i] = model.G[i]


@indirect(void(VECTOR, MODEL, VECTOR))
def add_gravity(gravity, model, P):
    """Weight of all beams into the loads P."""
    n_q = model.info.nq
    beams, elements = model.beams, model.elements
    for k in range(elements.size):
        at, mass = elements[k].iv - n_q, elements[k].mass
        n = 2 * NODE_VECTORS[beams[elements[k].beam].kind]
        M = model.M[mass]
        for i in range(n):
            m = M[i, 0] + M[i, n // 2]
            for c in range(3):
                P[at + 3 * i + c] += m * gravity[c]


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
