"""Lumped thread on a reel: spring segments or segments of fixed length, boundary segment, wound thread.

Node 0 is the tip, it leaves first; node i is released when the spool's angle reaches i l0 / r. Of the s released
nodes the last, s - 1, is the boundary node: its segment ends at the departure point Q and has the rest length
b = r (phi - (s - 1) l0 / r). Tangents e point outwards, from node i + 1 (or Q) to node i.

Spring segments hold positions and velocities of the nodes in the state (inertial axes). Segments of fixed length hold
the tangent e_i and its rate u_i = e_i' in the same slots, so that lengths are exact; once the whole thread is released
the slot of the last node holds that node's position and velocity. Implicit methods hold positions and velocities of
their nodes as well, and each segment is a constraint.

Source: Tenenbaum (2014), equations 1 to 15; see `evolvent_papers.heliogyro`.

`wound` : the drive, the departure point and the thread on the spool; `springs`, `chain` : the released part by the
kind of its segments; `joined` : those of fixed length under implicit methods; `loads` : on released nodes; `energy` :
energies and momenta; `moving`, `moving_energy`, `moving_tangent` : spring segments on a mesh that moves;
`implicit` : residual and tangent; `free` : free spools there; `bound` : of the explicit step.
"""

from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.thread.bound import add_thread_bound
from evolvent.kernels.thread.chain import (
    SHORT,
    boundary_step,
    chain_links,
    chain_matrix,
    chain_points,
    chain_rates,
    chain_rhs,
    chain_solve,
    departure_acceleration,
    kick_chain,
    project_chain,
    regular_rate,
)
from evolvent.kernels.thread.end import TINY, is_end
from evolvent.kernels.thread.energy import add_thread_energies, thread_inventory
from evolvent.kernels.thread.explicit import add_explicit_threads
from evolvent.kernels.thread.fields import add_node_fields, wound_fields
from evolvent.kernels.thread.free import add_spool_tangent, has_release, until_release
from evolvent.kernels.thread.implicit import add_thread_residual, add_thread_tangent, is_loaded
from evolvent.kernels.thread.joined import has_springs, leaves_spool, note_tensions, pull_joined
from evolvent.kernels.thread.loads import add_node_load_tangents, evaluate_thread_loads, node_loads
from evolvent.kernels.thread.moving import (
    carry_root,
    hold_root,
    kick_moving,
    moving_rates,
)
from evolvent.kernels.thread.moving_tangent import add_turning_elements, note_drift
from evolvent.kernels.thread.relaxing import begin_strains, relaxed_threads, strains_of
from evolvent.kernels.thread.results import note_results
from evolvent.kernels.thread.spool import (
    INEXTENSIBLE,
    JOINED,
    MOVING,
    SPRINGS,
    hold_torque,
    is_loose,
    lock_spools,
    paid_out,
    spool_direction,
    spool_losses,
    spring_spools,
)
from evolvent.kernels.thread.springs import longest_step, spring_points, spring_thread
from evolvent.kernels.thread.step import add_thread_step, add_thread_step_tangent, measure_threads
from evolvent.kernels.thread.wound import (
    carry_power,
    carry_wound,
    leave_spool,
    reels,
    spool,
    spool_axis,
    take_up,
    wound_mass,
    wound_node,
)

__all__ = [
    "FREE_SPOOL",
    "INEXTENSIBLE",
    "JOINED",
    "MOVING",
    "SHORT",
    "SPRINGS",
    "TINY",
    "add_explicit_threads",
    "add_node_fields",
    "add_node_load_tangents",
    "add_spool_tangent",
    "add_thread_bound",
    "add_thread_energies",
    "add_thread_residual",
    "add_thread_step",
    "add_thread_step_tangent",
    "add_thread_tangent",
    "add_turning_elements",
    "begin_strains",
    "boundary_step",
    "carry_power",
    "carry_root",
    "carry_wound",
    "chain_links",
    "chain_matrix",
    "chain_points",
    "chain_rates",
    "chain_rhs",
    "chain_solve",
    "departure_acceleration",
    "evaluate_thread_loads",
    "has_release",
    "has_springs",
    "hold_root",
    "hold_torque",
    "is_end",
    "is_loaded",
    "is_loose",
    "kick_chain",
    "kick_moving",
    "leave_spool",
    "leaves_spool",
    "lock_spools",
    "longest_step",
    "measure_threads",
    "moving_rates",
    "node_loads",
    "note_drift",
    "note_results",
    "note_tensions",
    "paid_out",
    "project_chain",
    "pull_joined",
    "reels",
    "regular_rate",
    "relaxed_threads",
    "spool",
    "spool_axis",
    "spool_direction",
    "spool_losses",
    "spring_points",
    "spring_spools",
    "spring_thread",
    "strains_of",
    "take_up",
    "thread_inventory",
    "until_release",
    "wound_fields",
    "wound_mass",
    "wound_node",
]
