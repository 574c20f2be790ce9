"""Joints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.kernels import calls, constraint_rows, joint, joint_tangent, sides
from evolvent.kernels.drive import LAW
from evolvent.kernels.ends import of_joint
from evolvent.model.family import End, Family, Kind, Records, record
from evolvent.model.layout import Rows
from evolvent.model.powers import COUPLED_ENERGY, JOINTS as DISSIPATED
from evolvent.model.questions import DRIVE, AdjointSupport, Law
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


def _is_held(found: Array) -> Array:
    return np.asarray((found["stiffness"] == 0.0) & ~_is_driven(found) & ~_is_gear(found))


@calls.force
def force(interval, model):
    """Forces by multipliers, and the rows of constraints; 0 over a step at whose end a joint does not hold."""
    step, n_v = interval.step, model.info.nv
    for k in range(model.joints.size):
        if step.h > 0.0 and not joint.holds(step.t + step.h, model.joints, k):
            interval.la[k] = 0.0
        stored, lost = joint.add_joint_residual(
            step.t, step.h, interval.ym, interval.la[k], k, n_v + k, model, model.F, interval.r
        )
        interval.powers[COUPLED_ENERGY] += stored
        interval.powers[DISSIPATED] += lost


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force` in a state."""
    step, n_v = interval.step, model.info.nv
    for k in range(model.joints.size):
        joint_tangent.add_joint_tangent(step.t, interval.la[k], k, n_v + k, step.scale, step.c_rate, 1.0, model, matrix)
        if model.joints[k].stiffness > 0.0 and model.joints[k].damping > 0.0 and joint.holds(step.t, model.joints, k):
            joint_tangent.add_rate_row(interval.ym, k, n_v + k, step.scale, model, matrix)


@calls.tangent
def step_tangent(interval, model, matrix):
    """Derivatives of `force` over a step; the rows are those of the end (`joint_tangent.add_end_row`), but of gears."""
    step, n_v = interval.step, model.info.nv
    for k in range(model.joints.size):
        rows = 1.0 if model.joints[k].kind == joint.GEAR else 0.0
        joint_tangent.add_joint_tangent(
            step.t + step.h, interval.la[k], k, n_v + k, step.scale, step.c_rate, rows, model, matrix
        )


@calls.measure
def measure(end, t, y, model):
    """Distances, angles and travels between the sides of all joints."""
    joint.measure_joints(end, t, y, model)


@calls.force
def explicit_force(interval, model):
    """Forces of penalties; constraints are rows of `kernels.constraint_rows`."""
    for k in range(model.joints.size):
        if joint.is_penalty(interval.step.t, interval.s, model.joints, k):
            interval.powers[DISSIPATED] += joint.add_penalty(interval.step.t, interval.ym, k, model, model.F)


@calls.energy
def explicit_energy(interval, model, out):
    """Elastic energy of penalties."""
    for k in range(model.joints.size):
        if joint.is_penalty(interval.step.t, interval.s, model.joints, k):
            joint.joint_geometry(interval.step.t, interval.ym, k, model)
            out[1] += joint.penalty_energy(model.joints, k)


@calls.force
def evaluate(interval, model):
    """Sides and forces of the joints whose multipliers are at hand."""
    for k in range(interval.la.size):
        joint.joint_geometry(interval.step.t, interval.ym, k, model)
        joint.note_reaction(k, interval.la[k], model)


@calls.stored
def coupled_energy(t, model):
    """Energy of all penalties."""
    joints, found = model.joints, 0.0
    for k in range(joints.size):
        if joints[k].stiffness > 0.0 and joint.holds(t, joints, k):
            found += 0.5 * joints[k].stiffness * joints[k].gap1 * joints[k].gap1
    return found


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
    return (turn.assembly.joint_parts[k], int(row["kind"]), *moving)


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
    """Rows of the joints that are no penalties, lengths first."""
    held = np.flatnonzero(found["stiffness"] == 0.0).tolist()
    for k in sorted(held, key=lambda k: found["kind"][k] not in (joint.DISTANCE, joint.CORD)):
        yield k, list(dict.fromkeys(of_joint(found[k], records)))


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
        "kind on index iq iv path drive law first last event switch nodes reduced mode_shape outside",
        "local along centre axis zero radius value stiffness damping until latest slack",
        "u g u0 u1 measured gap rate driven bends gap0 gap1 stored force moment",
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
    couples=lambda row, _: iter(()),  # by its multiplier
    force=force,
    tangent=tangent,
    step_tangent=step_tangent,
    measure=measure,
    explicit_force=explicit_force,
    explicit_energy=explicit_energy,
    by_rates=lambda model: bool(model.info.penalties > 0),
    changes="",
    reads_inertia=False,
    smooth=True,
    shares=Shares(),
    implicit=(
        lambda found: found["stiffness"] == 0.0, "is a constraint, which implicit methods keep without drift",
    ),
    laws=(Law(DRIVE, lambda found: (found["law"] != 0) & (found["drive"] == LAW)),),
    of_step=False,
    stiff=lambda found: found["stiffness"] > 0.0,
    adjoint=AdjointSupport(
        "its gap follows from the state and time, with all derivatives",
        timed=lambda found: (found["path"] != 0) | (found["law"] != 0),
    ),
    uneven=_uneven,
    evaluate=evaluate,
    coupled_energy=coupled_energy,
    times=("until",),
    rows=Rows(constraint_rows.JOINT, _rows),
    totals={"penalties": lambda found: int(np.sum(found["stiffness"] > 0.0))},
    at_times=True,
)  # fmt: skip
