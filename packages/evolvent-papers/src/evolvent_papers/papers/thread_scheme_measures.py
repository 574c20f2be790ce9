"""Measurements of single equations of Tenenbaum (2014) in runs of the engine: from positions, velocities and forces.

Nothing is read that the equations themselves give: groups of nodes follow from where they are, forces from masses and
accelerations.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent import cases
from evolvent_papers.papers.thread_runs import RIGID, tree
from evolvent_papers.papers.thread_variants import Data, deploy

Array = np.ndarray
Numbers = Mapping[str, float]
#: Data of the paper: radius, rate and offset of the spools, length, mass per length, mass at the tip; SI units.
R, SPOOL, L0, L, RHO, TIP = 0.01, 3.5, 0.05, 5.0, 0.000735, 0.0005
#: Pitch of 20 nodes on the spool, rad, and the length of their segments, m.
STEP, SEGMENT = L / (20 * R), L / 20
#: Distance from the spool's surface, m, up to which a node lies on it.
ON_THE_SPOOL = 1e-9
#: Stiffness, damping and step of the run whose forces are measured.
STIFFNESS, DAMPING, FINE = 1e3, 0.1, 2e-5


def in_the_frame(run: Any) -> tuple[Array, Array]:
    """Positions and velocities of the nodes in the frame of the spool, which turns with the body: (nt, n, 3)."""
    blade, angle, rate = run["blade-1"], run.body_angle.values, run.body_rate.values
    x, v = blade.position.values, blade.velocity.values
    spin = np.stack([-x[..., 1], x[..., 0], 0.0 * x[..., 0]], axis=-1) * rate[:, None, None]
    places, rates = (_turned(one, -angle) for one in (x, v - spin))
    return places - np.array([L0, 0.0, 0.0]), rates


def _turned(x: Array, angle: Array) -> Array:
    """Vectors (nt, n, 3) turned about Z by an angle (nt,)."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.stack([c * x[..., 0] - s * x[..., 1], s * x[..., 0] + c * x[..., 1], x[..., 2]], axis=-1)


def on_the_spool(x: Array) -> Array:
    """Whether nodes lie on the surface of the spool, in the plane X Z, by where they are; (nt, n) bool."""
    off = np.abs(np.hypot(x[..., 0], x[..., 2]) - R)
    return (off < ON_THE_SPOOL) & (np.abs(x[..., 1]) < ON_THE_SPOOL)


def paid_out(run: Any, at: int = -1) -> float:
    """Length of the thread from Q to its tip at a sample, m, by the positions of the nodes that have left the spool."""
    x = in_the_frame(run)[0][at]
    free = x[~on_the_spool(x)]
    return float(np.linalg.norm(np.diff(np.vstack([free, [0.0, 0.0, R]]), axis=0), axis=1).sum())


def deployment() -> Numbers:
    """Time of the deployment, s, its difference from L / (r w), us, and that of the length at its end from L, um."""
    run = tree(RIGID)
    end = float(run.time.values[-1])
    return {"time": end, "late": 1e6 * abs(end - L / (R * SPOOL)), "off": 1e6 * abs(paid_out(run) - L)}


def continuous_law() -> Numbers:
    """Length from Q to the tip after 20 s with a rate that rises within 5 s, m, and off r w (t - ramp/2), um."""
    run = tree(RIGID | {"spool.ramp": 5.0, "spool.start_length": 0.005, "solver.duration": 20.0})
    length = paid_out(run)
    return {"length": length, "off": 1e6 * abs(length - 0.005 - R * SPOOL * (20.0 - 2.5))}


def leaves() -> Numbers:
    """Angle of the tip's way from X over the first millisecond, deg, and turns of the thread on the spool.

    `off` is the largest difference from L of what is out and what the spool has not paid out, over a deployment, um.
    """
    run = tree(RIGID | {"solver.duration": 1e-3, "output.every": 1e-3})
    way = in_the_frame(run)[0][-1, 0] - np.array([0.0, 0.0, R])
    whole = tree(RIGID)
    places, angle = in_the_frame(whole)[0], SPOOL * whole.time.values
    lengths = [
        paid_out(whole, k) + L - R * angle[k] for k in range(10, len(angle), 50) if not on_the_spool(places[k]).all()
    ]
    return {
        "angle": math.degrees(math.atan2(math.hypot(way[1], way[2]), way[0])),
        "turns": L / (2.0 * math.pi * R),
        "off": 1e6 * float(np.abs(np.array(lengths) - L).max()),
    }


