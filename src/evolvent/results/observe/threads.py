"""Observations of threads and of the reels that they leave."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.assembly.references import FROM_TIP
from evolvent.flow.rhs import rhs
from evolvent.kernels.drive import FREE
from evolvent.results.observe.variables import Observed, cross, norm, turned, turned_back
from evolvent.results.observe.view import Pose, View
from evolvent.solvers.sampled import angular_momentum as sums_about_origin

Array = np.ndarray


def observe_thread(view: View, name: str) -> Observed:
    """Positions, tension, lag and deployed length of a thread; its nodes count from the tip.

    Notes
    -----
    The lag of a node is the angle from the pay-out axis to the line from the departure point Q to the node, in the axes
    of the reel's body (Tenenbaum 2014, eq. 19); the signed one is its part in the plane that the body's spin sweeps.
    """
    index, found = view.index(name), Observed()
    row = view.model.threads[index]
    seen = view.solution.observations
    first, n = int(row["node"]), int(row["n"])
    x, v = seen.position[:, first : first + n], seen.velocity[:, first : first + n]
    released = view.s[:, index, None] > np.arange(n)
    gone = view.s[:, view.model.threads.size + index] > 0
    tension = np.where(released, seen.tension[:, first : first + n], np.nan)
    last = np.maximum(view.s[:, index] - 1, 0)
    at, sums = np.arange(view.t.size), seen.thread_inventory[:, index]
    angle = seen.spool[:, index, 0]
    out = np.clip((float(row["radius"]) - 0.5 * float(row["coiling"]) * angle) * angle, 0.0, n * float(row["segment"]))
    out = np.where(gone, n * float(row["segment"]), out)
    hub = np.where(gone | (view.s[:, index] == 0), 0.0, tension[at, last])  # nothing is out, or all has left
    lag, signed = lags(view, row, x, released)
    found.along(
        "position", "node", x, "m", "positions of the nodes from the tip, wound ones on their spool, inertial axes"
    )
    found.along("velocity", "node", v, "m s-1", "velocities of the nodes, inertial axes")
    found.along("tension", "node", tension, "N", "tension of the segment inwards of each node, NaN while it is wound")
    found.along("released", "node", released, "1", "1 for nodes that have left the spool")
    found.along("lag", "node", lag, "rad", "angle between the pay-out axis and the line from the spool to the node")
    found.along("signed_lag", "node", signed, "rad", "lag in the plane of the spin, negative ahead of the spool")
    found.scalar("tip_lag", signed[:, 0], "rad", "signed lag of the tip")
    found.scalar("hub_tension", hub, "N", "tension at the spool")
    found.scalar("deployed_length", out, "m", "length of thread paid out")
    found.scalar("separated", gone, "1", "1 once the thread has left the spool")
    found.vector("tip_position", x[:, 0], "m", "position of the tip, inertial axes")
    if row["end"] >= 0:
        found.vector("end_force", _end_force(view, index, x, tension), "N", "force on the end part, inertial axes")
    sums = sums.copy()
    _add_tip(view, name, sums)
    copies = f", of all {int(row['copies'])} copies" if row["copies"] > 1 else ""
    what = "of the released thread, of wound thread that is carried and of a free spool" + copies
    found.scalar("energy_kinetic", sums[:, mdl.KINETIC], "J", f"kinetic energy {what}")
    found.scalar("energy_elastic", sums[:, mdl.ELASTIC], "J", f"elastic energy of the segments{copies}")
    what = "of released thread, and of wound thread that is carried" + copies
    found.vector("momentum", sums[:, mdl.P_ALL : mdl.P_ALL + 3], "kg m s-1", f"linear momentum {what}, inertial axes")
    text = f"angular momentum about the inertial origin {what}"
    found.vector("angular_momentum", sums_about_origin(sums), "kg m2 s-1", text)
    found.coordinate("node", "node", np.arange(n), "1", FROM_TIP)
    _draw(view, name, found)
    found.plots = ["tip_lag", "hub_tension", "deployed_length"]
    return found


def _add_tip(view: View, name: str, sums: Array) -> None:
    """Add energy and momenta of the point mass at the tip, where other parts act on it, to those of its thread."""
    own = view.assembly.names.get(f"{name}.tip")
    if own is None:
        return
    point = view.model.points[own[1]]
    x, v, m = view.coordinates(int(point["iq"])), view.coordinates(int(point["iv"])), float(point["mass"])
    sums[:, mdl.KINETIC] += 0.5 * m * (v * v).sum(axis=1)
    sums[:, mdl.P_ALL : mdl.P_ALL + 3] += m * v
    sums[:, mdl.H_RELEASED : mdl.H_RELEASED + 3] += m * np.cross(x, v)


def observe_thread_end(view: View, name: str) -> Observed:
    """Force of a spherical joint at the end of a thread on its point b."""
    found, index = Observed(), view.index(name)
    row = view.model.threads[index]
    first, n = int(row["node"]), int(row["n"])
    seen = view.solution.observations
    x, released = seen.position[:, first : first + n], view.s[:, index, None] > np.arange(n)
    tension = np.where(released, seen.tension[:, first : first + n], np.nan)
    thread = next(key for key, at in view.assembly.names.items() if at == ("threads", index))
    sign = 1.0 if view.part(name).a == f"{thread}.tip" else -1.0
    what = "force of the thread on b, inertial axes" if sign > 0.0 else "force on the thread, inertial axes"
    found.vector("force", sign * _end_force(view, index, x, tension), "N", what)
    found.plots = ["force"]
    return found


def _end_force(view: View, index: int, x: Array, tension: Array) -> Array:
    """Pull of the outermost segment on the point that a thread ends at, inertial axes: (nt, 3)."""
    row = view.model.threads[index]
    pose = view.pose(int(row["body"]))
    inner = pose.x + turned(pose.R, row["departure"])
    if row["n"] > 1:
        inner = np.where((view.s[:, index] > 1)[:, None], x[:, 1], inner)
    away = inner - x[:, 0]
    length = norm(away)
    pull: Array = (np.nan_to_num(tension[:, 0]) / np.where(length > 0.0, length, 1.0))[:, None] * away
    return pull


def _draw(view: View, name: str, found: Observed) -> None:
    """Add the line from the tip to the spool, with its values, and the pull on the body."""
    x, released, tension, hub, gone, signed = (
        found.variables[key].values
        for key in ("position", "released", "tension", "hub_tension", "separated", "signed_lag")
    )
    released, gone = released > 0.0, gone > 0.0
    row, width = view.model.threads[view.index(name)], view.part(name).width
    pose = view.pose(int(row["body"]))
    Q = pose.x + turned(pose.R, row["departure"])
    line = np.concatenate([np.where(released[..., None], x, Q[:, None]), Q[:, None]], axis=1)
    line[gone, -1] = line[gone, -2]
    found.along("line", "point", line, "m", "points of the thread from the tip to the spool, inertial axes")
    held = ~gone & released.any(axis=1)
    at_hub = np.where(held, hub, np.nan)[:, None]
    values = {
        "tension": ("N", "tension", np.concatenate([tension, at_hub], axis=1)),
        "signed_lag": ("rad", "signed lag", np.concatenate([signed, np.full_like(at_hub, np.nan)], axis=1)),
        "curvature": ("m-1", "curvature", curvature(line)),
    }
    for key, (unit, what, along) in values.items():
        found.along(f"line_{key}", "point", along, unit, f"{what} at the points of the thread")
    # the last node that has left the spool is where the thread goes to
    last = np.maximum(released.sum(axis=1) - 1, 0)
    away = line[np.arange(view.t.size), last] - Q
    length = norm(away)
    pull = (hub / np.where(length > 0.0, length, 1.0))[:, None] * away
    found.vector("hub_position", Q, "m", "where the thread leaves the spool, inertial axes")
    found.vector("hub_force", pull, "N", "pull of the thread where it leaves the spool, inertial axes")
    own: dict[str, Any] = {"copies": copies_drawn(view, row)} if row["copies"] > 1 else {}
    drawn = {"points": "line", "values": {key.replace("_", " "): f"line_{key}" for key in values}, "tip": 0, **own}
    if width is not None:
        chord = np.broadcast_to(turned(pose.R, row["chord"])[:, None], line.shape)
        found.along("chord", "point", chord, "1", "direction of the width, along the spool's axis, inertial axes")
        drawn |= {"width": width, "across": "chord"}
    force = {"name": f"pull of {name}", "points": "hub_position", "vectors": "hub_force", **own}
    found.drawn = [{"line": drawn}, {"forces": force}]
    if view.part(name).tip_mass > 0.0 and row["copies"] == 1:
        found.drawn.append({"marks": {"points": ["tip_position"]}})


def copies_drawn(view: View, row: np.record) -> dict[str, Any]:
    """How the copies of a thread stand about their body, for `evolvent.view.drawing`."""
    names = {index: name for name, (family, index) in view.assembly.names.items() if family == "bodies"}
    axis = view.model.bodies[int(row["body"])]["axis"]
    return {"count": int(row["copies"]), "body": names[int(row["body"])], "axis": [float(c) for c in axis]}


def curvature(x: Array) -> Array:
    """Curvature of a line at its points (nt, n, 3), 1/m; NaN at its ends and where two points coincide.

    Notes
    -----
    2 |a x b| / (|a| |b| |a + b|) of two pieces a and b on end, the circle's through three points.
    """
    a, b = x[:, 1:-1] - x[:, :-2], x[:, 2:] - x[:, 1:-1]
    found = np.full(x.shape[:2], np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        found[:, 1:-1] = 2.0 * norm(cross(a, b)) / (norm(a) * norm(b) * norm(a + b))
    found[~np.isfinite(found)] = np.nan
    return found


def lags(view: View, row: np.record, x: Array, released: Array) -> tuple[Array, Array]:
    """Lag angles of the nodes, and their signed parts in the plane of the spin: (nt, n), rad; NaN of wound nodes."""
    pose = view.pose(int(row["body"]))
    Q = pose.x + turned(pose.R, row["departure"])
    own = np.einsum("tji,tnj->tni", pose.R, x - Q[:, None])
    ahead, across = own @ row["payout_axis"], own @ _leading(pose, row)
    off = norm(own - ahead[..., None] * row["payout_axis"])
    seen = released & (norm(own) > 1e-9)
    lag = np.where(seen, np.arctan2(off, ahead), np.nan)
    return lag, np.where(seen, np.arctan2(-across, ahead), np.nan)


def _leading(pose: Pose, row: np.record) -> Array:
    """Direction, body axes, in which the spin at the start moves what is out along the pay-out axis.

    Of a body that does not spin across the pay-out axis, the axis of the spool.
    """
    rate = turned_back(pose.R[:1], pose.w[:1])
    moved = cross(rate, row["payout_axis"][None])[0]
    size = float(norm(moved))
    found: Array = moved / size if size > 1e-9 * max(float(norm(rate[0])), 1e-3) else row["chord"]
    return found


def _spool_torques(view: View, index: int) -> tuple[Array, Array]:
    """Torques of motor and friction on a free spool, N m: (nt,) each."""
    model, found = view.model, np.zeros((2, view.t.size))
    dy = np.zeros(view.y.shape[1])
    for k, t in enumerate(view.t):
        s = np.ascontiguousarray(view.s[k])
        rhs(float(t), np.ascontiguousarray(view.y[k]), s, model, dy)
        row = model.threads[index]
        found[:, k] = row["motor"], row["friction"]
        if row["spool_switch"] >= 0 and s[row["spool_switch"]] == 0:  # see `kernels.thread.spool.hold_torque`
            body = model.bodies[int(row["body"])]
            turning = float((body["R"] @ row["chord"]) @ body["a"][3:])
            held = s[index] > 0 and s[model.threads.size + index] == 0
            tension = model.nodes["tension"][int(row["node"]) + int(s[index]) - 1] if held else 0.0
            found[1, k] = row["spool"] * turning - row["r"] * tension - row["motor"]
    return found[0], found[1]


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
    radius = float(row["radius"]) - float(row["coiling"]) * seen.spool[:, index, 0]
    found.scalar("torque", tension * radius, "N m", "torque of the thread's tension on the spool")
    if row["coiling"] != 0.0:
        found.scalar("radius", radius, "m", "radius at which the tape leaves the spool")
    if row["drive"] == FREE:
        motor, friction = _spool_torques(view, index)
        found.scalar("motor_torque", motor, "N m", "torque of the motor on the spool, positive pays out")
        if row["spool_switch"] >= 0:
            stuck = view.s[:, int(row["spool_switch"])] == 0
            found.scalar("stuck", stuck, "1", "1 while friction or the brake holds the spool")
        found.scalar("friction_torque", friction, "N m", "torque of friction and brake on the spool")
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
                "width": view.part(threads[0]).width or float(row["radius"]),
                **({"copies": copies_drawn(view, row)} if row["copies"] > 1 else {}),
            }
        }
    ]
    return found
