"""Cases of contacts between rigid bodies."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent import System, parts
from families.beams import oscillation
from families.case import Case, at, columns, of

INERTIA, STIFF, FORCE, START, RADIUS = 0.8, 100.0, 2.0, 1e-4, 0.2
PLANE = parts.Plane(normal=(0.0, 1.0, 0.0))


def lever(found: System, axis: tuple[float, float, float], **fields: Any) -> None:
    """A body that turns about its origin, 1 m from where it touches something."""
    found.add(parts.RigidBody(motion="spin", inertia=INERTIA, axis=axis, **fields), "lever")


def pressed(shape_a: Any, shape_b: Any, depth: float, **law: Any) -> Case:
    """A force presses the end of a lever on a spring by contact, which it touches at the start."""

    def system() -> System:
        found = System()
        lever(found, (0.0, 0.0, 1.0))
        shapes = {"shape_a": shape_a, "shape": shape_b}
        touch = parts.Contact(
            a=("lever", (1.0, 0.0, 0.0)), b=(1.0, START - depth, 0.0), stiffness=STIFF, **shapes, **law
        )
        found.add(touch, "touch")
        found.add(parts.Load(at=("lever", (1.0, 0.0, 0.0)), force=(0.0, -FORCE, 0.0)), "push")
        return found

    w, rest = math.sqrt(STIFF / INERTIA), START - FORCE / STIFF
    return Case(
        part="touch", system=system, seen=at("lever"), end=0.5, step=1e-3, theory=1e-3,
        motion=lambda t: columns(oscillation(t, rest, 0.0, 0.0, w)), still=(rest,), poles=(1j * w,),
    )  # fmt: skip


@of("a contact between bodies without friction")
def sphere_on_plane() -> Case:
    return pressed(parts.Sphere(radius=RADIUS), PLANE, RADIUS)


@of("a contact between bodies with the law conservative")
def conservative_sphere() -> Case:
    return pressed(parts.Sphere(radius=RADIUS), PLANE, RADIUS, law="conservative")


@of("a contact of a box")
def sphere_on_box() -> Case:
    return pressed(parts.Sphere(radius=RADIUS), parts.Box(size=(2.0, 2.0 * RADIUS, 0.5)), 2.0 * RADIUS)


@of("a contact between bodies with friction")
def rubbing_sphere() -> Case:
    """A lever that turns in the plane slows down by friction at its end, or stands on the bristle against a torque."""
    N, mu, stick, torque, rate = 10.0, 0.3, 1e6, 1.0, 2.0

    def system() -> System:
        found = System()
        lever(found, (0.0, 1.0, 0.0), rate=rate)
        given: dict[str, Any] = {"stiffness": N / 1e-3, "friction": mu, "bristle_stiffness": stick}
        given |= {"shape_a": parts.Sphere(radius=RADIUS), "shape": PLANE}
        touch = parts.Contact(a=("lever", (1.0, 0.0, 0.0)), b=(1.0, 1e-3 - RADIUS, 0.0), **given)
        found.add(touch, "touch")
        found.add(parts.Load(at="lever", torque=(0.0, torque, 0.0)), "turn")
        return found

    return Case(
        part="touch", system=system, seen=at("lever"), end=0.6, step=1e-3, theory=5e-4, kink=1e-3,
        motion=lambda t: columns(rate * t - 0.5 * (mu * N - torque) / INERTIA * np.square(t)),
        still=(torque / stick,), poles=(1j * math.sqrt(stick / INERTIA),),
    )  # fmt: skip
