"""The body at rest on its stand, the state that the excitation gives it, and the parts of a case."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evolvent.massprops.inertia import Body, NormalModes, Pose, Stand, Start, displaced, linear_model, released, struck
from evolvent.results.motion import quaternions
from evolvent.systems.inertia_stand.case import Case

if TYPE_CHECKING:
    from evolvent.analysis.system import System


class Setup(NamedTuple):
    """What is known of a case before the body moves.

    Attributes
    ----------
    stand, body : Stand, Body
    modes : NormalModes, of the linear model at equilibrium
    loaded : int, the spring at which the excitation acts, from 1; 0 for none
    start : Start, the state that the excitation gives the body
    """

    stand: Stand
    body: Body
    modes: NormalModes
    loaded: int
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
    s, b, given = case.stand, case.body, case.excitation
    stand = Stand(
        points=s.springs, stiffness=s.stiffness, length=s.natural_length, damping=s.damping,
        lateral_stiffness=s.lateral_stiffness, lateral_damping=s.lateral_damping, support=s.support, gravity=s.gravity,
    )  # fmt: skip
    body = Body(mass=b.mass, centre=b.centre, inertia=b.tensor)
    modes = linear_model(stand, body).modes()
    if given.force is None and given.impulse is None:
        state = given.model_dump(include={"displacement", "rotation", "velocity", "rate"}, exclude_none=True)
        return Setup(stand, body, modes, 0, displaced(modes, **state))
    loaded = 0 if isinstance(given.at, tuple) else given.at
    if loaded == "best":
        loaded = 1 + int(np.argmax(least_energies(case, stand, modes)))
    point = stand.points[loaded - 1] if loaded else given.at
    if given.force is None:
        return Setup(stand, body, modes, loaded, struck(modes, given.impulse, point))
    return Setup(stand, body, modes, loaded, released(stand, body, modes, given.force, point))


def least_energies(case: Case, stand: Stand, modes: NormalModes) -> np.ndarray:
    """(n,) J, energy of the weakest of heave, roll and pitch, were the case's load to act at each spring."""
    given = case.excitation
    load, act = (given.impulse, modes.impulse) if given.force is None else (given.force, modes.release)
    return np.array([modes.energy(act(load, point))[modes.vertical].min() for point in stand.points])


def build(case: Case, *, laws: Mapping[str, Any] | None = None) -> System:
    """The parts "body", "spring-1" and so on and, of a guided body, "guide-x", "guide-z" and "guide-yaw"."""
    from evolvent import parts
    from evolvent.analysis.system import System

    setup = setup_of(case)
    stand, start, R = setup.stand, setup.start, setup.start.rotation
    system = System(gravity=(0.0, -case.stand.gravity, 0.0))
    body = parts.RigidBody(
        mass=case.body.mass,
        inertia=case.body.tensor.tolist(),
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
    if stand.support == "guided":
        along_x, along_z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
        system.add(parts.Guide(body="body", direction=along_x), "guide-x")
        system.add(parts.Guide(body="body", direction=along_z), "guide-z")
        system.add(parts.Guide(body="body", direction=along_z, axis=along_x), "guide-yaw")
    return system
