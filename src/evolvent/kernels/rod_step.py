"""Elements of rods over a step that conserves energy: stresses of the mean strains, forces along the mean shape.

s, c and v of an element (`kernels.rod`) are quadratic in vectors fixed to its bodies, so that their changes over a step
are exactly their derivatives at the mean shape times the increments; those of the strains follow from them by
`rod.conjugate`, which takes changes of products by the means of their factors, and phi and psi by their secants in c.
As of `kernels.element_step` the step adds chi/2 C (dE - ratio dE_p) and the damping beta C dE/h.
"""

from numba import types, void

from evolvent.compiled.jit import CUBE, MATRIX, REAL, VECTOR, indirect, inlined, matrix_view
from evolvent.kernels.rod import (
    _A,
    _B,
    _D0,
    _D1,
    _J0,
    _J1,
    _K,
    _P,
    _Q,
    _S,
    COSINE,
    PHI,
    PSI,
    STRAIN,
    _add_thermal_stress,
    add_curved_strains,
    add_mass_damping,
    add_mass_damping_tangents,
    add_to_bodies,
    add_turned_forces,
    angle_slopes,
    conjugate,
    element_vectors,
    fill_columns,
    measure_element,
    multiply_columns,
    project_columns,
    push_ends,
    strain_columns,
    stress,
    to_body_axes,
)
from evolvent.kernels.rotations import turn
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL

#: Change of the cosine below which secants are tangents: their difference is 1e-2 of its square.
_SMALL = 1e-6


@indirect(void(MODEL, MATRIX))
def measure_rods(model, out):
    """`measure_element` of all elements at the bodies' current positions; out : (elements, MEASURES) float."""
    for k in range(model.flexible.rod_elements.size):
        measure_element(k, model, out[k])


@inlined
def _secants(m0, m1):
    """Changes of phi and psi over that of the cosine."""
    change = m1[COSINE] - m0[COSINE]
    if abs(change) > _SMALL:
        return (m1[PHI] - m0[PHI]) / change, (m1[PSI] - m0[PSI]) / change
    dphi, dpsi, _, _ = angle_slopes(0.5 * (m0[COSINE] + m1[COSINE]))
    return dphi, dpsi


@inlined
def _step_stress(k, model, h, chi, ratio, m0, m1, before, change, S):
    """Stresses times the length over a step, changes of the strains; returns works of damping and of heat, J."""
    rows, work = model.flexible.rod_elements, model.flexible.rod
    length, beta = rows[k].length, rows[k].beta
    mean, lost, given = work[_B : _B + 6], 0.0, 0.0
    for i in range(6):
        d = m1[STRAIN + i] - m0[STRAIN + i]
        change[i] = d
        mean[i] = 0.5 * (m0[STRAIN + i] + m1[STRAIN + i]) + 0.5 * chi * (d - ratio * before[i])
        S[i] = 0.0
    if beta != 0.0:
        stress(rows, k, change, 0, beta * length / h, S)
        for i in range(6):
            lost += S[i] * change[i]
    stress(rows, k, mean, 0, length, S)
    if rows[k].heated != 0:
        given = _add_thermal_stress(rows, k, change, S)
    return lost, given


@indirect(types.UniTuple(REAL, 2)(MODEL, REAL, REAL, REAL, MATRIX, MATRIX, MATRIX, MATRIX))
def add_stressed_elements(model, h, chi, ratio, start, end, before, change):
    """Forces of all elements over a step, the bodies at their means; returns works that damping takes, heat gives, J.

    Parameters
    ----------
    h : float, s, length of the step; chi, ratio : float, of the filter
    start, end : (elements, MEASURES) float, of `measure_rods`
    before, change : (elements, 6) float, changes of the strains over the step before, and output over this one
    """
    work, lost, given = model.flexible.rod, 0.0, 0.0
    S, p = work[_S : _S + 6], work[_P : _P + 7]
    for k in range(model.flexible.rod_elements.size):
        viscous, heat = _step_stress(k, model, h, chi, ratio, start[k], end[k], before[k], change[k], S)
        lost, given = lost + viscous, given + heat
        dphi, dpsi = _secants(start[k], end[k])
        conjugate(start[k], end[k], dphi, dpsi, S, model.flexible.rod_elements[k].length, p)
        push_ends(k, p, model)
    return lost, given


