"""Thermal strain of beams: forces by which a temperature acts on their elements, and their tangent.

With the constants C of an element (`evolvent.elements.thermal`) and the amplitudes a of its load, the forces are
J^T (C^T a) among the loads, J the derivative of the products of the nodal vectors; of a cable with engineering strain,
of the stretches at its three points. What damping by the stiffness takes is that of the rate of the whole strain.
"""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.families.beams import cable
from evolvent.families.rods import rod
from evolvent.families.rods.rod_strains import STRAIN
from evolvent.families.shells import shell, shell_strains
from evolvent.kernels import ancf, ancf_beams
from evolvent.kernels.free_strains import AMPLITUDES, fill_mean
from evolvent.kernels.rotations import dot
from evolvent.model import MODEL

USED_FOR = "thermal_loads"
#: The first amplitudes stretch, the others bend.
STRETCHES = 2
#: Parameters of an element after its C: Q and C g0.
AFTER = AMPLITUDES * (AMPLITUDES + 1)


@inlined
def columns(is_cable, stretch):
    """Number of columns of C."""
    if is_cable:
        return 3 if stretch != 0 else cable.PRODUCTS
    return ancf.PRODUCTS


@indirect(void(types.int64, VECTOR, MODEL))
def evaluate_energies(n, y, model):
    """What strain energies change by, less the free strains, and works of these, at sample n into the records of loads.

    After `heat_beams`, of rods after `heat_rods` and `rod.evaluate_rods`, of shells alike. Works are those since sample
    0, by the trapezoidal rule over the samples, as the free strains change.

    Notes
    -----
    With c = C (g - g0) of all elements the energies change by a . Q a/2 - a . c; of a rod c . a is its stress times the
    free strains.
    """
    for k in range(model.thermal_loads.size):
        load = model.thermal_loads[k]
        load.change, load.along_y, load.along_z = load.now[0], load.now[2], load.now[4]
        if load.shell < 0:
            _add_half_work(load, n, -1.0)
        load.elastic = load.bending = load.own = 0.0
        for j in range(AMPLITUDES):
            load.pull[j] = 0.0
        if load.beam >= 0:
            _add_beam_energies(y, k, model)
        elif load.rod >= 0:
            _add_rod_energies(k, model)
        else:
            _add_shell_energies(n, k, model)
            continue
        _add_half_work(load, n, 1.0)
        for j in range(AMPLITUDES):
            load.amplitudes[j] = load.now[j]


@inlined
def _add_beam_energies(y, k, model):
    """`evaluate_energies` of a heated beam, whose record has those less the free strains then."""
    load = model.thermal_loads[k]
    a, p, at, first = load.now, model.parameters, load.constants, model.beams[load.beam].first_element
    is_cable = model.beams[load.beam].kind == ancf_beams.CABLE
    n = 3 if is_cable else ancf.N
    for i in range(first, first + model.beams[load.beam].elements):
        iq, m = model.elements[i].iq, columns(is_cable, model.elements[i].stretch)
        v, g = model.work[: 3 * n], model.work[3 * n : 3 * n + m]
        ancf.nodal_vectors(y[iq : iq + 3 * n + 3], n, v)
        if model.elements[i].stretch != 0:
            for q in range(3):
                b = cable._derivative(model.H[model.elements[i].form], q, 0, v)
                g[q] = math.sqrt(dot(b, b))
        else:
            ancf.products(v, n, g)
        after = at + AMPLITUDES * m
        for j in range(AMPLITUDES):
            c, own = -p[after + AMPLITUDES * AMPLITUDES + j], 0.0
            for q in range(m):
                c += p[at + j * m + q] * g[q]
            for q in range(AMPLITUDES):
                own += 0.5 * a[j] * p[after + AMPLITUDES * j + q] * a[q]
            load.pull[j] += c
            load.own += own
            load.elastic += own - a[j] * c
            if j >= STRETCHES:  # C and Q do not couple stretch and bending
                load.bending += own - a[j] * c
        at = after + AFTER
    row = model.beams[load.beam]
    row.elastic, row.bending = row.elastic + load.elastic, row.bending + load.bending


