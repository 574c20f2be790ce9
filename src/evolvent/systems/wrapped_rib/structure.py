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
    system = System()
    _add_hub(system, case, begin)
    R = rotation_matrices(begin.hub.quaternion)
    motion, contact, drive = case.hub.motion, case.contact, case.drive
    for b in range(case.rib.count):
        k = b + 1
        turn = 2.0 * np.pi * b / case.rib.count
        outwards = np.array([math.cos(turn), math.sin(turn), 0.0])
        root = tuple(R.T @ (begin.nodes[b, 0, 0] - begin.hub.position))
        system.add(_beam(case, begin.nodes[b], begin.rates[b]), f"rib-{k}")
        place, turn_stiffness = (0.0, None) if case.solver.method == IMPLICIT else case.penalty
        joint = parts.Joint(
            a=("hub", root),
            b=f"rib-{k}.root",
            type="clamp" if case.rib.root == "clamp" else "revolute",
            axis=tuple(R[:, 2]),
            stiffness=place,
            turn_stiffness=turn_stiffness,
        )
        system.add(joint, f"root-{k}")
        if case.rib.root_stiffness > 0.0 or case.rib.root_damping > 0.0:
            rest = turn + begin.directions[b]
            system.add(
                parts.RotationalSpring(
                    a="hub",
                    b=f"rib-{k}.root",
                    axis=tuple(R[:, 2]),
                    zero=tuple(R @ [math.cos(rest), math.sin(rest), 0.0]),
                    stiffness=case.rib.root_stiffness,
                    damping=case.rib.root_damping,
                ),
                f"hinge-{k}",
            )
        system.add(
            parts.CylinderContact(
                body="hub",
                beams=[f"rib-{k}"],
                radius=case.hub.radius,
                half_length=0.5 * case.hub.height,
                **_law(case, begin),
                initial_overlap=1e-3 if case.begins in ("straight", "wound") else SUNK,
            ),
            f"contact-{k}",
        )
        if drive is not None and drive.torque is not None:
            ramp = drive.ramp if drive.kind == "torque" else 0.0
            system.add(parts.DistributedTorque(beam=f"rib-{k}", torque=drive.torque, ramp=ramp), f"drive-{k}")
        if drive is not None and drive.kind == "tip":
            taut = case.rib.length * (1.0 + drive.stretch)
            system.add(
                parts.PrescribedMotion(
                    at=f"rib-{k}.tip",
                    feed=_feed(case, taut / case.hub.radius),
                    radius=case.hub.radius,
                    zero=tuple(outwards),
                    length=taut,
                ),
                f"drive-{k}",
            )
    if contact.self:
        for k in range(1, case.rib.count + 1):
            system.add(_layers(case, begin, k), f"layer-{k}")
    if motion == "driven":
        system.add(parts.PrescribedRotation(body="hub", feed=_feed(case, None)), "turn")
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
    from evolvent import elements, parts

    rib, damping = case.rib, case.damping
    section: Any = elements.Rectangle(thickness=rib.thickness, width=rib.width)
    if rib.tip_thickness is not None:
        section = elements.Taper(root=section, tip=elements.Rectangle(thickness=rib.tip_thickness, width=rib.width))
    return parts.Beam(
        length=rib.length,
        section=section,
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


def _feed(case: Case, whole: float | None) -> RampDrive:
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
