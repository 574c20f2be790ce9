"""Energy and momentum of a state."""

from numba import void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect
from evolvent.equations.rhs import set_state
from evolvent.kernels import rigid
from evolvent.kernels.calls import energy_at, momentum_at, state_at
from evolvent.model import ELASTIC, H_BODY, KINETIC, MODEL, P_ALL
from evolvent.model.interval import state_interval
from evolvent.model.powers import N_POWERS


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
    F, part, at = model.F, model.powers, model.interval
    for i in range(F.size):
        F[i] = 0.0
    for i in range(N_POWERS):
        part[i] = 0.0
    rigid.kinematics(t, y, model)
    set_state(t, -1.0, at)
    interval, calls = state_interval(at, y, F, F, F, part, s, y), model.explicit_energy_calls
    found = model.energies
    for i in range(3):
        found[i] = 0.0
    for k in range(calls.size):
        energy_at(model, calls[k])(interval, model, found)
    out[KINETIC], out[ELASTIC] = found[0], found[1]
    calls = model.momentum_calls
    for i in range(6):
        part[i] = 0.0
    for k in range(calls.size):
        momentum_at(model, calls[k])(y, model, part)
    for c in range(3):
        out[P_ALL + c], out[H_BODY + c] = part[c], part[3 + c]
    calls = model.explicit_sums_calls
    for k in range(calls.size):
        state_at(model, calls[k])(t, y, s, model, out)
