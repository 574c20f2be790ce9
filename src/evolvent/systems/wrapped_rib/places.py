"""How the ribs and the hub move in a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent.motion import Forces, Frame, Line, Motion, about_z, turned
from evolvent.solids import Solid
from evolvent.systems.wrapped_rib.show import case_of, element_forces

if TYPE_CHECKING:
    import xarray as xr


def motion(run: xr.Dataset) -> Motion:
    """Ribs from root to tip, the forces of the hub and of the turns below on them, and the hub.

    Notes
    -----
    The force on an element is its pressure times its length, at its middle, away from the hub's axis.
    """
    case, time = case_of(run), run.time.values
    count = time.size
    origin = run.hub_position.values if "hub_position" in run else np.zeros((count, 3))
    attitude = run.hub_quaternion.values if "hub_quaternion" in run else about_z(run.hub_angle.values)
    axis = turned(attitude, np.broadcast_to([0.0, 0.0, 1.0], (count, 1, 3)))
    lines = []
    for b in range(run.sizes["rib"]):
        points = run.position.values[:, b]
        values = {"tension [N]": run.tension.values[:, b], "curvature [1/m]": run.curvature.values[:, b]}
        lines.append(
            Line(
                name=f"rib {b + 1}",
                points=points,
                values=values if case.phase != "deploy" else dict(reversed(values.items())),
                width=case.rib.width,
                across=np.broadcast_to(axis, points.shape),
            )
        )
    middles = case.rib.element_length * (np.arange(case.rib.elements) + 0.5)
    at = np.stack([_along(line.points, run.arc.values, middles) for line in lines], axis=1)
    away = at - origin[:, None, None]
    pushes = element_forces(run, away - np.sum(away * axis[:, None], axis=-1, keepdims=True) * axis[:, None])
    forces = [
        Forces(name=f"force of {below} on {line.name}", points=at[:, b], vectors=force[:, b])
        for b, line in enumerate(lines)
        for below, force in pushes.items()
    ]
    edge = 0.5 * case.hub.height * np.array([0.0, 0.0, 1.0])
    around = np.linspace(0.0, 2.0 * np.pi, 49)
    ring = case.hub.radius * np.stack([np.cos(around), np.sin(around), np.zeros_like(around)], axis=1)
    hub = Solid.cylinder(case.hub.radius, case.hub.height)
    return Motion(
        title={"wind": "Winding", "hold": "Holding", "deploy": "Deployment"}[case.phase] + " of the rib",
        time=time,
        lines=lines,
        forces=forces,
        frames=[Frame(name="hub", origin=origin, attitude=attitude, outline=[ring - edge, ring + edge], solids=[hub])],
        numbers={
            "tip speed [m/s]": run.tip_speed.values[:, 0],
            "wound [turns]": run.wrap_angle.values[:, 0] / (2.0 * np.pi),
            "contact force [N]": run.contact_force.values[:, 0],
        },
    )


def _along(points: np.ndarray, arc: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Places (nt, k, 3) at the lengths `wanted` along points (nt, n, 3) at the lengths `arc`."""
    k = np.clip(np.searchsorted(arc, wanted) - 1, 0, arc.size - 2)
    share = ((wanted - arc[k]) / (arc[k + 1] - arc[k]))[:, None]
    found: np.ndarray = (1.0 - share) * points[:, k] + share * points[:, k + 1]
    return found
