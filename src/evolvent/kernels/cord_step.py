"""Cords on drums over a step that conserves energy.

The length of a cord depends on the position of its free end as seen from the drum alone. With the displacement u of the
end against the drum, its free direction e at the mean position, and the change dg of the length, those of a tension
act along m = e + u (dg - e . u)/u.u on the end and, at the same point, against it on the drum: their work over the step
is the tension times the change of the length exactly, and both momenta are kept.
"""

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect
from evolvent.kernels.rotations import cross
from evolvent.kernels.sides import ON_BODY, pull, side_vector
from evolvent.model import MODEL

_I = types.int64
#: Displacement, of the distance from the drum, below which e . u differs from the change of the length by round-off.
_SMALL = 1e-5


@indirect(void(VECTOR, _I, REAL, REAL, REAL, MODEL, VECTOR))
def add_cord_step(ym, k, la, change, h, model, F):
    """Generalised forces of the cord of joint k with tension -la, whose length changes by `change` over the step h.

    Bodies stand at their mean position, ym has mean coordinates and increments over h; after `joint.joint_geometry`.
    """
    joints, bodies, n_q = model.flexible.joints, model.bodies, model.info.nq
    on, index, iv, e = joints[k].on, joints[k].index, joints[k].iv, joints[k].g[1]
    a = side_vector(ym, bodies, ON_BODY, index[0], -1, -1, joints[k].centre, True)
    b = side_vector(ym, bodies, on[1], index[1], joints[k].iq[1], iv[1], joints[k].local[1], True)
    w = bodies[index[0]].w
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    tx, ty, tz = cross(w[0], w[1], w[2], dx, dy, dz)
    ux, uy, uz = h * (b[3] - a[3] - tx), h * (b[4] - a[4] - ty), h * (b[5] - a[5] - tz)
    least = _SMALL * _SMALL * (dx * dx + dy * dy + dz * dz)
    part = (change - e[0] * ux - e[1] * uy - e[2] * uz) / max(ux * ux + uy * uy + uz * uz, least)
    fx, fy, fz = la * (e[0] + part * ux), la * (e[1] + part * uy), la * (e[2] + part * uz)
    at = (b[0], b[1], b[2])
    pull(F, bodies, n_q, ON_BODY, index[0], iv[0], at, True, -fx, -fy, -fz)
    pull(F, bodies, n_q, on[1], index[1], iv[1], at, True, fx, fy, fz)
