"""Energies and momenta of threads on a mesh that moves (`moving`)."""

import math

from numba import types

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels.points import add_angular_momentum
from evolvent.kernels.thread.end import is_end
from evolvent.kernels.thread.moving import USED_FOR, flow_rates, node_motion
from evolvent.kernels.thread.springs import segment_vector
from evolvent.model import H_RELEASED, KINETIC, MODEL, P_ALL

__all__ = ["USED_FOR", "moving_inventory"]
_I = types.int64


@inlined
def _state(y, i, p, model):
    """Place and velocity of node i of thread p, of Q where i = n, of three floats each."""
    none = (0.0, 0.0, 0.0)
    x, u, _ = node_motion(y, y, 0, (none, none), i, 0, p, model)
    yy, v, _ = node_motion(y, y, 0, (none, none), i, 1, p, model)
    z, w, _ = node_motion(y, y, 0, (none, none), i, 2, p, model)
    return (x, yy, z), (u, v, w)


@indirect(REAL(VECTOR, _I, MODEL, VECTOR))
def moving_inventory(y, p, model, out):
    """Add kinetic energy and momenta of what is out of thread p to `out`; returns its elastic energy, J."""
    threads, nodes = model.threads, model.nodes
    n, elastic = threads[p].n, 0.0
    (lam, _, b, _), k6 = flow_rates(threads, p)
    c, rest = threads[p].stiffness * threads[p].segment / threads[p].element, threads[p].element
    for i in range(n):
        ex, ey, ez, _, _, _ = segment_vector(y, model.switches, p, i, model)
        extension = math.sqrt(ex * ex + ey * ey + ez * ez) - rest
        if threads[p].slack != 0:
            extension = max(extension, 0.0)
        elastic += 0.5 * c * extension * extension
        (xo, yo, zo), vo = _state(y, i, p, model)
        (xi, yi, zi), vi = _state(y, i + 1, p, model)
        so, si = i * lam + b, (i + 1) * lam + b
        Vo = (vo[0] + so * ex, vo[1] + so * ey, vo[2] + so * ez)
        Vi = (vi[0] + si * ex, vi[1] + si * ey, vi[2] + si * ez)
        for e in range(3):
            out[KINETIC] += k6 * (Vo[e] * Vo[e] + Vo[e] * Vi[e] + Vi[e] * Vi[e])
            out[P_ALL + e] += 3.0 * k6 * (Vo[e] + Vi[e])
        ux, uy, uz = 2.0 * Vo[0] + Vi[0], 2.0 * Vo[1] + Vi[1], 2.0 * Vo[2] + Vi[2]
        add_angular_momentum(out, H_RELEASED, k6, xo, yo, zo, ux, uy, uz)
        ux, uy, uz = Vo[0] + 2.0 * Vi[0], Vo[1] + 2.0 * Vi[1], Vo[2] + 2.0 * Vi[2]
        add_angular_momentum(out, H_RELEASED, k6, xi, yi, zi, ux, uy, uz)
        if i == 0:
            tip = nodes[threads[p].node].mass if is_end(threads, p, 0) else threads[p].tip_mass
            add_angular_momentum(out, H_RELEASED, tip, xo, yo, zo, vo[0], vo[1], vo[2])
            for e in range(3):
                out[KINETIC] += 0.5 * tip * vo[e] * vo[e]
                out[P_ALL + e] += tip * vo[e]
    return elastic
