"""Elements of geometrically exact shells between four bodies: forces and energy.

With the measures E of `shell_strains`, less those without stress, the energy of an element is E . K E/2, K constant
(`stiffness`), and k w^2/2 of each node's drilling strain w. A force is defined over an interval of length h between two
states; a state is an interval of length 0. Products of vectors that are fixed to the bodies change over a step exactly
by the means of the factors, so that the forces along the mean shape, with the stress of the mean strains, do the work
of the change of the energy. A step adds chi/2 K (dE - ratio dE_p), dE_p the change over the step before. The damping
is beta K E', E' the rate of the state or dE/h, and -alpha M v of the nodes. Tangents: `shell_tangent`.

Where the wall relaxes, each law m has a part K_m of K: added to the stresses is K_m times the sum of g (w - E) with the
strains w of its branches (`kernels.viscoelastic`). Drilling does not relax.
"""

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.compiled.views import matrix_view
from evolvent.families.shells.shell_strains import (
    _R,
    _S,
    _U,
    _X,
    DRILLING,
    FIRST,
    FORCE,
    G0,
    MEASURES,
    PRODUCTS,
    RATES,
    RELAX,
    SECOND,
    STRAIN,
    STRAINS,
    V0,
    VECTORS,
    P,
    fill_vectors,
    gather,
    measure_element,
    node_weight,
    slopes,
    surface_slopes,
    write_rates,
)
from evolvent.kernels import rigid
from evolvent.kernels.damping import damp_bodies
from evolvent.kernels.rotations import cross
from evolvent.kernels.viscoelastic import add_branches, branch_energy, relax_strains, relaxed_by
from evolvent.model import MODEL

USED_FOR = "shells"
#: The first strains are those of the surface, the others bend and shear.
BENDS = 5


@inlined
def filtered_mean(rows, k, i, m0, m1, chi, ratio):
    """Mean of measure i of element k over a step, with the filter."""
    change = m1[i] - m0[i]
    return 0.5 * (m0[i] + m1[i]) + 0.5 * chi * (change - ratio * rows[k].before[i - STRAIN])


@inlined
def free_stress(rows, k, i):
    """Stress i of the free strains of element k."""
    total = 0.0
    for j in range(STRAINS):
        total += rows[k].stiffness[i, j] * rows[k].free[j]
    return total


@inlined
def _add_relaxed(k, h, m0, m1, model, S):
    """Add to the stresses S of element k what relaxation changes them by over an interval of length h."""
    row, parts, work = model.shell_elements[k], model.shell_relaxations, model.shells[0].work
    if row.relaxation_end == row.relaxation:
        return
    mean, end = work[RELAX : RELAX + STRAINS], work[RELAX + STRAINS : RELAX + 2 * STRAINS]
    added = work[RELAX + 2 * STRAINS : RELAX + 3 * STRAINS]
    for i in range(STRAINS):
        mean[i], end[i] = 0.5 * (m0[STRAIN + i] + m1[STRAIN + i]), m1[STRAIN + i]
    for p in range(row.relaxation, row.relaxation_end):
        for i in range(STRAINS):
            added[i] = 0.0
        relax_strains(parts[p].prony, parts[p].prony_end, parts[p].branch, STRAINS, h, mean, end, model, added)
        for j in range(STRAINS):
            for i in range(STRAINS):
                S[i] += parts[p].stiffness[j, i] * added[j]


@inlined
def evaluate_element(k, h, chi, ratio, model):
    """Stresses S of the strains, and their conjugates of the products p, of element k over an interval.

    Returns the powers that damping takes and heat gives, W.

    Notes
    -----
    They are written into the scratch, as are positions, rotations and vectors of the mean shape, and `slopes`.
    """
    rows, work = model.shell_elements, model.shells[0].work
    S, p, G = work[_S : _S + STRAINS], work[P : P + PRODUCTS], matrix_view(work, G0, STRAINS, PRODUCTS)
    m0, m1 = rows[k].m0, rows[k].m1
    x, R = matrix_view(work, _X, 4, 3), matrix_view(work, _R, 12, 3)
    if h == 0.0:
        measure_element(k, model, m1)
        m0 = m1
    else:
        gather(k, model, 0.0, x, R)
        fill_vectors(x, R, matrix_view(work, V0, VECTORS, 3))
    for i in range(STRAINS):
        S[i] = 0.0
    for j in range(STRAINS):
        mean = filtered_mean(rows, k, STRAIN + j, m0, m1, chi, ratio)
        for i in range(STRAINS):
            S[i] += rows[k].stiffness[j, i] * mean
    _add_relaxed(k, h, m0, m1, model, S)
    slopes(m0, m1, G)
    beta, lost, given = rows[k].beta, 0.0, 0.0
    if beta != 0.0 or rows[k].heated != 0:
        rate = work[RATES : RATES + STRAINS]
        write_rates(k, h, m0, m1, model, matrix_view(work, V0, VECTORS, 3), G, rate)
        for i in range(STRAINS):
            viscous = 0.0
            for j in range(STRAINS):
                viscous += beta * rows[k].stiffness[j, i] * rate[j]
            S[i] += viscous
            lost += viscous * rate[i]
        if rows[k].heated != 0:
            for i in range(STRAINS):
                held = free_stress(rows, k, i)
                S[i] -= held
                given += held * rate[i]
    for j in range(PRODUCTS):
        p[j] = 0.0
    for i in range(STRAINS):
        for j in range(PRODUCTS):
            p[j] += S[i] * G[i, j]
    return lost, given


