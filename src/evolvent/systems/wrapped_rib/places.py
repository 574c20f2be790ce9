"""Where the ribs and the hub are at every sample of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent.motion import Forces, Frame, Motion, Strand, about_z, turned
from evolvent.systems.wrapped_rib.show import case_of, element_forces

if TYPE_CHECKING:
    import xarray as xr


def motion(run: xr.Dataset) -> Motion:
    """Ribs from root to tip, the forces of the hub and of the turns below on them, and the hub's axes.

    Notes
    -----
    The force on an element is its pressure times its length, at its middle, away from the hub's axis.
    """
    case, time = case_of(run), run.time.values
    count = time.size
    origin = run.hub_position.values if "hub_position" in run else np.zeros((count, 3))
    attitude = run.hub_quaternion.values if "hub_quaternion" in run else about_z(run.hub_angle.values)
    strands = []
    for b in range(run.sizes["rib"]):
        values = {"tension [N]": run.tension.values[:, b], "curvature [1/m]": run.curvature.values[:, b]}
        strands.append(Strand(name=f"rib {b + 1}", points=run.position.values[:, b], values=values))
    middles = case.rib.element_length * (np.arange(case.rib.elements) + 0.5)
    at = np.stack([_along(strand.points, run.arc.values, middles) for strand in strands], axis=1)
    axis = turned(attitude, np.broadcast_to([0.0, 0.0, 1.0], (count, 1, 3)))[:, None]
    away = at - origin[:, None, None]
    pushes = element_forces(run, away - np.sum(away * axis, axis=-1, keepdims=True) * axis)
    forces = [
        Forces(name=f"force of {below} on {strand.name}", points=at[:, b], vectors=force[:, b])
        for b, strand in enumerate(strands)
        for below, force in pushes.items()
    ]
    edge = 0.5 * case.hub.height * np.array([0.0, 0.0, 1.0])
    around = np.linspace(0.0, 2.0 * np.pi, 49)
    ring = case.hub.radius * np.stack([np.cos(around), np.sin(around), np.zeros_like(around)], axis=1)
    posts = [np.stack([ring[k] - edge, ring[k] + edge]) for k in range(0, 48, 8)]
    hub = Frame(name="hub", origin=origin, attitude=attitude, outline=[ring - edge, ring + edge, *posts])
    return Motion(time=time, strands=strands, forces=forces, frames=[hub])


def _along(points: np.ndarray, arc: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Places (nt, k, 3) at the lengths `wanted` along points (nt, n, 3) at the lengths `arc`."""
    k = np.clip(np.searchsorted(arc, wanted) - 1, 0, arc.size - 2)
    share = ((wanted - arc[k]) / (arc[k + 1] - arc[k]))[:, None]
    found: np.ndarray = (1.0 - share) * points[:, k] + share * points[:, k + 1]
    return found