@inlined
def _add_rod_energies(k, model):
    """`evaluate_energies` of a heated rod."""
    load = model.thermal_loads[k]
    first, S, F = model.rods[load.rod].first_element, model.work[:6], model.work[6:12]
    for i in range(first, first + model.rods[load.rod].elements):
        row, alpha = model.rod_elements[i], model.parameters[load.constants + i - first]
        free, m = row.free, row.m1
        for j in range(6):
            S[j] = F[j] = 0.0
        rod.stress(model.rod_elements, i, m, STRAIN, row.length, S)
        rod.stress(model.rod_elements, i, free, 0, row.length, F)
        for j in range(6):
            load.own += 0.5 * F[j] * free[j]
            change = 0.5 * (F[j] * free[j] - F[j] * m[STRAIN + j] - S[j] * free[j])
            load.elastic += change
            load.bending += change if j > 2 else 0.0
        load.pull[0], load.pull[4], load.pull[2] = (
            load.pull[0] + alpha * S[0], load.pull[4] + alpha * S[4], load.pull[2] - alpha * S[5]
        )  # fmt: skip


@inlined
def _add_shell_energies(n, k, model):
    """`evaluate_energies` of a heated shell: the work is that of the elastic stresses, element by element."""
    load, rows = model.thermal_loads[k], model.shell_elements
    first, S = model.shells[load.shell].first_element, model.work[: shell_strains.STRAINS]
    if n == 0:
        load.work = 0.0
    for i in range(first, first + model.shells[load.shell].elements):
        row = rows[i]
        for m in range(shell_strains.STRAINS):
            S[m] = 0.0
            for j in range(shell_strains.STRAINS):
                S[m] += row.stiffness[m, j] * row.m1[shell_strains.STRAIN + j]
        whole, bent = shell.less_free(rows, i, S)
        load.elastic, load.bending = load.elastic + whole, load.bending + bent
        for m in range(shell_strains.STRAINS):
            held = S[m] - shell.free_stress(rows, i, m)
            if n > 0:
                load.work -= 0.5 * (held + row.held[m]) * (row.free[m] - row.freed[m])
            row.held[m], row.freed[m] = held, row.free[m]


@inlined
def _add_half_work(load, n, sign):
    """Half of the work since sample n - 1, by the pull in the record, and `sign` times its `own` energy."""
    if n == 0:
        load.work = 0.0
        return
    load.work += sign * load.own
    for j in range(AMPLITUDES):
        load.work -= 0.5 * (load.now[j] - load.amplitudes[j]) * load.pull[j]


@inlined
def _fill_stresses(load, at, m, p, s):
    """s = C^T a : (m,), of the element whose constants stand at `at` of the parameters p."""
    for k in range(m):
        s[k] = 0.0
    for j in range(AMPLITUDES):
        a = load.now[j]
        if a != 0.0:
            for k in range(m):
                s[k] += a * p[at + j * m + k]


