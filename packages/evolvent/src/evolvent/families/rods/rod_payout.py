"""Rods whose length that is out follows a drive: n elements share it, and material flows through the mesh.

Arbitrary Lagrangian-Eulerian description, as of threads (`kernels.thread.moving`). Node i stands at the part xi_i of
the length l that is out, from the exit. With the whole strains G = Gamma + Gamma_0 and K = k + K_0 of the helix, which
at a node are the means of its elements, its material has the velocity and, in the axes of its section, the rate of turn

    V = x' + c R G,   W = w + c K,   c = (1 - xi) l'.

The kinetic energy is the sum of (m V.V + W.J W)/2 over the nodes, by Gregory's weights of the trapezoidal rule, m and J
in proportion to l, and that of the rest, a mass mu (L - l) at the exit, which moves with it. Lagrange's equations for
the nodes and l hold without terms of flux. With lam = l'/l, c' = (1 - xi) l'' and rates at fixed xi (G' = .. - lam G)

    node:    lam m V + m (x'' + R (c' G + c w x G + c G')),
             lam J W + J (w' + c' K + c K') + w x J W - c G x m R^T V
    element: to the stresses that work on its strains -c m R^T V and -c J W of its ends (half of those inside)
    l:       sum (1 - xi) (R G . (m V)' + m V . (R G)' + K . (J W)' + J W . K') - T/l + lam sum (1 - xi) (m V . R G
             + J W . K) + sum (U_e - S . (G, K))/l + mu v.v/2, T of the nodes, v of the exit

and the last is the force of the drive. Weight on the nodes adds -(1/l) sum m g . (x - x_0) to it.
"""

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.compiled.views import matrix_view
from evolvent.families.rods.rod_strains import _A, _D0, _J0, STRAIN, measure_element, rates_of_state
from evolvent.kernels.drive import drive
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.model import MODEL, having, nonzero

USED_FOR = having("rods", payout=nonzero)
_I = types.int64


@indirect(void(REAL, _I, MODEL))
def spread(t, r, model):
    """Length of rod r that is out at the time t, over its elements, and the masses of its nodes."""
    row, bodies, nodes = model.rods[r], model.bodies, model.beam_nodes
    row.out, row.rate, row.acceleration = drive(row.drive, model.parameters[row.first : row.last], row.law, t)
    for i in range(row.elements + 1):
        node, body, J = nodes[row.first_node + i], bodies[row.first_body + i], bodies[row.first_body + i].inertia
        body.mass = row.density * row.out * node.share
        if i == 0:
            body.mass += row.density * (row.length - row.out)
        else:
            own = model.rod_elements[row.first_element + i - 1]
            own.length = row.out / row.length * (node.undeformed[0] - nodes[row.first_node + i - 1].undeformed[0])
        for j in range(3):
            for k in range(3):
                J[j, k] = row.out * node.share * row.gyration[j, k]


@inlined
def _mean(a, b, at):
    """Three numbers of a node, from those of the elements before and after it."""
    return 0.5 * (a[at] + b[at]), 0.5 * (a[at + 1] + b[at + 1]), 0.5 * (a[at + 2] + b[at + 2])


@inlined
def _neighbours(row, i):
    """Elements before and after node i of a rod; the only one at an end."""
    return row.first_element + max(i - 1, 0), row.first_element + min(i, row.elements - 1)


@inlined
def _motion(row, i, model):
    """Mass of the material of node i that is out, 1 - xi, m V (inertial axes), and W (axes of the section)."""
    a, b = _neighbours(row, i)
    elements, body, node = model.rod_elements, model.bodies[row.first_body + i], model.beam_nodes[row.first_node + i]
    rest = 1.0 - node.undeformed[0] / row.length
    m, c = row.density * row.out * node.share, rest * row.rate
    gx, gy, gz = _mean(elements[a].whole, elements[b].whole, 0)
    kx, ky, kz = _mean(elements[a].whole, elements[b].whole, 3)
    ux, uy, uz = turn(body.R, gx, gy, gz)
    wx, wy, wz = turn_back(body.R, body.w[0], body.w[1], body.w[2])
    v = body.v
    return (
        m, rest, (m * (v[0] + c * ux), m * (v[1] + c * uy), m * (v[2] + c * uz)),
        (wx + c * kx, wy + c * ky, wz + c * kz),
    )  # fmt: skip


@inlined
def _times(J, x, y, z):
    """J (x, y, z)."""
    return (
        J[0, 0] * x + J[0, 1] * y + J[0, 2] * z,
        J[1, 0] * x + J[1, 1] * y + J[1, 2] * z,
        J[2, 0] * x + J[2, 1] * y + J[2, 2] * z,
    )


