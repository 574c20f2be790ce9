"""View: positions, velocities and attitudes of bodies, points, beam nodes and sides of joints, over all samples."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from evolvent.kernels import rigid, sides, springs
from evolvent.kernels.flexible import NODE_VECTORS
from evolvent.motion import rotation_matrices
from evolvent.observe.variables import turned
from evolvent.solvers.drive import METHODS
from evolvent.solvers.solution import Solution

Array = np.ndarray


class Pose(NamedTuple):
    """Motion of a body: position (nt, 3), rotation (nt, 3, 3) from body to inertial axes, velocity and rate (nt, 3)."""

    x: Array
    R: Array
    v: Array
    w: Array


class Side(NamedTuple):
    """One end of a joint, inertial axes.

    Attributes
    ----------
    u : (nt, 3) float, position or direction
    rate : (nt, 3) float, its rate
    body : int, of a body, else -1
    """

    u: Array
    rate: Array
    body: int


class View:
    """A solution, read by parts.

    Attributes
    ----------
    solution : Solution
    assembly, model, t, y, s : of the solution
    explicit : bool, whether an explicit method made it, which has no multipliers
    """

    def __init__(self, solution: Solution) -> None:
        self.solution, self.assembly, self.model = solution, solution.assembly, solution.assembly.model
        self.t, self.y, self.s = solution.t, solution.y, solution.s
        self.explicit = solution.method in METHODS
        self._poses: dict[int, Pose] = {}

    def index(self, name: str) -> int:
        """Index of a part in its family."""
        return int(self.assembly.names[name][1])

    def part(self, name: str) -> Any:
        """The part as the user wrote it."""
        return self.assembly.parts[name]

    def coordinates(self, at: int, size: int = 3) -> Array:
        """Columns of the state: (nt, size)."""
        found: Array = self.y[:, at : at + size]
        return found

    def pose(self, index: int) -> Pose:
        """Motion of a body."""
        if index not in self._poses:
            self._poses[index] = self._pose(self.model.bodies[index])
        return self._poses[index]

    def _pose(self, body: Any) -> Pose:
        n, q, v = self.t.size, int(body["iq"]), int(body["iv"])
        if body["motion"] == rigid.FREE:
            R = rotation_matrices(self.coordinates(q + 3, 4))
            rate = turned(R, self.coordinates(v + 3))
            return Pose(self.coordinates(q), R, self.coordinates(v), rate)
        if body["motion"] == rigid.SPIN:
            angle, rate = self.y[:, q], self.y[:, v]
        else:
            angle, rate = body["rate"] * self.t, np.full(n, body["rate"])
        R = body["R0"] @ about(body["axis"], angle)
        x = np.broadcast_to(body["x0"], (n, 3))
        return Pose(x, R, np.zeros((n, 3)), turned(R, body["axis"]) * rate[:, None])

    def angle(self, index: int) -> Array | None:
        """Angle of a spinning or driven body about its axis, over any number of turns: (nt,); None of a free one."""
        body = self.model.bodies[index]
        if body["motion"] == rigid.SPIN:
            return np.asarray(self.y[:, int(body["iq"])])
        return None if body["motion"] == rigid.FREE else np.asarray(body["rate"] * self.t)

    def on_body(self, index: int, local: Array) -> tuple[Array, Array]:
        """Position and velocity (nt, 3) of a point given in body axes."""
        pose = self.pose(index)
        arm = turned(pose.R, local)
        return pose.x + arm, pose.v + np.cross(pose.w, arm)

    def marker(self, index: int) -> tuple[Array, Array]:
        """Position and velocity (nt, 3) of a marker."""
        row = self.model.markers[index]
        if row["kind"] == springs.ON_POINT:
            point = self.model.points[row["index"]]
            return self.coordinates(int(point["iq"])), self.coordinates(int(point["iv"]))
        return self.on_body(int(row["index"]), row["local"])

    def nodes(self, index: int) -> tuple[Array, Array]:
        """Coordinates and rates of a beam's nodes: (nt, n + 1, vectors, 3), m and 1, m/s and 1/s."""
        row = self.model.flexible.beams[index]
        n, k = int(row["nodes"]), NODE_VECTORS[int(row["kind"])]
        q, v = (self.coordinates(int(row[key]), 3 * k * n) for key in ("iq", "iv"))
        return q.reshape(-1, n, k, 3), v.reshape(-1, n, k, 3)

    def side(self, joint: Any, which: int, *, is_place: bool) -> Side:
        """An end of a row of the family `joints`."""
        if joint["on"][which] == sides.ON_COORDINATES:
            q, v = int(joint["iq"][which]), int(joint["iv"][which])
            return Side(self.coordinates(q), self.coordinates(v), -1)
        index, local = int(joint["index"][which]), joint["local"][which]
        if is_place:
            return Side(*self.on_body(index, local), index)
        pose = self.pose(index)
        direction = turned(pose.R, local)
        return Side(direction, np.cross(pose.w, direction), index)


def about(axis: Array, angle: Array) -> Array:
    """Rotation matrices (nt, 3, 3) about a unit vector by angles (nt,), Rodrigues' formula."""
    K = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * K + (1.0 - c) * (K @ K)