def groups() -> Numbers:
    """Least and largest number of boundary nodes over a deployment, and of nodes that are neither of the three groups.

    By positions: a node is off the spool's surface or on it; a boundary node is off it and its inner neighbour on it,
    or is the last one. Nodes of no group are on the spool between nodes that are off it.
    """
    found = tree(RIGID | {"output.every": 0.01, "output.fine": False})
    wound = on_the_spool(in_the_frame(found)[0][1:])  # at the start node 1 lies at Q
    inner = np.column_stack([wound[:, 1:], np.ones(len(wound), dtype=bool)])
    boundary = (~wound & inner).sum(axis=1)
    stray = (np.diff(wound.astype(int), axis=1) < 0).sum()
    return {"least": float(boundary.min()), "most": float(boundary.max()), "stray": float(stray)}


def boundary_time() -> Numbers:
    """Largest share of the deployment, percent, over which one node is the boundary node, with 20 and 40 nodes."""
    found = {}
    for nodes in (20, 40):
        run = tree(RIGID | {"blade.nodes": nodes, "output.every": 0.01, "output.fine": False})
        out = (~on_the_spool(in_the_frame(run)[0])).sum(axis=1)
        found[f"n{nodes}"] = 100.0 * float(np.bincount(out[out > 0]).max()) / len(out)
    return found


def releases() -> Numbers:
    """Latest release of a node after the time of (1), s, of all nodes; the sampling interval, s; and how many leave."""
    every = 0.01
    run = tree(RIGID | {"output.every": every, "output.fine": False})
    off = ~on_the_spool(in_the_frame(run)[0])
    first = run.time.values[off.argmax(axis=0)]
    late = first - STEP * np.arange(20) / SPOOL
    return {"early": float(-late.min()), "late": float(late.max()), "every": every, "nodes": float(off[-1].sum())}


def tested_every_step() -> Numbers:
    """Difference of the times of release of nodes 2 and 3 from (1), of a step, by RK4 with steps of 1 ms."""
    step = 1e-3
    given = {"solver.method": "rk4", "blade.stiffness": 1e2, "solver.step": step, "solver.duration": 15.0}
    run = tree(given | {"output.every": step, "output.fine": False})
    off = ~on_the_spool(in_the_frame(run)[0])
    first = run.time.values[off.argmax(axis=0)[1:3]]
    return {"late": float(np.abs(first - STEP * np.array([1.0, 2.0]) / SPOOL).max() / step)}


def wound() -> Numbers:
    """Largest distance of a wound node from (2) and (17) over a deployment, mm, and from the spool's surface, mm."""
    run = tree(RIGID | {"output.every": 0.01, "output.fine": False})
    x, _ = in_the_frame(run)
    angle = SPOOL * run.time.values[:, None] - STEP * np.arange(20)
    still = angle < 0.0
    gap = np.linalg.norm(x - R * np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=-1), axis=-1)
    plus = SPOOL * run.time.values[:, None] + STEP * np.arange(20)
    last = np.abs(angle[:, 1]).argmin()
    return {
        "gap": 1e3 * float(gap[still].max()),
        "radius": 1e3 * float(np.abs(np.hypot(x[..., 0], x[..., 2]) - R)[still].max()),
        "at_release": 1e3 * float(np.linalg.norm(x[last, 1] - np.array([0.0, 0.0, R]))),
        "by_plus": 1e3 * R * float(np.hypot(np.sin(plus[last, 1]), np.cos(plus[last, 1]) - 1.0)),
    }


def start() -> Numbers:
    """Largest difference of velocities at the start from (17), of r w, of positions, of r; the body's rate, rad/s."""
    run = tree(RIGID)
    x, v = (one[0] for one in in_the_frame(run))
    angle = -STEP * np.arange(20)
    sin, cos, none = np.sin(angle), np.cos(angle), 0.0 * angle
    speed = R * SPOOL
    return {
        "velocity": float(np.abs(v - speed * np.stack([cos, none, -sin], axis=-1)).max()) / speed,
        "position": float(np.abs(x - R * np.stack([sin, none, cos], axis=-1)).max()) / R,
        "body": float(run.body_rate.values[0]),
    }


