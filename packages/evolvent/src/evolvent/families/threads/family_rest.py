"""Threads at rest: spools that stand, and the nodes that have left them."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.families.threads.family_lengths import deployed_lengths, taken_lengths
from evolvent.kernels import markers, rigid, thread
from evolvent.kernels.drive import FREE, angles_of, drive, set_ramp
from evolvent_base.errors import InputError

Array = np.ndarray

#: Part of a segment within which the length that is out fits the nodes that have been released.
_FITS = 1e-9


def freeze(model: Any, time: float) -> Any:
    """The model with spools that stand at their angles of a time (`Drives.freeze`).

    Where thread flows from a reel to a take-up reel, both turn on at their rates, which leave its length constant.
    """
    spools = np.flatnonzero(model.threads["drive"] != FREE)
    if not spools.size:
        return model
    found = model._replace(threads=model.threads.copy())
    for p in spools:
        flow = _flow_at(model, int(p), time)
        for prefix, radius in (("", "radius"), ("take_", "take_radius")):
            row = model.threads[p]
            if row[prefix + "drive"] < 0:
                continue
            angle = angles_of(row, model, np.array([time]), prefix)[0]
            outer = row[radius] - (row["coiling"] * angle if prefix == "" else 0.0)
            rate = (flow if prefix == "" else -flow) / outer
            found = set_ramp(found, found.threads[p : p + 1], prefix, angle - rate * time, rate)
    return found


def _flow_at(model: Any, p: int, time: float) -> float:
    """Rate at which thread p flows from its reel to a take-up reel at `time`, m/s; 0 without such a reel.

    Raises
    ------
    InputError
        Where both reels change the length between them: there is no equilibrium.
    """
    row = model.threads[p]
    if row["take_drive"] < 0:
        return 0.0
    rates = []
    for prefix, radius in (("", "radius"), ("take_", "take_radius")):
        own = model.parameters[int(row[prefix + "first"]) : int(row[prefix + "last"])]
        angle, rate, _ = drive(int(row[prefix + "drive"]), own, int(row[prefix + "law"]), time)
        rates.append((row[radius] - (row["coiling"] * angle if prefix == "" else 0.0)) * rate)
    paid, taken = float(rates[0]), -float(rates[1])
    if abs(paid - taken) > _FITS * max(abs(paid), abs(taken)):
        raise InputError(
            f"a reel pays out {paid:g} m/s at {time:g} s and the take-up reel of its thread takes up {taken:g} m/s; an "
            f"equilibrium or modes need the same rate of both"
        )
    return paid


def place_nodes(assembly: Any, time: float, y: Array, s: Array, given: bool) -> None:
    """Place the nodes that are off their spools at a time, and count them (`Drives.place`).

    Of a state that is given only nodes whose positions it does not have, those of its start, are placed, on straight
    lines. Else threads are straight and not stretched, as at the start.
    """
    model, at = assembly.model, np.array([time])
    lengths = deployed_lengths(model, at)[0] - taken_lengths(model, at)[0]
    before = _departures(model, 0.0, assembly.y)
    now = _departures(model, time, y)
    for p, row in enumerate(model.threads):
        out, l0, first, released = float(lengths[p]), float(row["segment"]), int(row["iq"]), int(s[p])
        if row["drive"] == FREE or s[model.threads.size + p]:
            continue
        if row["kind"] == thread.MOVING:
            if time != 0.0 and not given:
                n, (Q0, R0), (Q, R) = int(row["n"]), before[p], now[p]
                nodes, held = y[first : first + 3 * n].reshape(-1, 3), int(row["end"] >= 0)
                away = R0.T @ (nodes[0] - Q0)
                line = out * (R @ away) / np.linalg.norm(away)
                end = _outer(model, row, y, nodes, 1, time)
                if held and end is not None:
                    line = end - Q
                nodes[held:] = Q + np.outer(1.0 - np.arange(held, n) / n, line)
            continue
        if not (released - 1.0 - _FITS) * l0 <= out <= (released + _FITS) * l0 or (released == 0 and out > 0.0):
            s[p] = min(max(int(np.ceil(round(out / l0, 9))), int(row["end"] >= 0)), int(row["n"]))
        if out > row["n"] * l0 * (1.0 + _FITS):  # which `check_lengths` allows of a thread that separates
            s[model.threads.size + p] = 1
        Q, R = now[p]
        nodes = y[first : first + 3 * int(row["n"])].reshape(-1, 3)
        if given and s[p] <= released:
            continue
        if given:
            own = assembly.y[first : first + nodes.size].reshape(-1, 3)
            while released < s[p] and np.any(nodes[released] != own[released]):  # one that has left its spool since
                released += 1
            if released == s[p]:
                continue
            outer = _outer(model, row, y, nodes, released, time)
            share = out - max(released - 1, 0) * l0
            line = outer - Q if outer is not None and share > 0.0 else (R @ row["payout_axis"]) * max(share, l0)
            fractions = (out - np.arange(released, s[p]) * l0) / max(share, l0 if outer is None else share)
            nodes[released : s[p]] = Q + fractions[:, None] * line
            continue
        if time == 0.0 and s[p] == released:
            continue
        end = _outer(model, row, y, nodes, 1, time) if row["end"] >= 0 else None
        if end is not None:
            line = (end - Q) / out if out > 0.0 else R @ row["payout_axis"]
        else:
            Q0, R0 = before[p]
            away = nodes[0] - Q0 if released else np.zeros(3)
            size = float(np.linalg.norm(away))
            line = R @ (R0.T @ away) / size if size > 0.0 else R @ row["payout_axis"]
        first_own = int(row["end"] >= 0)
        nodes[first_own : s[p]] = Q + (out - np.arange(first_own, s[p]) * l0)[:, None] * line


def _departures(model: Any, time: float, y: Array) -> list[tuple[Array, Array]]:
    """Where each thread leaves its spool, m, and the rotation of the body there, inertial axes."""
    rigid.kinematics(time, y, model)
    found = []
    for row in model.threads:
        body = model.bodies[row["body"]]
        R = np.array(body["R"])
        found.append((np.array(body["x"]) + R @ row["departure"], R))
    return found


def _outer(model: Any, row: np.record, y: Array, nodes: Array, released: int, time: float) -> Array | None:
    """Position of the last node that has left the spool; None where none has."""
    if released == 0:
        return None
    if released > 1 or row["end"] < 0:
        return np.array(nodes[released - 1])
    marker = model.markers[row["end"]]
    if marker["kind"] == markers.ON_POINT:
        return np.array(y[model.points["iq"][marker["index"]] :][:3])
    rigid.kinematics(time, y, model)
    body = model.bodies[marker["index"]]
    return np.array(body["x"]) + np.array(body["R"]) @ marker["local"]
