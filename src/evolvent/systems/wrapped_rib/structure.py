"""The system of a case: hub, ribs, their joints, contacts and drive."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.errors import InputError
from evolvent.motion import rotation_matrices
from evolvent.systems._common import refuse_laws
from evolvent.systems.wrapped_rib.case import IMPLICIT, Case
from evolvent.systems.wrapped_rib.start import Start, start

if TYPE_CHECKING:
    from evolvent.parts import RampDrive
    from evolvent.system import System

#: Angle over which a hub or a carried tip reaches its rate at least, rad: at once it would take an infinite force.
LEAST_RAMP = 0.1
#: Depth, in radii, to which a saved run may have pressed its ribs into the hub as they whipped onto it.
SUNK = 0.1
#: Stiffness of what sticks on the hub, of that of the contact.
STICK = 0.1


def build(case: Case, *, laws: Mapping[str, Any] | None = None, begin: Start | None = None) -> System:
    """The system of a case: the parts "hub", "rib-1", "root-1", "contact-1", "drive-1" and so on.

    Parameters
    ----------
    case : Case
    laws : mapping, which must be empty: the system places no law of the user's
    begin : Start, optional, of the case; found if left out

    Raises
    ------
    InputError
        If the case needs a saved run that does not fit, or a law is given.
    """
    from evolvent import parts
    from evolvent.system import System

    refuse_laws(laws, "wrapped-rib")
    begin = start(case) if begin is None else begin
    system, rib, drive, hub = System(), case.rib, case.drive, case.hub
    _add_hub(system, case, begin)
    R = rotation_matrices(begin.hub.quaternion)
    axis = tuple(R[:, 2])
    stiffness, turn_stiffness = (0.0, None) if case.solver.method == IMPLICIT else case.penalty
    cylinder = {"body": "hub", "radius": hub.radius, "half_length": 0.5 * hub.height, **_law(case, begin)}
    cylinder["initial_overlap"] = 1e-3 if case.begins in ("straight", "wound") else SUNK
    for b in range(rib.count):
        k, root = b + 1, f"rib-{b + 1}.root"
        turn = 2.0 * math.pi * b / rib.count
        place = tuple(R.T @ (begin.nodes[b, 0, 0] - begin.hub.position))
        system.add(_beam(case, begin.nodes[b], begin.rates[b]), f"rib-{k}")
        kind = "clamp" if rib.root == "clamp" else "revolute"
        hold = {"stiffness": stiffness, "turn_stiffness": turn_stiffness}
        system.add(parts.Joint(a=("hub", place), b=root, type=kind, axis=axis, **hold), f"root-{k}")
        if rib.root_stiffness > 0.0 or rib.root_damping > 0.0:
            rest = turn + begin.directions[b]
            spring = {"zero": tuple(R @ [math.cos(rest), math.sin(rest), 0.0]), "stiffness": rib.root_stiffness}
            spring["damping"] = rib.root_damping
            system.add(parts.RotationalSpring(a="hub", b=root, axis=axis, **spring), f"hinge-{k}")
        system.add(parts.CylinderContact(beams=[f"rib-{k}"], **cylinder), f"contact-{k}")
        if drive is not None and drive.torque is not None:
            ramp = drive.ramp if drive.kind == "torque" else 0.0
            system.add(parts.DistributedTorque(beam=f"rib-{k}", torque=drive.torque, ramp=ramp), f"drive-{k}")
        if drive is not None and drive.kind == "tip":
            taut = rib.length * (1.0 + drive.stretch)
            path = {"drive": _drive(case, taut / hub.radius), "radius": hub.radius, "length": taut}
            outwards = (math.cos(turn), math.sin(turn), 0.0)
            system.add(parts.PrescribedMotion(at=f"rib-{k}.tip", zero=outwards, **path), f"drive-{k}")
    for k in range(1, rib.count + 1) if case.contact.self else ():
        system.add(_layers(case, begin, k), f"layer-{k}")
    if hub.motion == "driven":
        system.add(parts.PrescribedRotation(body="hub", drive=_drive(case, None)), "turn")
    return system


def _add_hub(system: System, case: Case, begin: Start) -> None:
    """The hub as a body; a driven one spins, so that what turns it does work."""
    from evolvent import parts

    hub, at = case.hub, begin.hub
    given: dict[str, Any] = {"motion": "driven", "rate": 0.0, "orientation": tuple(at.quaternion)}
    given["shape"] = parts.Cylinder(radius=hub.radius, length=hub.height)
    if hub.motion == "free":
        given |= {"motion": "free", "mass": hub.mass, "inertia": hub.inertia, "position": tuple(at.position)}
        given |= {"velocity": tuple(at.velocity), "angular_velocity": tuple(at.rate)}
    elif hub.motion in ("spin", "driven"):
        # without a moment of its own a driven hub has a small share of the ribs', which its drive moves
        light = 1e-3 * case.strip.line_density * case.rib.length * hub.radius**2
        given |= {"motion": "spin", "inertia": light if hub.inertia is None else hub.inertia}
        given["rate"] = float(at.rate[2]) if hub.motion == "spin" else 0.0
    system.add(parts.RigidBody(**given), "hub")


def _beam(case: Case, nodes: np.ndarray, rates: np.ndarray) -> Any:
    """One rib."""
    from evolvent import parts

    rib, damping = case.rib, case.damping
    return parts.Beam(
        length=rib.length,
        section=rib.profile,
        material=rib.material,
        elements=rib.elements,
        formulation=rib.formulation,
        nodes=nodes,
        rates=rates,
        mass_damping=damping.alpha,
        stiffness_damping=damping.beta,
        damping=damping.kind,
        damped=case.damped,
    )


def _law(case: Case, begin: Start) -> dict[str, Any]:
    """Law of contact and contact points, of the hub and of the turns."""
    contact = case.contact
    return {
        "law": contact.law,
        "stiffness": begin.stiffness,
        "exponent": contact.exponent,
        "damping": contact.damping if contact.law == "paper" else contact.dissipation,
        "points": contact.points,
        "friction": contact.friction,
        "stick_stiffness": STICK * begin.stiffness,
    }


def _layers(case: Case, begin: Start, k: int) -> Any:
    """Turns of rib k (from 1) on the turns below: its own, or those of the next rib."""
    from evolvent import parts

    rib = case.rib
    return parts.SelfContact(
        body="hub",
        over=f"rib-{k}",
        under=f"rib-{k % rib.count + 1}" if rib.count > 1 else None,
        thickness=[rib.thickness_at((i + 0.5) / rib.elements) for i in range(rib.elements)],
        width=rib.width,
        **_law(case, begin),
    )


def _drive(case: Case, whole: float | None) -> RampDrive:
    """How the hub turns, or how far a carried tip has wound; ends smoothly at the angle `whole` (rad)."""
    from evolvent import parts

    drive = case.drive
    assert drive is not None
    assert drive.rate is not None
    ramp = max(drive.ramp, 2.0 * LEAST_RAMP / abs(drive.rate))
    if whole is None:  # the hub turns against the winding sense under a rib that is held back
        return parts.RampDrive(steps=[(0.0, ramp, -drive.rate)])
    stop = min(ramp, 2.0 * LEAST_RAMP / drive.rate)
    ends = whole / drive.rate + 0.5 * ramp - 0.5 * stop
    if ends < ramp:
        raise InputError(
            f"drive.ramp is {drive.ramp:g} s, in which all of the rib would be wound at drive.rate {drive.rate:g} "
            f"rad/s; take a shorter one"
        )
    return parts.RampDrive(steps=[(0.0, ramp, drive.rate), (ends, stop, 0.0)])
