"""Observations of loads: their values, power and work."""

from __future__ import annotations

import numpy as np

from evolvent import jit
from evolvent.kernels import beam_loads
from evolvent.kernels import loads as kernels
from evolvent.kernels.profile import profile, window
from evolvent.observe.variables import Observed, dot, turned
from evolvent.observe.view import View

Array = np.ndarray


def observe_load(view: View, name: str) -> Observed:
    """Force or torque at a marker; loads along threads have no single value."""
    found, row = Observed(), view.model.loads[view.index(name)]
    if row["kind"] < kernels.AT_MARKER:
        return found
    first, last = int(row["first"]), int(row["last"])
    values = view.model.parameters[first:last]
    at = first + kernels.PROFILE if values.size > kernels.PROFILE else -1
    strength = _strength(view, values[kernels.START], values[kernels.END], values[kernels.RAMP], at)
    vector = np.broadcast_to(values[:3], (view.t.size, 3))
    marker = view.model.markers[int(row["target"])]
    if values[kernels.FRAME] != 0.0:
        vector = turned(view.pose(int(marker["index"])).R, values[:3])
    x, v = view.marker(int(row["target"]))
    is_torque = bool(row["kind"] == kernels.TORQUE)
    if is_torque:
        v = view.pose(int(marker["index"])).w
    _add(found, view, vector * strength[:, None], x, v, is_torque=is_torque)
    return found


def observe_beam_load(view: View, name: str) -> Observed:
    """Force at a beam's node; loads spread over beams have no single value."""
    found, row = Observed(), view.model.flexible.beam_loads[view.index(name)]
    at = int(row["first"]) if row["last"] > row["first"] else -1
    strength = row["value"] * _strength(view, row["start"], row["end"], row["ramp"], at)
    if row["kind"] == beam_loads.FIELD:
        found.scalar("torque", strength, "N m", "torque about its axis that is spread over the beam")
        found.plots = ["torque"]
        return found
    force = strength[:, None] * row["axis"]
    if row["kind"] == beam_loads.LINE:
        found.vector("force_per_length", force, "N m-1", "force per length of the beam, inertial axes")
        found.plots = ["force_per_length"]
        return found
    x, v = view.coordinates(int(row["iq"])), view.coordinates(int(row["iv"]))
    _add(found, view, force, x, v, is_torque=False)
    return found


def _strength(view: View, start: float, end: float, ramp: float, at: int) -> Array:
    """Factor of a load over time: its window, times its profile at the place `at` of the parameters (-1 for none)."""
    found = np.array([window(float(t), float(start), float(end), float(ramp)) for t in view.t])
    if at >= 0:
        jit.load([profile])
        found = found * np.array([profile(float(t), at, view.model) for t in view.t])
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
