r"""Wrapped rib: a thin strip is wound round a rigid hub by a drive, is held there, and springs open by its own bending.

The hub is a cylinder of radius R about z, its middle at the origin. A rib of length L is hinged or clamped at
(R, 0, 0), several ribs evenly round the hub; it starts straight, pointing outwards, and winds counterclockwise in the
plane z = 0. Its flat side faces the hub. EI and EA are its bending and axial stiffness, m its mass per length.

Elements: absolute nodal coordinates, r = S(xi) e, with one quadratic form of the products of nodal vectors for each
formulation (`evolvent.elements`). `cable` has position and slope, `cable_stretch` the same with engineering strain; the
beams have 24 coordinates. Damping is alpha M e' + beta J^T H J e', of all elements or chosen ones. The contact acts at
contact points inside the elements, K d^n (1 + a d') along the normal. The equations M e'' + F + D + g_e^T la = Q, g = 0
(index 3) are stepped by generalized-alpha (Arnold & Bruels 2007); RK4 and Heun take penalties in place of g.

Drives:

- `torque`, a force on every part of the rib proportional to z x r per mass, in all the torque T about the axis.
- `hub`: the hub turns and the rib is held back, by its drag alpha and, if given, by a field torque.
- `tip`: the tip is carried round along the involute, with a strain that holds the rib taut.

Closed forms (`reference.py`): a light string on an involute gives the time of winding; wound and held by T, the normal
forces sum to T L / (2 R^2) and the tension falls from T/R at the root to 0 at the tip; a rib that springs open from
rest does so at the constant tip speed sqrt(3 EI/m)/R.

Where the paper is in error, or silent:

- Its mesh of 10 elements is locked: bent to the hub's radius it is 2.35e6 times as stiff as the rib (`advice.locking`).
  `full` is that element; `cable` is the default.
- It winds by "a constant torque" whose value and manner are not given. A couple at the hinge does no more work than
  pi/2 of itself and winds nothing; the torque here is a field.
- Its contact law K d^n + c d' jumps at the touch, so that an implicit step may have no solution: fixed steps from 0.5 s
  to 4 ms failed. `hunt-crossley` is the default.
- Its damping b K_e e' resists rotation as well: a spinning rib without strain gains or loses energy by it.
- Its gamma = 2/(1 + rho) + 1/2 is a misprint for - 1/2.
- The largest tip speed and contact force do not converge with the mesh, for the last bit whips as l^(-1/2); their
  times, means and impulses do.

Source: Yi, Yuan, Dong, Li (2017), a wrapped-rib antenna's rib wound round its hub.
"""

from evolvent.definition import SystemDefinition
from evolvent.systems.wrapped_rib.case import Case
from evolvent.systems.wrapped_rib.chart import study_figures
from evolvent.systems.wrapped_rib.results import layout
from evolvent.systems.wrapped_rib.show import figures, motion, numbers
from evolvent.systems.wrapped_rib.simulate import plan, stepping
from evolvent.systems.wrapped_rib.start import check_follows
from evolvent.systems.wrapped_rib.structure import build


class WrappedRib(SystemDefinition):
    """The system `wrapped-rib`."""

    Case = Case
    start_key = "start"
    study_figures = staticmethod(study_figures)
    layout = staticmethod(layout)
    motion = staticmethod(motion)
    figures = staticmethod(figures)
    numbers = staticmethod(numbers)
    plan = staticmethod(plan)
    stepping = staticmethod(stepping)
    check_follows = staticmethod(check_follows)
    build = staticmethod(build)


SYSTEM = WrappedRib()

__all__ = [
    "Case",
    "build",
    "check_follows",
    "figures",
    "layout",
    "motion",
    "numbers",
    "plan",
    "stepping",
    "study_figures",
]
