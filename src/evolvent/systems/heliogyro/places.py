"""How the blades and the body move in a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent.motion import Forces, Frame, Line, Motion, about_z, turned
from evolvent.solids import Solid
from evolvent.systems.heliogyro.show import case_of

if TYPE_CHECKING:
    import xarray as xr


def motion(run: xr.Dataset) -> Motion:
    """Blades from tip to spool, their pull on the body, and the body with its spools.

    Notes
    -----
    The tension of a node is that of its segment towards the spool, that of the spool the last segment's; wound nodes
    are at the spool and have none.
    """
    case, time = case_of(run), run.time.values
    blades, n = run.sizes["blade"], run.sizes["node"]
    if "body_quaternion" in run:
        attitude, origin = run.body_quaternion.values, run.body_position.values
    else:
        attitude, origin = about_z(run.body_angle.values), np.zeros((time.size, 3))
    L0, radius = case.body.spool_offset, case.spool.radius
    released, let_go = run.released.values, run.let_go.values
    lines, starts, pulls = [], [], []
    solids = [Solid.cylinder(0.7 * L0, 2.0 * radius)]
    for b in range(blades):
        turn = 2.0 * np.pi * b / blades
        out, axis = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([-np.sin(turn), np.cos(turn), 0.0])
        Q = L0 * out + np.array([0.0, 0.0, radius])
        points = np.empty((time.size, n + 1, 3))
        points[:, :n] = np.where(released[:, b, :, None], run.position.values[:, b], Q)
        points[:, n] = np.where(let_go[:, b, None], points[:, n - 1], Q)
        hub = np.where(let_go[:, b] | ~released[:, b].any(axis=1), np.nan, run.hub_tension.values[:, b])
        tension = np.concatenate([run.tension.values[:, b], hub[:, None]], axis=1)
        lag = np.concatenate([run.signed_lag.values[:, b], np.full((time.size, 1), np.nan)], axis=1)
        lag[:, :n][~released[:, b]] = np.nan
        width = case.blade.width
        lines.append(
            Line(
                name=f"blade {b + 1}",
                points=origin[:, None] + turned(attitude, points),
                values={"tension [N]": tension, "lag [rad]": lag, "curvature [1/m]": _curvature(points)},
                width=width,
                across=None if width is None else turned(attitude, np.broadcast_to(axis, points.shape)),
                tip=0,
            )
        )
        spool = run.spool_angle.values[:, b] if "spool_angle" in run else None
        solids.append(Solid.cylinder(radius, width or radius, centre=L0 * out, axis=axis, turned=spool))
        # the last node that has left the spool is where the thread goes to
        last = np.maximum(released[:, b].sum(axis=1) - 1, 0)
        along = points[np.arange(time.size), last] - Q
        length = np.linalg.norm(along, axis=1, keepdims=True)
        starts.append(Q)
        pulls.append(np.nan_to_num(hub)[:, None] * along / np.where(length > 0.0, length, 1.0))
    at = np.broadcast_to(np.array(starts), (time.size, blades, 3))
    force = Forces(
        name="pull of the blades on the body",
        points=origin[:, None] + turned(attitude, at),
        vectors=turned(attitude, np.stack(pulls, axis=1)),
    )
    around = np.linspace(0.0, 2.0 * np.pi, 25)
    edge = L0 * np.stack([np.cos(around), np.sin(around), np.zeros(25)], axis=1)
    return Motion(
        title="Deployment of the heliogyro's blades",
        time=time,
        lines=lines,
        forces=[force],
        frames=[Frame(name="body", origin=origin, attitude=attitude, outline=[edge], solids=solids)],
        numbers={
            "body rate [rad/s]": run.body_rate.values,
            "deployed [m]": run.deployed_length.values[:, 0],
            "tip lag [deg]": np.degrees(run.signed_lag.values[:, 0, 0]),
        },
    )


def _curvature(x: np.ndarray) -> np.ndarray:
    """Curvature of a line at its points (nt, n, 3), 1/m; NaN at its ends and where two points coincide.

    Notes
    -----
    2 |a x b| / (|a| |b| |a + b|) of two pieces a and b on end, the circle's through three points.
    """
    a, b = x[:, 1:-1] - x[:, :-2], x[:, 2:] - x[:, 1:-1]
    sizes = [np.linalg.norm(v, axis=-1) for v in (a, b, a + b)]
    found = np.full(x.shape[:2], np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        found[:, 1:-1] = 2.0 * np.linalg.norm(np.cross(a, b), axis=-1) / (sizes[0] * sizes[1] * sizes[2])
    found[~np.isfinite(found)] = np.nan
    return found
