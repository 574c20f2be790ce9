"""Reduced flexible bodies: modal coordinates beside a floating frame, and the rows that carry its interface nodes.

The frame is a free body: the mean axes of the reduced model (Buckens frame), about which its free modes have neither
linear nor angular momentum. So mass and stiffness of modal coordinates q are diagonal, T = m q'.q'/2, U = q.K q/2, and
their force on the left of the equations is m q'' + C q' + K q. Interface nodes are bodies too. A row of the family
`joints` holds a node against the frame, in the axes of the frame: d . (x_node - x_frame) - value - phi . q = 0 for a
displacement, the product of two directions likewise for a rotation. phi is a row of the shapes of the modes, so that
the gap is linear in q and quadratic in vectors: rigid motions of the whole leave it as it is, and over an interval the
multiplier does the exact work of its change along the mean shape.

Craig, Bampton (1968), AIAA Journal 6, 1313-1319; Canavin, Likins (1977), Journal of Spacecraft and Rockets 14, 724-732
(mean axes).
"""

from numba import types, void

from evolvent.algebra.sparse import SPARSE, first_entry
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import rigid
from evolvent.model import MODEL

USED_FOR = "reduced_bodies"
_I = types.int64


@inlined
def coupling_of(k, model):
    """Reduced body of the row k of the family `joints`, and the range of its shape among the parameters."""
    b, first = model.joints[k].reduced - 1, model.joints[k].mode_shape
    return b, first, first + model.reduced_bodies[b].modes


@indirect(void(VECTOR, _I, MODEL))
def take_shape(y, k, model):
    """Take phi . q from the gap of joint k, and phi . q' from its rate."""
    b, first, last = coupling_of(k, model)
    q, v = model.reduced_bodies[b].iq, model.reduced_bodies[b].iv
    moved = rate = 0.0
    for i in range(first, last):
        moved += model.parameters[i] * y[q + i - first]
        rate += model.parameters[i] * y[v + i - first]
    model.constraints[k].gap -= moved
    model.constraints[k].rate -= rate


@indirect(void(_I, REAL, MODEL, VECTOR))
def pull_modes(k, la, model, F):
    """Generalised forces of joint k with the multiplier la on modal coordinates, on the left of the equations."""
    b, first, last = coupling_of(k, model)
    at = model.reduced_bodies[b].iv - model.info.nq
    for i in range(first, last):
        F[at + i - first] -= la * model.parameters[i]


@indirect(void(_I, _I, REAL, REAL, MODEL, SPARSE))
def add_shape(k, row, column, with_row, model, matrix):
    """Add the derivative of the gap of joint k by modal coordinates, times `column` and `with_row`, to a tangent."""
    b, first, last = coupling_of(k, model)
    at = model.reduced_bodies[b].iv - model.info.nq
    if first == last:
        return
    values = matrix.values
    to, right, _ = first_entry(matrix, row, at)
    of, _, down = first_entry(matrix, at, row)
    if to < 0 or of < 0:
        return
    for i in range(last - first):
        values[to + i * right] -= with_row * model.parameters[first + i]
        values[of + i * down] -= column * model.parameters[first + i]


@indirect(types.UniTuple(REAL, 2)(VECTOR, REAL, REAL, REAL, MODEL, VECTOR))
def add_modes(y, h, chi, ratio, model, F):
    """Elastic and damping forces of modal coordinates over an interval; returns their elastic energy and loss, J and W.

    Parameters
    ----------
    y : (ny,) float, state, or mean state with rates that are increments over h
    h : float, s, length of the interval; 0 for a state
    chi, ratio : float, filter of an interval (`evolvent.equations.energy_momentum`)
    """
    bodies, modes, n_q = model.reduced_bodies, model.modes, model.info.nq
    energy = lost = 0.0
    for b in range(bodies.size):
        q, v = bodies[b].iq, bodies[b].iv
        for i in range(bodies[b].modes):
            k = bodies[b].first_mode + i
            stiffness, damping, rate = modes[k].stiffness, modes[k].damping, y[v + i]
            modes[k].change = h * rate
            filtered = y[q + i] + 0.5 * chi * (modes[k].change - ratio * modes[k].before)
            F[v + i - n_q] += stiffness * filtered + damping * rate
            energy += 0.5 * stiffness * y[q + i] * y[q + i]
            lost += damping * rate * rate
    return energy, lost


@inlined
def add_mode_inertia(a, factor, n_q, bodies, F):
    """F += factor m a of modal coordinates; a : (nv,) float."""
    for b in range(bodies.size):
        at = bodies[b].iv - n_q
        for i in range(bodies[b].modes):
            F[at + i] += factor * bodies[b].mass * a[at + i]


@indirect(void(REAL, REAL, REAL, MODEL, SPARSE))
def add_mode_tangents(c_mass, c_rate, chi, model, matrix):
    """c_mass M + c_rate C + (1 + chi) K of modal coordinates into a matrix."""
    bodies, modes, n_q = model.reduced_bodies, model.modes, model.info.nq
    for b in range(bodies.size):
        at = bodies[b].iv - n_q
        if bodies[b].modes == 0:
            continue
        to, right, down = first_entry(matrix, at, at)
        for i in range(bodies[b].modes):
            k = bodies[b].first_mode + i
            own = c_mass * bodies[b].mass + c_rate * modes[k].damping + (1.0 + chi) * modes[k].stiffness
            matrix.values[to + i * (right + down)] += own


