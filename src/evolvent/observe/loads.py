"""Observations of loads: their values, power and work."""

from __future__ import annotations

import numpy as np

from evolvent.observe.variables import Observed, dot, turned
from evolvent.observe.view import View

Array = np.ndarray


def observe_load(view: View, name: str) -> Observed:
    """Force or torque at a marker; loads along threads have no single value."""
    from evolvent.kernels import loads as kernels
    from evolvent.kernels.springs import ON_BODY

    found, row = Observed(), view.model.loads[view.index(name)]
    if row["kind"] < kernels.AT_MARKER:
        return found
    values = view.model.parameters[int(row["first"]) : int(row["last"])]
    acts = ((view.t >= values[4]) & (view.t < values[5]))[:, None]
    force = np.broadcast_to(values[:3], (view.t.size, 3)) * acts
    marker = view.model.markers[int(row["target"])]
    if values[3] != 0.0:
        force = turned(view.pose(int(marker["index"])).R, values[:3]) * acts
    x, v = view.marker(int(row["target"]))
    is_torque = row["kind"] == kernels.TORQUE
    if is_torque and marker["kind"] == ON_BODY:
        v = view.pose(int(marker["index"])).w
    _add(found, view, force, x, v, is_torque=is_torque)
    return found


def observe_beam_load(view: View, name: str) -> Observed:
    """Force at a beam's node; loads spread over beams have no single value."""
    from evolvent.kernels import beam_loads as kernels

    found, row = Observed(), view.model.flexible.beam_loads[view.index(name)]
    strength = np.array([kernels.strength(row, t) for t in view.t])
    if row["kind"] != kernels.POINT:
        found.scalar(
            "strength", strength, "N m" if row["kind"] == kernels.FIELD else "1", "value of the load over time"
        )
        return found
    force = strength[:, None] * row["axis"]
    x, v = view.coordinates(int(row["iq"])), view.coordinates(int(row["iv"]))
    _add(found, view, force, x, v, is_torque=False)
    return found


def _add(found: Observed, view: View, force: Array, x: Array, v: Array, *, is_torque: bool) -> None:
    what, unit = ("torque", "N m") if is_torque else ("force", "N")
    power = dot(force, v)
    found.vector(what, force, unit, f"{what} that acts, inertial axes")
    found.vector("position", x, "m", "where it acts, inertial axes")
    found.scalar("power", power, "W", "power of the load")
    steps = np.diff(view.t) * 0.5 * (power[1:] + power[:-1])
    work = np.concatenate([[0.0], np.cumsum(steps)]) if power.size else power
    found.scalar("work", work, "J", "work since the first sample, by the trapezoidal rule over the samples")
    found.drawn = [{"forces": {"points": "position", "vectors": what, "unit": unit}}]
    found.plots = [what]
