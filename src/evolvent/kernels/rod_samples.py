"""Nodes of rods in states between the ends of a step."""

from evolvent.compiled.jit import inlined, kernel, matrix_view
from evolvent.kernels.rod import _Q
from evolvent.kernels.rotations import rotation_from_quaternion, turn, turn_back


@kernel
def _end_positions(rows, k, y, bodies, A, B):
    """Rotations of the bodies of element k in the state y into A and B; returns the vector between its ends."""
    a, b, la, lb = bodies[rows[k].a].iq, bodies[rows[k].b].iq, rows[k].arm_a, rows[k].arm_b
    rotation_from_quaternion(y[a + 3], y[a + 4], y[a + 5], y[a + 6], A)
    rotation_from_quaternion(y[b + 3], y[b + 4], y[b + 5], y[b + 6], B)
    ax, ay, az = turn(A, la[0], la[1], la[2])
    bx, by, bz = turn(B, lb[0], lb[1], lb[2])
    return y[b] + bx - y[a] - ax, y[b + 1] + by - y[a + 1] - ay, y[b + 2] + bz - y[a + 2] - az


@inlined
def _mean_turned_back(A, B, d):
    """(A + B)^T d/2."""
    p, q = turn_back(A, d[0], d[1], d[2]), turn_back(B, d[0], d[1], d[2])
    return 0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1]), 0.5 * (p[2] + q[2])


@inlined
def keep_chords(theta, y0, y1, model, y):
    """Move the nodes of rods in a state y between y0 and y1 to where v L of all elements is on a straight line."""
    f, bodies = model.flexible, model.bodies
    rows = f.rod_elements
    A, B = matrix_view(f.rod, _Q, 3, 3), matrix_view(f.rod, _Q + 9, 3, 3)
    for r in range(f.rods.size):
        ox = oy = oz = 0.0  # what the nodes so far have been moved by
        for k in range(f.rods[r].first_element, f.rods[r].first_element + f.rods[r].elements):
            u = _mean_turned_back(A, B, _end_positions(rows, k, y0, bodies, A, B))
            v = _mean_turned_back(A, B, _end_positions(rows, k, y1, bodies, A, B))
            dx, dy, dz = _end_positions(rows, k, y, bodies, A, B)
            w = _mean_turned_back(A, B, (dx + ox, dy + oy, dz + oz))  # the node before has been moved already
            ex = u[0] + theta * (v[0] - u[0]) - w[0]
            ey = u[1] + theta * (v[1] - u[1]) - w[1]
            ez = u[2] + theta * (v[2] - u[2]) - w[2]
            px, py, pz = turn(A, ex, ey, ez)
            qx, qy, qz = turn(B, ex, ey, ez)
            ox, oy, oz = ox + 0.5 * (px + qx), oy + 0.5 * (py + qy), oz + 0.5 * (pz + qz)
            q = bodies[rows[k].b].iq
            y[q], y[q + 1], y[q + 2] = y[q] + ox, y[q + 1] + oy, y[q + 2] + oz