def lag_angle() -> Numbers:
    """Largest difference of the lag that a run gives from (19) on the positions of its nodes, deg; least signed lag."""
    run = tree(RIGID)
    x, _ = in_the_frame(run)
    from_q = x - np.array([0.0, 0.0, R])
    with np.errstate(invalid="ignore"):
        by_19 = np.degrees(np.arccos(from_q[..., 0] / np.linalg.norm(from_q, axis=-1)))
    given, signed = (np.degrees(run["blade-1"][name].values) for name in ("lag", "signed_lag"))
    far = np.isfinite(given) & (np.linalg.norm(from_q, axis=-1) > 1e-3)
    return {
        "gap": float(np.abs(given - by_19)[far].max()),
        "least": float(np.nanmin(signed[run.time.values >= 1.0])),
        "samples": float(far.sum()),
    }


def turned_velocity() -> Numbers:
    """Angle between the velocity of nodes just after their release and the thread, deg, and its size over r w.

    The largest of nodes 2 to 4, 2e-6 s after it; without (12) `left` is the least.
    """
    found = {}
    for name, turned in (("turned", True), ("left", False)):
        angles, sizes = [], []
        for k in (1, 2, 3):
            run = _just_after(k, turned)
            x, v = (one[-1] for one in in_the_frame(run))
            along = x[k - 1] - np.array([0.0, 0.0, R])
            cosine = v[k] @ along / np.linalg.norm(v[k]) / np.linalg.norm(along)
            angles.append(math.degrees(math.acos(min(cosine, 1.0))))
            sizes.append(float(np.linalg.norm(v[k])) / (R * SPOOL))
        found[name] = max(angles) if turned else min(angles)
        found[f"size_{name}"] = max(abs(size - 1.0) for size in sizes)
    return found


def _just_after(node: int, turned: bool) -> Any:
    """A run of springs that ends 2e-6 s after a node (from 0) is released."""
    end = STEP * node / SPOOL + 2e-6
    given = {"blade.stiffness": STIFFNESS, "blade.rotate_velocity": turned, "solver.duration": end}
    return tree(given | {"output.every": end, "output.fine": False})


