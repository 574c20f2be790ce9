"""Observations of bodies, point masses and springs."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.kernels.springs import spring_energy, spring_tension
from evolvent.motion import quaternions
from evolvent.observe.variables import Observed, Variable, dot, norm, turned, turned_back
from evolvent.observe.view import View


def observe_body(view: View, name: str) -> Observed:
    """Position, attitude, velocity, rate, momentum and energy of a rigid body.

    Notes
    -----
    Linear momentum m v; angular momentum about the centre of mass R J R^T w; energy (m v.v + w.J w)/2.
    """
    index = view.index(name)
    row, pose, found = view.model.bodies[index], view.pose(index), Observed()
    attitude = continuous(quaternions(pose.R))
    own = turned_back(pose.R, pose.w)
    spin = turned(pose.R, own @ row["inertia"])
    found.vector("position", pose.x, "m", "position of the centre of mass, inertial axes")
    text = "attitude, quaternion from body to inertial axes, scalar first"
    found.variables["attitude"] = Variable(("time", "quaternion"), attitude, "1", text)
    found.vector("velocity", pose.v, "m s-1", "velocity of the centre of mass, inertial axes")
    found.vector("rate", own, "rad s-1", "angular velocity, body axes")
    angle = view.angle(index)
    if angle is not None:
        found.scalar("angle", angle, "rad", "angle about its axis, over any number of turns")
    mass = float(row["mass"])
    found.vector("momentum", mass * pose.v, "kg m s-1", "linear momentum, inertial axes")
    found.vector("angular_momentum", spin, "kg m2 s-1", "angular momentum about the centre of mass, inertial axes")
    kinetic = 0.5 * mass * dot(pose.v, pose.v) + 0.5 * dot(pose.w, spin)
    found.scalar("kinetic_energy", kinetic, "J", "kinetic energy")
    solids = solids_of(view.part(name), mass, row["inertia"])
    found.drawn = [{"frame": {"origin": "position", "attitude": "attitude", "solids": solids}}]
    found.plots = ["rate"]
    if row["iq"] >= 0 and angle is None:
        found.plots.append("position")
    return found


def solids_of(part: Any, mass: float, inertia: np.ndarray) -> list[dict[str, Any]]:
    """What a body is drawn as: its shape, or the box of uniform density with its mass and moments of inertia.

    Notes
    -----
    Edges a, b, c of that box: a^2 = 6 (Iy + Iz - Ix)/m and so on; none of a body without mass.
    """
    shape: Any = getattr(part, "shape", None)
    match type(shape).__name__:
        case "Box":
            return [{"box": {"edges": list(shape.size)}}]
        case "Cylinder":
            ends = [[-0.5 * shape.length, shape.radius], [0.5 * shape.length, shape.radius]]
            return [{"revolution": {"profile": ends, "centre": [0.0, 0.0, 0.0], "axis": list(shape.axis)}}]
        case "Sphere":
            angles = np.linspace(0.0, np.pi, 17)
            profile = [[-shape.radius * float(np.cos(a)), shape.radius * float(np.sin(a))] for a in angles]
            return [{"revolution": {"profile": profile, "centre": [0.0, 0.0, 0.0], "axis": [0.0, 0.0, 1.0]}}]
    moments = np.diag(inertia)
    if mass <= 0.0 or not np.any(moments):
        return []
    squares = 6.0 * (moments.sum() - 2.0 * moments) / mass
    thin = 0.02 * np.sqrt(max(float(squares.max()), 0.0))
    return [{"box": {"edges": [max(float(np.sqrt(max(x, 0.0))), thin) for x in squares]}}]


def continuous(q: np.ndarray) -> np.ndarray:
    """Quaternions (nt, 4) with signs such that they do not jump from sample to sample."""
    if len(q) < 2:
        return q
    flips = np.where(np.einsum("ti,ti->t", q[1:], q[:-1]) < 0.0, -1.0, 1.0)
    return np.concatenate([q[:1], q[1:] * np.cumprod(flips)[:, None]])


def observe_point(view: View, name: str) -> Observed:
    """Position, velocity, momentum and energy of a point mass."""
    row, found = view.model.points[view.index(name)], Observed()
    x, v = view.coordinates(int(row["iq"])), view.coordinates(int(row["iv"]))
    mass = float(row["mass"])
    found.vector("position", x, "m", "position, inertial axes")
    found.vector("velocity", v, "m s-1", "velocity, inertial axes")
    found.scalar("speed", norm(v), "m s-1", "speed")
    found.vector("momentum", mass * v, "kg m s-1", "linear momentum, inertial axes")
    found.scalar("kinetic_energy", 0.5 * mass * dot(v, v), "J", "kinetic energy")
    found.drawn = [{"marks": {"points": ["position"]}}]
    found.plots = ["position"]
    return found


def observe_spring(view: View, name: str) -> Observed:
    """Length, extension, its rate, and the force of a spring-damper."""
    springs, index, found = view.model.springs, view.index(name), Observed()
    row = springs[index]
    (a, va), (b, vb) = view.marker(int(row["a"])), view.marker(int(row["b"]))
    length = norm(b - a)
    e = np.divide(b - a, length[:, None], out=np.zeros_like(a - b), where=length[:, None] > 0.0)
    extension, rate = length - float(row["length"]), dot(e, vb - va)
    parts = [
        spring_tension(springs, index, float(x), float(v), float(t), view.model.parameters)
        for x, v, t in zip(extension, rate, view.t, strict=True)
    ]
    tension = np.array([elastic + damping for elastic, damping in parts])
    found.scalar("length", length, "m", "length")
    found.scalar("extension", extension, "m", "length less the natural length")
    found.scalar("extension_rate", rate, "m s-1", "rate of the extension")
    found.scalar("force", tension, "N", "tension, elastic and damping part, positive where the spring pulls")
    if row["law"] == 0:
        stored = [spring_energy(float(row["stiffness"]), float(x)) for x in extension]
        found.scalar("energy", np.array(stored), "J", "elastic energy of the axial stiffness")
    found.along("ends", "end", np.stack([a, b], axis=1), "m", "ends a and b, inertial axes")
    found.drawn = [{"line": {"points": "ends", "kind": "spring", "values": ["force"]}}]
    found.plots = ["force"]
    return found
