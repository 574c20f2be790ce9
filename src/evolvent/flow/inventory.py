"""Energy and momentum of a state."""

from numba import void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect
from evolvent.flow.explicit_forces import add_explicit_inventory, has_explicit_forces
from evolvent.kernels import attitude, points, reduced, rigid, rod_payout, springs, tape, thread
from evolvent.model import ELASTIC, H_BODY, KINETIC, MODEL, P_ALL


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, VECTOR))
def inventory(t, y, s, model, out):
    """Energies and momenta of a state.

    Parameters
    ----------
    out : (N_INVENTORY,) float, output
        kinetic energy, elastic energy (J); angular momentum about the inertial origin of bodies, released and wound
        thread (kg m2/s); linear momentum (kg m/s); the part of the wound thread's angular momentum that bodies carry.
        Wound thread that is not carried is counted in its own angular momentum only. Leaves node positions and
        velocities in the nodes' x, v.
    """
    for i in range(out.size):
        out[i] = 0.0
    P, H = out[P_ALL : P_ALL + 3], out[H_BODY : H_BODY + 3]
    rigid.kinematics(t, y, model)
    if model.threads.size > 0:
        thread.reels(t, y, s, model)
    rigid.add_body_energy(y, model.bodies, out, KINETIC)
    rigid.add_body_momenta(y, model.bodies, P, H)
    points.add_point_energy(y, model.points, out, KINETIC)
    points.add_point_momenta(y, model.points, P, H)
    if model.rods.size > 0:
        rod_payout.sum_flows(model)
        flow = model.sums[1]
        out[KINETIC] += flow[0]
        for c in range(3):
            P[c] += flow[1 + c]
            H[c] += flow[4 + c]
    if model.wheels.size > 0:
        attitude.add_wheel_energy(y, model, out, KINETIC)
        attitude.add_wheel_momenta(y, model, H)
    if model.tapes.size > 0:
        tape.add_kinetic_energy(y, model, out, KINETIC)
    if model.reduced_bodies.size > 0:
        reduced.add_mode_energies(y, model, out, KINETIC, ELASTIC)
    if model.springs.size > 0:
        out[ELASTIC] += springs.evaluate_springs(t, y, model)
    for p in range(model.threads.size):
        thread.thread_inventory(y, s, model, p, out)
    if has_explicit_forces(model):
        add_explicit_inventory(t, y, s, model, out)