@indirect(void(VECTOR, MODEL, VECTOR, _I, _I))
def add_mode_energies(y, model, out, kinetic, elastic):
    """Add kinetic and elastic energy of all modal coordinates to out[kinetic] and out[elastic], J."""
    bodies, modes = model.reduced_bodies, model.modes
    for b in range(bodies.size):
        q, v = bodies[b].iq, bodies[b].iv
        for i in range(bodies[b].modes):
            out[kinetic] += 0.5 * bodies[b].mass * y[v + i] * y[v + i]
            out[elastic] += 0.5 * modes[bodies[b].first_mode + i].stiffness * y[q + i] * y[q + i]


@inlined
def note_changes(modes):
    """Keep the changes of modal coordinates over the last step, for the filter of the next one."""
    for k in range(modes.size):
        modes[k].before = modes[k].change


# ---------------------------------------------------------------------------------------------- explicit methods


@indirect(REAL(VECTOR, MODEL, VECTOR))
def mode_rates(y, model, dy):
    """Rates of modal coordinates without rows of constraint; returns the power that damping takes, W."""
    bodies, modes, lost = model.reduced_bodies, model.modes, 0.0
    for b in range(bodies.size):
        q, v, mass = bodies[b].iq, bodies[b].iv, bodies[b].mass
        for i in range(bodies[b].modes):
            own, rate = modes[bodies[b].first_mode + i], y[v + i]
            dy[q + i] = rate
            dy[v + i] = -(own.stiffness * y[q + i] + own.damping * rate) / mass
            lost += own.damping * rate * rate
    return lost


@indirect(REAL(_I, _I, MODEL))
def shape_product(k, j, model):
    """phi_k . phi_j/m of joints k and j of one reduced body: their entry in G M^-1 G^T by modal coordinates."""
    b, first, last = coupling_of(k, model)
    other, value = model.joints[j].mode_shape, 0.0
    for i in range(last - first):
        value += model.parameters[first + i] * model.parameters[other + i]
    return value / model.reduced_bodies[b].mass


@indirect(REAL(_I, MODEL, VECTOR))
def shape_rate(k, model, dy):
    """-d^2 gap/dt^2 of joint k by the accelerations of modal coordinates in dy : (ny,)."""
    b, first, last = coupling_of(k, model)
    v, value = model.reduced_bodies[b].iv, 0.0
    for i in range(first, last):
        value += model.parameters[i] * dy[v + i - first]
    return value


@indirect(void(_I, REAL, MODEL, VECTOR, _I))
def move_modes(k, la, model, out, first_place):
    """Add what the multiplier la of joint k gives modal coordinates to `out`, from an index of their first on."""
    b, first, last = coupling_of(k, model)
    factor = la / model.reduced_bodies[b].mass
    for i in range(first, last):
        out[first_place + i - first] += factor * model.parameters[i]


@indirect(void(VECTOR, MODEL, VECTOR))
def kick_modes(y, model, dy):
    """Jumps of the rates of modal coordinates, which dy holds at their velocities."""
    bodies = model.reduced_bodies
    for b in range(bodies.size):
        for i in range(bodies[b].iv, bodies[b].iv + bodies[b].modes):
            y[i] += dy[i]


# ---------------------------------------------------------------------------------------------- results


@indirect(void(VECTOR, MODEL))
def evaluate_reduced(y, model):
    """Energies and momenta of all reduced bodies in a state, after `kinematics`, into their records.

    Overwrites `Model.sums`. Modal coordinates have no momentum beside that of the frame.
    """
    rows, modes, out = model.reduced_bodies, model.modes, model.sums[1]
    for k in range(rows.size):
        first, linear, angular = rows[k].first_body, rows[k].linear, rows[k].angular
        own = model.bodies[first : first + rows[k].nodes + 1]
        for i in range(7):
            out[i] = 0.0
        rigid.add_body_energy(y, own, out, 0)
        rigid.add_body_momenta(y, own, out[1:4], out[4:7])
        rows[k].kinetic, rows[k].elastic = out[0], 0.0
        for i in range(rows[k].modes):
            rate, q = y[rows[k].iv + i], y[rows[k].iq + i]
            rows[k].kinetic += 0.5 * rows[k].mass * rate * rate
            rows[k].elastic += 0.5 * modes[rows[k].first_mode + i].stiffness * q * q
        for i in range(3):
            linear[i], angular[i] = out[1 + i], out[4 + i]


def mode_bounds(model, b):
    """Largest square of a frequency (rad2/s2) of the modes of reduced body b, and damping rate (1/s). Not compiled.

    Notes
    -----
    Constraints do not raise the highest frequency (Rayleigh), so that those of the free modes are bounds.
    """
    row = model.reduced_bodies[b]
    own = model.modes[int(row["first_mode"]) : int(row["first_mode"] + row["modes"])]
    if not own.size:
        return 0.0, 0.0
    return float(own["stiffness"].max() / row["mass"]), float(own["damping"].max() / row["mass"])
