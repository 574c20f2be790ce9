"""Cases of joint coordinates: springs along axes, friction, motors, synchronizations."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.optimize import brentq

from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.parts.base import Part
from families.case import Array, Case, at, columns, of, springs_poles
from implicit.rigs import coordinates

M = 2.0
#: Stiffnesses along three axes that are not those of the frame.
K = np.array([50.0, 80.0, 130.0])
AXES = np.array([[2.0, 1.0, 2.0], [-2.0, 2.0, 1.0], [-1.0, -2.0, 2.0]]) / 3.0


def on_axes(gravity: Array, velocity: Array, **first: Any) -> System:
    """A point mass on three springs along axes that are fixed to the ground; `first`: keys of the first."""
    found = System(gravity=tuple(gravity))
    found.add(parts.Point(mass=M, velocity=tuple(velocity)), "mass")
    for k, (stiffness, axis) in enumerate(zip(K, AXES, strict=True)):
        more = first if k == 0 else {}
        spring = parts.JointSpring(
            a="ground", b="mass", axis=tuple(axis), motion="translation", stiffness=stiffness, **more
        )
        found.add(spring, f"spring {k}")
    return found


@of("a joint spring on a travel")
def axial_spring() -> Case:
    """A mass swings along each of three axes by itself."""
    g, v, w = np.array([0.0, 0.0, -9.81]), np.array([0.5, 0.3, 0.0]), np.sqrt(K / M)
    still = M * (AXES @ g) / K

    def motion(t: Array) -> Array:
        phase = np.outer(t, w)
        return np.asarray((still * (1.0 - np.cos(phase)) + AXES @ v / w * np.sin(phase)) @ AXES)

    return Case(
        part="spring 0", system=lambda: on_axes(g, v), seen=at("mass"), end=2.0, step=2e-3, motion=motion,
        still=still @ AXES, poles=springs_poles(*w**2),
    )  # fmt: skip


@of("a joint coordinate with friction")
def friction() -> Case:
    """It slides along one of the axes against friction, or sticks on its bristle under a part of that."""
    F, stick, v, load = 1.0, 1e4, 1.5, 0.3
    w = math.sqrt(K[0] / M)
    rest = -(F - load) / K[0]

    return Case(
        part="spring 0",
        system=lambda: on_axes(load / M * AXES[0], v * AXES[0], friction=F, bristle_stiffness=stick),
        seen=lambda assembly, y: (coordinates(assembly, y, "mass") @ AXES[0])[..., None],
        end=0.25,  # before it stops, at 0.31 s
        step=1e-3, theory=5e-4, kink=1e-4,
        motion=lambda t: columns(rest * (1.0 - np.cos(w * t)) + v / w * np.sin(w * t)),
        still=(load / (K[0] + stick),), poles=springs_poles((K[0] + stick) / M, K[1] / M, K[2] / M),
    )  # fmt: skip


@of("a bearing")
def bearing() -> Case:
    """A block slides along an inclined guide against friction by its weight, or sticks under a part of that."""
    mu, k, stick, v, load, pressed = 0.2, 50.0, 1e4, 1.5, 0.3, 5.0
    F, w = mu * pressed, math.sqrt(k / M)
    rest, axis = -(F - load) / k, AXES[0]

    def system() -> System:
        found = System(gravity=tuple((load * axis + pressed * AXES[1]) / M))
        found.add(parts.RigidBody(mass=M, inertia=(0.1, 0.2, 0.3), velocity=tuple(v * axis)), "block")
        found.add(parts.Joint(a=(0.0, 0.0, 0.0), b="block", type="prismatic", axis=tuple(axis)), "guide")
        found.add(parts.JointSpring(joint="guide", stiffness=k), "spring")
        found.add(parts.Bearing(joint="guide", coefficient=mu, span=0.3, bristle_stiffness=stick), "bearing")
        return found

    return Case(
        part="bearing", system=system, seen=lambda assembly, y: (at("block")(assembly, y)[..., :3] @ axis)[..., None],
        end=0.25,  # before it stops, at 0.31 s
        step=1e-3, theory=5e-4,
        motion=lambda t: columns(rest * (1.0 - np.cos(w * t)) + v / w * np.sin(w * t)),
        still=(load / (k + stick),), poles=springs_poles((k + stick) / M),
    )  # fmt: skip


@of("a motor")
def motor() -> Case:
    """A PD motor turns a wheel to an angle."""
    J, kp, kd, target = 0.4, 5.0, 0.3, 0.6

    def system() -> System:
        found = System()
        found.add(parts.RigidBody(motion="spin", inertia=J), "wheel")
        found.add(parts.JointSpring(a="ground", b="wheel"), "hinge")
        drive = parts.ConstantDrive(rate=0.0, angle=target)
        found.add(parts.Motor(joint="hinge", motion=drive, position_gain=kp, velocity_gain=kd), "motor")
        return found

    decay, w = 0.5 * kd / J, math.sqrt(kp / J - (0.5 * kd / J) ** 2)
    return Case(
        part="motor", system=system, seen=at("wheel"), end=2.0, step=2e-3, damped=True,
        motion=lambda t: columns(target * (1.0 - np.exp(-decay * t) * (np.cos(w * t) + decay / w * np.sin(w * t)))),
        still=(target,), poles=(complex(-decay, w),),
    )  # fmt: skip


@of("a synchronization")
def synchronization() -> Case:
    """Two wheels coupled by a cable over pulleys, one of them on a spring."""
    J, k, rest, c, ratios = np.array([0.4, 0.7]), 3.0, 0.5, 20.0, np.array([2.0, -1.0])

    def system() -> System:
        found = System()
        for n in (0, 1):
            found.add(parts.RigidBody(motion="spin", inertia=J[n], position=(float(n), 0.0, 0.0)), f"wheel {n}")
            spring: dict[str, Any] = {"stiffness": k, "rest": rest} if n == 0 else {}
            found.add(parts.JointSpring(a="ground", b=f"wheel {n}", **spring), f"hinge {n}")
        found.add(
            parts.Joint(type="synchronization", joints=["hinge 0", "hinge 1"], ratios=tuple(ratios), stiffness=c),
            "cable",
        )
        return found

    g = ratios * (-1.0, 1.0)
    squares, shapes = np.linalg.eig(np.diag(1.0 / J) @ (c * np.outer(g, g) + np.diag([k, 0.0])))
    still = rest * np.array([1.0, ratios[0] / ratios[1]])
    parts_of = np.linalg.solve(shapes, still)

    def motion(t: Array) -> Array:
        return np.asarray(still - np.cos(np.outer(t, np.sqrt(squares))) * parts_of @ shapes.T)

    def seen(assembly: Assembly, y: Array) -> Array:
        return columns(*(coordinates(assembly, y, f"wheel {n}")[..., 0] for n in (0, 1)))

    return Case(
        part="cable", system=system, seen=seen, end=2.0, step=1e-3, motion=motion, still=still,
        poles=springs_poles(*squares),
    )  # fmt: skip


def on_wheel(part: Part, *, rate: float = 0.0, **spring: float) -> System:
    """A wheel on a spring, with another part on its hinge."""
    found = System()
    found.add(parts.RigidBody(motion="spin", inertia=0.4, rate=rate), "wheel")
    found.add(parts.JointSpring(a="ground", b="wheel", **spring), "hinge")
    found.add(part, "it")
    return found


def hinge_angle(offset: float) -> Any:
    """The angle of such a wheel, which starts at `offset`."""
    return lambda assembly, y: coordinates(assembly, y, "wheel") + offset


@of("a harness")
def harness() -> Case:
    """Bristles that were bent before slip until it turns back; in equilibrium they stick."""
    J, k, c, stick, L, v = 0.4, 3.0, 5.0, 20.0, 0.8, 1.5
    it = parts.Resistance(joint="hinge", type="harness", stiffness=c, bristles=[[stick, L]], relaxed_at=-1.0)
    w, rest = math.sqrt((k + c) / J), -L / (k + c)
    return Case(
        part="it", system=lambda: on_wheel(it, rate=v, stiffness=k), seen=hinge_angle(0.0), end=0.25, step=1e-3,
        motion=lambda t: columns(rest * (1.0 - np.cos(w * t)) + v / w * np.sin(w * t)),
        still=(-L / (k + c + stick),), poles=springs_poles((k + c + stick) / J),
    )  # fmt: skip


@of("a tape-spring hinge")
def tape_spring() -> Case:
    """A folded tape opens against a spring, snaps, and swings about straight; with damping it would stay folded."""
    J, k, slope, moment, start, snaps, c = 0.4, 30.0, 0.2, 0.1, 0.7, 0.1, 0.4
    it = parts.Resistance(
        joint="hinge",
        type="tape-spring",
        straight=[[-1.0, -k], [0.2, 0.2 * k]],
        folded=[[snaps, moment + slope * snaps], [3.0, moment + 3.0 * slope]],
    )
    w, u = math.sqrt((slope + c) / J), math.sqrt((k + c) / J)
    rest, middle = (c * start - moment) / (slope + c), c * start / (k + c)
    when = math.acos((snaps - rest) / (start - rest)) / w
    rate = -w * (start - rest) * math.sin(w * when)

    def motion(t: Array) -> Array:
        folded = rest + (start - rest) * np.cos(w * t)
        straight = middle + (snaps - middle) * np.cos(u * (t - when)) + rate / u * np.sin(u * (t - when))
        return columns(np.where(t < when, folded, straight))

    return Case(
        part="it", system=lambda: on_wheel(it, start=start, stiffness=c, rest=start), seen=hinge_angle(start), end=2.2,
        step=1e-3, motion=motion, still=(rest,), poles=springs_poles((slope + c) / J),
    )  # fmt: skip


@of("an adhesion")
def adhesion() -> Case:
    """A wheel that turns breaks it, and swings on."""
    J, k, holds, way, v, rest = 0.4, 3.0, 0.5, 0.05, 1.5, 0.1
    it = parts.Resistance(joint="hinge", type="adhesion", strength=holds, distance=way)
    w, u = math.sqrt((k + holds / way) / J), math.sqrt(k / J)
    still = k * rest / (k + holds / way)

    def sticks(t: Any) -> Any:
        return still * (1.0 - np.cos(w * t)) + v / w * np.sin(w * t)

    when = float(brentq(lambda t: float(sticks(t)) - way, 0.0, math.asin(way * w / v) / w))
    rate = still * w * math.sin(w * when) + v * math.cos(w * when)

    def motion(t: Array) -> Array:
        after = rest + (way - rest) * np.cos(u * (t - when)) + rate / u * np.sin(u * (t - when))
        return columns(np.where(t < when, sticks(t), after))

    return Case(
        part="it", system=lambda: on_wheel(it, rate=v, stiffness=k, rest=rest), seen=hinge_angle(0.0), end=1.5,
        step=1e-3, motion=motion, still=(still,), poles=springs_poles((k + holds / way) / J),
    )  # fmt: skip


@of("a motor's drivetrain")
def drivetrain() -> Case:
    """A motor of a current turns a wheel on a spring against eddies, magnetic hysteresis and a gear, one way.

    In equilibrium these slip.
    """
    J, k, n, K, current, h, b, e, stick = 0.4, 3.0, 10.0, 0.02, 5.0, 0.01, 2e-3, 0.8, 5e3
    it = parts.Motor(
        joint="hinge", current={"constant": current}, torque_constant=K, resistance=1.0, ratio=n, hysteresis_torque=h,
        eddy_damping=b, efficiency=e, bristle_stiffness=stick,
    )  # fmt: skip
    # sliding, J x'' = e (n K i - n^2 b x' - n h) - k x
    rest, decay, v = e * (n * K * current - n * h) / k, 0.5 * e * n * n * b / J, 1.0
    w = math.sqrt(k / J - decay**2)
    return Case(
        part="it", system=lambda: on_wheel(it, rate=v, stiffness=k), seen=hinge_angle(0.0), end=0.4, step=2e-4,
        motion=lambda t: columns(
            rest * (1.0 - np.exp(-decay * t) * (np.cos(w * t) + decay / w * np.sin(w * t)))
            + v / w * np.exp(-decay * t) * np.sin(w * t)
        ),
        theory=2e-3, kink=1e-4, still=(rest,), poles=(complex(-decay, w),), damped=True,
    )  # fmt: skip
