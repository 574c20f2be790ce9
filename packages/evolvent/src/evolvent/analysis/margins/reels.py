"""Margins of reels along a run: torques on the spool of what drives it and of what resists.

A thread has no position at rest for a length that is out: its tension follows from the motion. So a reel has the table
along the run alone, from its start to the end of its turning. The tension counts as inertia, from which it comes in
spin and under gravity.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis.margins.coordinates import MarginCoordinate, specified_acceleration
from evolvent.analysis.margins.factors import Standard
from evolvent.analysis.margins.keys import Margin, MarginLine
from evolvent.analysis.margins.shares import Share, with_keys
from evolvent.analysis.margins.tables import MarginTable
from evolvent.assembly.families import records
from evolvent.families.threads.part import Thread
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.profile import profile
from evolvent.model.shares import DAMPING, FRICTION, INERTIA, MOTOR
from evolvent.results.observe import observe
from evolvent_base.errors import InputError

if TYPE_CHECKING:
    from evolvent.assembly.assembled import Assembly
    from evolvent.solvers.common.solution import Solution

Array = np.ndarray
#: Share of the whole turn that counts as none.
_STILL = 1e-9


def names_of(assembly: Assembly) -> dict[str, Any]:
    """Reels with a thread, and the records of their threads."""
    own = ((part.reel, assembly.names[name]) for name, part in assembly.parts.items() if isinstance(part, Thread))
    return {reel: records(assembly.model, family)[k] for reel, (family, k) in own}


def asked_of(assembly: Assembly, keys: Margin) -> dict[str, Any]:
    """Reels that have a margin, and the records of their threads.

    Raises
    ------
    InputError
        For a driven spool without the torque of its motor, and a free one with another motor.
    """
    found = {}
    for name, thread in names_of(assembly).items():
        line = keys.lines.get(name, MarginLine())
        if line.leave_out:
            continue
        free = thread["drive"] == FREE_SPOOL
        if not free and line.torque is None:
            raise InputError(
                f"the spool of {name!r} follows a drive, whose motor the case does not describe; give "
                f"margin.lines.{name}.torque, the torque that it has at the worst, or say by "
                f"margin.lines.{name}.leave_out why it has no margin"
            )
        if free and line.torque is not None:
            raise InputError(
                f"margin.lines.{name}.torque is given, but the spool is free and has its own motor; leave it out"
            )
        found[name] = thread
    return found


def along_run(
    assembly: Assembly, name: str, thread: Any, keys: Margin, solution: Solution, known: tuple[Standard, str]
) -> MarginTable | None:
    """The table of a reel along a run; None where its spool does not turn.

    Parameters
    ----------
    name, thread : the reel, and the record of its thread
    known : the table of factors, and the evidence of what has no own
    """
    line = keys.lines.get(name, MarginLine())
    own = {key: np.asarray(v.values) for key, v in observe(solution, [name])[name].variables.items()}
    angle, rate = own["angle"], own["rate"]
    turn = float(angle[-1] - angle[0])
    if not np.isfinite(turn) or turn == 0.0:
        return None
    sense = 1.0 if turn > 0.0 else -1.0
    start, end = map(float, line.travel or (angle[0], angle[-1]))
    on = (sense * (angle - start) >= 0.0) & (sense * (end - angle) > _STILL * abs(turn))
    if not on.any():
        raise InputError(
            f"margin.lines.{name}.travel is {list(line.travel or ())!r}, but the spool turns from {angle[0]:.6g} to "
            f"{angle[-1]:.6g} rad in the run"
        )
    angle, rate, t, n = angle[on], rate[on], solution.t[on], int(on.sum())
    shares = [
        _share(f"{name}.tension", name, INERTIA, keys, known),
        _share(f"{name}.motor", name, MOTOR, keys, known),
    ]
    values = [sense * own["torque"][on]]
    if thread["drive"] == FREE_SPOOL:
        motor = own["motor_torque"][on]
        constant = np.full(n, float(thread["spool_torque"]))
        if thread["motor_profile"] >= 0:
            constant += [profile(float(one), int(thread["motor_profile"]), assembly.model) for one in t]
        if thread["motor_law"] != 0 and np.any(constant != 0.0):  # one may drive, and the other brake
            shares.append(_share(f"{name}.law", name, MOTOR, keys, known))
            values += [sense * constant, sense * (motor - constant)]
        else:
            values.append(sense * motor)
        for aspect, category, torque in (
            ("friction", FRICTION, np.full(n, float(thread["spool_friction"]))),
            ("damping", DAMPING, float(thread["spool_viscous"]) * np.abs(rate)),
        ):
            if np.any(torque != 0.0):
                shares.append(_share(f"{name}.{aspect}", name, category, keys, known))
                values.append(-torque)
    else:
        values.append(np.full(n, float(line.torque or 0.0)))
    coordinate = MarginCoordinate(
        name, -1, (), True, start, end, acceleration=specified_acceleration(line, start, end),
        zero=frozenset((*keys.zero, *line.zero)),
    )  # fmt: skip
    inertia = np.full(n, float(thread["spool_inertia"]))
    return MarginTable(coordinate, shares, angle, t, np.array(values), inertia, *known)


def _share(label: str, name: str, category: str, keys: Margin, known: tuple[Standard, str]) -> Share:
    return with_keys(Share(label, name, category, known[1], ""), keys.parts)


def labels_of(assembly: Assembly, keys: Margin) -> list[str]:
    """Names by which the key `parts` may refer to the shares of reels."""
    aspects = ("tension", "motor", "law", "friction", "damping")
    return [label for name in asked_of(assembly, keys) for label in (name, *(f"{name}.{one}" for one in aspects))]
