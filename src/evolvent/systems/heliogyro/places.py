"""Where the blades and the body are at every sample of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent.motion import Forces, Frame, Motion, Strand, about_z, turned
from evolvent.systems.heliogyro.show import case_of

if TYPE_CHECKING:
    import xarray as xr


def motion(run: xr.Dataset) -> Motion:
    """Blades from tip to spool, their pull on the body, and the body's axes.

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
    L0, released, let_go = case.body.spool_offset, run.released.values, run.let_go.values
    strands, starts, pulls = [], [], []
    for b in range(blades):
        turn = 2.0 * np.pi * b / blades
        Q = np.array([L0 * np.cos(turn), L0 * np.sin(turn), case.spool.radius])
        points = np.empty((time.size, n + 1, 3))
        points[:, :n] = np.where(released[:, b, :, None], run.position.values[:, b], Q)
        points[:, n] = np.where(let_go[:, b, None], points[:, n - 1], Q)
        hub = np.where(let_go[:, b] | ~released[:, b].any(axis=1), np.nan, run.hub_tension.values[:, b])
        tension = np.concatenate([run.tension.values[:, b], hub[:, None]], axis=1)
        lag = np.concatenate([run.signed_lag.values[:, b], np.full((time.size, 1), np.nan)], axis=1)
        lag[:, :n][~released[:, b]] = np.nan
        placed = origin[:, None] + turned(attitude, points)
        values = {"tension [N]": tension, "lag [rad]": lag}
        strands.append(Strand(name=f"blade {b + 1}", points=placed, values=values))
        # the last node that has left the spool is where the thread goes to
        last = np.maximum(released[:, b].sum(axis=1) - 1, 0)
        along = points[np.arange(time.size), last] - Q
        length = np.linalg.norm(along, axis=1, keepdims=True)
        pull = np.nan_to_num(hub)[:, None] * along / np.where(length > 0.0, length, 1.0)
        starts.append(Q)
        pulls.append(pull)
    at = np.broadcast_to(np.array(starts), (time.size, blades, 3))
    force = Forces(
        name="pull of the blades on the body",
        points=origin[:, None] + turned(attitude, at),
        vectors=turned(attitude, np.stack(pulls, axis=1)),
    )
    around = np.linspace(0.0, 2.0 * np.pi, 25)
    hub_line = L0 * np.stack([np.cos(around), np.sin(around), np.zeros(25)], axis=1)
    body = Frame(name="body", origin=origin, attitude=attitude, outline=[hub_line])
    return Motion(time=time, strands=strands, forces=[force], frames=[body])
