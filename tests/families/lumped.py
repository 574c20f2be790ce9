"""Cases of bodies, points, springs, links and joints, threads, loads and events."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import evolvent
from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from families.case import Array, Case, at, columns, of, springs_poles, swing
from implicit.rigs import coordinates

G = 9.81
DOWN = (0.0, 0.0, -G)
ORIGIN = (0.0, 0.0, 0.0)

# ------------------------------------------------------------------------------------------------ bodies, points


@of("a driven body")
def driven_body() -> Case:
    """A mass on a spring turns steadily with a hub: k (r - e - l) = m w^2 r."""
    k, m, w, e, length, time = 10.0, 1.0, 2.0, 0.3, 0.5, 0.4
    r = k * (e + length) / (k - m * w**2)

    def system() -> System:
        found = System()
        found.add(parts.RigidBody(motion="driven", rate=w), "hub")
        found.add(parts.Point(mass=m, position=(r, 0.0, 0.0), velocity=(0.0, w * r, 0.0)), "mass")
        found.add(parts.Spring(a=("hub", (e, 0.0, 0.0)), b="mass", stiffness=k, length=length))
        return found

    # along and across the spring, coupled by 2 w (Coriolis); along the axis
    along, across = k / m - w**2, w**2 * e / (r - e)
    plane = np.roots([1.0, -(along + across + 4.0 * w**2), along * across])
    return Case(
        part="hub", system=system, seen=at("mass"), end=3.0, step=0.01, rotating="hub", time=time,
        motion=lambda t: columns(r * np.cos(w * t), r * np.sin(w * t), 0.0),
        still=(r * math.cos(w * time), r * math.sin(w * time), 0.0), poles=springs_poles(*plane, w**2 * r / (r - e)),
    )  # fmt: skip


@of("a body that spins about an axis")
def spinning_body() -> Case:
    """Held by a spring without length: a torque -k r d sin(angle), as a pendulum's."""
    k, J, r, d, start = 5.0, 0.5, 0.4, 1.0, 1.0

    def system() -> System:
        found = System()
        turned = (math.cos(0.5 * start), 0.0, 0.0, math.sin(0.5 * start))
        found.add(parts.RigidBody(motion="spin", inertia=J, orientation=turned), "wheel")
        found.add(parts.Spring(a=("wheel", (r, 0.0, 0.0)), b=(d, 0.0, 0.0), stiffness=k, length=0.0))
        return found

    w = math.sqrt(k * r * d / J)
    return Case(
        part="wheel", system=system, seen=at("wheel"), end=3.0, step=0.01,
        motion=lambda t: columns(swing(t, start, w) - start), still=(-start,), poles=(1j * w,),
    )  # fmt: skip


@of("a net")
def net() -> Case:
    """A node between three cords with the force density q falls across them by (1 - cos) of sqrt(3 q/m)."""
    q, m, g = 10.0, 0.1, 0.01

    def system() -> System:
        found = System(gravity=(0.0, 0.0, -g))
        flat = {"formula": {"expression": "0*x", "diameter": 2.0}}
        topology = {"rings": {"rings": 1, "gores": 3}}
        found.add(
            parts.Net(surface=flat, topology=topology, force_density=q, stiffness=200.0, node_mass=m), "net"
        )  # fmt: skip
        return found

    def seen(assembly: Assembly, y: Array) -> Array:
        at_node = int(assembly.model.points["iq"][assembly.model.nets["first_point"][0]])
        return y[..., at_node + 2 : at_node + 3]

    w, sag = math.sqrt(3.0 * q / m), m * g / (3.0 * q)
    return Case(
        part="net", system=system, seen=seen, end=0.5, step=2e-3, theory=1e-5,
        motion=lambda t: columns(-sag * (1.0 - np.cos(w * t))), still=(-sag,), poles=(1j * w,),
    )  # fmt: skip


BODY_MASS, BODY_INERTIA, BODY_STIFFNESS, INNER, OUTER, TURNED = 2.0, (0.2, 0.25, 0.3), 10.0, 0.5, 1.0, 0.8


def held_body(found: System, *, tilt: float = 0.0, position: Any = ORIGIN) -> None:
    """A body at the middle of four springs without length, turned about z.

    The springs pull its centre back by 4 k x, and turn it back about z by 4 k a b sin(angle), about x and y by half as
    much. With `tilt` two of them stand higher and lower and turn it about y as well.
    """
    a, b = INNER, OUTER
    turned = (math.cos(0.5 * TURNED), 0.0, 0.0, math.sin(0.5 * TURNED))
    found.add(parts.RigidBody(mass=BODY_MASS, inertia=BODY_INERTIA, position=position, orientation=turned), "body")
    for s in (1.0, -1.0):
        for inner, outer in (((s * a, 0.0, 0.0), (s * b, 0.0, s * tilt)), ((0.0, s * a, 0.0), (0.0, s * b, 0.0))):
            found.add(parts.Spring(a=outer, b=("body", inner), stiffness=BODY_STIFFNESS, length=0.0))


