"""End of a thread that is fixed to a point of a body or to a point mass.

Node 0 is then that point itself: the tension of the outermost segment acts there, and the mass of the node (half a
segment and the tip mass) moves with it. On a body the mass is carried at the point; that of a point mass is part of the
point's own mass, and the node has none. The node's coordinates in the state are not used.
"""

import numpy as np

from evolvent.compiled.jit import inlined
from evolvent.kernels.markers import ON_BODY, marker_columns, marker_kinematics, push_marker
from evolvent.kernels.rigid import DRIVEN, add_mass, add_wrench, centripetal
from evolvent.kernels.sides import ON_COORDINATES, side_columns

#: Below this distance from Q (m) a segment's direction is the pay-out direction (eq. 11).
TINY = 1e-9


@inlined
def is_end(threads, p, i):
    """Whether node i of thread p is a point of a body or a point mass."""
    return i == 0 and threads[p].end >= 0


@inlined
def node_columns(model, p, i, J):
    """Write the columns J of node i of thread p (`sides.side_columns`); returns its first unknown and their number."""
    threads = model.threads
    if is_end(threads, p, i):
        return marker_columns(model, threads[p].end, J)
    return side_columns(model, ON_COORDINATES, -1, threads[p].iv + 3 * i, threads[p].departure, True, J)


@inlined
def place_end(y, model, p):
    """Position and velocity of the point that thread p ends at, into those of its node 0."""
    k = model.threads[p].node
    found = marker_kinematics(y, model.markers, model.points, model.bodies, model.threads[p].end)
    x, v = model.nodes[k].x, model.nodes[k].v
    x[0], x[1], x[2], v[0], v[1], v[2] = found


@inlined
def end_acceleration(p, model):
    """Acceleration of the point of a body that thread p ends at, but for the body's own: three floats.

    Of a driven body it is that of the point. Zeros without an end.
    """
    bodies, e = model.bodies, model.threads[p].end
    if e < 0:
        return 0.0, 0.0, 0.0
    b, x = model.markers[e].index, model.nodes[model.threads[p].node].x
    ax, ay, az = centripetal(bodies, b, x[0] - bodies[b].x[0], x[1] - bodies[b].x[1], x[2] - bodies[b].x[2])
    if bodies[b].path != 0:
        along, u = bodies[b].along, bodies[b].direction
        ax, ay, az = ax + along * u[0], ay + along * u[1], az + along * u[2]
    return ax, ay, az


@inlined
def carry_end(model, p):
    """Mass, weight and inertial force of the end of thread p onto its body; returns the power of the weight, W."""
    bodies, nodes, markers, gravity = model.bodies, model.nodes, model.markers, model.info.gravity
    k, e = model.threads[p].node, model.threads[p].end
    if markers[e].kind != ON_BODY:
        return 0.0
    b, m, x, v = markers[e].index, nodes[k].mass, nodes[k].x, nodes[k].v
    dx, dy, dz = x[0] - bodies[b].x[0], x[1] - bodies[b].x[1], x[2] - bodies[b].x[2]
    cx, cy, cz = end_acceleration(p, model)
    gx, gy, gz = gravity[0], gravity[1], gravity[2]
    add_wrench(bodies[b].F, dx, dy, dz, m * (gx - cx), m * (gy - cy), m * (gz - cz))
    add_mass(bodies, b, m, dx, dy, dz)
    return m * (gx * v[0] + gy * v[1] + gz * v[2])


@inlined
def pull_end(model, p, fx, fy, fz):
    """A force on the point that thread p ends at."""
    x = model.nodes[model.threads[p].node].x
    push_marker(model.markers, model.points, model.bodies, model.threads[p].end, x[0], x[1], x[2], fx, fy, fz)


def add_end_bound(model, row, times, body, point):
    """Add the outermost segment, so many times, to the stiffness and damping at its point. Not compiled."""
    marker, node = model.markers[int(row["end"])], model.nodes[int(row["node"])]
    index = int(marker["index"])
    d = np.array(node["x"]) - row["Q"][:3]
    length = float(np.linalg.norm(d))
    e = d / length if length > TINY else np.array(row["X"])
    for what, value in enumerate((row["stiffness"], row["damping"])):
        if marker["kind"] != ON_BODY:
            point[what, index] += times * value * np.outer(e, e)
        elif model.bodies["motion"][index] != DRIVEN:
            J = np.concatenate([e, np.cross(node["x"] - model.bodies["x"][index], e)])
            body[what, index] += times * value * np.outer(J, J)