@inlined
def _measure(row, model):
    """Measures and whole strains of a rod's elements at the bodies' current positions."""
    elements = model.rod_elements
    for k in range(row.first_element, row.first_element + row.elements):
        m1, whole, rest = elements[k].m1, elements[k].whole, elements[k].rest
        measure_element(k, model, m1)
        for i in range(6):
            whole[i] = m1[STRAIN + i] + rest[i]


@inlined
def _changes(row, i, model):
    """(R G)' and, in the axes of the section, K' at node i, rates at fixed xi."""
    a, b = _neighbours(row, i)
    elements, body = model.rod_elements, model.bodies[row.first_body + i]
    gx, gy, gz = _mean(elements[a].whole, elements[b].whole, 0)
    dx, dy, dz = _mean(elements[a].rates, elements[b].rates, 0)
    wx, wy, wz = turn_back(body.R, body.w[0], body.w[1], body.w[2])
    sx, sy, sz = cross(wx, wy, wz, gx, gy, gz)
    return turn(body.R, sx + dx, sy + dy, sz + dz), _mean(elements[a].rates, elements[b].rates, 3)


@inlined
def _material_changes(row, i, model):
    """(m V)' less m x'', inertial axes, and (J W)' less J w', axes of the section, of node i."""
    a, b = _neighbours(row, i)
    elements, body = model.rod_elements, model.bodies[row.first_body + i]
    m, rest, p, W = _motion(row, i, model)
    lam, c, c1 = row.rate / row.out, rest * row.rate, rest * row.acceleration
    u, k = _changes(row, i, model)
    gx, gy, gz = _mean(elements[a].whole, elements[b].whole, 0)
    kx, ky, kz = _mean(elements[a].whole, elements[b].whole, 3)
    gx, gy, gz = turn(body.R, gx, gy, gz)
    F = (
        lam * p[0] + m * (c1 * gx + c * u[0]), lam * p[1] + m * (c1 * gy + c * u[1]),
        lam * p[2] + m * (c1 * gz + c * u[2]),
    )  # fmt: skip
    T = _times(
        body.inertia, lam * W[0] + c1 * kx + c * k[0], lam * W[1] + c1 * ky + c * k[1], lam * W[2] + c1 * kz + c * k[2]
    )
    return F, T


@indirect(void(_I, MODEL))
def add_flow(r, model):
    """Forces of inertia of the flow in rod r, beyond M a, onto its nodes; those on strains into `flow` of its elements.

    After `kinematics`. The records of the elements have their whole strains and rates.
    """
    row, elements, work = model.rods[r], model.rod_elements, model.rod
    J, D, moves = matrix_view(work, _J0, 7, 12), matrix_view(work, _D0, 6, 7), work[_A : _A + 7]
    lam = row.rate / row.out
    _measure(row, model)
    for k in range(row.first_element, row.first_element + row.elements):
        rates, flow, whole = elements[k].rates, elements[k].flow, elements[k].whole
        rates_of_state(k, model, elements[k].m1, J, D, moves, rates)
        for i in range(6):
            rates[i] -= lam * whole[i]
            flow[i] = 0.0
    for i in range(row.elements + 1):
        body, (a, b) = model.bodies[row.first_body + i], _neighbours(row, i)
        m, rest, p, W = _motion(row, i, model)
        c, F = rest * row.rate, body.F
        force, torque = _material_changes(row, i, model)
        wx, wy, wz = turn_back(body.R, body.w[0], body.w[1], body.w[2])
        hx, hy, hz = _times(body.inertia, W[0], W[1], W[2])
        jx, jy, jz = _times(body.inertia, W[0] - wx, W[1] - wy, W[2] - wz)
        px, py, pz = turn_back(body.R, p[0], p[1], p[2])
        gx, gy, gz = _mean(elements[a].whole, elements[b].whole, 0)
        sx, sy, sz = cross(wx, wy, wz, jx, jy, jz)  # w x J w is among the wrenches of the body
        ux, uy, uz = cross(c * gx, c * gy, c * gz, px, py, pz)
        tx, ty, tz = turn(body.R, torque[0] + sx - ux, torque[1] + sy - uy, torque[2] + sz - uz)
        F[0] -= force[0]
        F[1] -= force[1]
        F[2] -= force[2]
        F[3] -= tx
        F[4] -= ty
        F[5] -= tz
        for side in range(2):
            flow = elements[a if side == 0 else b].flow
            flow[0] -= 0.5 * c * px
            flow[1] -= 0.5 * c * py
            flow[2] -= 0.5 * c * pz
            flow[3] -= 0.5 * c * hx
            flow[4] -= 0.5 * c * hy
            flow[5] -= 0.5 * c * hz
    root = model.bodies[row.first_body]
    for c in range(3):
        root.F[c] += row.density * row.rate * root.v[c]


@inlined
def pull_of(rows, k, energy, S):
    """What element k pulls at the drive times the length that is out: its energy (J) less its stresses' work on l."""
    whole, pull = rows[k].whole, energy
    for i in range(6):
        pull -= S[i] * whole[i]
    return pull