@inlined
def add_rod_step(model, h, chi, ratio, start, end, before, change):
    """Forces of all rods over a step; returns powers that damping by mass and by stiffness takes, and of heat, W."""
    lost, given = add_stressed_elements(model, h, chi, ratio, start, end, before, change)
    return add_mass_damping(model), lost / h, given / h


@inlined
def _end_axes(R0, dq, at, Q):
    """Q = R0 (1 + [t]x/2)/(1 + t.t/4), by which a change of the increment t turns the end, inertial axes."""
    x, y, z = 0.5 * dq[at], 0.5 * dq[at + 1], 0.5 * dq[at + 2]
    s = 1.0 / (1.0 + x * x + y * y + z * z)
    Q[0, 0], Q[1, 0], Q[2, 0] = turn(R0, s, s * z, -s * y)
    Q[0, 1], Q[1, 1], Q[2, 1] = turn(R0, -s * z, s, s * x)
    Q[0, 2], Q[1, 2], Q[2, 2] = turn(R0, s * y, -s * x, s)


@inlined
def _end_vectors(rows, k, A, B, xa, xb):
    """`rod.element_vectors` at the end of a step."""
    la, lb = rows[k].arm_a, rows[k].arm_b
    ax, ay, az = turn(A, la[0], la[1], la[2])
    bx, by, bz = turn(B, lb[0], lb[1], lb[2])
    return ax, ay, az, bx, by, bz, xb[0] + bx - xa[0] - ax, xb[1] + by - xa[1] - ay, xb[2] + bz - xa[2] - az


@indirect(void(MODEL, REAL, REAL, REAL, VECTOR, CUBE, CUBE, MATRIX, MATRIX, MATRIX, MATRIX, MATRIX, SPARSE))
def add_rod_step_tangents(model, h, chi, ratio, dq, R0, R1, x1, start, end, before, change, matrix):
    """Twice the derivatives of the forces of `add_rod_step` by the increments; the bodies are at their means.

    Parameters
    ----------
    dq : (nv,) float, increments; R0, R1 : (nb, 3, 3) float, rotations at both ends, x1 : (nb, 3) float, positions
    """
    rows, bodies, work, n_q = model.flexible.rod_elements, model.bodies, model.flexible.rod, model.info.nq
    S, p = work[_S : _S + 6], work[_P : _P + 7]
    J0, J1 = matrix_view(work, _J0, 7, 12), matrix_view(work, _J1, 7, 12)
    D0, D1 = matrix_view(work, _D0, 6, 7), matrix_view(work, _D1, 6, 7)
    A, B, K = matrix_view(work, _A, 7, 7), matrix_view(work, _B, 7, 12), matrix_view(work, _K, 12, 12)
    P, Q = matrix_view(work, _Q, 3, 3), matrix_view(work, _Q + 9, 3, 3)
    for k in range(rows.size):
        a, b, length, m0, m1 = rows[k].a, rows[k].b, rows[k].length, start[k], end[k]
        Ra, Rb, v0 = bodies[a].R, bodies[b].R, element_vectors(rows, k, bodies)
        v1 = _end_vectors(rows, k, R1[a], R1[b], x1[a], x1[b])
        _step_stress(k, model, h, chi, ratio, m0, m1, before[k], change[k], S)
        dphi, dpsi = _secants(m0, m1)
        conjugate(m0, m1, dphi, dpsi, S, length, p)
        fill_columns(k, model, Ra, Rb, v0, J0)
        fill_columns(k, model, R1[a], R1[b], v1, J1)
        strain_columns(m0, m1, dphi, dpsi, length, D0)
        dphi, dpsi, _, _ = angle_slopes(m1[COSINE])
        strain_columns(m1, m1, dphi, dpsi, length, D1)
        multiply_columns(rows, k, length * (1.0 + chi + 2.0 * rows[k].beta / h), D0, D1, B, A)
        add_curved_strains(m1, S, length, A)
        project_columns(J0, A, J1, B, K)
        add_turned_forces(k, model, p, Ra, Rb, v0, R1[a], R1[b], v1, K)
        _end_axes(R0[a], dq, bodies[a].iv - n_q + 3, P)
        _end_axes(R0[b], dq, bodies[b].iv - n_q + 3, Q)
        to_body_axes(K, R0[a], R0[b], P, Q)
        add_to_bodies(k, model, K, matrix)
    add_mass_damping_tangents(2.0 / h, model, matrix)
