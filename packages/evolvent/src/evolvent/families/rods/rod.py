"""Elements of geometrically exact rods between two bodies: forces and energy.

With the strains E = (Gamma, K) of `rod_strains` the energy of an element is E . C E L/2. The compliance 1/C
contains the bending by moments that vary linearly along the element (`evolvent.elements.rods`), so that an element
neither locks nor needs more points than one.

A force is defined over an interval of length h between two states; a state is an interval of length 0. s, c and v are
quadratic in vectors that are fixed to the bodies, so that their changes over a step are exactly their derivatives at
the mean shape times the increments. Those of the strains follow from them by `conjugate`, which takes changes of
products by the means of their factors, and those of phi and psi by their secants in c: so the force along the mean
shape, with the stress of the mean strains, does the work of the change of the energy. A step adds
chi/2 C (dE - ratio dE_p), dE_p the change over the step before. The damping is beta C E', E' the rate of the state or
dE/h. What a record holds of its last evaluation is listed in `model.RESULTS`.

Literature: Simo 1985; MacNeal 1978 (residual bending flexibility). Tangents: `rod_tangent`.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.compiled.views import matrix_view
from evolvent.families.rods import rod_payout, tape
from evolvent.families.rods.rod_strains import (
    _A,
    _B,
    _D0,
    _J0,
    _P,
    _S,
    CHORD,
    COSINE,
    PHI,
    PSI,
    STRAIN,
    element_vectors,
    first_slopes,
    measure_element,
    rates_of_state,
    secants,
)
from evolvent.families.rods.strip import add_fibre_stress, fibre_energy
from evolvent.kernels import rigid
from evolvent.kernels.damping import damp_bodies
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.viscoelastic import add_branches, branch_energy, relax_strains, relaxed_by
from evolvent.model import MODEL

USED_FOR = "rods"


@inlined
def stress(rows, k, strain, at, scale, S):
    """S = scale C E of the strains at strain[at:]; added."""
    C = rows[k].stiffness
    if rows[k].uncoupled != 0:
        for i in range(6):
            S[i] += scale * (C[i, i] * strain[at + i])
        return
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += C[i, j] * strain[at + j]
        S[i] += scale * total


@inlined
def conjugate(m0, m1, dphi, dpsi, S, length, p):
    """p : (7,) such that p . d(s, c, v) = S . dE over a step from the measures m0 to m1, exactly.

    Parameters
    ----------
    dphi, dpsi : float, derivatives of phi and psi by the cosine, or their changes over that of the cosine
    S : (6,) float, forces and moments times the length

    Notes
    -----
    Products change by the mean of one factor times the change of the other.
    """
    phi, psi = 0.5 * (m0[PHI] + m1[PHI]), 0.5 * (m0[PSI] + m1[PSI])
    w0 = m0[0] * m0[4] + m0[1] * m0[5] + m0[2] * m0[6]
    w1 = m1[0] * m1[4] + m1[1] * m1[5] + m1[2] * m1[6]
    w = 0.5 * (w0 + w1)
    along = by_c = by_psi = 0.0
    for i in range(3):
        s, v, M = 0.5 * (m0[i] + m1[i]), 0.5 * (m0[4 + i] + m1[4 + i]), S[3 + i] / length
        along += S[i] * s
        by_c += S[i] * v + M * s
        by_psi += S[i] * 0.5 * (w0 * m0[i] + w1 * m1[i])
    p[COSINE] = dphi * by_c + dpsi * by_psi
    for i in range(3):
        s, v, M = 0.5 * (m0[i] + m1[i]), 0.5 * (m0[4 + i] + m1[4 + i]), S[3 + i] / length
        p[i] = phi * M + psi * (w * S[i] + along * v)
        p[CHORD + i] = phi * S[i] + psi * along * s


@inlined
def _crossed(A, B, p):
    """Sum of P_ij d_i^a x d_j^b, P the derivative of p . (s, c) by T."""
    x = y = z = 0.0
    for j in range(3):
        bx, by, bz = _conjugate_director(A, p, j)
        cx, cy, cz = cross(bx, by, bz, B[0, j], B[1, j], B[2, j])
        x, y, z = x + cx, y + cy, z + cz
    return x, y, z


@inlined
def _conjugate_director(A, p, j):
    """Sum over i of P_ij d_i^a."""
    k, m = (j + 1) % 3, (j + 2) % 3
    c, above, below = 0.5 * p[COSINE], 0.5 * p[m], 0.5 * p[k]  # P_kj = p_m/2 and P_mj = -p_k/2 by the order of T
    return (
        c * A[0, j] + above * A[0, k] - below * A[0, m],
        c * A[1, j] + above * A[1, k] - below * A[1, m],
        c * A[2, j] + above * A[2, k] - below * A[2, m],
    )


@inlined
def push_ends(k, p, v, model):
    """Add the forces -p . d(s, c, v) of element k to the wrenches of its bodies, at the bodies' current positions.

    Parameters
    ----------
    v : 9 floats, `element_vectors`
    """
    rows, bodies = model.rod_elements, model.bodies
    a, b, scale = rows[k].a, rows[k].b, 0.5 / rows[k].length
    A, B, Fa, Fb = bodies[a].R, bodies[b].R, bodies[a].F, bodies[b].F
    ax, ay, az, bx, by, bz, dx, dy, dz = v
    gx, gy, gz = turn(A, scale * p[4], scale * p[5], scale * p[6])
    hx, hy, hz = turn(B, scale * p[4], scale * p[5], scale * p[6])
    fx, fy, fz = gx + hx, gy + hy, gz + hz
    x, y, z = _crossed(A, B, p)
    ux, uy, uz = cross(gx, gy, gz, dx, dy, dz)
    mx, my, mz = cross(ax, ay, az, fx, fy, fz)
    Fa[0] += fx
    Fa[1] += fy
    Fa[2] += fz
    Fa[3] -= x + ux - mx
    Fa[4] -= y + uy - my
    Fa[5] -= z + uz - mz
    ux, uy, uz = cross(hx, hy, hz, dx, dy, dz)
    mx, my, mz = cross(bx, by, bz, fx, fy, fz)
    Fb[0] -= fx
    Fb[1] -= fy
    Fb[2] -= fz
    Fb[3] -= ux - x + mx
    Fb[4] -= uy - y + my
    Fb[5] -= uz - z + mz


@inlined
def _write_rates(k, h, m0, m1, model, rate):
    """Rates of the strains: their changes over the length of the step, or by the velocities of a state."""
    if h != 0.0:
        for i in range(6):
            rate[i] = (m1[STRAIN + i] - m0[STRAIN + i]) / h
        return
    if model.rod_elements[k].flows != 0:  # at a fixed part of the length
        for i in range(6):
            rate[i] = model.rod_elements[k].rates[i]
        return
    work = model.rod
    J, D, moves = matrix_view(work, _J0, 7, 12), matrix_view(work, _D0, 6, 7), work[_A : _A + 7]
    rates_of_state(k, model, m1, J, D, moves, rate)


@inlined
def _add_thermal_stress(rows, k, rate, S):
    """Subtract the stresses times the length of the free strains of element k from S; returns their power, W."""
    C, free, length, given = rows[k].stiffness, rows[k].free, rows[k].length, 0.0
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += C[i, j] * free[j]
        S[i] -= length * total
        given += length * total * rate[i]
    return given


@inlined
def evaluate_element(k, h, chi, ratio, model, S, p):
    """Stresses S times the length, and `conjugate` p, of element k over an interval.

    Parameters
    ----------
    h, chi, ratio : as of `add_rods`

    Returns
    -------
    dphi, dpsi : secants, as of `conjugate`
    lost, given : powers that damping takes and heat gives, W
    v : 9 floats, `element_vectors`
    """
    rows, work, lost, given, bending_rate = model.rod_elements, model.rod, 0.0, 0.0, 0.0
    length, beta, m0, m1 = rows[k].length, rows[k].beta, rows[k].m0, rows[k].m1
    if h == 0.0:
        v = measure_element(k, model, m1)
        m0 = m1
        dphi, dpsi = first_slopes(m1[COSINE], m1[PHI], m1[PSI])
    else:
        v = element_vectors(rows, k, model.bodies)
        dphi, dpsi = secants(m0, m1)
    mean, rate, viscous = work[_B : _B + 6], work[_B + 6 : _B + 12], work[_B + 12 : _B + 18]
    for i in range(6):
        e0, e1 = m0[STRAIN + i], m1[STRAIN + i]
        mean[i] = e1
        if h != 0.0:
            mean[i] = 0.5 * (e0 + e1) + 0.5 * chi * (e1 - e0 - ratio * rows[k].before[i])
        S[i] = 0.0
    if rows[k].prony_end > rows[k].prony:
        plain, end = work[_B + 6 : _B + 12], work[_B + 12 : _B + 18]
        for i in range(6):
            plain[i], end[i] = 0.5 * (m0[STRAIN + i] + m1[STRAIN + i]), m1[STRAIN + i]
        relax_strains(rows[k].prony, rows[k].prony_end, rows[k].branch, 6, h, plain, end, model, mean)
    stress(rows, k, mean, 0, length, S)
    stored = 0.0
    if rows[k].flows != 0:
        for i in range(6):
            stored += 0.5 * S[i] * m1[STRAIN + i]
    add_fibre_stress(rows[k], m0, m1, length, S)
    if beta != 0.0 or rows[k].heated != 0:
        _write_rates(k, h, m0, m1, model, rate)
        for i in range(6):
            viscous[i] = 0.0
        stress(rows, k, rate, 0, beta * length, viscous)
        for i in range(6):
            S[i] += viscous[i]
            lost += viscous[i] * rate[i]
        if rows[k].heated != 0:
            given = _add_thermal_stress(rows, k, rate, S)
        bending_rate = rate[5]
    if rows[k].tape > 0:
        lost += tape.evaluate_tape(k, h, chi, ratio, 0.0, bending_rate, model)
        S[5] += rows[k].flattening[0]
    if rows[k].flows != 0:
        rows[k].pull = rod_payout.pull_of(rows, k, stored + length * fibre_energy(rows[k], m1), S)
        for i in range(6):
            S[i] += rows[k].flow[i]
    conjugate(m0, m1, dphi, dpsi, S, length, p)
    return dphi, dpsi, lost, given, v


@inlined
def add_mass_damping(model):
    """Forces -alpha M v of all rods' nodes; returns the power that they take, W."""
    rods, bodies, lost = model.rods, model.bodies, 0.0
    for r in range(rods.size):
        alpha = rods[r].alpha
        if alpha == 0.0:
            continue
        first = rods[r].first_body
        lost += damp_bodies(alpha, bodies, first, first + rods[r].elements + 1)
    return lost


