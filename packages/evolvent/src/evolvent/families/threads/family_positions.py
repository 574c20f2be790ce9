"""Threads with segments of fixed length under implicit methods and statics.

Explicit methods have the directions of their segments as coordinates. Here positions of the nodes take their place, and
each segment that is out is a constraint, a joint behind those of the parts: a node keeps the length
l0 from the next one, or at the spool the length b that is paid out from Q. Rows of wound nodes do not hold.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent.families.threads.directions import write_directions, write_positions
from evolvent.families.threads.family_lengths import deployed_lengths
from evolvent.kernels import gaps, rigid, sides, thread
from evolvent.model import zeros
from evolvent.model.questions import Positions

Array = np.ndarray


def with_positions(model: Any) -> Positions | None:
    """Threads with positions as coordinates, and their segments as joints (`State.positions`)."""
    fixed = np.flatnonzero(model.threads["kind"] == thread.INEXTENSIBLE)
    if not fixed.size:
        return None
    threads = model.threads.copy()
    threads["kind"][fixed], threads["stiffness"][fixed], threads["damping"][fixed] = thread.JOINED, 0.0, 0.0
    segments = zeros("joints", int(threads["n"][fixed].sum()))
    segments["kind"], segments["until"], segments["latest"] = gaps.SEGMENT, -np.inf, -np.inf
    segments["event"], segments["switch"], segments["on"][:, 2] = -1, -1, sides.ON_NOTHING
    segments["first"] = np.repeat(fixed, threads["n"][fixed])
    segments["last"] = np.concatenate([np.arange(n) for n in threads["n"][fixed]])
    return Positions(
        {"threads": threads}, {"joints": segments}, segments["first"].tolist(), write_positions, _count_nodes,
        "the thread {name} with segments of fixed length does not support; take it away, give it a `stiffness`, or use "
        "segments 'springs'",
    )  # fmt: skip


def _count_nodes(model: Any, time: float, s: Array) -> None:
    """Count the nodes that are out at a time, which follows from the drives."""
    for p, (row, length) in enumerate(zip(model.threads, deployed_lengths(model, np.array([time]))[0], strict=True)):
        out = np.ceil(round(float(length / row["segment"]), 9))
        s[p] = min(max(int(out), 0), int(row["n"]))


def evaluate_tensions(rhs: Callable[..., None], assembly: Any, t: Array, y: Array, s: Array, la: Array) -> None:
    """Write tensions of states (nt, ny) with positions as multipliers of the segments (`State.multipliers`).

    They are those of explicit methods, by the accelerations of the state: the multipliers of a step are means over it
    (energy-momentum), or oscillate where the method damps little.
    """
    if assembly.directions is None:
        return
    model = assembly.directions.copy()
    own, nodes = np.flatnonzero(assembly.model.constraints["alone"]), segment_nodes(assembly.model)
    dy = np.zeros_like(assembly.y)
    for k in range(t.size):
        state = y[k].copy()
        write_directions(t[k], state, s[k], model)
        model.nodes["tension"] = 0.0
        rhs(t[k], state, s[k], model, dy)
        la[k, own] = model.nodes["tension"][nodes]


def segment_nodes(model: Any) -> Array:
    """Nodes at which the rows of segments of fixed length note their tensions, in the order of the rows."""
    own = model.joints[model.joints["kind"] == gaps.SEGMENT]
    found: Array = model.threads["node"][own["first"]] + own["last"]
    return found


def hold_segments(t: float, y: Array, s: Array, model: Any) -> None:
    """Let the segments hold that are out in a state with positions, and give them their ends (`Drives.hold`)."""
    joints, threads, rows = model.joints, model.threads, model.constraints
    rigid.kinematics(t, y, model)
    for k in np.flatnonzero(joints["kind"] == gaps.SEGMENT):
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