def body_seen(assembly: Assembly, y: Array) -> Array:
    """Place of the body, its angle about z, and how far its axis z has tilted."""
    x = coordinates(assembly, y, "body")
    return columns(*np.moveaxis(x[..., :3], -1, 0), 2.0 * np.arctan2(x[..., 6], x[..., 3]), x[..., 4], x[..., 5])


@of("a free body")
def free_body() -> Case:
    """The centre moves as on one spring, the turn about z as a pendulum."""

    def system() -> System:
        found = System(gravity=DOWN)
        held_body(found, position=(0.1, 0.0, 0.0))
        return found

    m, stiff, turn = BODY_MASS, 4.0 * BODY_STIFFNESS, 4.0 * BODY_STIFFNESS * INNER * OUTER
    w, spin, sag = math.sqrt(stiff / m), math.sqrt(turn / BODY_INERTIA[2]), m * G / stiff
    return Case(
        part="body", system=system, seen=body_seen, end=1.5, step=2e-3,
        motion=lambda t: columns(
            0.1 * np.cos(w * t), 0.0, -sag * (1.0 - np.cos(w * t)), swing(t, TURNED, spin), 0.0, 0.0
        ),
        still=(0.0, 0.0, -sag, 0.0, 0.0, 0.0),
        poles=springs_poles(
            *[stiff / m] * 3, 0.5 * turn / BODY_INERTIA[0], 0.5 * turn / BODY_INERTIA[1], turn / BODY_INERTIA[2]
        ),
    )  # fmt: skip


@evolvent.law
def tie(t, x, v, p, f):  # type: ignore[no-untyped-def]
    """A spring without length between two places."""
    energy = 0.0
    for c in range(3):
        e = x[3 + c] - x[c]
        f[c] += p[0] * e
        f[3 + c] -= p[0] * e
        energy += 0.5 * p[0] * e * e
    return energy, 0.0


@of("a custom force")
def custom_force() -> Case:
    """A mass hangs on a spring without length, by a law of the user's."""
    k, m = 20.0, 0.5

    def system() -> System:
        found = System(gravity=DOWN)
        found.add(parts.Point(mass=m, position=(0.1, 0.0, 0.0)), "mass")
        found.add(parts.CustomForce(points=[ORIGIN, "mass"], law=tie, parameters=(k,)), "tie")
        return found

    w, sag = math.sqrt(k / m), m * G / k
    return Case(
        part="tie", system=system, seen=at("mass"), end=2.0, step=1e-3,
        motion=lambda t: columns(0.1 * np.cos(w * t), 0.0, -sag * (1.0 - np.cos(w * t))),
        still=(0.0, 0.0, -sag), poles=springs_poles(*[k / m] * 3),
    )  # fmt: skip


@of("a guide")
def guide() -> Case:
    """Guides bear the weight and a torque about y of springs that stand askew; the rest moves as before."""

    def system() -> System:
        found = System(gravity=(3.0, 0.0, -G))
        held_body(found, tilt=0.3)
        found.add(parts.Joint(a="ground", b="body", type="guide", axis=(0.0, 0.0, 1.0)), "level")
        along = (math.cos(TURNED), math.sin(TURNED), 0.0)
        found.add(parts.Joint(a="ground", b="body", type="guide", axis=(0.0, 0.0, 1.0), axis_b=along), "upright")
        return found

    m, stiff, turn = BODY_MASS, 4.0 * BODY_STIFFNESS, 4.0 * BODY_STIFFNESS * INNER * OUTER
    w, spin, off = math.sqrt(stiff / m), math.sqrt(turn / BODY_INERTIA[2]), 3.0 * m / stiff
    return Case(
        part="level", system=system, seen=body_seen, end=1.5, step=2e-3,
        motion=lambda t: columns(off * (1.0 - np.cos(w * t)), 0.0, 0.0, swing(t, TURNED, spin), 0.0, 0.0),
        still=(off, 0.0, 0.0, 0.0, 0.0, 0.0),
        poles=springs_poles(*[stiff / m] * 2, 0.5 * turn / BODY_INERTIA[0], turn / BODY_INERTIA[2]),
    )  # fmt: skip


