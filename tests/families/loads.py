"""Cases of fields, of loads by laws, of moments and light, and of bodies carried along a line."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.linalg import expm

from evolvent import System, parts
from families.beams import BETA, EI, INERTIA, STIFF, cantilever, oscillation, rod, tip
from families.case import Array, Case, at, columns, of, springs_poles, swing
from families.lumped import (
    BODY_INERTIA,
    BODY_MASS,
    BODY_STIFFNESS,
    INNER,
    OUTER,
    TURNED,
    body_seen,
    held_body,
    outer_node,
    reeled,
)

ORIGIN = (0.0, 0.0, 0.0)


def linear_motion(K: Array, C: Array, f: Array, x0: Array, v0: Array) -> Any:
    """x'' = K x + C x' + f as a function of times: (nt, 3)."""
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [K, C]])
    rest = np.concatenate([-np.linalg.solve(K, f), np.zeros(3)])
    start = np.concatenate([x0, v0]) - rest
    return lambda t: np.array([(expm(A * time) @ start + rest)[:3] for time in np.atleast_1d(t)])


def oscillations(K: Array, C: Array) -> Array:
    """Poles of x'' = K x + C x' that oscillate, one of each pair."""
    found = np.linalg.eigvals(np.block([[np.zeros((3, 3)), np.eye(3)], [K, C]]))
    found = found[found.imag > 0.0]
    return found[np.argsort(np.abs(found))]


@of("an orbital frame")
def orbit() -> Case:
    """A mass on a spring without length, pushed by a force, in the frame of a circular orbit."""
    n, k, m, F = 0.7, 8.0, 2.0, np.array([3.0, 1.0, 2.0])
    x0, v0 = np.array([0.2, -0.3, 0.4]), np.array([0.1, 0.5, -0.2])
    K = np.diag([3.0 * n * n, 0.0, -n * n]) - k / m * np.eye(3)
    C = np.array([[0.0, 2.0 * n, 0.0], [-2.0 * n, 0.0, 0.0], [0.0, 0.0, 0.0]])

    def system() -> System:
        found = System()
        found.add(parts.Field(type="orbit", rate=n), "orbit")
        found.add(parts.Point(mass=m, position=tuple(x0), velocity=tuple(v0)), "mass")
        found.add(parts.Spring(a=ORIGIN, b="mass", stiffness=k, length=0.0))
        found.add(parts.Load(at="mass", force=tuple(F)), "push")
        return found

    return Case(
        part="orbit", system=system, seen=at("mass"), end=3.0, step=0.01, motion=linear_motion(K, C, F / m, x0, v0),
        still=-np.linalg.solve(K, F / m), poles=oscillations(K, C),
    )  # fmt: skip


@of("an acceleration field")
def acceleration_field() -> Case:
    """A mass in a linear field, whose damping is out of action at rest."""
    K, C, f = np.diag([-4.0, -9.0, -1.0]), -0.1 * np.eye(3), np.array([1.0, 2.0, 3.0])
    x0 = np.array([0.2, -0.3, 0.4])

    def system() -> System:
        found = System()
        law = ["1 - w*x - c*vx", "2 - 9*y - c*vy", "3 - z - c*vz"]
        found.add(parts.Field(law=law, constants={"w": 4.0, "c": 0.1}), "field")
        found.add(parts.Point(mass=3.0, position=tuple(x0)), "mass")
        return found

    return Case(
        part="field", system=system, seen=at("mass"), end=3.0, step=0.01,
        motion=linear_motion(K, C, f, x0, np.zeros(3)), still=-np.linalg.solve(K, f),
        poles=oscillations(K, C), damped=True,
    )  # fmt: skip


@of("a force on a node of a thread")
def node_force() -> Case:
    """A force on the only node, by a profile."""
    c, m, force = 200.0, 0.55, 15.0
    w, x = math.sqrt(c / m), 0.8 + force / c

    def system() -> System:
        found = reeled(parts.ConstantDrive(rate=0.0, angle=8.0), length=1.0, nodes=1, stiffness=c)
        found.add(parts.Load(at="thread.tip", direction=(1.0, 0.0, 0.0), profile={"constant": force}), "pull")
        return found

    return Case(
        part="pull", system=system, seen=outer_node, end=1.0, step=1e-3,
        still=(x, 0.0, 0.0), poles=springs_poles(w**2, *[force / (m * x)] * 2),
        motion=lambda t: columns(0.8 + force / c * (1.0 - np.cos(w * t)), 0.0, 0.0),
    )  # fmt: skip


