"""Cases of beams, hinges and contacts."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent import System, elements, parts
from evolvent.assembly.assembled import Assembly
from families.case import Array, Case, columns, of, springs_poles, swing
from implicit.rigs import coordinates

ORIGIN = (0.0, 0.0, 0.0)
#: Roots of cos(x) cosh(x) = -1, beta L of the modes of a cantilever, and their factors sigma.
BETA = np.array([1.8751040687, 4.6940911330, 7.8547574382, 10.9955407349])
SIGMA = np.array([0.7340955137, 1.0184673186, 0.9992244965, 1.0000335533])

SQUARE = elements.Rectangle(thickness=0.05, width=0.05)
SOFT, STIFF, HARD, RIGID = (
    elements.Material(young_modulus=E, poisson_ratio=0.0, density=1000.0) for E in (2e6, 5e8, 2e9, 2e11)
)
EI, MASS = 2e6 * 0.05**4 / 12.0, 2.5


def rod(found: System, count: int, material: Any, kind: str, stiffness: float = 1e5, **fields: Any) -> None:
    """A beam of 1 m along x, held at its root by penalties, or constraints without a stiffness."""
    turn = 2e4 if stiffness > 0.0 else None
    found.add(
        parts.Beam(length=1.0, section=SQUARE, material=material, elements=count, formulation="cable", **fields), "rod"
    )
    found.add(parts.Joint(a=ORIGIN, b="rod.root", type=kind, stiffness=stiffness, rotational_stiffness=turn), "root")


def cantilever(
    part: str, sag: float, shares: Array, add: Callable[[System], Any], gravity: float = 0.0, **fields: Any
) -> Case:
    """A clamped beam that sinks by `sag` at its tip; shares : of its modes in that."""

    def system() -> System:
        found = System(gravity=(0.0, -gravity, 0.0))
        rod(found, 4, SOFT, "clamp", **fields)
        add(found)
        return found

    w = BETA**2 * math.sqrt(EI / MASS)
    shares = shares / shares.sum()
    return Case(
        part=part, system=system, seen=tip, end=1.5, step=1e-4, theory=1.5e-3,
        motion=lambda t: columns(-sag * np.sum(shares * (1.0 - np.cos(np.outer(t, w))), axis=1)),
        still=(-sag,), poles=(1j * w[0], 1j * w[0]),
    )  # fmt: skip


@of("a beam")
def beam() -> Case:
    """Under its weight the tip sinks by q L^4/(8 E I)."""
    q = MASS * 0.02
    shares = SIGMA / BETA**5 * np.array([1.0, -1.0, 1.0, -1.0])
    return cantilever("rod", q / (8.0 * EI), shares, lambda found: None, gravity=0.02)


@of("a joint that is a constraint on a beam's node")
def clamp() -> Case:
    """Under its weight the tip sinks by q L^4/(8 E I)."""
    shares = SIGMA / BETA**5 * np.array([1.0, -1.0, 1.0, -1.0])
    return cantilever("root", MASS * 0.02 / (8.0 * EI), shares, lambda found: None, gravity=0.02, stiffness=0.0)


@of("a joint driven along a path on a beam's node")
def drawn() -> Case:
    """A clamped beam is drawn out at its tip, which is pinned across that: beta L = 3.9266, tan(x) = tanh(x)."""
    rate, time = 0.01, 0.5

    def system() -> System:
        found = System()
        rod(found, 4, SOFT, "clamp")
        drive = parts.RampDrive(steps=[(0.0, time, rate)])
        found.add(parts.Joint(a="ground", b="rod.tip", type="point-on-line", drive=drive, axis=(1.0, 0.0, 0.0)), "path")
        return found

    def motion(t: Array) -> Array:
        s = np.clip(t / time, 0.0, 1.0)
        return columns(1.0 + rate * (time * s**4 * (2.5 - 3.0 * s + s * s) + np.maximum(t - time, 0.0)))

    w = 3.9266023120**2 * math.sqrt(EI / MASS)
    return Case(
        part="path", system=system, seen=lambda assembly, y: coordinates(assembly, y, "rod")[..., -1, 0, :1], end=1.0,
        step=1e-4, theory=1.5e-3, motion=motion, still=(1.0,), poles=(1j * w, 1j * w),
    )  # fmt: skip


@of("a thermal load on a beam")
def heated() -> Case:
    """A rod that is heated slowly beside its own period grows by alpha T L, and its bending stays as it was."""
    expansion, change = 1e-3, 50.0
    material = SOFT.model_copy(update={"thermal_expansion": expansion})

    def system() -> System:
        found = System()
        rod(found, 4, material, "clamp")
        ramp = {"ramp": {"final": change, "duration": 1.0}}
        found.add(parts.ThermalLoad(part="rod", temperature=ramp), "heat")
        return found

    def length(t: Array) -> Array:
        s = np.clip(t, 0.0, 1.0)
        return columns(1.0 + expansion * change * s**3 * (10.0 - 15.0 * s + 6.0 * s * s))

    w = BETA[0] ** 2 * math.sqrt(EI / MASS)
    return Case(
        part="heat", system=system, seen=lambda assembly, y: coordinates(assembly, y, "rod")[..., -1, 0, :1], end=1.2,
        step=1e-4, theory=3e-3, motion=length, still=(1.0 + expansion * change,), poles=(1j * w, 1j * w), time=1.2,
    )  # fmt: skip


@of("a beam with the paper's damping")
def paper_beam() -> Case:
    """As without damping, of which there is next to none."""
    shares = SIGMA / BETA**5 * np.array([1.0, -1.0, 1.0, -1.0])
    sag, damped = MASS * 0.02 / (8.0 * EI), {"damping": "paper", "stiffness_damping": 1e-9}
    return cantilever("rod", sag, shares, lambda found: None, gravity=0.02, **damped)


@of("a load on a beam")
def beam_load() -> Case:
    """Under a force the tip sinks by F L^3/(3 E I)."""
    F = 0.02
    push = parts.Load(at="rod.tip", force=(0.0, -F, 0.0))
    return cantilever("push", F / (3.0 * EI), BETA**-4, lambda found: found.add(push, "push"))


@of("a load on a beam by a profile")
def beam_profile() -> Case:
    """As under a force that does not change."""
    F = 0.02
    push = parts.Load(at="rod.tip", direction=(0.0, -1.0, 0.0), profile={"constant": F})
    return cantilever("push", F / (3.0 * EI), BETA**-4, lambda found: found.add(push, "push"))


def oscillation(t: Array, rest: float, start: float, rate: float, w: float) -> Array:
    """x'' = -w^2 (x - rest)."""
    return rest + (start - rest) * np.cos(w * t) + rate / w * np.sin(w * t)


INERTIA = MASS / 3.0


@of("a joint spring on an angle")
def hinge() -> Case:
    """A rod on a hinge whose spring rests at an angle: in equilibrium there, else it swings about that."""
    c, rest = 1.0, -0.1

    def system() -> System:
        found = System()
        rod(found, 2, STIFF, "revolute")
        found.add(parts.JointSpring(a="ground", b="rod.root", stiffness=c, rest=rest), "hinge")
        return found

    w = math.sqrt(c / INERTIA)
    return Case(
        part="hinge", system=system, seen=tip, end=2.0, step=7e-5, theory=5e-4,
        motion=lambda t: columns(np.sin(oscillation(t, rest, 0.0, 0.0, w))), still=(math.sin(rest),), poles=(1j * w,),
    )  # fmt: skip


@of("a joint spring on an angle with a latch")
def latch() -> Case:
    """A rod swings on its hinge's spring until the latch's spring acts as well."""
    c, rest, rate, angle, stiff = 1.0, 0.1, 0.3, 0.2, 5.0
    w, locked = math.sqrt(c / INERTIA), math.sqrt((c + stiff) / INERTIA)

    def system() -> System:
        found = System()
        nodes = parts.Beam(length=1.0, section=SQUARE, material=HARD, elements=2, formulation="cable").start_nodes()
        rod(found, 2, HARD, "revolute", rates=np.cross([0.0, 0.0, rate], nodes))
        given: dict[str, Any] = {"stiffness": c, "rest": rest, "latch": angle, "latch_stiffness": stiff}
        found.add(parts.JointSpring(a="ground", b="rod.root", **given), "hinge")
        return found

    # a cos(w t - phase) + rest passes the latch first at `when`
    size, phase = math.hypot(rest, rate / w), math.atan2(rate / w, -rest)
    when = (phase - math.acos((angle - rest) / size)) / w
    speed = w * size * math.sin(phase - w * when)
    middle = (c * rest + stiff * angle) / (c + stiff)

    def motion(t: Array) -> Array:
        before, after = oscillation(t, rest, 0.0, rate, w), oscillation(t - when, middle, angle, speed, locked)
        return columns(np.sin(np.where(t < when, before, after)))

    return Case(
        part="hinge", system=system, seen=tip, end=2.0, step=5e-5, theory=1.5e-3, motion=motion,
        still=(math.sin(rest),), poles=(1j * w,),
    )  # fmt: skip


@of("a beam's node at a spring's end")
def node_on_spring() -> Case:
    """A rod on a hinge, its tip on a spring without length: a torque -k L d sin(angle), as a pendulum's."""
    k, d, start = 1.0, 2.0, 0.1

    def system() -> System:
        found = System()
        rod(found, 1, STIFF, "revolute", direction=(math.cos(start), math.sin(start), 0.0))
        found.add(parts.Spring(a="rod.tip", b=(d, 0.0, 0.0), stiffness=k, length=0.0), "spring")
        return found

    w = math.sqrt(k * d / INERTIA)
    return Case(
        part="points", system=system, seen=tip, end=2.0, step=2e-4, theory=5e-4,
        motion=lambda t: columns(np.sin(swing(t, start, w))), still=(0.0,), poles=(1j * w,),
    )  # fmt: skip


