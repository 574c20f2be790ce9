"""The parts of a case: half a satellite of two blades, or one part of N."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import parts
from evolvent.analysis.system import System
from evolvent.closed_forms import blade_moments, rotor_inertia
from evolvent.elements.materials import Material
from evolvent.elements.shapes import Strip
from evolvent_papers.film_blade.case import Case

if TYPE_CHECKING:
    from evolvent.analysis.system import System

#: Moments of inertia of the tip mass over its mass, in widths squared: of a bar along the chord, and about its axis.
BAR, AXIS = 1.0 / 12.0, 1.0 / 300.0


def build(case: Case, *, laws: Mapping[str, Any] | None = None) -> System:
    """The parts "body", "blade", "tip", and the joints "spin", "root" and "bar".

    Notes
    -----
    All blades move alike, so that one is computed, with the body's moment of inertia over their number. A blade whose
    root is free starts straight at the lag of a thread, with the velocities of its steady pay-out; one whose root is
    held starts radially. The angular momentum is that of the case; film that is not out is a mass at the root.
    """
    body, blade, out, rotor = case.body, case.blade, case.payout, case.rotor
    lag = case.steady_lag if blade.root == "free" and out.ramp == 0.0 else 0.0
    speed = out.rate if out.ramp == 0.0 else 0.0
    mass, _, _ = blade_moments(rotor, out.start)
    wound = rotor.line_density * (out.length - out.start) * body.root_offset**2
    momentum = case.momentum + body.blades * mass * body.root_offset * speed * math.sin(lag)
    spin = momentum / (rotor_inertia(rotor, out.start, lag) + body.blades * wound)
    along, across = np.array([math.cos(lag), -math.sin(lag), 0.0]), np.array([math.sin(lag), math.cos(lag), 0.0])
    normal = math.cos(blade.pitch) * np.array([0.0, 0.0, 1.0]) - math.sin(blade.pitch) * across
    root = (body.root_offset, 0.0, 0.0)
    tip = np.array(root) + out.start * along
    turn = (0.0, 0.0, spin)
    steps = ((0.0, out.ramp, out.rate),) if out.ramp else ()

    system = System(title=case.title)
    shape = parts.Cylinder(radius=body.root_offset, length=body.root_offset)
    inertia = body.inertia / body.blades
    system.add(
        # its mass does not count, as its axis is fixed
        parts.RigidBody(mass=inertia / body.root_offset**2, inertia=inertia, angular_velocity=turn, shape=shape),
        "body",
    )
    axis = {"axis": (0.0, 0.0, 1.0), "position": (0.0, 0.0, 0.0)}
    system.add(parts.Joint(a="ground", b="body", type="revolute", **axis), "spin")
    strip = parts.Rod(
        length=out.length, payout=parts.RampDrive(rate=speed, angle=out.start, steps=steps),
        section=Strip(thickness=blade.thickness, width=blade.width),
        material=Material(
            young_modulus=blade.young_modulus, poisson_ratio=blade.poisson_ratio, density=blade.density
        ),
        elements=blade.elements, stiffness_damping=blade.stiffness_damping, position=root,
        direction=tuple(along), normal=tuple(normal), velocity=(0.0, spin * body.root_offset, 0.0),
        angular_velocity=turn,
    )  # fmt: skip
    system.add(strip, "blade")
    chord = tuple(np.cross(along, normal))
    if blade.root == "free":
        hinge = parts.Joint(a="body", b="blade.root", type="universal", position=root, axis=tuple(normal), axis_b=chord)
    else:
        hinge = parts.Joint(a="body", b="blade.root", type="revolute", position=root, axis=chord)
    system.add(hinge, "root")
    square = blade.tip_mass * blade.width**2
    bar = parts.RigidBody(
        mass=blade.tip_mass, inertia=(BAR * square, AXIS * square, BAR * square), position=tuple(tip),
        velocity=tuple(np.array([-spin * tip[1], spin * tip[0], 0.0]) + speed * along), angular_velocity=turn,
    )  # fmt: skip
    system.add(bar, "tip")
    system.add(parts.Joint(a="tip", b="blade.tip", type="clamp"), "bar")
    return system