@of("a force or torque by a law")
def law() -> Case:
    """The force of a spring to a place on the ground, as a law."""
    k, m = 8.0, 2.0
    w = math.sqrt(k / m)

    def system() -> System:
        found = System()
        found.add(parts.Point(mass=m, position=(0.0, 0.0, 1.0)), "mass")
        found.add(parts.Load(at="mass", law=["3 - k*x", "-k*y", "-k*z"], constants={"k": k}), "pull")
        return found

    return Case(
        part="pull", system=system, end=3.0, step=0.01, seen=at("mass"),
        motion=lambda t: columns(3.0 / k * (1.0 - np.cos(w * t)), 0.0, np.cos(w * t)),
        still=(3.0 / k, 0.0, 0.0), poles=springs_poles(*[w**2] * 3),
    )  # fmt: skip


@of("radiation pressure on a panel")
def panel() -> Case:
    """Light along the normal of a panel in a body's middle: F = p A (1 + specular + 2/3 diffuse)."""
    force = 0.5 * 2.0 * (1.0 + 0.3 + 2.0 / 3.0 * 0.2)
    stiff, turn = 4.0 * BODY_STIFFNESS, 4.0 * BODY_STIFFNESS * INNER * OUTER
    w, spin, push = math.sqrt(stiff / BODY_MASS), math.sqrt(turn / BODY_INERTIA[2]), force / stiff

    def system() -> System:
        found = System()
        held_body(found)
        light = {"area": 2.0, "normal": (0.0, 0.0, 1.0), "pressure": 0.5, "specular": 0.3, "diffuse": 0.2}
        found.add(parts.Radiation(at="body", **light), "light")
        return found

    return Case(
        part="light", system=system, seen=body_seen, end=1.5, step=2e-3,
        motion=lambda t: columns(0.0, 0.0, push * (1.0 - np.cos(w * t)), swing(t, TURNED, spin), 0.0, 0.0),
        still=(0.0, 0.0, push, 0.0, 0.0, 0.0),
        poles=springs_poles(
            *[stiff / BODY_MASS] * 3, 0.5 * turn / BODY_INERTIA[0], 0.5 * turn / BODY_INERTIA[1],
            turn / BODY_INERTIA[2],
        ),
    )  # fmt: skip


@of("a body driven along a line")
def table() -> Case:
    """A mass on a spring without length on a shaker's table, which moves by u = a sin(f t)."""
    k, m, a, f, time, lift = 8.0, 2.0, 0.5, 3.0, 0.4, 0.2
    w = math.sqrt(k / m)

    def system() -> System:
        found = System()
        drive = {"expression": "a*sin(f*t)", "constants": {"a": a, "f": f}}
        found.add(parts.RigidBody(motion="driven", drive=drive), "table")
        found.add(parts.Point(mass=m, position=(0.0, 0.0, 1.0)), "mass")
        found.add(parts.Spring(a="table", b="mass", stiffness=k, length=0.0))
        found.add(parts.Load(at="mass", force=(0.0, k * lift, 0.0)), "lift")
        return found

    return Case(
        part="table", system=system, end=3.0, step=0.01, seen=at("mass"), time=time,
        motion=lambda t: columns(
            a * w**2 / (w**2 - f**2) * (np.sin(f * t) - f / w * np.sin(w * t)), lift * (1.0 - np.cos(w * t)),
            np.cos(w * t),
        ),
        still=(a * math.sin(f * time), lift, 0.0), poles=springs_poles(*[w**2] * 3),
    )  # fmt: skip


@of("a moment or follower force on a beam")
def moment() -> Case:
    """A moment on a rod on a hinge with a spring."""
    c, M = 1.0, -0.1

    def system() -> System:
        found = System()
        rod(found, 2, STIFF, "revolute")
        found.add(parts.JointSpring(a="ground", b="rod.root", stiffness=c), "hinge")
        found.add(parts.Load(at="rod.root", torque=(0.0, 0.0, M)), "moment")
        return found

    w = math.sqrt(c / INERTIA)
    return Case(
        part="moment", system=system, seen=tip, end=2.0, step=7e-5, theory=5e-4,
        motion=lambda t: columns(np.sin(oscillation(t, M / c, 0.0, 0.0, w))), still=(math.sin(M / c),),
        poles=(1j * w,),
    )  # fmt: skip


@of("a load on a beam by a law")
def beam_law() -> Case:
    """As under a force that does not change."""
    F = 0.02
    push = parts.Load(at="rod.tip", law=["0", "-F", "0"], constants={"F": F})
    return cantilever("push", F / (3.0 * EI), BETA**-4, lambda found: found.add(push, "push"))
