"""Point masses: inertia, energy, momentum, and the bound of the explicit step.

A point without mass is a beam's node: it has that one's coordinates, and what acts on it acts on the beam.
"""

from evolvent.algebra.sparse import add_entry
from evolvent.compiled.jit import inlined
from evolvent.kernels.rotations import cross


@inlined
def add_angular_momentum(out, at, mass, x, y, z, vx, vy, vz):
    """Angular momentum of a point mass about the inertial origin into out[at : at + 3]."""
    hx, hy, hz = cross(x, y, z, mass * vx, mass * vy, mass * vz)
    out[at] += hx
    out[at + 1] += hy
    out[at + 2] += hz


@inlined
def clear_forces(points):
    """Forces on all points to zero."""
    for i in range(points.size):
        for c in range(3):
            points[i].f[c] = 0.0


@inlined
def take_forces(n_q, points, F):
    """Forces of points from generalised forces F, which stand on the left of the equations."""
    for i in range(points.size):
        for c in range(3):
            points[i].f[c] -= F[points[i].iv - n_q + c]


@inlined
def pass_to_beams(n_q, points, F):
    """Forces on beams' nodes into generalised forces F, which stand on the left of the equations."""
    for i in range(points.size):
        if points[i].mass == 0.0:
            for c in range(3):
                F[points[i].iv - n_q + c] -= points[i].f[c]


@inlined
def write_point_rates(y, points, dy):
    """State derivatives of all points from their forces f; those of beams' nodes are left."""
    for i in range(points.size):
        if points[i].mass == 0.0:
            continue
        q, v, f, compliance = points[i].iq, points[i].iv, points[i].f, points[i].compliance
        dy[q], dy[q + 1], dy[q + 2] = y[v], y[v + 1], y[v + 2]
        dy[v], dy[v + 1], dy[v + 2] = f[0] * compliance, f[1] * compliance, f[2] * compliance


@inlined
def kick_points(y, points):
    """Jumps of the velocities of all points by the impulses that their f hold."""
    for i in range(points.size):
        for c in range(3):
            y[points[i].iv + c] += points[i].f[c] * points[i].compliance


@inlined
def add_point_weight(gravity, n_q, points, P):
    """Weight of all points into the loads P."""
    for i in range(points.size):
        for c in range(3):
            P[points[i].iv - n_q + c] += points[i].mass * gravity[c]


@inlined
def add_point_residual(dv, over, n_q, points, F):
    """F += m dv/over - f of all points; dv : (nv,) float, changes of velocities in the time `over`, s."""
    for i in range(points.size):
        at = points[i].iv - n_q
        for c in range(3):
            F[at + c] += points[i].mass * dv[at + c] / over - points[i].f[c]


@inlined
def add_point_tangent(c_mass, n_q, points, matrix):
    """c_mass M of all points into a matrix."""
    for i in range(points.size):
        at = points[i].iv - n_q
        for c in range(3):
            add_entry(matrix, at + c, at + c, c_mass * points[i].mass)


@inlined
def add_point_energy(y, points, out, at):
    """Add the kinetic energy of all points to out[at], J."""
    for i in range(points.size):
        v = points[i].iv
        out[at] += 0.5 * points[i].mass * (y[v] * y[v] + y[v + 1] * y[v + 1] + y[v + 2] * y[v + 2])


@inlined
def add_point_momenta(y, points, P, H):
    """Add linear momentum and angular momentum about the inertial origin of all points to P, H : (3,) float."""
    for i in range(points.size):
        q, v, m = points[i].iq, points[i].iv, points[i].mass
        add_angular_momentum(H, 0, m, y[q], y[q + 1], y[q + 2], y[v], y[v + 1], y[v + 2])
        for c in range(3):
            P[c] += m * y[v + c]


@inlined
def evaluate_points(y, points):
    """Momentum and kinetic energy of each point in a state into its record."""
    for i in range(points.size):
        row = points[i]
        row.kinetic = 0.0
        for c in range(3):
            row.linear[c] = row.mass * y[row.iv + c]
            row.kinetic += 0.5 * row.linear[c] * y[row.iv + c]


@inlined
def add_centrifugal(mass, at, spin, matrix):
    """Add what the acceleration of a steady turn `spin`, rad/s, changes with the position of a mass."""
    square = spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2]
    for c in range(3):
        for e in range(3):
            add_entry(matrix, at + c, at + e, mass * (spin[c] * spin[e] - (square if c == e else 0.0)))


def point_bound(points, i, blocks):
    """M^-1 K and M^-1 C of point i; blocks : (2, 3, 3) float, K and C. Not compiled."""
    return blocks / points["mass"][i]