@indirect(types.UniTuple(REAL, 3)(REAL, REAL, REAL, MODEL))
def add_rods(h, chi, ratio, model):
    """Forces of all rods onto their bodies over an interval; returns powers of damping by mass, by stiffness, of heat.

    Parameters
    ----------
    h : float, s, length of the step, after `measure_rods` of both ends, the bodies at their means; or 0 of a state
    chi, ratio : float, of the filter of a step; 0 of a state

    Notes
    -----
    The power of heat is that of the forces by which free strains act, as loads; elastic energies are those of the
    whole strain.
    """
    return _add_rods(h, chi, ratio, model)


@indirect(types.UniTuple(REAL, 3)(MODEL))
def add_rods_of_state(model):
    """`add_rods` for a state: an interval of length zero, compiled without the terms of a step."""
    return _add_rods(0.0, 0.0, 0.0, model)


@inlined
def _add_rods(h, chi, ratio, model):
    """See `add_rods`; inlined, so that constant arguments remove branches."""
    work, lost, given = model.rod, 0.0, 0.0
    S, p = work[_S : _S + 6], work[_P : _P + 7]
    for r in range(model.rods.size):
        if model.rods[r].payout != 0:
            rod_payout.add_flow(r, model)
    for k in range(model.rod_elements.size):
        _, _, viscous, heat, v = evaluate_element(k, h, chi, ratio, model, S, p)
        lost, given = lost + viscous, given + heat
        push_ends(k, p, v, model)
        if model.rod_elements[k].tape > 0:
            tape.push_nodes(k, model)
    return add_mass_damping(model), lost, given