def tip(assembly: Assembly, y: Array) -> Array:
    """Place of the last node of the beam 'rod', across it."""
    return coordinates(assembly, y, "rod")[..., -1, 0, 1:2]


# ------------------------------------------------------------------------------------------------ contacts

K_TOUCH, SUNK, G_TOUCH = 20.0, 1e-4, 0.1


def resting(part: str, add: Callable[[System], Any], direction: float) -> Case:
    """A rod on a hinge whose tip lies on a spring by contact, which it touches at the start: N = m g/2."""

    def system() -> System:
        found = System(gravity=(0.0, -G_TOUCH, 0.0))
        rod(found, 2, HARD, "revolute", direction=(direction, 0.0, 0.0))
        add(found)
        return found

    w, depth = math.sqrt(3.0 * K_TOUCH / MASS), 0.5 * MASS * G_TOUCH / K_TOUCH
    return Case(
        part=part, system=system, seen=tip, end=2.0, step=5e-5, theory=1.5e-3,
        motion=lambda t: columns(SUNK - oscillation(t, depth, SUNK, 0.0, w)), still=(SUNK - depth,), poles=(1j * w,),
    )  # fmt: skip


def on_drum(**law: Any) -> Case:
    """The tip on a cylinder."""
    given = {"shape": parts.Cylinder(radius=0.2), "stiffness": K_TOUCH, "points": 1} | law
    drum = parts.Contact(a="rod", b=(1.0, SUNK - 0.2, 0.0), **given)
    return resting("drum", lambda found: found.add(drum, "drum") and None, 1.0)