@indirect(void(REAL, REAL, VECTOR, REAL, MODEL, VECTOR))
def add_thermal_loads(t0, t1, y, factor, model, P):
    """Forces of all temperatures, times `factor`, into the loads P; keeps the amplitudes for the tangent.

    Notes
    -----
    Amplitudes are the means of those at t0 and t1. Over a step along the mean shape the forces then do the work
    a_m . dc, c = C g, and the strain energy, in which -a . c stands, changes beside it by -da . c_m alone.
    """
    n_q, p = model.info.nq, model.parameters
    elements, work = model.elements, model.work
    for k in range(model.thermal_loads.size):
        load = model.thermal_loads[k]
        if load.beam < 0:
            continue
        fill_mean(t0, t1, factor, load, model)
        at, first = load.constants, model.beams[load.beam].first_element
        is_cable = model.beams[load.beam].kind == ancf_beams.CABLE
        for i in range(first, first + model.beams[load.beam].elements):
            iq, own = elements[i].iq, elements[i].iv - n_q
            n = 3 if is_cable else ancf.N
            size = 3 * n + 3
            m = columns(is_cable, elements[i].stretch)
            v, s = work[: 3 * n], work[3 * n : 3 * n + m]
            ancf.nodal_vectors(y[iq : iq + size], n, v)
            _fill_stresses(load, at, m, p, s)
            if elements[i].stretch != 0:
                H = model.H[elements[i].form]
                for q in range(3):
                    a, b = cable._derivative(H, q, 0, v), cable._derivative(H, q, 3, v)
                    pull = s[q] / math.sqrt(dot(a, a))
                    cable._add_stress(H, q, a, b, pull, 0.0, 0.0, P[own : own + size])
            else:
                ancf.add_force(s, v, n, P[own : own + size])
            at += AMPLITUDES * m + AFTER


@inlined
def _write_product_tangent(s, n, K):
    """K = -(A (x) I3), A of the stresses s of the products of n vectors (`kernels.ancf`)."""
    for r in range(3 * n + 3):
        for c in range(3 * n + 3):
            K[r, c] = 0.0
    k = 0
    for i in range(n):
        for j in range(i, n):
            for c in range(3):
                K[3 * i + 3 + c, 3 * j + 3 + c] -= s[k]
                K[3 * j + 3 + c, 3 * i + 3 + c] -= s[k]
            k += 1


@inlined
def _write_stretch_tangent(H, s, v, K):
    """K = -d(sum s |a|)''; of each point s/|a| (I - t t^T), t = a/|a|."""
    for r in range(12):
        for c in range(12):
            K[r, c] = 0.0
    for q in range(3):
        a = cable._derivative(H, q, 0, v)
        aa = dot(a, a)
        pull = s[q] / math.sqrt(aa)
        for i in range(3):
            for j in range(3):
                w = H[q, i] * H[q, j] * pull
                for r in range(3):
                    K[3 * i + 3 + r, 3 * j + 3 + r] -= w
                    for c in range(3):
                        K[3 * i + 3 + r, 3 * j + 3 + c] += w * a[r] * a[c] / aa


@indirect(void(VECTOR, MODEL, SPARSE))
def add_thermal_tangents(y, model, matrix):
    """Add the derivative of minus the forces of the last `add_thermal_loads` by the coordinates."""
    n_q, p = model.info.nq, model.parameters
    elements, work = model.elements, model.work
    for k in range(model.thermal_loads.size):
        load = model.thermal_loads[k]
        if load.beam < 0:
            continue
        at, first = load.constants, model.beams[load.beam].first_element
        is_cable = model.beams[load.beam].kind == ancf_beams.CABLE
        for i in range(first, first + model.beams[load.beam].elements):
            iq, own = elements[i].iq, elements[i].iv - n_q
            n = 3 if is_cable else ancf.N
            size = 3 * n + 3
            m = columns(is_cable, elements[i].stretch)
            v, s = work[: 3 * n], work[3 * n : 3 * n + m]
            ancf.nodal_vectors(y[iq : iq + size], n, v)
            _fill_stresses(load, at, m, p, s)
            K = model.K24
            M = model.M[elements[i].mass]
            if elements[i].stretch != 0:
                _write_stretch_tangent(model.H[elements[i].form], s, v, K)
            else:
                _write_product_tangent(s, n, K)
            middle = 3 * (n // 2) + 3
            for c in range(3):  # the first node's position has the reaction
                for r in range(3, size):
                    K[c, r] = -K[middle + c, r]
            for r in range(size):
                for c in range(3):
                    K[r, c] = -K[r, middle + c]
            ancf_beams.add_with_mass(matrix, own, size, K, 0.0, M)
            at += AMPLITUDES * m + AFTER
