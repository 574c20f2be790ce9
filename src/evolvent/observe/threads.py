"""Observations of threads and of the reels that they leave."""

from __future__ import annotations

import numpy as np

from evolvent import model as mdl
from evolvent.observe.variables import Observed, dot, norm, turned
from evolvent.observe.view import View
from evolvent.solvers.sampled import angular_momentum as sums_about_origin

Array = np.ndarray


def observe_thread(view: View, name: str) -> Observed:
    """Positions, tension, lag and deployed length of a thread; its nodes count from the tip.

    Notes
    -----
    The lag of a node is the angle from the feed axis to the line from the departure point Q to the node, in the axes of
    the reel's body (Tenenbaum 2014, eq. 19); the signed one is its part in the plane of the body's spin.
    """
    index, found = view.index(name), Observed()
    row = view.model.threads[index]
    seen = view.solution.observations
    first, n = int(row["node"]), int(row["n"])
    x, v = seen.position[:, first : first + n], seen.velocity[:, first : first + n]
    released = view.s[:, index, None] > np.arange(n)
    gone = view.s[:, view.model.threads.size + index] > 0
    pose = view.pose(int(row["body"]))
    Q = pose.x + turned(pose.R, row["departure"])
    tension = np.where(released, seen.tension[:, first : first + n], np.nan)
    last = np.maximum(view.s[:, index] - 1, 0)
    at, sums = np.arange(view.t.size), seen.thread_inventory[:, index]
    out = np.clip(float(row["radius"]) * seen.spool[:, index, 0], 0.0, n * float(row["segment"]))
    out = np.where(gone, n * float(row["segment"]), out)
    hub = np.where(gone | (view.s[:, index] == 0), 0.0, tension[at, last])  # nothing is out, or all has left
    lag, signed = lags(view, row, x, released)
    found.along(
        "position", "node", x, "m", "positions of the nodes from the tip, wound ones on their spool, inertial axes"
    )
    found.along("velocity", "node", v, "m s-1", "velocities of the nodes, inertial axes")
    found.along("tension", "node", tension, "N", "tension of the segment inwards of each node, NaN while it is wound")
    found.along("released", "node", released, "1", "1 for nodes that have left the spool")
    found.along("lag", "node", lag, "rad", "angle between the feed axis and the line from the spool to the node")
    found.along("signed_lag", "node", signed, "rad", "lag in the plane of the spin, negative ahead of the spool")
    found.scalar("tip_lag", signed[:, 0], "rad", "signed lag of the tip")
    found.scalar("hub_tension", hub, "N", "tension at the spool")
    found.scalar("deployed_length", out, "m", "length of thread paid out")
    found.scalar("separated", gone, "1", "1 once the thread has left the spool")
    found.vector("tip_position", x[:, 0], "m", "position of the tip, inertial axes")
    copies = f", of all {int(row['copies'])} copies" if row["copies"] > 1 else ""
    what = "of the released thread, of wound thread that is carried and of a free spool" + copies
    found.scalar("energy_kinetic", sums[:, mdl.KINETIC], "J", f"kinetic energy {what}")
    found.scalar("energy_elastic", sums[:, mdl.ELASTIC], "J", f"elastic energy of the segments{copies}")
    what = "of released thread, and of wound thread that is carried" + copies
    found.vector("momentum", sums[:, mdl.P_ALL : mdl.P_ALL + 3], "kg m s-1", f"linear momentum {what}, inertial axes")
    text = f"angular momentum about the inertial origin {what}"
    found.vector("angular_momentum", sums_about_origin(sums), "kg m2 s-1", text)
    found.coordinate("node", "node", np.arange(n), "1", "node, 0 at the tip")
    line = np.concatenate([np.where(released[..., None], x, Q[:, None]), Q[:, None]], axis=1)
    line[gone, -1] = line[gone, -2]
    found.along("line", "point", line, "m", "points of the thread from the tip to the spool, inertial axes")
    pull = np.concatenate([tension, hub[:, None]], axis=1)
    found.along("line_tension", "point", pull, "N", "tension at the points of the thread")
    found.drawn = [{"line": {"points": "line", "values": ["line_tension"]}}]
    found.plots = ["tip_lag", "hub_tension", "deployed_length"]
    return found


def lags(view: View, row: np.record, x: Array, released: Array) -> tuple[Array, Array]:
    """Lag angles of the nodes, and their signed parts in the plane of the spin: (nt, n), rad; NaN of wound nodes."""
    pose = view.pose(int(row["body"]))
    Q = pose.x + turned(pose.R, row["departure"])
    own = np.einsum("tji,tnj->tni", pose.R, x - Q[:, None])
    ahead, across = own @ row["feed_axis"], own @ row["chord"]
    off = norm(own - ahead[..., None] * row["feed_axis"])
    seen = released & (norm(own) > 1e-9)
    ahead_turns = dot(pose.w[:1], turned(pose.R[:1], np.cross(row["feed_axis"], row["chord"])))[0]
    sense = -1.0 if ahead_turns < 0.0 else 1.0
    lag = np.where(seen, np.arctan2(off, ahead), np.nan)
    return lag, np.where(seen, np.arctan2(-sense * across, ahead), np.nan)


def observe_reel(view: View, name: str) -> Observed:
    """Angle and rate of the spool, and the torque of its thread, of all reels that hold a thread."""
    found = Observed()
    threads = [k for k, part in view.assembly.parts.items() if getattr(part, "reel", None) == name]
    if not threads:
        return found
    index = view.index(threads[0])
    row, seen = view.model.threads[index], view.solution.observations
    last = np.maximum(view.s[:, index] - 1, 0)
    tension = seen.tension[np.arange(view.t.size), int(row["node"]) + last]
    free = view.s[:, view.model.threads.size + index] > 0
    tension = np.where(free | (view.s[:, index] == 0), 0.0, tension)
    found.scalar("angle", seen.spool[:, index, 0], "rad", "angle of the spool, positive pays out")
    found.scalar("rate", seen.spool[:, index, 1], "rad s-1", "rate of the spool")
    found.scalar("torque", tension * float(row["radius"]), "N m", "torque of the thread's tension on the spool")
    pose = view.pose(int(row["body"]))
    centre = pose.x + turned(pose.R, row["departure"] - float(row["radius"]) * row["normal"])
    found.vector("position", centre, "m", "centre of the spool, inertial axes")
    found.plots = ["angle", "torque"]
    found.drawn = [
        {
            "spool": {
                "body": view.part(name).body,
                "radius": float(row["radius"]),
                "angle": "angle",
                "centre": [float(c) for c in row["departure"] - float(row["radius"]) * row["normal"]],
                "axis": [float(c) for c in row["chord"]],
            }
        }
    ]
    return found
