"""Threads with segments of fixed length under implicit methods and statics.

Explicit methods have the directions of their segments as coordinates. Here positions of the nodes take their place, and
each segment that is out is a constraint, a joint behind those of the parts: a node keeps the length
l0 from the next one, or at the spool the length b that is paid out from Q. Rows of wound nodes do not hold.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.checks import redundant_part
from evolvent.assembly.constraints import constraint_families, constraints_of
from evolvent.equations.fixed_lengths import write_directions, write_positions
from evolvent.equations.rhs import rhs
from evolvent.kernels import joint, rigid, sides, thread
from evolvent.solvers.common import payout
from evolvent_base.errors import InputError

Array = np.ndarray


def with_positions(assembly: Assembly, t: float = 0.0) -> Assembly:
    """The assembly with positions as coordinates of threads with segments of fixed length; itself without such threads.

    Parameters
    ----------
    t : float, s, of its state

    Raises
    ------
    InputError
        For constraints among the parts that the others imply: the release of a node has no solution by directions.
    """
    model = assembly.model
    fixed = np.flatnonzero(model.threads["kind"] == thread.INEXTENSIBLE)
    if not fixed.size:
        return assembly
    if model.constraints.size and (redundant := redundant_part(assembly, t)):
        name = next(name for name, found in assembly.names.items() if found == ("threads", int(fixed[0])))
        raise InputError(
            f"{redundant!r} is redundant: the other constraints already imply it, which the thread {name!r} with "
            f"segments of fixed length does not support; take it away, give it a `stiffness`, or use segments 'springs'"
        )
    y = assembly.y.copy()
    needs.load(model, write_positions)
    write_positions(t, y, assembly.s, model)
    threads = model.threads.copy()
    threads["kind"][fixed], threads["stiffness"][fixed], threads["damping"][fixed] = thread.JOINED, 0.0, 0.0
    segments = mdl.zeros("joints", int(threads["n"][fixed].sum()))
    segments["kind"], segments["until"], segments["latest"] = joint.SEGMENT, -np.inf, -np.inf
    segments["event"], segments["switch"], segments["on"][:, 2] = -1, -1, sides.ON_NOTHING
    segments["first"] = np.repeat(fixed, threads["n"][fixed])
    segments["last"] = np.concatenate([np.arange(n) for n in threads["n"][fixed]])
    joints = np.concatenate([model.joints, segments]).view(type(model.joints))
    families: dict[str, Any] = {name: getattr(model, name) for name in mdl.RECORDS}
    families |= {"threads": threads, "joints": joints}
    families["constraints"] = constraints = constraints_of(families)
    others = constraints["alone"] == 0
    constraints["outside"][others] = model.constraints["outside"]
    rows = constraint_families(families, model.masses, int(model.info.nq))
    of, pairs = rows["row_sides"]["row"], rows["row_pairs"]
    info = model.info.copy()
    info.bandwidth = int((of[pairs["a"]] - of[pairs["b"]]).max(initial=0))
    names = {index: name for name, (family, index) in assembly.names.items() if family == "threads"}
    found = model._replace(
        **rows, threads=threads, info=info, joints=joints, constraints=constraints, la=np.zeros(rows["rows"].size),
        A=np.zeros((rows["rows"].size, int(info.bandwidth) + 1)),
    )  # fmt: skip
    parts = np.empty(others.size, dtype=object)
    parts[others], parts[~others] = assembly.row_parts, [names[int(p)] for p in segments["first"]]
    hold_segments(t, y, assembly.s, found)
    return dataclasses.replace(assembly, model=found, y=y, row_parts=parts.tolist(), directions=model)


def given_positions(assembly: Assembly, y: Any, time: float) -> tuple[Assembly, Any]:
    """`with_positions` of an assembly and of a state of it at a time (s), or None.

    The nodes that are out then follow from the drives.
    """
    found = with_positions(assembly)
    if found is assembly or y is None or np.shape(y) != assembly.y.shape:
        return found, y
    model, s, state = assembly.model, assembly.s.copy(), np.array(y, dtype=float)
    lengths = payout.deployed_lengths(assembly, np.array([time]))[0]
    for p, row in enumerate(model.threads):
        out = np.ceil(round(float(lengths[p] / row["segment"]), 9))
        s[p] = min(max(int(out), 0), int(row["n"]))
    write_positions(time, state, s, model)
    return found, state


def evaluate_tensions(assembly: Assembly, t: Array, y: Array, s: Array, la: Array) -> None:
    """Write tensions of states (nt, ny) with positions as multipliers of the segments into la : (nt, nj).

    They are those of explicit methods, by the accelerations of the state: the multipliers of a step are means over it
    (energy-momentum), or oscillate where the method damps little.
    """
    if assembly.directions is None:
        return
    model = assembly.directions.copy()
    needs.load(model, rhs, write_directions)
    own, nodes = np.flatnonzero(assembly.model.constraints["alone"]), segment_nodes(assembly.model)
    dy = np.zeros_like(assembly.y)
    for k in range(t.size):
        state = y[k].copy()
        write_directions(t[k], state, s[k], model)
        model.nodes["tension"] = 0.0
        rhs(t[k], state, s[k], model, dy)
        la[k, own] = model.nodes["tension"][nodes]


def segment_nodes(model: mdl.Model) -> Array:
    """Nodes at which the rows of segments of fixed length note their tensions, in the order of the rows."""
    own = model.joints[model.joints["kind"] == joint.SEGMENT]
    found: Array = model.threads["node"][own["first"]] + own["last"]
    return found


def hold_segments(t: float, y: Array, s: Array, model: mdl.Model) -> None:
    """Let the segments hold that are out in a state with positions, and give them their ends."""
    joints, threads, rows = model.joints, model.threads, model.constraints
    rigid.kinematics(t, y, model)
    for k in np.flatnonzero(joints["kind"] == joint.SEGMENT):
        p, i = int(joints["first"][k]), int(joints["last"][k])
        row, count, gone = threads[p], int(s[p]), bool(s[threads.size + p])
        q, v, body = int(row["iq"]) + 3 * i, int(row["iv"]) + 3 * i, int(row["body"])
        held = i < count - gone
        rows["until"][k] = rows["latest"][k] = np.inf if held else -np.inf
        inner, outer = ((sides.ON_COORDINATES, at) for at in (1, 0))
        for side, (on, step) in enumerate((inner, outer)):
            joints["on"][k, side], joints["index"][k, side] = on, -1
            joints["iq"][k, side], joints["iv"][k, side] = q + 3 * step, v + 3 * step
        joints["value"][k] = row["segment"]
        if i + 1 >= count:
            joints["on"][k, 0], joints["index"][k, 0], joints["local"][k, 0] = sides.ON_BODY, body, row["departure"]
        if held:
            away = y[q - 3 : q] - y[q : q + 3] if i > 0 else np.zeros(3)
            length = float(np.linalg.norm(away))
            X = model.bodies["R"][body] @ row["payout_axis"]
            joints["along"][k] = away / length if length > 0.0 else X