@inlined
def _push_drilling(k, a, stress, model, x, R, U):
    """Add the forces of the drilling strain of node a of element k, with the given stress, to its bodies' wrenches."""
    rows, bodies, half, r = model.shell_elements, model.bodies, 0.5 * stress, 3 * a
    surface_slopes(rows, k, a, x, U)
    for b in range(4):
        F, one, two = bodies[rows[k].nodes[b]].F, half * rows[k].slopes[2 * a, b], half * rows[k].slopes[2 * a + 1, b]
        for c in range(3):
            F[c] -= one * R[r + c, 1] - two * R[r + c, 0]
    tx, ty, tz = cross(R[r, 1], R[r + 1, 1], R[r + 2, 1], half * U[0, 0], half * U[0, 1], half * U[0, 2])
    ux, uy, uz = cross(R[r, 0], R[r + 1, 0], R[r + 2, 0], half * U[1, 0], half * U[1, 1], half * U[1, 2])
    F = bodies[rows[k].nodes[a]].F
    F[3] -= tx - ux
    F[4] -= ty - uy
    F[5] -= tz - uz


@inlined
def push_nodes(k, h, chi, ratio, model):
    """Add the forces of element k to the wrenches of its bodies, along the mean shape of `evaluate_element`."""
    rows, bodies, work = model.shell_elements, model.bodies, model.shells[0].work
    p, V, F = work[P : P + PRODUCTS], matrix_view(work, V0, VECTORS, 3), matrix_view(work, FORCE, VECTORS, 3)
    x, R, U = matrix_view(work, _X, 4, 3), matrix_view(work, _R, 12, 3), matrix_view(work, _U, 2, 3)
    m1 = rows[k].m1
    m0 = m1 if h == 0.0 else rows[k].m0
    for i in range(VECTORS):
        F[i, 0] = F[i, 1] = F[i, 2] = 0.0
    for m in range(PRODUCTS):
        i, j = FIRST[m], SECOND[m]
        for c in range(3):
            F[i, c] += p[m] * V[j, c]
            F[j, c] += p[m] * V[i, c]
    for a in range(4):
        own, r = bodies[rows[k].nodes[a]].F, 3 * a
        fx = fy = fz = gx = gy = gz = 0.0
        for i in range(3):
            w = node_weight(i, a)
            fx, fy, fz = fx + w * F[i, 0], fy + w * F[i, 1], fz + w * F[i, 2]
        for i in range(3, VECTORS):
            w = node_weight(i, a)
            gx, gy, gz = gx + w * F[i, 0], gy + w * F[i, 1], gz + w * F[i, 2]
        tx, ty, tz = cross(R[r, 2], R[r + 1, 2], R[r + 2, 2], gx, gy, gz)
        own[0] -= fx
        own[1] -= fy
        own[2] -= fz
        own[3] -= tx
        own[4] -= ty
        own[5] -= tz
        w = filtered_mean(rows, k, DRILLING + a, m0, m1, chi, ratio)
        _push_drilling(k, a, rows[k].drilling * w, model, x, R, U)


@indirect(types.UniTuple(REAL, 3)(REAL, REAL, REAL, MODEL))
def add_shells(h, chi, ratio, model):
    """Forces of all shells onto their bodies over an interval; returns powers of both dampings and of heat, W.

    Parameters
    ----------
    h : float, s, length of the step, after `measure_shells` of both ends, the bodies at their means; or 0 of a state
    chi, ratio : float, of the filter of a step; 0 of a state

    Notes
    -----
    The power of heat is that of the forces by which free strains act, as loads; elastic energies are those of the
    whole strain.
    """
    shells, by_mass, by_stiffness, by_heat = model.shells, 0.0, 0.0, 0.0
    for k in range(model.shell_elements.size):
        lost, given = evaluate_element(k, h, chi, ratio, model)
        by_stiffness, by_heat = by_stiffness + lost, by_heat + given
        push_nodes(k, h, chi, ratio, model)
    for k in range(shells.size):
        if shells[k].alpha != 0.0:
            first = shells[k].first_body
            by_mass += damp_bodies(shells[k].alpha, model.bodies, first, first + shells[k].nodes)
    return by_mass, by_stiffness, by_heat


@inlined
def less_free(rows, k, S):
    """What the strain energy of element k, and that of bending, change by, less the free strains, J.

    Parameters
    ----------
    S : (15,) float, stresses of its whole strains
    """
    whole = bent = 0.0
    for i in range(STRAINS):
        held, free = free_stress(rows, k, i), rows[k].free[i]
        change = 0.5 * (held * (free - rows[k].m1[STRAIN + i]) - S[i] * free)
        whole += change
        bent += change if i >= BENDS else 0.0
    return whole, bent