@of("a point mass")
def point() -> Case:
    """On a spring without length it runs round an ellipse, and sinks by m g / k."""
    k, m, v = 8.0, 2.0, 3.0
    w, sag = math.sqrt(k / m), m * G / k

    def system() -> System:
        found = System(gravity=DOWN)
        found.add(parts.Point(mass=m, position=(1.0, 0.0, -sag), velocity=(0.0, v, 0.0)), "mass")
        found.add(parts.Spring(a=ORIGIN, b="mass", stiffness=k, length=0.0))
        return found

    return Case(
        part="mass", system=system, seen=at("mass"), end=3.0, step=0.01,
        motion=lambda t: columns(np.cos(w * t), v / w * np.sin(w * t), -sag),
        still=(0.0, 0.0, -sag), poles=springs_poles(*[w**2] * 3),
    )  # fmt: skip


HUNG, K_HUNG, M_HUNG = 1.0, 50.0, 2.0
SAG = M_HUNG * G / K_HUNG


def hung(t: Array, c: float = 0.0) -> Array:
    """How far a mass on a spring with damping sinks from its natural length."""
    decay, w = 0.5 * c / M_HUNG, math.sqrt(K_HUNG / M_HUNG)
    wd = math.sqrt(w**2 - decay**2)
    return SAG * (1.0 - np.exp(-decay * t) * (np.cos(wd * t) + decay / wd * np.sin(wd * t)))


def hung_poles(c: float = 0.0) -> Array:
    """A pendulum two ways, and the spring along its line."""
    decay, swings = 0.5 * c / M_HUNG, math.sqrt(G / (HUNG + SAG))
    return np.array([1j * swings, 1j * swings, -decay + 1j * math.sqrt(K_HUNG / M_HUNG - decay**2)])