class Forces:
    """Forces on four nodes that are out, from masses and accelerations of a run of springs over 0.4 s.

    In inertial axes nothing but the segments acts, so that the mass of a node times its acceleration is their force.
    """

    def __init__(self) -> None:
        given = {
            "blade.stiffness": STIFFNESS, "blade.damping": DAMPING, "spool.start_length": 0.9,
            "solver.step": FINE, "solver.duration": 0.4, "output.every": FINE, "output.fine": False,
        }  # fmt: skip
        run = tree(given)
        x, v = run["blade-1"].position.values, run["blade-1"].velocity.values
        self.nodes = int(run["blade-1"].released.values[0].sum())
        self.x, self.v, self.t = x[1:-1], v[1:-1], run.time.values[1:-1]
        m = np.full(self.nodes, RHO * SEGMENT)
        m[0] = TIP + 0.5 * m[0]
        self.force = m[:, None] * ((v[2:] - v[:-2]) / (2.0 * FINE))[:, : self.nodes]
        angle, rate = run.body_angle.values[1:-1, None], run.body_rate.values[1:-1, None]
        X = np.concatenate([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
        Y = np.concatenate([-np.sin(angle), np.cos(angle), 0.0 * angle], axis=1)
        self.X, self.Q, self.hub = X, L0 * X + np.array([0.0, 0.0, R]), L0 * rate * Y

    def segment(self, i: int, j: int) -> tuple[Array, Array, Array]:
        """Direction from node i to node j, elongation and its rate."""
        return self._between(self.x[:, j] - self.x[:, i], self.v[:, j] - self.v[:, i], SEGMENT)

    def boundary(self) -> tuple[Array, Array, Array]:
        """The same from the boundary node to Q, whose velocity is that of the body there alone."""
        last = self.nodes - 1
        rest = 0.9 + R * SPOOL * self.t - SEGMENT * last
        return self._between(self.Q - self.x[:, last], self.hub - self.v[:, last], rest)

    @staticmethod
    def _between(apart: Array, closing: Array, rest: Array | float) -> tuple[Array, Array, Array]:
        distance = np.linalg.norm(apart, axis=1)
        e = apart / distance[:, None]
        return e, distance - rest, np.sum(closing * e, axis=1)


@functools.cache
def _forces() -> Forces:
    return Forces()


@functools.cache
def _fitted() -> tuple[float, float]:
    """Stiffness and damping that the forces on the inner nodes show, by least squares, N/m and N s/m."""
    seen = _forces()
    columns, forces = [], []
    for i in range(1, seen.nodes - 1):
        (e, s, c), (f, u, w) = seen.segment(i, i - 1), seen.segment(i, i + 1)
        columns.append(np.stack([(s[:, None] * e + u[:, None] * f).ravel(), (c[:, None] * e + w[:, None] * f).ravel()]))
        forces.append(seen.force[:, i].ravel())
    found = np.linalg.lstsq(np.concatenate(columns, axis=1).T, np.concatenate(forces), rcond=None)[0]
    return float(found[0]), float(found[1])


def spring_force() -> Numbers:
    """Stiffness that the forces on nodes between two others show, N/m."""
    return {"stiffness": _fitted()[0]}


def damper_force() -> Numbers:
    """Damping that the forces on nodes between two others show, N s/m."""
    return {"damping": _fitted()[1]}


def first_node() -> Numbers:
    """Share of the force on node 1 that is not along its one segment, and that (3, 4) leave unexplained, percent."""
    seen = _forces()
    e, s, c = seen.segment(0, 1)
    along = np.sum(seen.force[:, 0] * e, axis=1)
    largest = np.abs(along).max()
    return {
        "across": 100.0 * float(np.linalg.norm(seen.force[:, 0] - along[:, None] * e, axis=1).max() / largest),
        "rest": 100.0 * float(np.abs(along - STIFFNESS * s - DAMPING * c).max() / largest),
    }


def polyline() -> Numbers:
    """Share of the force on inner nodes, percent, that springs and dampers along the lines leave unexplained.

    `bent` is the largest angle between segments that meet at a node, deg.
    """
    seen = _forces()
    rest, bent = 0.0, 0.0
    for i in range(1, seen.nodes - 1):
        (e, s, c), (f, u, w) = seen.segment(i, i - 1), seen.segment(i, i + 1)
        by = (STIFFNESS * s + DAMPING * c)[:, None] * e + (STIFFNESS * u + DAMPING * w)[:, None] * f
        force = seen.force[:, i]
        rest = max(rest, float(np.linalg.norm(force - by, axis=1).max() / np.linalg.norm(force, axis=1).max()))
        bent = max(bent, math.degrees(math.acos(min(-float(np.sum(e * f, axis=1).max()), 1.0))))
    return {"rest": 100.0 * rest, "bent": bent}


def velocity_of_q() -> Numbers:
    """Speed at which the damper of the boundary segment shows thread to come from Q, mm/s, along the thread.

    Also the damper's pull at d = 1 N s/m by (8, 9) on a segment that lags by 13.49 deg and does not stretch, mN, its
    share of the mean tension at the spool from 7 to 30 s, percent, and what d changes in the lag then, deg.
    """
    seen = _forces()
    last = seen.nodes - 1
    (e, s, c), (f, u, w) = seen.segment(last, last - 1), seen.boundary()
    left = np.sum((seen.force[:, last] - (STIFFNESS * s + DAMPING * c)[:, None] * e) * f, axis=1)
    constant = np.linalg.lstsq(np.stack([u, w, np.ones_like(u)], axis=1), left, rcond=None)[0]
    steady = math.asin(2.0 * R * SPOOL / (L0 * 6.0))
    least, most = (deploy(Data(stiffness=1e3, damping=d), until=30.0, step=1e-4) for d in (1e-3, 1.0))
    late, pull = least.t > 7.0, R * SPOOL * (1.0 - math.cos(steady))
    return {
        "speed": -1e3 * float(constant[2] / constant[1]),
        "pull": 1e3 * pull,
        "percent": 100.0 * pull / float(least.pull[late].mean()),
        "lag": float(np.abs(least.lag - most.lag)[late].max()),
    }


def data() -> Numbers:
    """Table IV.1 in the built-in case `heliogyro-paper`, SI units."""
    case = cases.load("heliogyro-paper")
    body, blade, spool = case.body, case.blade, case.spool
    return {
        "J": body.spin_inertia, "rho": blade.line_density, "L": blade.length, "L0": body.spool_offset,
        "r": spool.radius, "Omega_0": body.rate, "w": spool.rate, "m_k": blade.tip_mass, "n": float(blade.nodes),
        "dphi": blade.length / blade.nodes / spool.radius, "d": blade.damping,
    }  # fmt: skip