@inlined
def _note_results(rows, k, E, S):
    """Results of element k with the elastic strains E and their stresses S, N and N m, into its record."""
    C, along, bent = rows[k].section, fibre_energy(rows[k], rows[k].m1), 0.0
    for i in range(3):
        along += 0.5 * S[i] * E[i]
        bent += 0.5 * S[3 + i] * E[3 + i]
    rows[k].energy_density = along + bent
    rows[k].stored, rows[k].bent = rows[k].length * (along + bent), rows[k].length * bent
    for i in range(6):
        E[i] = 0.0
        for j in range(6):
            E[i] += C[i, j] * S[j]
    add_fibre_stress(rows[k], rows[k].m1, rows[k].m1, 1.0, S)
    rows[k].axial_force, rows[k].shear_force_y, rows[k].shear_force_z = S[0], S[1], S[2]
    rows[k].torsional_moment, rows[k].bending_moment_y, rows[k].bending_moment_z = S[3], S[4], S[5]
    rows[k].strain, rows[k].shear_strain_y, rows[k].shear_strain_z = E[0], E[1], E[2]
    rows[k].twist, rows[k].curvature_y, rows[k].curvature_z = E[3], E[4], E[5]


@indirect(void(VECTOR, MODEL))
def evaluate_sums(y, model):
    """Kinetic energies and momenta of all rods in a state, after `kinematics`, into their records.

    Overwrites `Model.sums`.
    """
    rows, out = model.rods, model.sums[1]
    for k in range(rows.size):
        first, linear, angular = rows[k].first_body, rows[k].linear, rows[k].angular
        own = model.bodies[first : first + rows[k].elements + 1]
        for i in range(7):
            out[i] = 0.0
        rigid.add_body_energy(y, own, out, 0)
        rigid.add_body_momenta(y, own, out[1:4], out[4:7])
        if rows[k].payout != 0:
            rod_payout.add_flow_sums(k, model, out)
        rows[k].kinetic = out[0]
        if rows[k].tape > 0:
            rows[k].kinetic += tape.kinetic_energy(rows[k].tape - 1, y, model)
        for i in range(3):
            linear[i], angular[i] = out[1 + i], out[4 + i]