@of("a spring")
def spring() -> Case:
    """A damped oscillation along its line; across it, a pendulum."""

    def system() -> System:
        found = System(gravity=DOWN)
        found.add(parts.Point(mass=M_HUNG, position=(0.0, 0.0, -HUNG)), "mass")
        found.add(parts.Spring(a=ORIGIN, b="mass", stiffness=K_HUNG, damping=1.0), "spring")
        return found

    return Case(
        part="spring", system=system, seen=at("mass"), end=2.0, step=5e-3, damped=True,
        motion=lambda t: columns(0.0, 0.0, -HUNG - hung(t, 1.0)), still=(0.0, 0.0, -HUNG - SAG), poles=hung_poles(1.0),
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ links, joints


def pendulum(rod: Any, part: str) -> Case:
    """A mass on a rod, released far from its lowest place."""
    length, start = 1.2, 1.0
    x = (length * math.sin(start), 0.0, -length * math.cos(start))

    def system() -> System:
        found = System(gravity=DOWN)
        found.add(parts.Point(mass=0.7, position=x), "mass")
        found.add(rod, part)
        return found

    def motion(t: Array) -> Array:
        angle = swing(t, start, math.sqrt(G / length))
        return columns(length * np.sin(angle), 0.0, -length * np.cos(angle))

    return Case(
        part=part, system=system, seen=at("mass"), end=2.0, step=5e-3, motion=motion, still=(0.0, 0.0, -length),
        poles=springs_poles(G / length, G / length),
    )  # fmt: skip


@of("a link")
def link() -> Case:
    """A pendulum."""
    return pendulum(parts.Joint(a=ORIGIN, b="mass", type="link"), "link")


@of("a joint that is a constraint")
def constraint() -> Case:
    """A pendulum."""
    return pendulum(parts.Joint(a=ORIGIN, b="mass", type="distance"), "rod")


@of("a joint by a penalty")
def penalty() -> Case:
    """A distance that is held by a penalty is a spring with damping."""

    def system() -> System:
        found = System(gravity=DOWN)
        found.add(parts.Point(mass=M_HUNG, position=(0.0, 0.0, -HUNG)), "mass")
        found.add(parts.Joint(a=ORIGIN, b="mass", type="distance", stiffness=K_HUNG, damping=1.0), "rod")
        return found

    return Case(
        part="rod", system=system, seen=at("mass"), end=2.0, step=5e-3, damped=True,
        motion=lambda t: columns(0.0, 0.0, -HUNG - hung(t, 1.0)), still=(0.0, 0.0, -HUNG - SAG), poles=hung_poles(1.0),
    )  # fmt: skip


RATIO, INERTIAS, TURN, REST = 20.0 / 35.0, (0.2, 0.1), 1.5, 0.3


def geared(**given: float) -> System:
    """Two wheels whose angles keep q_1 + ratio q_2 = 0, and a spring on the first one that rests at an angle."""
    found = System()
    for name, inertia in zip(("one", "two"), INERTIAS, strict=True):
        found.add(parts.RigidBody(motion="spin", inertia=inertia), name)
    found.add(parts.Joint(a="one", b="two", type="gear", ratio=RATIO, **given), "gear")
    found.add(parts.JointSpring(a="ground", b="one", axis=(0.0, 0.0, 1.0), stiffness=TURN, rest=REST), "spring")
    return found


def angles(assembly: Assembly, y: Array) -> Array:
    """Angles of both wheels."""
    return y[..., assembly.model.bodies["iq"][1:3]]


@of("a gear that is a constraint")
def gear() -> Case:
    """The second wheel counts with its inertia by the ratio squared."""
    w = math.sqrt(TURN / (INERTIAS[0] + INERTIAS[1] / RATIO**2))

    def motion(t: Array) -> Array:
        angle = REST * (1.0 - np.cos(w * t))
        return columns(angle, -angle / RATIO)

    return Case(
        part="gear", system=geared, seen=angles, end=2.0, step=0.01, motion=motion, still=(REST, -REST / RATIO),
        poles=springs_poles(w**2),
    )  # fmt: skip


@of("a gear by a penalty")
def soft_gear() -> Case:
    """Two wheels on a spring between them, of two modes."""
    k = 20.0
    size = np.sqrt(INERTIAS)
    K = np.array([[TURN + k, k * RATIO], [k * RATIO, k * RATIO**2]]) / np.outer(size, size)
    squares, shapes = np.linalg.eigh(K)
    still = np.array([REST, -REST / RATIO])

    def motion(t: Array) -> Array:
        part = shapes.T @ (still * size)
        return still - (np.cos(np.outer(t, np.sqrt(squares))) * part) @ shapes.T / size

    return Case(
        part="gear", system=lambda: geared(stiffness=k), seen=angles, end=2.0, step=0.005, motion=motion,
        still=tuple(still), poles=springs_poles(*squares),
    )  # fmt: skip


@of("a joint driven along a path")
def carried() -> Case:
    """A mass hangs from a hand that goes up; in equilibrium the hand stands where it is at that time."""
    v, time = 0.3, 2.0

    def system() -> System:
        found = System(gravity=DOWN)
        found.add(parts.Point(mass=1.0, velocity=(0.0, 0.0, v)), "hand")
        found.add(parts.Point(mass=M_HUNG, position=(0.0, 0.0, -HUNG), velocity=(0.0, 0.0, v)), "mass")
        found.add(parts.Spring(a="hand", b="mass", stiffness=K_HUNG))
        found.add(
            parts.Joint(
                a="ground", b="hand", type="point-on-line", drive=parts.ConstantDrive(rate=v), axis=(0.0, 0.0, 1.0)
            ),
            "path",
        )
        return found

    return Case(
        part="path", system=system, end=2.0, step=5e-3, time=time,
        seen=lambda assembly, y: np.concatenate([at("hand")(assembly, y), at("mass")(assembly, y)], axis=-1),
        motion=lambda t: columns(0.0, 0.0, v * t, 0.0, 0.0, v * t - HUNG - hung(t)),
        still=(0.0, 0.0, v * time, 0.0, 0.0, v * time - HUNG - SAG), poles=hung_poles(),
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ threads


def outer_node(assembly: Assembly, y: Array) -> Array:
    """The first coordinates of the thread: those of the node that leaves the spool first."""
    return y[..., int(assembly.model.threads["iq"][0]) :][..., :3]


def with_spool(assembly: Assembly, y: Array) -> Array:
    """`outer_node`, and the angle of the spool."""
    angle = y[..., int(assembly.model.threads["spool_q"][0])]
    return np.concatenate([outer_node(assembly, y), angle[..., None]], axis=-1)


def reeled(drive: Any, *, gravity: Any = ORIGIN, length: float, **thread: Any) -> System:
    """A thread along x from a reel at the origin."""
    found = System(gravity=gravity)
    found.add(parts.RigidBody(motion="driven"), "hub")
    found.add(parts.Reel(body="hub", centre=(0.0, 0.0, -0.1), radius=0.1, drive=drive), "reel")
    if "stiffness" in thread:
        thread = {"boundary_segment": "constant"} | thread
    found.add(parts.Thread(reel="reel", length=length, line_density=0.1, tip_mass=0.5, **thread), "thread")
    return found


def hanging_squares(c: float, masses: Array, rests: Array, g: float = G) -> tuple[float, Array, Array]:
    """A chain from its tip on under its weight: its length, and squares of its frequencies, along it and across."""
    tension = g * np.cumsum(masses)
    lengths = rests + tension / c
    squares = []
    for k in (np.full(masses.size, c), tension / lengths):
        pulled = np.diag(k) + np.diag(np.append(0.0, k[:-1])) - np.diag(k[:-1], 1) - np.diag(k[:-1], -1)
        squares.append(np.linalg.eigvals(pulled / masses[:, None]).real)
    return float(lengths.sum()), squares[0], squares[1]


def hanging(c: float, masses: Array, rests: Array, g: float = G) -> tuple[float, Array]:
    """As `hanging_squares`: the length, and the poles, along it and twice across."""
    length, along, across = hanging_squares(c, masses, rests, g)
    return length, springs_poles(*along, *across, *across)


@of("a thread with segments of springs")
def spring_thread() -> Case:
    """Paid out at a constant rate under its weight, until its second node leaves the spool at 1 s; two hang at 2 s."""
    c, m, v = 200.0, 0.55, 0.2
    w, inner = math.sqrt(c / m), 0.1
    x, poles = hanging(c, np.array([m, inner]), np.array([1.0, 0.2]))

    def motion(t: Array) -> Array:
        x = 0.8 + v * t + m * G / c * (1.0 - np.cos(w * t))
        return columns(np.where(t < 1.0, x, np.nan), 0.0, 0.0)

    return Case(
        part="thread", seen=outer_node, end=1.5, step=1e-3, motion=motion, still=(x, 0.0, 0.0), poles=poles, time=2.0,
        system=lambda: reeled(
            parts.ConstantDrive(rate=v / 0.1, angle=8.0), gravity=(G, 0.0, 0.0), length=2.0, nodes=2, stiffness=c
        ),
    )  # fmt: skip


@of("a thread that goes slack")
def slack_thread() -> Case:
    """A mass is pulled towards its reel, which stops: it goes on and falls, freely; below the reel it comes to hang."""
    v, g = 1.5, 0.1 * G
    x, poles = hanging(200.0, np.array([0.55]), np.array([0.8]), g)

    def motion(t: Array) -> Array:
        return columns(0.8 - v * t - 0.5 * g * t**2, 0.0, 0.0)

    return Case(
        part="thread", seen=outer_node, end=0.3, step=1e-3, motion=motion, still=(-x, 0.0, 0.0), poles=poles,
        system=lambda: reeled(
            parts.RampDrive(rate=-v / 0.1, angle=8.0, steps=[(0.0, 0.02, 0.0)]), gravity=(-g, 0.0, 0.0), length=1.0,
            nodes=1, stiffness=200.0, slack=True,
        ),
    )  # fmt: skip


@of("a thread with segments of fixed length")
def fixed_thread() -> Case:
    """One segment, all of it out: a pendulum, that hangs and swings at sqrt(g/l) about both axes."""
    start = 1.0

    def motion(t: Array) -> Array:
        angle = swing(t, start, math.sqrt(G))
        return columns(np.sin(angle), 0.0, -np.cos(angle))

    return Case(
        part="thread", seen=outer_node, end=2.0, step=5e-3, motion=motion, still=(0.0, 0.0, -1.0),
        poles=springs_poles(G, G),
        system=lambda: reeled(
            parts.ConstantDrive(rate=0.0, angle=10.0), gravity=DOWN, length=1.0, nodes=1, segments="inextensible",
            direction=(math.sin(start), 0.0, -math.cos(start)),
        ),
    )  # fmt: skip


@of("a thread on a moving mesh")
def moving_thread() -> Case:
    """One element of 1 m: a third of its mass moves with the tip, and half of its weight pulls there."""
    c, moved, m = 200.0, 0.5 + 0.1 / 3.0, 0.55
    w, x = math.sqrt(c / moved), 1.0 + m * G / c
    return Case(
        part="thread", seen=outer_node, end=1.0, step=1e-3, still=(x, 0.0, 0.0),
        poles=springs_poles(w**2, *[m * G / (x * moved)] * 2),
        motion=lambda t: columns(1.0 + m * G / c * (1.0 - np.cos(w * t)), 0.0, 0.0),
        system=lambda: reeled(
            parts.ConstantDrive(rate=0.0, angle=10.0), gravity=(G, 0.0, 0.0), length=2.0, nodes=1, stiffness=0.5 * c,
            mesh="moving",
        ),
    )  # fmt: skip


@of("a thread on a moving mesh and a free spool")
def moving_free_spool() -> Case:
    """A drum with a heavy rope and a weight: (x + M/q) = (x0 + M/q) cosh(k t), k^2 = q g/(I/R^2 + q L + M).

    The rope starts without strain, and its spring is stiff: it rings by a ten-thousandth of the motion.
    """
    q, M, inertia, r, length = 0.1, 0.5, 0.005, 0.1, 2.0
    k = math.sqrt(q * G / (inertia / r**2 + q * length + M))
    return Case(
        part="thread", end=0.5, step=5e-5, theory=3e-4,
        seen=lambda assembly, y: r * y[..., int(assembly.model.threads["spool_q"][0])][..., None],
        motion=lambda t: columns((0.5 + M / q) * np.cosh(k * t) - M / q),
        system=lambda: reeled(
            parts.FreeSpool(inertia=inertia, angle=5.0), gravity=(G, 0.0, 0.0), length=length, nodes=2, stiffness=1e5,
            damping=1.0, mesh="moving",
        ),
    )  # fmt: skip


@of("a thread on a free spool")
def free_spool() -> Case:
    """A drum with a load on a spring: it falls at m g R^2/(I + m R^2) in the mean, and rings about that."""
    c, m, inertia, r = 200.0, 0.75, 0.01, 0.1
    w = math.sqrt(c * (1.0 / m + r**2 / inertia))

    def motion(t: Array) -> Array:
        stretch = G / w**2 * (1.0 - np.cos(w * t))
        angle = r * c * G / (inertia * w**2) * (0.5 * t**2 - (1.0 - np.cos(w * t)) / w**2)
        return columns(0.5 + r * angle + stretch, 0.0, 0.0, 5.0 + angle)

    return Case(
        part="thread", seen=with_spool, end=0.5, step=5e-4, motion=motion,
        system=lambda: reeled(
            parts.FreeSpool(inertia=inertia, angle=5.0), gravity=(G, 0.0, 0.0), length=5.0, nodes=1, stiffness=c
        ),
    )  # fmt: skip


@of("a thread with segments of fixed length on a free spool")
def fixed_free_spool() -> Case:
    """A drum with a load: it falls at m g R^2/(I + m R^2)."""
    m, inertia, r = 0.75, 0.01, 0.1

    def motion(t: Array) -> Array:
        return columns(5.0 + 0.5 * m * G * r / (inertia + m * r**2) * t**2)

    return Case(
        part="thread", end=0.5, step=5e-3, motion=motion,
        seen=lambda assembly, y: y[..., int(assembly.model.threads["spool_q"][0])][..., None],
        system=lambda: reeled(
            parts.FreeSpool(inertia=inertia, angle=5.0), gravity=(G, 0.0, 0.0), length=5.0, nodes=1,
            segments="inextensible",
        ),
    )  # fmt: skip


@of("a thread on a spool under feedback")
def feedback() -> Case:
    """No solver takes it: its loop is closed before (`tests/reels/test_feedback_drives.py`)."""
    drive = parts.FeedbackDrive(
        law="1 - out", variables={"out": "thread.deployed_length"}, sensor=parts.Sensor(period=0.1), angle=5.0
    )
    return Case(
        part="thread", end=0.5, step=5e-4, seen=outer_node, motion=lambda t: columns(0.5 + 0.0 * t),
        system=lambda: reeled(drive, gravity=(G, 0.0, 0.0), length=5.0, nodes=1, stiffness=200.0),
    )  # fmt: skip


@of("a load on a thread")
def thread_load() -> Case:
    """A force per length acts on the half segment that belongs to the only node."""
    c, m, force = 200.0, 0.55, 30.0
    w, pull = math.sqrt(c / m), 0.5 * force
    x = 0.8 + pull / c

    def system() -> System:
        found = reeled(parts.ConstantDrive(rate=0.0, angle=8.0), length=1.0, nodes=1, stiffness=c)
        found.add(parts.Load(along="thread", force=(force, 0.0, 0.0)), "wind")
        return found

    return Case(
        part="wind", system=system, seen=outer_node, end=1.0, step=1e-3,
        still=(x, 0.0, 0.0), poles=springs_poles(w**2, *[pull / (m * x)] * 2),
        motion=lambda t: columns(0.8 + 0.5 * force / c * (1.0 - np.cos(w * t)), 0.0, 0.0),
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ loads, events


@of("a force or torque")
def force() -> Case:
    """A force on a mass on a spring, and a small torque on a wheel that a spring without length holds."""
    k, m, F, J, turn, torque = 8.0, 2.0, 3.0, 0.5, 2.0, 0.002
    w, spin = math.sqrt(k / m), math.sqrt(turn / J)

    def system() -> System:
        found = System()
        found.add(parts.Point(mass=m, position=(0.0, 0.0, 1.0)), "mass")
        found.add(parts.Spring(a=ORIGIN, b="mass", stiffness=k, length=0.0))
        found.add(parts.Load(at="mass", force=(F, 0.0, 0.0)), "push")
        found.add(parts.RigidBody(motion="spin", inertia=J), "wheel")
        found.add(parts.Spring(a=("wheel", (0.4, 0.0, 0.0)), b=(1.0, 0.0, 0.0), stiffness=turn / 0.4, length=0.0))
        found.add(parts.Load(at="wheel", torque=(0.0, 0.0, torque)), "turn")
        return found

    return Case(
        part="push", system=system, end=3.0, step=0.01, theory=1e-5,
        seen=lambda assembly, y: np.concatenate([at("mass")(assembly, y), 1e3 * at("wheel")(assembly, y)], axis=-1),
        motion=lambda t: columns(
            F / k * (1.0 - np.cos(w * t)), 0.0, np.cos(w * t), 1e3 * torque / turn * (1.0 - np.cos(spin * t))
        ),
        still=(F / k, 0.0, 0.0, 1e3 * math.asin(torque / turn)), poles=springs_poles(*[w**2] * 3, spin**2),
    )  # fmt: skip


@of("a force or torque by a profile")
def profile() -> Case:
    """A sine of time on a mass on a spring: x = F/(m (w^2 - f^2)) (sin f t - f/w sin w t)."""
    k, m, F, f, time = 8.0, 2.0, 3.0, 3.0, 0.4
    w = math.sqrt(k / m)
    sine = {"amplitude": F, "frequency": f / (2.0 * math.pi)}

    def system() -> System:
        found = System()
        found.add(parts.Point(mass=m, position=(0.0, 0.0, 1.0)), "mass")
        found.add(parts.Spring(a=ORIGIN, b="mass", stiffness=k, length=0.0))
        found.add(parts.Load(at="mass", direction=(1.0, 0.0, 0.0), profile={"sine": sine}), "push")
        return found

    return Case(
        part="push", system=system, end=3.0, step=0.01, seen=at("mass"), time=time,
        motion=lambda t: columns(
            F / (m * (w**2 - f**2)) * (np.sin(f * t) - f / w * np.sin(w * t)), 0.0, np.cos(w * t)
        ),
        still=(F / k * math.sin(f * time), 0.0, 0.0), poles=springs_poles(*[w**2] * 3),
    )  # fmt: skip


@evolvent.law
def falls_below(t, y, parameters):  # type: ignore[no-untyped-def]
    """Rises through zero where the first coordinate falls below a level."""
    return parameters[0] - y[0]


@of("an event")
def releasing_event() -> Case:
    """A mass on a spring is released from a penalty beside it where it passes a place, and swings on more slowly."""
    k, m, stiffness, when = 8.0, 2.0, 10.0, 0.2
    w, slow = math.sqrt((k + stiffness) / m), math.sqrt(k / m)
    place, speed = math.sin(w * when) / w, math.cos(w * when)

    def system() -> System:
        found = System()
        found.add(parts.Point(mass=m, velocity=(1.0, 0.0, 0.0)), "mass")
        found.add(parts.Spring(a=ORIGIN, b="mass", stiffness=k, length=0.0))
        found.add(parts.Event(law=f"x - {place!r}", variables={"x": "mass.position.x"}), "passing")
        found.add(parts.Joint(a=ORIGIN, b="mass", stiffness=stiffness, released_by="passing"), "held")
        return found

    def motion(t: Array) -> Array:
        u = slow * (t - when)
        return columns(np.where(t < when, np.sin(w * t) / w, place * np.cos(u) + speed / slow * np.sin(u)), 0.0, 0.0)

    return Case(
        part="passing", system=system, seen=at("mass"), end=1.2, step=1e-3, motion=motion,
        still=(0.0, 0.0, 0.0), poles=springs_poles(*[w**2] * 3),
    )  # fmt: skip


@of("an event that stops a run")
def event() -> Case:
    """A mass on a spring passes half its amplitude at a sixth of its period; the run ends there."""
    k, m = 8.0, 2.0
    w = math.sqrt(k / m)

    def system() -> System:
        found = System()
        found.add(parts.Point(mass=m, position=(1.0, 0.0, 0.0)), "mass")
        found.add(parts.Spring(a=ORIGIN, b="mass", stiffness=k, length=0.0))
        found.add(parts.Event(law=falls_below, parameters=(0.5,), stops=True), "passing")
        return found

    return Case(
        part="passing", system=system, seen=at("mass"), end=math.pi / 3.0 / w, step=math.pi / 150.0 / w, stops=True,
        motion=lambda t: columns(np.cos(w * t), 0.0, 0.0), still=(0.0, 0.0, 0.0), poles=springs_poles(*[w**2] * 3),
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ attitude


def angle_about_z(assembly: Assembly, y: Array) -> Array:
    """Angle of the body 'bus' about z."""
    x = coordinates(assembly, y, "bus")
    return columns(2.0 * np.arctan2(x[..., 6], x[..., 3]))


def sprung_bus(k: float, inertia: float, rest: float = 0.0) -> System:
    """A bus that turns about z on a torsional spring."""
    found = System()
    found.add(parts.RigidBody(motion="spin", inertia=inertia), "bus")
    found.add(parts.JointSpring(a="ground", b="bus", stiffness=k, rest=rest), "spring")
    return found


def turn_of_bus(assembly: Assembly, y: Array) -> Array:
    """Angle of a bus that turns about an axis."""
    return columns(coordinates(assembly, y, "bus")[..., 0])


@of("a reaction wheel")
def reaction_wheel() -> Case:
    """A motor's torque, tau sin(f t), acts back on a bus on a spring, which turns without the wheel's inertia."""
    J, inertia, torque, k, f, rest = 2.0, 0.2, 0.3, 5.0, 3.0, 0.1
    w = math.sqrt(k / (J - inertia))

    def system() -> System:
        found = sprung_bus(k, J, rest)
        wave = {"sine": {"amplitude": torque, "frequency": f / (2.0 * math.pi)}}
        found.add(parts.ReactionWheel(body="bus", inertia=inertia, profile=wave), "wheel")
        return found

    forced = -torque / ((J - inertia) * (w**2 - f**2))
    return Case(
        part="wheel", system=system, seen=turn_of_bus, end=2.0, step=0.01, time=math.pi / f, still=(rest,),
        poles=(0.0, 1j * w),  # the wheel turns freely
        motion=lambda t: columns(rest * (1.0 - np.cos(w * t)) + forced * (np.sin(f * t) - f / w * np.sin(w * t))),
    )  # fmt: skip


@of("a thruster")
def thruster() -> Case:
    """A burn whose force grows with time turns a bus on a spring."""
    J, k, slope, arm, time = 2.0, 5.0, 0.6, 0.4, 1.5
    w = math.sqrt(k / J)

    def system() -> System:
        found = sprung_bus(k, J)
        burn = {"table": [[0.0, 0.0], [5.0, 5.0 * slope]]}
        place = ("bus", (arm, 0.0, 0.0))
        found.add(parts.Thruster(at=place, direction=(0.0, 1.0, 0.0), thrust=9.0, profile=burn), "engine")
        return found

    return Case(
        part="engine", system=system, seen=turn_of_bus, end=2.0, step=0.01,
        motion=lambda t: columns(arm * slope / k * (t - np.sin(w * t) / w)),
        time=time, still=(arm * slope * time / k,), poles=(1j * w,),
    )  # fmt: skip


@of("an attitude controller")
def attitude_controller() -> Case:
    """The error is a damped oscillator, (J - I) e'' + D e' + P e = 0; a spring holds the bus in place."""
    J, inertia, P, D, start, m, k = 2.0, 0.1, 4.0, 1.0, 0.8, 1.0, 50.0

    def system() -> System:
        found = System()
        turned = (math.cos(0.5 * start), 0.0, 0.0, math.sin(0.5 * start))
        found.add(parts.RigidBody(mass=m, inertia=J, orientation=turned), "bus")
        found.add(parts.Spring(a=ORIGIN, b="bus", stiffness=k, length=0.0))
        for axis in np.eye(3):
            found.add(
                parts.ReactionWheel(body="bus", axis=tuple(axis), inertia=inertia), f"wheel {'xyz'[axis.argmax()]}"
            )
        goal, wheels = (1.0, 0.0, 0.0, 0.0), ["wheel x", "wheel y", "wheel z"]
        gains = {"proportional": (P, P, P), "derivative": (D, D, D)}
        found.add(parts.AttitudeController(body="bus", actuators=wheels, target=goal, **gains), "control")
        return found

    decay = 0.5 * D / (J - inertia)
    w = math.sqrt(P / (J - inertia) - decay**2)
    return Case(
        part="control", system=system, seen=angle_about_z, end=3.0, step=0.01, damped=True, still=(0.0,),
        motion=lambda t: columns(start * np.exp(-decay * t) * (np.cos(w * t) + decay / w * np.sin(w * t))),
        poles=(*[0.0] * 3, *[-decay + 1j * w] * 3, *[1j * math.sqrt(k / m)] * 3),
    )  # fmt: skip
