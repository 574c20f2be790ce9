"""The system of a case: hub, ribs, their joints, contacts and drive."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from evolvent import parts
from evolvent.analysis.system import System
from evolvent_base.dense import product
from evolvent_base.errors import InputError
from evolvent_papers.wrapped_rib.case import Case
from evolvent_papers.wrapped_rib.initial_state import Start
from evolvent_papers.wrapped_rib.keys import IMPLICIT

if TYPE_CHECKING:
    from evolvent.analysis.system import System
    from evolvent.parts import RampDrive

#: Smallest angle over which a hub or a carried tip reaches its rate, rad.
LEAST_RAMP = 0.1
#: Depth, in radii of the hub, to which the ribs of a saved run may lie in it at its end.
SUNK = 0.1
#: Stiffness of points that stick by friction, of that of the contact.
STICK = 0.1


def build(case: Case, begin: Start) -> System:
    """The system of a case: the parts "hub", "rib-1", "root-1", "contact-1", "drive-1" and so on.

    Raises
    ------
    InputError
        If a part is refused, or the drive's ramp is too long.
    """
    system, rib, drive, hub, axis = System(), case.rib, case.drive, case.hub, tuple(begin.rotation[:, 2])
    _add_hub(system, case, begin)
    hold: dict[str, Any] = {"type": "clamp" if rib.root == "clamp" else "revolute", "axis": axis}
    if case.method not in IMPLICIT:
        hold["stiffness"], hold["rotational_stiffness"] = case.penalty
    damping, law = case.damping, _law(case, begin)
    beam: dict[str, Any] = {"length": rib.length, "section": rib.profile, "material": rib.material}
    beam |= {"elements": rib.elements, "formulation": rib.formulation, "damping": damping.kind, "damped": case.damped}
    beam["shape"] = rib.shape
    beam |= {"mass_damping": damping.alpha, "stiffness_damping": damping.beta}
    sunk = 1e-3 if case.begins in ("straight", "wound") else SUNK
    for b, (nodes, rates) in enumerate(zip(begin.nodes, begin.rates, strict=True)):
        k, root, turn = b + 1, f"rib-{b + 1}.root", 2.0 * math.pi * b / rib.count
        system.add(parts.Beam(nodes=nodes, rates=rates, **beam), f"rib-{k}")
        place = tuple(product(begin.rotation.T, nodes[0, 0] - begin.hub["position"]))
        system.add(parts.Joint(a=("hub", place), b=root, **hold), f"root-{k}")
        if max(rib.root_stiffness, rib.root_damping, rib.root_friction) > 0.0 or rib.root_latch is not None:
            outwards = tuple(product(begin.rotation, [math.cos(turn), math.sin(turn), 0.0]))
            spring: dict[str, Any] = {"zero": outwards, "stiffness": rib.root_stiffness, "damping": rib.root_damping}
            spring |= {"rest": begin.rest[b], "friction": rib.root_friction, "latch": rib.root_latch}
            if rib.root_latch is not None:
                spring |= {"latch_stiffness": rib.root_latch_stiffness, "latch_damping": rib.root_latch_damping}
            system.add(parts.JointSpring(a="hub", b=root, axis=axis, **spring), f"hinge-{k}")
        system.add(parts.Contact(a=f"rib-{k}", b="hub", initial_overlap=sunk, **law), f"contact-{k}")
        if drive is not None and drive.torque is not None:
            ramp = drive.ramp if drive.kind == "torque" else 0.0
            spread = parts.Load(along=f"rib-{k}", torque=(0.0, 0.0, drive.torque), pitch=_pitch(case), ramp=ramp)
            system.add(spread, f"drive-{k}")
        if drive is not None and drive.kind == "tip":
            taut = case.strip.length * (1.0 + drive.stretch)
            path = {"drive": _drive(case, taut / hub.radius), "drum": hub.radius, "length": taut}
            path["a"] = (0.0, 0.0, case.root_height + case.rise * (1.0 + drive.stretch))
            path["anchor"] = (math.cos(turn), math.sin(turn), 0.0)
            system.add(parts.Joint(b=f"rib-{k}.tip", type="involute", **path), f"drive-{k}")
    for k in range(1, rib.count + 1) if case.contact.self else ():
        under = f"rib-{k % rib.count + 1}"  # the next one, or a single rib itself
        layer = {"thickness": [rib.thickness_of(i) for i in range(rib.elements)], "width": rib.width}
        system.add(parts.Contact(a=f"rib-{k}", b=under, around="hub", **layer, **law), f"layer-{k}")
    if hub.motion == "driven":
        system.add(parts.Joint(a="ground", b="hub", type="revolute", drive=_drive(case, None)), "turn")
    return system


def _add_hub(system: System, case: Case, begin: Start) -> None:
    """The hub as a body; a driven one spins, so that what turns it does work."""
    hub, at = case.hub, begin.hub
    given: dict[str, Any] = {"motion": "driven", "rate": 0.0, "orientation": at["orientation"]}
    if hub.motion == "free":
        given = {"motion": "free", "mass": hub.given_mass, "inertia": hub.given_inertia, **at}
    elif hub.motion in ("spin", "driven"):
        # a driven hub without its own inertia gets a small share of the ribs', which its drive moves
        light = 1e-3 * case.strip.line_density * case.rib.length * hub.radius**2
        inertia = hub.given_inertia
        given |= {"motion": "spin", "inertia": light if inertia is None and hub.motion == "driven" else inertia}
        given["rate"] = at["angular_velocity"][2] if hub.motion == "spin" else 0.0
    system.add(parts.RigidBody(shape=parts.Cylinder(radius=hub.radius, length=hub.height), **given), "hub")


def _pitch(case: Case) -> float:
    """Pitch of the screw motion along which a torque acts, m.

    On the hub a rib lies as a helix where what pulls it has the direction of the helix: the torque alone has with the
    rib's own pitch. Drag, of a hub that turns, has no part along the axis, which the torque has to add.
    """
    drive, strip = case.drive, case.strip
    assert drive is not None
    assert drive.torque is not None
    if drive.kind != "hub" or case.phase == "deploy" or drive.rate is None:
        return case.rib.pitch
    drag = case.damping.alpha * drive.rate * strip.line_density * strip.length * strip.radius**2
    return case.rib.pitch * (1.0 + drag / drive.torque)


def _law(case: Case, begin: Start) -> dict[str, Any]:
    """Law of contact and contact points, of the hub and of the turns."""
    contact = case.contact
    taken = {"paper": contact.damping, "hunt-crossley": contact.dissipation, "conservative": 0.0}
    return {
        "law": contact.law,
        "stiffness": begin.stiffness,
        "exponent": contact.exponent,
        "damping": taken[contact.law],
        "points": contact.points,
        "friction": contact.friction,
        "bristle_stiffness": STICK * begin.stiffness,
    }


def _drive(case: Case, whole: float | None) -> RampDrive:
    """Angle of the hub, or wound by a carried tip, which ends smoothly at the angle `whole` (rad)."""
    drive = case.drive
    assert drive is not None
    assert drive.rate is not None
    ramp = max(drive.ramp, 2.0 * LEAST_RAMP / abs(drive.rate))
    if whole is None:  # the hub turns against the winding sense
        return parts.RampDrive(steps=[(0.0, ramp, -drive.rate)])
    stop = min(ramp, 2.0 * LEAST_RAMP / drive.rate)
    ends = whole / drive.rate + 0.5 * ramp - 0.5 * stop
    if ends < ramp:
        raise InputError(
            f"drive.ramp is {drive.ramp:g} s, in which all of the rib would be wound at drive.rate {drive.rate:g} "
            f"rad/s; use a shorter one"
        )
    return parts.RampDrive(steps=[(0.0, ramp, drive.rate), (ends, stop, 0.0)])
