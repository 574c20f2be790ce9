"""Joints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.families.joints import joint, joint_tangent
from evolvent.families.relaxation.family import set_of
from evolvent.kernels import constraints, gaps, sides
from evolvent.kernels.drive import LAW
from evolvent.kernels.ends import of_joint
from evolvent.model.family import End, Family, Kind, Records, record
from evolvent.model.questions import DRIVE, AdjointSupport, Advice, Law, Notes, Parts, Rows, Statics
from evolvent.model.shares import Shares

Array = np.ndarray
_3 = (3,)


def _is_gear(found: Array) -> Array:
    return np.asarray(found["kind"] == joint.GEAR)


def _is_driven(found: Array) -> Array:
    return np.asarray((found["path"] != joint.STILL) | (found["kind"] == joint.ANGLE))


def _is_unbalanced(found: Array) -> Array:
    """Joints whose forces on both sides need not lie on one line: (n,) bool.

    The damper of a soft joint pulls along the rate of a gap between two points, not along the gap.
    """
    return np.asarray((found["kind"] == joint.POINT) & (found["stiffness"] > 0.0) & (found["damping"] > 0.0))


def _turns(found: Array) -> Array:
    """Joints that hold directions: (n,) bool."""
    directions = np.isin(found["kind"], (joint.DIRECTION, joint.ANGLE, joint.GEAR))
    return np.asarray(directions | ((found["kind"] == joint.ALONG) & (found["on"][:, 0] == sides.ON_NODE)))


def _tensions(solution: Any) -> Iterator[tuple[int, Array, float, bool]]:
    """Tensions of cords over pulleys and on drums, which rods that hold a distance do not have (`Notes.tensions`)."""
    joints = solution.assembly.model.joints
    for k in np.flatnonzero(np.isin(joints["kind"], (gaps.PULLEY, gaps.CORD))).tolist():
        tension = solution.la[:, k]
        yield k, tension, float(tension.max()), joints["stiffness"][k] > 0.0


def _is_held(found: Array) -> Array:
    return np.asarray((found["stiffness"] == 0.0) & ~_is_driven(found) & ~_is_gear(found))


def _uneven(turn: Any, rows: list[int]) -> Iterator[int]:
    """Lengths that do not end on the axis, and rows of one part that together are not the same about it."""
    joints, groups = turn.model.joints, dict[tuple[Any, ...], list[int]]()
    for k in rows:
        if joints["kind"][k] in (joint.POINT, joint.DIRECTION, joint.ALONG):
            groups.setdefault(_group(turn, k), []).append(k)
        elif joints["kind"][k] not in joint.LENGTHS or not _ends_on_axis(turn, joints[k]):
            yield k
    yield from (own[0] for own in groups.values() if not _are_even(turn, own))


def _held(turn: Any, row: Any) -> list[int]:
    """Sides on bodies that do not turn."""
    return [s for s in range(3) if row["on"][s] == sides.ON_BODY and turn.still[row["index"][s]]]


def _ends_on_axis(turn: Any, row: Any) -> bool:
    return all(turn.on_axis(turn.place(row["index"][s], row["local"][s])) for s in _held(turn, row))


def _group(turn: Any, k: int) -> tuple[Any, ...]:
    """What rows must share to be the same about the axis together: their part, kind and what moves."""
    row, moving = turn.model.joints[k], []
    for side in range(3):
        still = row["on"][side] == sides.ON_BODY and turn.still[row["index"][side]]
        if row["on"][side] != sides.ON_NOTHING and not still:
            turned = tuple(np.round(row["local"][side], 12)) if row["kind"] == joint.DIRECTION or side == 2 else ()
            moving.append((side, *(int(row[key][side]) for key in ("on", "index", "iq")), turned))
    return (turn.assembly.row_parts[k], int(row["kind"]), *moving)


def _are_even(turn: Any, rows: list[int]) -> bool:
    """Whether rows of constraint together are the same about the axis: so is the space of their directions."""
    directions, value, x = [], 0.0, None
    for k in rows:
        row = turn.model.joints[k]
        held = _held(turn, row)
        if row["path"] != joint.STILL:
            return False
        for s in held:
            R, local = turn.model.bodies["R0"][row["index"][s]], row["local"][s]
            if row["kind"] == joint.DIRECTION or s == 2:
                directions.append(R @ local)
            else:
                x = turn.place(row["index"][s], local)
        if row["kind"] == joint.POINT:
            directions.append(row["along"])
        if row["kind"] == joint.ALONG and 2 not in held and (x is None or not turn.on_axis(x)):
            return False
        value = max(value, abs(float(row["value"])))
    if not directions:
        return True
    Q, d, _ = np.linalg.svd(np.array(directions).T, full_matrices=False)
    Q = Q[:, d > 1e-9 * d[0]]
    P, W = Q @ Q.T, np.cross(np.eye(3), turn.axis)
    even = float(np.abs(P @ W - W @ P).max()) <= turn.ROUND_OFF
    if value > turn.ROUND_OFF and not all(turn.along(one) for one in directions):
        return False
    arm = np.zeros(3) if x is None else x - turn.centre
    off = float(np.linalg.norm(P @ np.cross(turn.axis, arm)))
    return even and off <= turn.ROUND_OFF * max(1.0, float(np.linalg.norm(arm)))


def _rows(found: Array, records: Records) -> Iterator[tuple[int, list[End]]]:
    """Rows of the joints that are no penalties, lengths first; explicit methods have no segments of fixed length."""
    held = np.flatnonzero((found["stiffness"] == 0.0) & (found["kind"] != joint.SEGMENT)).tolist()
    for k in sorted(held, key=lambda k: found["kind"][k] not in (joint.DISTANCE, joint.CORD)):
        yield k, list(dict.fromkeys(of_joint(found[k], records)))


def _sets(model: Any, index: int) -> Iterator[tuple[str, float, str]]:
    yield "length beyond that of the start", float(set_of(model, model.joints[index])[0]), "m"


# scalar constraints, one a multiplier, or penalties (stiffness > 0), until a time; of links and guides as well. A
# side is a vector: of coordinates (on 1, at iq, iv), `local` of a body (on 0), or `local` times the slopes of a
# node (on 2, at iq, iv); the third side is the direction of ALONG; nodes: 1 where a side is of a beam; path: how
# a drive moves the row; event, switch: what releases it, event k or the latch of coordinate -2 - k, and its switch,
# 1 once released, or -1; slack: factor of `info.compliance`; latest: `until` as it was given, which an event may
# bring forward; first, last: of a segment of a thread, its thread and node; reduced: 1 + reduced body of which an
# interface node is held, or 0; mode_shape: first parameter of the shape of its modes along the row. measured:
# distance, product, travel or angle, of which the gap is the rest; u0, u1: u at both ends of an interval; force,
# moment: on the second side
JOINTS = Family(
    "joints",
    record(
        "kind on index iq iv path drive law first last event switch nodes reduced mode_shape prony prony_end branch",
        "local along centre axis zero radius value stiffness damping until latest",
        "u g u0 u1 measured gap bends stored force moment",
        on=(3,), index=(3,), iq=(3,), iv=(3,), local=(3, 3), along=_3, centre=_3, axis=_3, zero=_3, u=(3, 3), g=(3, 3),
        u0=(3, 3), u1=(3, 3), force=_3, moment=_3,
    ),
    order=290,
    results={
        "force": ("force", "N", "force of the joint on {on}, inertial axes"),
        "moment": ("moment", "N m", "moment of the joint on {on} about the joint's position, inertial axes"),
        "u": ("ends", "m", "ends a and b, inertial axes"),
        "measured": ("length", "m", "distance of the two ends"),
        "gap": ("gap", "rad", "error of the coordinate of a"),
        "stored": ("energy_elastic", "J", "elastic energy of the penalties that hold the joint"),
    },
    kinds=(
        Kind(
            "a joint by a penalty",
            which=lambda found: (found["stiffness"] > 0.0) & ~_is_gear(found), symmetric=True,
        ),
        Kind(
            "a gear by a penalty",
            which=lambda found: (found["stiffness"] > 0.0) & _is_gear(found), symmetric=True,
        ),
        Kind(
            "a gear that is a constraint",
            which=lambda found: (found["stiffness"] == 0.0) & _is_gear(found),
            symmetric=True,
        ),
        Kind(
            "a joint driven along a path",
            which=lambda found: (found["stiffness"] == 0.0) & _is_driven(found) & (found["nodes"] == 0),
            symmetric=True,
        ),
        Kind(
            "a joint driven along a path on a beam's node",
            which=lambda found: (found["stiffness"] == 0.0) & _is_driven(found) & (found["nodes"] == 1),
            symmetric=True,
        ),
        Kind(
            "a joint that is a constraint",
            which=lambda found: _is_held(found) & (found["nodes"] == 0),
            symmetric=True,
        ),
        Kind(
            "a joint that is a constraint on a beam's node",
            which=lambda found: _is_held(found) & (found["nodes"] == 1),
            symmetric=True,
        ),
    ),
    ends=of_joint,
    isolated=lambda found, _: not np.any(_is_unbalanced(found)),
    **constraints.answers(Rows(
        _rows,
        turns=_turns,
        drives=_is_driven,
        couples=lambda found: ~np.isin(found["kind"], (joint.POINT, joint.ANGLE, joint.GEAR)),
        ends=lambda found: found["kind"] != joint.GEAR,
        alone=lambda found: found["kind"] == joint.SEGMENT,
        measure=joint.measure_row,
        bend=joint.bend_row,
        force=joint.add_row_force,
        tangent=joint_tangent.add_held_joint,
        end=joint_tangent.add_end_row,
        rates=joint_tangent.add_rate_row,
        note=joint.note_reaction,
    )),
    laws=(Law(DRIVE, lambda found: (found["law"] != 0) & (found["drive"] == LAW)),),
    times=("until",),
    shares=Shares(),
    smooth=True,
    stiff=lambda found: found["stiffness"] > 0.0,
    adjoint=AdjointSupport(
        "its gap follows from the state and time, with all derivatives",
        timed=lambda found: (found["path"] != 0) | (found["law"] != 0), rates=lambda model: model.info.penalties > 0,
        mirrored=lambda found: np.isin(found["kind"], (joint.POINT, joint.DIRECTION)),
        smooth=lambda found: (found["path"] == 0) & (found["law"] == 0),
    ),
    notes=Notes(tensions=_tensions),
    parts=Parts(changes="", reads_inertia=False),
    statics=Statics(uneven=_uneven, sets=_sets),
    advice=Advice(
        implicit=(
            lambda found: found["stiffness"] == 0.0, "is a constraint, which implicit methods keep without drift",
        ),
    ),
)  # fmt: skip
