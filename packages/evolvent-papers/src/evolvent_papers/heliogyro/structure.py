"""The system of a case: body, spools, blades and their loads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import parts
from evolvent.analysis.system import System
from evolvent_base.errors import InputError
from evolvent_papers.heliogyro.case import WAYS, Case

if TYPE_CHECKING:
    from evolvent.analysis.system import System


def build(case: Case, *, laws: Mapping[str, Any] | None = None) -> System:
    """The system of a case: the part "body", and "reel-1", "blade-1" and so on.

    Parameters
    ----------
    case : Case
    laws : mapping, see `run`

    Notes
    -----
    Where all blades move alike one thread, "blade-1", stands for all of them.
    """
    laws = laws or {}
    body, blade, spool = case.body, case.blade, case.spool
    system = System()
    own = (
        {"mass": body.mass, "angular_velocity": (0.0, 0.0, body.rate)} if body.motion == "free" else {"rate": body.rate}
    )
    shape = parts.Cylinder(radius=0.7 * body.spool_offset, length=2.0 * spool.radius)
    system.add(parts.RigidBody(motion=body.motion, inertia=body.inertia, shape=shape, **own), "body")
    symmetric = _symmetric(case, laws)
    lag = spool.start_lag if body.rate >= 0.0 else -spool.start_lag
    of_blades = blade.model_dump(exclude={"young_modulus"}) | {
        "wound_mass": "carried" if case.carried else "ignored",
        "stiffness": blade.segment_stiffness,
        "thickness": spool.film_thickness,
    }
    force, event = (law_and_parameters(laws, name) for name in ("force", "event"))
    for k in range(1 if symmetric else body.blades):
        reel, name, turn = f"reel-{k + 1}", f"blade-{k + 1}", 2.0 * np.pi * k / body.blades
        X = np.array([np.cos(turn), np.sin(turn), 0.0])
        Y = np.array([-np.sin(turn), np.cos(turn), 0.0])
        axes = {"payout_axis": tuple(X), "spool_axis": tuple(Y), "centre": tuple(body.spool_offset * X)}
        system.add(parts.Reel(body="body", radius=spool.radius, drive=_drive(case, laws, k), **axes), reel)
        direction = tuple(np.cos(lag) * X - np.sin(lag) * Y)
        copies = body.blades if symmetric else 1
        system.add(parts.Thread(reel=reel, direction=direction, multiplicity=copies, **of_blades), name)
        if case.sunlight is not None:
            system.add(parts.Radiation(along=name, width=blade.width, **case.sunlight.model_dump()))
        if force is not None:
            system.add(parts.Load(along=name, law=force[0], parameters=force[1]))
    if case.spin_up is not None:
        system.add(_spin_up(case), "spin-up")
    if event is not None:
        system.add(parts.Event(law=event[0], parameters=event[1], stops=True))
    return system


def _spin_up(case: Case) -> Any:
    """The torque about the spin axis; fixed to the body's axes, with which the blades turn."""
    given = case.spin_up
    assert given is not None
    when = {"start": given.start, "until": given.until, "ramp": given.ramp, "frame": "body"}
    if given.profile is not None:
        return parts.Load(at="body", axis=(0.0, 0.0, 1.0), profile=given.profile, **when)
    return parts.Load(at="body", torque=(0.0, 0.0, given.torque), **when)


def _symmetric(case: Case, laws: Mapping[str, Any]) -> bool:
    """Whether all blades move alike, so that one thread stands for all."""
    rates = [case.spool.rate] + [change.rate for change in case.spool.changes]
    equal = all(not isinstance(rate, tuple) or len(set(rate)) == 1 for rate in rates)
    axial = case.sunlight is None or (case.sunlight.direction[0] == 0.0 and case.sunlight.direction[1] == 0.0)
    return case.body.motion != "free" and equal and axial and laws.get("force") is None


def law_and_parameters(laws: Mapping[str, Any], name: str) -> tuple[Any, tuple[float, ...]] | None:
    """A user's law and its parameters; None if it is not given."""
    given = laws.get(name)
    if not isinstance(given, tuple):
        return None if given is None else (given, ())
    if len(given) != 2:
        raise InputError(f"laws[{name!r}] has {len(given)} entries; it must be a law, or a law and its parameters")
    try:
        return given[0], tuple(float(p) for p in given[1])
    except (TypeError, ValueError):
        raise InputError(f"the parameters of laws[{name!r}] are {given[1]!r}; they must be numbers") from None


def _drive(case: Case, laws: Mapping[str, Any], blade: int) -> Any:
    """The drive of one blade's spool."""
    spool = case.spool
    angle = spool.start_angle
    law = law_and_parameters(laws, "drive")
    if law is not None:
        for key in ("free", "feedback"):
            if getattr(spool, key) is not None:
                raise InputError(f"spool.{key} and laws['drive'] are both given; give one of them")
        if spool.start_length > 0.0:
            raise InputError(
                "spool.start_length and laws['drive'] are both given; the drive's angle at t = 0 "
                "sets the deployed length"
            )
        return parts.LawDrive(law=law[0], parameters=law[1])
    if spool.free is not None:
        return parts.FreeSpool(angle=angle, **spool.free.model_dump())
    if spool.feedback is not None:
        loop, segment = spool.feedback, case.blade.length / case.blade.nodes
        return parts.FeedbackDrive(
            law=loop.law, variables=loop.variables(f"blade-{blade + 1}", segment), constants=loop.constants or None,
            sensor=loop.sensor, limits=loop.limits, angle=angle, rate=loop.rate,
        )  # fmt: skip
    if spool.table is not None:
        time, rate = zip(*spool.table, strict=True)
        if time[0] != 0.0:
            raise InputError(f"spool.table starts at {time[0]:g} s; its first row must be at 0 s")
        return parts.TableDrive(time=time, rate=rate, start=angle)
    if spool.rate is None:
        raise InputError(
            f"spool.rate is missing; give it, such as '3.5 rad/s', or {', '.join(f'spool.{way}' for way in WAYS)}"
        )

    def own(rate: float | tuple[float, ...]) -> float:
        return rate[blade] if isinstance(rate, tuple) else rate

    steps = [(change.time, change.ramp, own(change.rate)) for change in spool.changes]
    if spool.ramp > 0.0:
        return parts.RampDrive(rate=0.0, angle=angle, steps=[(0.0, spool.ramp, own(spool.rate)), *steps])
    return parts.RampDrive(rate=own(spool.rate), angle=angle, steps=steps)
