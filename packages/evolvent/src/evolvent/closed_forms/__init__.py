r"""Closed forms and small models, independent of the engine: of a strip on a hub, and of blades on a spinning body.

They size a structure before it is modelled, and runs are compared with them.

**The strip** winds on a hub, lies on it and springs off. The rib is uniform, but for a taper of the thickness where one
is named: length L, mass m per length, bending stiffness EI, axial stiffness EA, hub radius R. The hub does not turn.
The winding sense is counterclockwise, as seen with the hub's axis z towards the eye.

A field torque T is a force c z x r per mass on every part of the rib, r from the axis, with c = T / int r^2 dm at every
instant: its moment about the axis is T whatever the shape.

**The blades** are N straight rigid blades of length l, hinged at the distance L0 from the spin axis of a body that
turns at W. M, S and I are mass, first and second moment of a blade about its hinge, k = L0 S / I, and the lag d is
positive behind the outward direction.

**The membrane strip** has its root on the spin axis; tension alone makes it stiff.

**The film blade** is bent edgewise by Coriolis forces while it is paid out, by which it buckles.

**The tape spring and the lenticular rod** flatten where they are bent; their law of uniform bending is nonlinear.
"""

from __future__ import annotations

from evolvent.closed_forms.blades import (
    MOST_DOUBLINGS,
    WOUND_LAG,
    Rotor,
    blade_moments,
    lag_frequency,
    payout_lag,
    rotor_inertia,
    slow_torque_limit,
    spin_up_lag,
    spin_up_swing,
    step_acceleration_limit,
    step_torque_limit,
)
from evolvent.closed_forms.films import (
    Film,
    buckling_places,
    lateral_buckling,
    payout_buckling,
    payout_buckling_modes,
    payout_slack,
)
from evolvent.closed_forms.membranes import driven_twist, spinning_strip_modes, sunlight_coning
from evolvent.closed_forms.openings import Opening, opening
from evolvent.closed_forms.strips import (
    STIFF,
    WOUND,
    Strip,
    Winding,
    axial_stiffness_at,
    bending_energy,
    deployed_length,
    deployed_tip_radius,
    deployment_speed,
    deployment_time,
    membrane_energy,
    peel,
    root_strain,
    string_shape,
    string_winding,
    wound_contact_force,
    wound_pressure,
    wound_tension,
)
from evolvent.closed_forms.tails import (
    SHORT_TAIL,
    HeldTail,
    SpunTail,
    held_tails,
    least_winding_torque,
    parabola_energy,
    short_tail,
    spun_tail,
    winding_share,
)
from evolvent.closed_forms.tapes import Snap, flattened_bending, snap

__all__ = [
    "MOST_DOUBLINGS",
    "SHORT_TAIL",
    "STIFF",
    "WOUND",
    "WOUND_LAG",
    "Film",
    "HeldTail",
    "Opening",
    "Rotor",
    "Snap",
    "SpunTail",
    "Strip",
    "Winding",
    "axial_stiffness_at",
    "bending_energy",
    "blade_moments",
    "buckling_places",
    "deployed_length",
    "deployed_tip_radius",
    "deployment_speed",
    "deployment_time",
    "driven_twist",
    "flattened_bending",
    "held_tails",
    "lag_frequency",
    "lateral_buckling",
    "least_winding_torque",
    "membrane_energy",
    "opening",
    "parabola_energy",
    "payout_buckling",
    "payout_buckling_modes",
    "payout_lag",
    "payout_slack",
    "peel",
    "root_strain",
    "rotor_inertia",
    "short_tail",
    "slow_torque_limit",
    "snap",
    "spin_up_lag",
    "spin_up_swing",
    "spinning_strip_modes",
    "spun_tail",
    "step_acceleration_limit",
    "step_torque_limit",
    "string_shape",
    "string_winding",
    "sunlight_coning",
    "winding_share",
    "wound_contact_force",
    "wound_pressure",
    "wound_tension",
]