@indirect(void(MODEL))
def evaluate_nodes(model):
    """Motion, deflection and curvature of all nodes of rods into the records, after `evaluate_rods`.

    Notes
    -----
    The deflection is the position less that of the shape without stress, carried by the root. The curvature is the
    rotation of the sections over the elements that meet at the node, per length.
    """
    for k in range(model.rods.size):
        row, first = model.rods[k], model.rods[k].first_element
        root = model.beam_nodes[row.first_node].x
        for i in range(row.elements + 1):
            body, node = model.bodies[row.first_body + i], model.beam_nodes[row.first_node + i]
            arm = model.rod_elements[first + i].arm_a if i < row.elements else model.rod_elements[first + i - 1].arm_b
            dx, dy, dz, vx, vy, vz = rigid.point_kinematics(model.bodies, row.first_body + i, arm[0], arm[1], arm[2])
            node.x[0], node.x[1], node.x[2] = body.x[0] + dx, body.x[1] + dy, body.x[2] + dz
            node.v[0], node.v[1], node.v[2] = vx, vy, vz
            ux, uy, uz = turn_back(
                model.bodies[row.first_body].R, node.x[0] - root[0], node.x[1] - root[1], node.x[2] - root[2]
            )
            shape, out = node.undeformed, node.deflection
            part = row.out / row.length if row.payout != 0 else 1.0
            out[0], out[1], out[2] = ux - part * shape[0], uy - part * shape[1], uz - part * shape[2]
            angle = length = 0.0
            for j in range(max(i - 1, 0), min(i, row.elements - 1) + 1):
                m = model.rod_elements[first + j].m1
                angle += math.atan2(math.sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]), m[COSINE])
                length += model.rod_elements[first + j].length
            node.curvature = angle / length
            for c in range(3):
                node.slope[c] = body.R[c, 0]