@of("a contact without friction")
def contact() -> Case:
    return on_drum()


@of("a contact with the law conservative")
def conservative() -> Case:
    return on_drum(law="conservative")


@of("a contact with the paper's law")
def paper() -> Case:
    return on_drum(law="paper", damping=0.0)


@of("a layer on other turns")
def layer() -> Case:
    """The tip on a short beam below it, as seen from an axis far below."""
    thickness = 0.01

    def add(found: System) -> None:
        place = (-0.8, SUNK - thickness, 0.0)
        below = parts.Beam(
            length=0.4,
            section=SQUARE,
            material=HARD,
            elements=1,
            formulation="cable",
            position=place,
            direction=(-1.0, 0.0, 0.0),
        )
        found.add(below, "below")
        for end, x in (("root", -0.8), ("tip", -1.2)):
            held = {"type": "clamp", "stiffness": 1e5, "rotational_stiffness": 2e4}
            found.add(parts.Joint(a=(x, *place[1:]), b=f"below.{end}", **held), f"below-{end}")
        given: dict[str, Any] = {"thickness": thickness, "stiffness": K_TOUCH, "points": 1}
        found.add(parts.Contact(a="rod", b="below", around=(-0.5, -3.0, 0.0), **given), "layer")

    return resting("layer", add, -1.0)


