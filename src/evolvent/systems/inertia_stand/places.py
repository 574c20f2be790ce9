"""Where the body and its springs are at every sample of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent.inertia import equilibrium
from evolvent.motion import Forces, Frame, Motion, Strand, product, quaternions, turned
from evolvent.systems.inertia_stand.prepare import body_of, stand_of
from evolvent.systems.inertia_stand.show import box, case_of

if TYPE_CHECKING:
    import xarray as xr


def motion(run: xr.Dataset) -> Motion:
    """Springs from ground to body, their forces on it, and its axes; level axes, y up, in true size."""
    case, time = case_of(run), run.time.values
    stand, body = stand_of(case), body_of(case)
    rest = equilibrium(stand, body)
    origin = run.position.values + rest.position
    attitude = product(run.attitude.values, quaternions(rest.rotation[None]))
    ends = origin[:, None] + turned(
        attitude, np.broadcast_to(stand.points - body.centre, (time.size, *stand.points.shape))
    )
    ground = np.broadcast_to(stand.ground_points, ends.shape)
    force = run.spring_force.values
    strands = [
        Strand(
            name=f"spring {k + 1}",
            points=np.stack([ground[:, k], ends[:, k]], axis=1),
            values={"force [N]": np.repeat(force[:, k, None], 2, axis=1)},
        )
        for k in range(len(stand.points))
    ]
    along = ground - ends
    along = along / np.linalg.norm(along, axis=-1, keepdims=True)
    pulls = Forces(name="force of the springs on the body", points=ends, vectors=force[..., None] * along)
    springs = np.array(case.stand.springs)
    edges = box(springs, float(np.abs(springs).max())) - np.array(case.body.centre)
    frame = Frame(name="body", origin=origin, attitude=attitude, outline=list(edges))
    return Motion(time=time, strands=strands, forces=[pulls], frames=[frame])
