"""The body at rest on its stand, the state that the excitation gives it, and the parts of a case."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evolvent import parts
from evolvent.analysis.system import System
from evolvent.results.rotations import quaternions
from evolvent_massprops.excitation_keys import Excited, excitation_on
from evolvent_massprops.inertia import Body, NormalModes, Pose, Stand, Start, displaced, excited, linear_model
from evolvent_massprops.inertia_stand.case import Case

if TYPE_CHECKING:
    from evolvent.analysis.system import System


#: Radius of a limiter's pad, m.
PAD = 5e-3


class Setup(NamedTuple):
    """What is known of a case before the body moves.

    Attributes
    ----------
    stand, body : Stand, Body
        The body with the air that it moves; gravity as it acts on both together.
    modes : NormalModes, of the linear model at equilibrium
    excited : Excited, where the excitation acts
    start : Start, the state that the excitation gives the body
    """

    stand: Stand
    body: Body
    modes: NormalModes
    excited: Excited
    start: Start

    @property
    def equilibrium_pose(self) -> Pose:
        """The body at rest on its springs, whose tilt and stretch it has."""
        return self.modes.model.pose


@functools.lru_cache(maxsize=64)
def setup_of(case: Case) -> Setup:
    """Rest, linear modes and state at t = 0 of a case.

    Raises
    ------
    InputError
        If the springs cannot hold the body, or the excitation moves it in a way that its guides hold.
    """
    given = case.excitation
    known, known_body = known_of(case)
    mass, moments = case.added
    stand, body = known, known_body
    if case.air is not None:  # which has no weight: with it, gravity is smaller by as much as the mass is larger
        stand = dataclasses.replace(known, gravity=case.stand.gravity * case.body.mass / (case.body.mass + mass))
        body = Body(mass=case.body.mass + mass, centre=known_body.centre, inertia=case.body.tensor + moments)
    modes = linear_model(stand, body).modes()
    found = excitation_on(given, stand.points, modes)
    if found.loads:
        return Setup(stand, body, modes, found, excited(stand, body, modes, found.loads))
    state = given.model_dump(include={"displacement", "rotation", "velocity", "rate"}, exclude_none=True)
    return Setup(stand, body, modes, found, displaced(modes, **state))


def known_of(case: Case) -> tuple[Stand, Body]:
    """Stand and body of a case without the air that moves along: what a laboratory knows."""
    s, b = case.stand, case.body
    stand = Stand(
        points=s.springs, stiffness=s.stiffness, length=s.natural_length, damping=s.damping,
        lateral_stiffness=s.lateral_stiffness, lateral_damping=s.lateral_damping, support=s.support, gravity=s.gravity,
    )  # fmt: skip
    return stand, Body(mass=b.mass, centre=b.centre, inertia=b.tensor)


def build(case: Case, *, laws: Mapping[str, Any] | None = None) -> System:
    """The parts "body", "spring-1" and so on, and what guides the body.

    A guided body has "guide-x", "guide-z" and "guide-yaw"; one with limiters "limiter-1-x", "limiter-1-z" and so on.
    """
    setup = setup_of(case)
    stand, start, R = setup.stand, setup.start, setup.start.rotation
    system = System(gravity=(0.0, -float(stand.gravity), 0.0))
    body = parts.RigidBody(
        mass=float(setup.body.mass),
        inertia=setup.body.inertia.tolist(),
        position=start.position.tolist(),
        orientation=quaternions(R).tolist(),
        velocity=start.velocity.tolist(),
        angular_velocity=(R.T @ start.rate).tolist(),
    )
    system.add(body, "body")
    attached, up = stand.points - setup.body.centre, (0.0, 1.0, 0.0)
    own = ("stiffness", "damping", "length", "lateral_stiffness", "lateral_damping")
    for k, ground in enumerate(stand.ground_points):
        numbers = {name: float(getattr(stand, name)[k]) for name in own}
        ends = {"a": tuple(ground), "b": ("body", tuple(attached[k]))}
        system.add(parts.Spring(**ends, axis=up, **numbers), f"spring-{k + 1}")
    if case.stand.limiters is not None:
        _limit(system, setup, case)
    elif stand.support == "guided":
        along_x, along_z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
        system.add(parts.Joint(a="ground", b="body", type="guide", axis=along_x), "guide-x")
        system.add(parts.Joint(a="ground", b="body", type="guide", axis=along_z), "guide-z")
        system.add(parts.Joint(a="ground", b="body", type="guide", axis=along_z, axis_b=tuple(R[:, 0])), "guide-yaw")
    return system


def _limit(system: System, setup: Setup, case: Case) -> None:
    """Add a sphere on the body and a plane on the ground for every pad, apart by the clearance at equilibrium."""
    given, rest = case.stand.limiters, setup.equilibrium_pose
    assert given is not None
    points = np.array(case.stand.springs if given.points == "springs" else given.points)
    law = {"stiffness": given.stiffness, "friction": given.friction, "damping": given.damping}
    for k, place in enumerate(points):
        point = place - setup.body.centre
        at = rest.position + rest.rotation @ point
        for axis, name in ((0, "x"), (2, "z")):
            for side in (-1.0, 1.0) if abs(place[axis]) < 1e-9 else (float(np.sign(place[axis])),):
                out = side * np.eye(3)[axis]
                contact = parts.Contact(
                    a=("body", tuple(point)), b=tuple(at + (given.clearance + PAD) * out),
                    shape_a=parts.Sphere(radius=PAD), shape=parts.Plane(normal=tuple(-out)),
                    bristle_stiffness=given.bristle_stiffness,
                    bristle_damping=2.0 * float(np.sqrt(given.bristle_stiffness * case.body.mass)) / len(points),
                    initial_overlap=1.0 + abs(given.clearance) / PAD, **law,
                )  # fmt: skip
                mark = "" if abs(place[axis]) >= 1e-9 else "+" if side > 0.0 else "-"
                system.add(contact, f"limiter-{k + 1}-{name}{mark}")
