"""Observations of threads and of the reels that they leave."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly.references import FROM_TIP
from evolvent.kernels.drive import FREE, drive
from evolvent.model import RESULTS
from evolvent.results.observe.variables import Observed, cross, norm, observer, turned, turned_back
from evolvent.results.observe.view import Pose, View

Array = np.ndarray


@observer("threads")
def observe_thread(view: View, name: str) -> Observed:
    """Positions, tension, lag and deployed length of a thread; its nodes count from the tip.

    Notes
    -----
    The lag of a node is the angle from the pay-out axis to the line from the departure point Q to the node, in the axes
    of the reel's body (Tenenbaum 2014, eq. 19); the signed one is its part in the plane that the body's spin sweeps.
    """
    index, found = view.index(name), Observed()
    row, fields = view.model.threads[index], view.fields["nodes"]
    first, n = int(row["node"]), int(row["n"])
    released = view.s[:, index, None] > np.arange(n)
    for field, described in RESULTS["nodes"].items():
        values = fields[field][:, first : first + n]
        found.along(
            described[0], "node", values if field != "tension" else np.where(released, values, np.nan), *described[1:]
        )
    x = fields["x"][:, first : first + n]
    lag, signed = lags(view, row, x, released)
    found.along("released", "node", released, "1", "1 for nodes that have left the spool")
    found.along("lag", "node", lag, "rad", "angle between the pay-out axis and the line from the spool to the node")
    found.along("signed_lag", "node", signed, "rad", "lag in the plane of the spin, negative ahead of the spool")
    found.scalar("tip_lag", signed[:, 0], "rad", "signed lag of the tip")
    gone = view.s[:, view.model.threads.size + index] > 0
    found.scalar("separated", gone, "1", "1 once the thread has left the spool")
    found.vector("tip_position", x[:, 0], "m", "position of the tip, inertial axes")
    _add(view, found, index, "out hub hub_pull Q kinetic elastic linear angular")
    if row["end"] >= 0:
        _add(view, found, index, "end_pull")
    found.coordinate("node", "node", np.arange(n), "1", FROM_TIP)
    _draw(view, name, found)
    found.plots = ["tip_lag", "hub_tension", "deployed_length"]
    found.changes(view.t, gone.astype(int), {1: "separated"})
    found.acts_one_way(view.t, "hub_tension", zero="slack", other="taut")
    return found


def _add(view: View, found: Observed, index: int, fields: str) -> None:
    """Add fields of the record of a thread that are results."""
    count = int(view.model.threads["copies"][index])
    copies = f", of all {count} copies" if count > 1 else ""
    for field in fields.split():
        values, (name, unit, text) = view.fields["threads"][field][:, index], RESULTS["threads"][field]
        if values.ndim == 1:
            extremes = view.fields["threads"].extremes_of(field, index)
            found.scalar(name, values, unit, text.format(copies=copies), extremes=extremes)
        else:
            found.vector(name, values[:, :3], unit, text.format(copies=copies))


@observer("thread_ends")
def observe_thread_end(view: View, name: str) -> Observed:
    """Force of a spherical joint at the end of a thread on its point b."""
    found, index = Observed(), view.index(name)
    thread = next(key for key, at in view.assembly.names.items() if at == ("threads", index))
    sign = 1.0 if view.part(name).a == f"{thread}.tip" else -1.0
    what = "force of the thread on b, inertial axes" if sign > 0.0 else "force on the thread, inertial axes"
    found.vector("force", sign * view.fields["threads"]["end_pull"][:, index], "N", what)
    found.plots = ["force"]
    return found


def _draw(view: View, name: str, found: Observed) -> None:
    """Add the line from the tip to the spool, with its values, and the pull on the body."""
    x, released, tension, hub, gone, signed = (
        found.variables[key].values
        for key in ("position", "released", "tension", "hub_tension", "separated", "signed_lag")
    )
    released, gone = released > 0.0, gone > 0.0
    row, width = view.model.threads[view.index(name)], view.part(name).width
    pose, Q = view.pose(int(row["body"])), found.variables["hub_position"].values
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


@observer("reels")
def observe_reel(view: View, name: str) -> Observed:
    """Angle and rate of the spool, and the torque of its thread, of all reels that hold a thread."""
    found = Observed()
    threads = [k for k, part in view.assembly.parts.items() if getattr(part, "reel", None) == name]
    winding = [k for k, part in view.assembly.parts.items() if getattr(part, "take_up", None) == name]
    if winding:
        _observe_take_up(view, name, winding[0], found)
    if not threads:
        return found
    index = view.index(threads[0])
    row = view.model.threads[index]
    _add(view, found, index, "phi turning torque" + (" reach" if row["coiling"] != 0.0 else ""))
    if row["drive"] == FREE:
        _add(view, found, index, "motor")
        if row["spool_switch"] >= 0:
            stuck = view.s[:, int(row["spool_switch"])] == 0
            found.scalar("stuck", stuck, "1", "1 while friction or the brake holds the spool")
        _add(view, found, index, "friction")
    for key, (times, values, unit) in view.solution.measured.get(name, {}).items():
        last = np.maximum(np.searchsorted(times, view.t * (1.0 + 1e-9) + 1e-12, side="right") - 1, 0)
        found.scalar(f"measured_{key}", values[last], unit, f"last sample of {key}, with noise")
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


def _observe_take_up(view: View, name: str, thread: str, found: Observed) -> None:
    """Add angle, rate and wound length of a take-up reel."""
    row, part = view.model.threads[view.index(thread)], view.part(name)
    own = view.model.parameters[int(row["take_first"]) : int(row["take_last"])]
    turns = [drive(int(row["take_drive"]), own, int(row["take_law"]), float(t)) for t in view.t]
    angle = np.array([turn[0] for turn in turns])
    for (key, unit, text), values in zip(
        (RESULTS["threads"]["phi"], RESULTS["threads"]["turning"]), (angle, np.array([turn[1] for turn in turns])),
        strict=True,
    ):  # fmt: skip
        found.scalar(key, values, unit, text)
    found.scalar("wound_length", -part.radius * angle, "m", "length of thread that the reel has taken up")
    pose = view.pose(int(view.model.markers["index"][row["end"]]))
    centre = np.array(part.centre, dtype=float)
    found.vector("position", pose.x + turned(pose.R, centre), "m", "centre of the spool, inertial axes")
    found.plots = ["angle", "wound_length"]
    found.drawn = [
        {
            "spool": {
                "body": part.body,
                "radius": part.radius,
                "angle": "angle",
                "centre": [float(c) for c in centre],
                "axis": [float(c) for c in part.frame(name)[1]],
                "width": view.part(thread).width or part.radius,
            }
        }
    ]
