"""How the body and its springs move in a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent.inertia import equilibrium
from evolvent.motion import Forces, Frame, Line, Marks, Motion, product, quaternions, turned
from evolvent.solids import Solid
from evolvent.systems.inertia_stand.prepare import body_of, stand_of
from evolvent.systems.inertia_stand.show import case_of

if TYPE_CHECKING:
    import xarray as xr

#: Largest displacement in pictures, of the stand's half length; the true one would not be seen.
SHOWN = 0.12


def motion(run: xr.Dataset) -> Motion:
    """Springs from ground to body, their forces on it, and the body; level axes, y up."""
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
    lines = [
        Line(
            name=f"spring {k + 1}",
            points=np.stack([ground[:, k], ends[:, k]], axis=1),
            values={"force [N]": np.repeat(force[:, k, None], 2, axis=1)},
            kind="spring",
            tip=None,
        )
        for k in range(len(stand.points))
    ]
    along = ground - ends
    along = along / np.linalg.norm(along, axis=-1, keepdims=True)
    pulls = Forces(name="force of the springs on the body", points=ends, vectors=force[..., None] * along)
    springs, centre = np.array(case.stand.springs), np.array(case.body.centre)
    reach = float(np.abs(springs).max())
    corners = _corners(springs, reach)
    low, high = corners[0], corners[-1]
    frame = Frame(
        name="body",
        origin=origin,
        attitude=attitude,
        outline=list(_edges(corners - centre)),
        solids=[Solid.box(high - low, centre=0.5 * (low + high) - centre)],
    )
    moved = float(np.abs(ends - ends.mean(axis=0)).max())
    return Motion(
        title="Inertia stand",
        time=time,
        lines=lines,
        forces=[pulls],
        marks=[Marks(name="fixed end", points=ground)],
        frames=[frame],
        numbers={
            "kinetic energy [J]": run.energy_kinetic.values,
            "height above rest [mm]": 1e3 * run.position.values[:, 1],
        },
        up="y",
        magnification=float(f"{max(1.0, SHOWN * reach / moved):.1g}") if moved > 0.0 else 1.0,
    )


def _corners(springs: np.ndarray, reach: float) -> np.ndarray:
    """Corners (8, 3) of a body that reaches to its springs."""
    low, high = springs.min(axis=0), springs.max(axis=0)
    low[1] -= 0.12 * reach
    high[1] += 0.12 * reach
    return np.array(
        [[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    )


def _edges(corners: np.ndarray) -> np.ndarray:
    """Edges (12, 2, 3) between the corners of a box."""
    pairs = [(a, b) for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count("1") == 1]
    return np.array([[corners[a], corners[b]] for a, b in pairs])