@inlined
def relaxed_rods(h, model):
    """What relaxation of all rods takes over a step of length h that is accepted, J."""
    rows, taken = model.rod_elements, 0.0
    for k in range(rows.size):
        if rows[k].prony_end > rows[k].prony and h > 0.0:
            first, last, branch = rows[k].prony, rows[k].prony_end, rows[k].branch
            taken += rows[k].length * relaxed_by(first, last, branch, 6, rows[k].stiffness, h, model)
            if rows[k].tape > 0:
                taken += tape.relaxed_tape(k, h, model)
    return taken


@inlined
def _note_relaxed(rows, k, E, S, model):
    """Results of element k beside those of its instantaneous stiffness; returns what its energies change by, J.

    Returns
    -------
    whole, bent : float, of all strains, and of those of moments
    """
    C, m, length, whole, bent = rows[k].stiffness, rows[k].m1, rows[k].length, 0.0, 0.0
    first, last, branch = rows[k].prony, rows[k].prony_end, rows[k].branch
    for i in range(last - first):
        share, at = model.prony_terms[first + i].share, branch + 6 * i
        whole += branch_energy(share, model.branch_strains, at, C, 0, 6)
        bent += branch_energy(share, model.branch_strains, at, C, 3, 6)
        for a in range(6):
            force = 0.0
            for b in range(6):
                force += C[a, b] * m[STRAIN + b]
            whole -= 0.5 * share * force * m[STRAIN + a]
            bent -= 0.5 * share * force * m[STRAIN + a] if a > 2 else 0.0
    for i in range(6):
        E[i] = S[i] = 0.0
    add_branches(first, last, branch, 6, STRAIN, m, model, E)
    stress(rows, k, E, 0, 1.0, S)
    rows[k].axial_force += S[0]
    rows[k].shear_force_y += S[1]
    rows[k].shear_force_z += S[2]
    rows[k].torsional_moment += S[3]
    rows[k].bending_moment_y += S[4]
    rows[k].bending_moment_z += S[5]
    rows[k].energy_density += whole
    rows[k].stored += length * whole
    rows[k].bent += length * bent
    return length * whole, length * bent


@indirect(void(MODEL, VECTOR))
def evaluate_rods(model, out):
    """Evaluate all rods at a state, after `kinematics`, into their records; add the energies of their whole strains.

    Parameters
    ----------
    out : (3,) float, J; the strain energy is added to out[1], that of moments to out[2]

    Notes
    -----
    The records have the elastic strains, without those of heat, and what belongs to these; strains in the middle of
    the element's section by its compliance alone, without the bending by moments that vary along the element.
    """
    rows, work = model.rod_elements, model.rod
    E, S = work[_B : _B + 6], work[_S : _S + 6]
    for k in range(rows.size):
        m = rows[k].m1
        measure_element(k, model, m)
        for i in range(6):
            S[i] = 0.0
        stress(rows, k, m, STRAIN, rows[k].length, S)
        out[1] += rows[k].length * fibre_energy(rows[k], m)
        for i in range(6):
            out[1] += 0.5 * S[i] * m[STRAIN + i]
            if i > 2:
                out[2] += 0.5 * S[i] * m[STRAIN + i]
        for i in range(6):
            E[i], S[i] = m[STRAIN + i] - rows[k].free[i], 0.0
        stress(rows, k, E, 0, 1.0, S)
        _note_results(rows, k, E, S)
        if rows[k].prony_end > rows[k].prony:
            energy, bent = _note_relaxed(rows, k, E, S, model)
            out[1] += energy
            out[2] += bent
        if rows[k].tape > 0:
            energy = tape.evaluate_results(k, model)
            out[1] += energy
            out[2] += energy