@indirect(types.UniTuple(REAL, 2)(VECTOR, _I, _I, MODEL))
def drive_rod(a, shift, r, model):
    """Force of the drive of rod r into its record, after the forces of all rods; powers of the drive and of weight, W.

    Parameters
    ----------
    a : (..) float, accelerations, those of a body from the index iv - shift on
    """
    row, elements, gravity = model.rods[r], model.rod_elements, model.info.gravity
    root = model.bodies[row.first_body]
    force = weight = kinetic = momentum = 0.0
    for k in range(row.first_element, row.first_element + row.elements):
        force += elements[k].pull / row.out
    for i in range(row.elements + 1):
        body, (before, after) = model.bodies[row.first_body + i], _neighbours(row, i)
        at = body.iv - shift
        m, rest, p, W = _motion(row, i, model)
        u, change = _changes(row, i, model)
        F, T = _material_changes(row, i, model)
        gx, gy, gz = _mean(elements[before].whole, elements[after].whole, 0)
        G = turn(body.R, gx, gy, gz)
        K = _mean(elements[before].whole, elements[after].whole, 3)
        h = _times(body.inertia, W[0], W[1], W[2])
        turned = _times(body.inertia, a[at + 3], a[at + 4], a[at + 5])
        for c in range(3):
            along = G[c] * p[c] + K[c] * h[c]
            momentum += rest * along
            force += rest * (G[c] * (F[c] + m * a[at + c]) + p[c] * u[c] + K[c] * (T[c] + turned[c]) + h[c] * change[c])
            kinetic += 0.5 * (p[c] * p[c] / m + W[c] * h[c])
            weight += m * gravity[c] * (body.x[c] - root.x[c]) / row.out
    force += (row.rate * momentum - kinetic) / row.out - weight
    for c in range(3):
        force += 0.5 * row.density * root.v[c] * root.v[c]
    row.drive_force = force
    return force * row.rate, weight * row.rate


@indirect(void(REAL, _I, MODEL, VECTOR))
def set_weight(factor, r, model, P):
    """Weight of the nodes of rod r, whose masses change, into the loads P."""
    row, gravity = model.rods[r], model.info.gravity
    for b in range(row.first_body, row.first_body + row.elements + 1):
        at = model.bodies[b].iv - model.info.nq
        for c in range(3):
            P[at + c] = factor * model.bodies[b].mass * gravity[c]


@indirect(void(_I, MODEL, VECTOR))
def add_flow_sums(r, model, out):
    """Add to out : (7,) kinetic energy (J) and momenta of the flow in rod r, beyond those of its bodies.

    Energy, linear momentum, angular momentum about the inertial origin; after `kinematics`.
    """
    row = model.rods[r]
    _measure(row, model)
    for i in range(row.elements + 1):
        body = model.bodies[row.first_body + i]
        m, _, p, W = _motion(row, i, model)
        wx, wy, wz = turn_back(body.R, body.w[0], body.w[1], body.w[2])
        h = _times(body.inertia, W[0], W[1], W[2])
        own = _times(body.inertia, wx, wy, wz)
        x, v = body.x, body.v
        px, py, pz = p[0] - m * v[0], p[1] - m * v[1], p[2] - m * v[2]
        sx, sy, sz = cross(x[0], x[1], x[2], px, py, pz)
        tx, ty, tz = turn(body.R, h[0] - own[0], h[1] - own[1], h[2] - own[2])
        for c in range(3):
            out[0] += 0.5 * (p[c] * p[c] / m - m * v[c] * v[c] + W[c] * h[c])
        out[0] -= 0.5 * (wx * own[0] + wy * own[1] + wz * own[2])
        out[1] += px
        out[2] += py
        out[3] += pz
        out[4] += sx + tx
        out[5] += sy + ty
        out[6] += sz + tz


@inlined
def sum_flows(model):
    """`add_flow_sums` of all rods together, into the row 1 of `Model.sums`: (7,) float."""
    own = model.sums[1]
    for i in range(7):
        own[i] = 0.0
    for r in range(model.rods.size):
        if model.rods[r].payout != 0:
            add_flow_sums(r, model, own)


@indirect(void(REAL, REAL, REAL, MODEL))
def note_lengths(theta, t, h, model):
    """Ratios of the length out at the part `theta` of a step of length h from t to those at its ends, of all rods."""
    for r in range(model.rods.size):
        row = model.rods[r]
        if row.payout != 0:
            p = model.parameters[row.first : row.last]
            now = drive(row.drive, p, row.law, t + theta * h)[0]
            row.grown0 = now / drive(row.drive, p, row.law, t)[0]
            row.grown1 = now / drive(row.drive, p, row.law, t + h)[0]