@inlined
def _note_relaxed(k, m, model):
    """Add to the resultants of element k what relaxation changes them by; m : its measures in the state.

    Returns
    -------
    whole, bent : float, J, what it changes the energies by, of all strains, and of those of bending and shear
    """
    rows, parts, work, whole, bent = model.shell_elements, model.shell_relaxations, model.shells[0].work, 0.0, 0.0
    added = work[RELAX : RELAX + STRAINS]
    for p in range(rows[k].relaxation, rows[k].relaxation_end):
        first, last, branch, share = parts[p].prony, parts[p].prony_end, parts[p].branch, 0.0
        for i in range(STRAINS):
            added[i] = 0.0
        add_branches(first, last, branch, STRAINS, STRAIN, m, model, added)
        for i in range(last - first):
            own, at = model.prony_terms[first + i].share, branch + STRAINS * i
            whole += branch_energy(own, model.branch_strains, at, parts[p].stiffness, 0, STRAINS)
            bent += branch_energy(own, model.branch_strains, at, parts[p].stiffness, 5, STRAINS)
            share += own
        for i in range(STRAINS):
            force = 0.0
            for j in range(STRAINS):
                force += parts[p].stiffness[i, j] * m[STRAIN + j]
            whole -= 0.5 * share * force * m[STRAIN + i]
            bent -= 0.5 * share * force * m[STRAIN + i] if i > 4 else 0.0
        for i in range(8):
            for j in range(STRAINS):
                rows[k].stress[i] += parts[p].resultants[i, j] * added[j]
    return whole, bent


@inlined
def relaxed_shells(h, model):
    """What relaxation of all shells takes over a step of length h that is accepted, J."""
    rows, taken = model.shell_relaxations, 0.0
    if h > 0.0:
        for p in range(rows.size):
            first, last, branch = rows[p].prony, rows[p].prony_end, rows[p].branch
            taken += relaxed_by(first, last, branch, STRAINS, rows[p].stiffness, h, model)
    return taken


@indirect(void(MODEL, VECTOR))
def evaluate_shells(model, out):
    """Evaluate all shells at a state, after `kinematics`, into their records; add the energies of their whole strains.

    Parameters
    ----------
    out : (3,) float, J; the strain energy is added to out[1], that of bending to out[2]

    Notes
    -----
    The records have what belongs to the elastic strains, without those of heat.
    """
    rows, work = model.shell_elements, model.shells[0].work
    S = work[_S : _S + STRAINS]
    for k in range(rows.size):
        m = rows[k].m1
        measure_element(k, model, m)
        for i in range(STRAINS):
            S[i] = 0.0
            for j in range(STRAINS):
                S[i] += rows[k].stiffness[i, j] * m[STRAIN + j]
        stored = bent = twisted = 0.0
        for i in range(STRAINS):
            stored += 0.5 * S[i] * m[STRAIN + i]
            bent += 0.5 * S[i] * m[STRAIN + i] if i >= BENDS else 0.0
        for i in range(DRILLING, MEASURES):
            twisted += 0.5 * rows[k].drilling * m[i] * m[i]
        for i in range(8):
            total = 0.0
            for j in range(STRAINS):
                total += rows[k].resultants[i, j] * (m[STRAIN + j] - rows[k].free[j])
            rows[k].stress[i] = total
        if rows[k].relaxation_end > rows[k].relaxation:
            energy, of_bending = _note_relaxed(k, m, model)
            stored, bent = stored + energy, bent + of_bending
        out[1] += stored + twisted
        out[2] += bent
        if rows[k].heated != 0:
            change, of_bending = less_free(rows, k, S)
            stored, bent = stored + change, bent + of_bending
        rows[k].stored, rows[k].bent, rows[k].drilled = stored + twisted, bent, twisted
        N = rows[k].stress
        rows[k].membrane_force_1, rows[k].membrane_force_2, rows[k].membrane_shear = N[0], N[1], N[2]
        rows[k].moment_1, rows[k].moment_2, rows[k].twisting_moment = N[3], N[4], N[5]
        rows[k].shear_force_1, rows[k].shear_force_2 = N[6], N[7]


@indirect(void(VECTOR, MODEL))
def evaluate_sums(y, model):
    """Kinetic energies and momenta of all shells in a state, after `kinematics`, into their records.

    Overwrites `Model.sums`.
    """
    rows, out = model.shells, model.sums[1]
    for k in range(rows.size):
        linear, angular = rows[k].linear, rows[k].angular
        own = model.bodies[rows[k].first_body : rows[k].first_body + rows[k].nodes]
        for i in range(7):
            out[i] = 0.0
        rigid.add_body_energy(y, own, out, 0)
        rigid.add_body_momenta(y, own, out[1:4], out[4:7])
        rows[k].kinetic = out[0]
        for i in range(3):
            linear[i], angular[i] = out[1 + i], out[4 + i]