@of("a contact with friction")
def friction() -> Case:
    """A rod in the groove between two cylinders slides along them, or stands on its bristles.

    Four contact points of each cylinder bear it, at 0.25, 0.5, 0.75 and 1 m. Their forces along the normals, at 45
    degrees, are sqrt(2) m g together, so that it slows down at sqrt(2) mu g; bristles that stick hold it by 8 k.
    """
    stiff, stick, mu, g, along, v, count = 2500.0, 1000.0, 0.3, 1.0, 0.05, 0.5, 4
    x = 0.25 * np.arange(1, count + 1)
    # the rod at rest, a rigid bar on springs: depths at x
    sink = MASS * g / stiff * np.linalg.solve([[count, x.sum()], [x.sum(), x @ x]], [1.0, 0.5])

    def system() -> System:
        found = System(gravity=(along, -g, 0.0))
        slope = np.array([1.0, -sink[1], 0.0]) / math.hypot(1.0, sink[1])
        nodes = np.zeros((3, 2, 3))
        nodes[:, 0] = np.array([0.0, -sink[0], 0.0]) + np.outer([0.0, 0.5, 1.0], slope)
        nodes[:, 1] = slope
        rates = np.zeros((3, 2, 3))
        rates[:, 0, 0] = v
        bar = parts.Beam(
            length=1.0, section=SQUARE, material=RIGID, elements=2, formulation="cable", nodes=nodes, rates=rates
        )
        found.add(bar, "rod")
        given: dict[str, Any] = {"stiffness": stiff, "friction": mu, "bristle_stiffness": stick}
        given["shape"] = parts.Cylinder(radius=1.0, axis=(1.0, 0.0, 0.0))
        for name, side in (("left", 1.0), ("right", -1.0)):
            centre = (0.0, -math.sqrt(0.5), side * math.sqrt(0.5))
            found.add(parts.Contact(a="rod", b=centre, **given), name)
        return found

    # across it the rod stands on `count` springs each way, of the normals and of the bristles
    arms = x - 0.5
    K = (stiff + stick) * np.array([[count, arms.sum()], [arms.sum(), arms @ arms]])
    across = np.linalg.eigvals(np.diag([1.0, 12.0]) @ K / MASS)
    return Case(
        part="left", system=system, end=0.5, step=8e-6, theory=5e-4, kink=1e-5,
        seen=lambda assembly, y: coordinates(assembly, y, "rod")[..., 0, 0, :1],
        motion=lambda t: columns(v * t - 0.5 * (mu * math.sqrt(2.0) * g - along) * t**2),
        still=(MASS * along / (2 * count * stick),), poles=springs_poles(2 * count * stick / MASS, *across, *across),
    )  # fmt: skip
