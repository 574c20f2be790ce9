"""Observations of loads: their values, power and work."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly import families
from evolvent.flow.inventory import inventory
from evolvent.kernels import beam_loads, flexible
from evolvent.kernels import loads as kernels
from evolvent.kernels.profile import profile
from evolvent.kernels.thread import load_resultant
from evolvent.model import N_INVENTORY
from evolvent.results.observe.law_loads import law_values, line_resultant, node_vectors
from evolvent.results.observe.threads import copies_drawn
from evolvent.results.observe.variables import Observed, cross, dot, turned
from evolvent.results.observe.view import View

Array = np.ndarray
#: Start, end and ramp of a load, s, and the index of its profile in the parameters, -1 for none.
Times = tuple[float, float, float, int]


def observe_load(view: View, name: str) -> Observed:
    """Force or torque at a marker, or the resultant of a load along a thread."""
    found, row = Observed(), view.model.loads[view.index(name)]
    if row["kind"] < kernels.AT_MARKER:
        return observe_thread_load(view, view.index(name))
    part = view.part(name)
    if getattr(part, "kind", "") == "line-load":
        return _observe_rod_load(view, view.index(name), view.assembly.parts[part.beam])
    first, last = int(row["first"]), int(row["last"])
    values = view.model.parameters[first:last]
    is_panel = bool(row["kind"] == kernels.PANEL)
    at = first + kernels.PROFILE if values.size > kernels.PROFILE and not is_panel else -1
    times = (float(values[kernels.START]), float(values[kernels.END]), float(values[kernels.RAMP]))
    after = strength(view, *times, at)
    marker = view.model.markers[int(row["target"])]
    vector = np.broadcast_to(values[:3], (view.t.size, 3))
    x, v = view.marker(int(row["target"]))
    is_torque = bool(row["kind"] == kernels.TORQUE)
    if is_torque:
        pose = view.pose(int(marker["index"]))
        v = pose.w
    if row["law"] != 0:
        given = np.concatenate([x, pose.R.reshape(-1, 9)], axis=1) if is_torque else x
        vector = law_values(view, int(row["law"]), int(row["law_first"]), int(row["law_last"]), given, v)
    if is_panel:
        n, (specular, diffuse) = turned(view.pose(int(marker["index"])).R, values[7:10]), values[10:12]
        size = float(np.linalg.norm(values[:3])) or 1.0
        c = (n @ values[:3] / size)[:, None]  # `kernels.loads.panel_force`
        across = c * size * (2.0 * specular * np.abs(c) + 2.0 / 3.0 * diffuse)
        vector = np.abs(c) * (1.0 - specular) * values[:3] + across * n
    if values[kernels.FRAME] != 0.0:
        vector = turned(view.pose(int(marker["index"])).R, vector)
    _add_vector(found, after[:, None] * vector, x, "torque" if is_torque else "force")
    power = dot(vector, v)
    steady = row["law"] == 0 and not is_panel and not is_torque and values[kernels.FRAME] == 0.0
    _add_work(found, view, power, (*times, at), along=dot(vector, x) if steady else None)
    return found


def _observe_rod_load(view: View, index: int, rod: Any) -> Observed:
    """Resultant of a line load on a rod, whose rows are the forces at its nodes."""
    found, shares = Observed(), rod.centres()[0]
    rows = view.model.loads[index : index + shares.size]
    size = int(rows[0]["last"] - rows[0]["first"])
    values = view.model.parameters[int(rows[0]["first"]) :][:size]
    at = int(rows[0]["first"]) + kernels.PROFILE if size > kernels.PROFILE else -1
    times = (float(values[kernels.START]), float(values[kernels.END]), float(values[kernels.RAMP]))
    after, steady = strength(view, *times, at), rows[0]["law"] == 0
    force, middle = np.zeros((view.t.size, 3)), np.zeros((view.t.size, 3))
    power, along = np.zeros(view.t.size), np.zeros(view.t.size)
    for row, share in zip(rows, shares, strict=True):
        vector = np.broadcast_to(view.model.parameters[int(row["first"]) :][:3], (view.t.size, 3))
        x, v = view.marker(int(row["target"]))
        if row["law"] != 0:
            own = law_values(view, int(row["law"]), int(row["law_first"]), int(row["law_last"]), x, v)
            vector = share * own
        force, middle, power = force + vector, middle + share / float(rod.length) * x, power + dot(vector, v)
        along += dot(vector, x)
    _add_vector(found, after[:, None] * force, middle, "force")
    _add_work(found, view, power, (*times, at), along=along if steady else None)
    return found


def observe_thread_load(view: View, index: int) -> Observed:
    """Resultant on the released thread, and the work on all copies that the thread stands for."""
    found, model = Observed(), view.model.copy()
    thread = model.threads[int(model.loads["target"][index])]
    sums, values, power = np.empty(N_INVENTORY), np.empty((view.t.size, 6)), np.empty(view.t.size)
    for k, (t, y, s) in enumerate(zip(view.t.tolist(), view.y, view.s, strict=True)):
        inventory(t, y, s, model, sums)  # it places the nodes
        power[k] = load_resultant(t, s, model, index, values[k])
    _add_vector(found, values[:, :3], values[:, 3:], "force")
    what = "resultant of the load on the released thread" + (", of one copy" if thread["copies"] > 1 else "")
    found.vector("force", values[:, :3], "N", f"{what}, inertial axes")
    found.vector("position", values[:, 3:], "m", "middle of the released thread, inertial axes")
    if thread["copies"] > 1:
        found.drawn[0]["forces"]["copies"] = copies_drawn(view, thread)
    _add_work(found, view, power)
    return found


def strength(view: View, start: float, end: float, ramp: float, at: int) -> Array:
    """Factor of a load just after each sample, (nt,).

    It acts from its start to its end, grows smoothly over `ramp`, and follows the profile at the point `at` of the
    parameters (-1 for none): `kernels.profile`.
    """
    t, near = view.t.copy(), 1e-9 * max(float(np.ptp(view.t)), 1e-300)
    for stop in (start, end):
        t[np.abs(t - stop) < near] = stop
    return strength_at(view, t, start, end, ramp, at)


def strength_at(view: View, t: Array, start: float, end: float, ramp: float, at: int) -> Array:
    """Factor of a load at times t (n,): `strength`."""
    s = np.clip((t - start) / ramp, 0.0, 1.0) if ramp > 0.0 else np.ones(t.size)
    found = s * s * (3.0 - 2.0 * s)
    if at >= 0:
        found = found * np.array([profile(time, at, view.model) for time in t.tolist()])
    return np.where((t >= start) & (t < end), found, 0.0)


def observe_beam_load(view: View, name: str) -> Observed:
    """Force at a beam's node, resultant force of a line load, or torque of one spread over the mass."""
    found, row = Observed(), view.model.flexible.beam_loads[view.index(name)]
    at = int(row["first"]) if row["law"] == 0 and row["last"] > row["first"] else -1
    times = (float(row["start"]), float(row["end"]), float(row["ramp"]))
    after = row["value"] * strength(view, *times, at)
    nodes, rates = view.nodes(int(row["beam"]))
    if families.follows(view.model.flexible.beam_loads)[view.index(name)]:
        _add_following(found, view, row, after, (*times, at))
        return found
    if row["kind"] == beam_loads.POINT:
        on = (int(row["iq"]) - int(view.model.flexible.beams["iq"][row["beam"]])) // 3
        what = "force" if on % nodes.shape[2] == 0 else "generalized_force"
        _add_vector(found, after[:, None] * row["axis"], nodes[:, on // nodes.shape[2], 0], what)
        power = view.coordinates(int(row["iv"])) @ row["axis"]
    elif row["kind"] == beam_loads.LINE:
        length = float(view.model.flexible.beams["length"][row["beam"]])
        beam, elements = view.model.flexible.beams[row["beam"]], view.model.flexible.elements
        own = slice(int(beam["first_element"]), int(beam["first_element"] + beam["elements"]))
        middle, moves = (mean_of(values, elements["length"][own]) for values in (nodes, rates))
        _add_vector(found, length * after[:, None] * row["axis"], middle, "force")
        power = length * moves @ row["axis"]
    else:
        place = np.broadcast_to(row["centre"], (view.t.size, 3))
        _add_vector(found, after[:, None] * row["axis"], place, "torque")
        power = spread_rate(view, row, nodes)
    along = None
    if row["kind"] == beam_loads.POINT:
        along = view.coordinates(int(row["iq"])) @ row["axis"]
    elif row["kind"] == beam_loads.LINE:
        along = length * middle @ row["axis"]
    value = float(row["value"])
    _add_work(found, view, value * power, (*times, at), along=None if along is None else value * along)
    return found


def _add_following(found: Observed, view: View, row: Any, after: Array, times: Times) -> None:
    """Add a moment, a follower force or a load by a law on a beam."""
    nodes, rates = view.nodes(int(row["beam"]))
    if row["kind"] == beam_loads.LINE:
        vector, power = line_resultant(view, row, nodes, rates)
        lengths = view.model.flexible.elements["length"][view.model.flexible.elements["beam"] == row["beam"]]
        x, what = mean_of(nodes, lengths), "force"
    else:
        vector, power = node_vectors(view, row)
        x, what = view.coordinates(int(row["iq"])), "torque" if row["kind"] == beam_loads.MOMENT else "force"
    _add_vector(found, after[:, None] * vector, x, what)
    _add_work(found, view, row["value"] * power, times)


def mean_of(nodes: Array, lengths: Array) -> Array:
    """Mean over a beam's length (nt, 3) of the position (or velocity) of its axis.

    Parameters
    ----------
    nodes : (nt, n + 1, vectors, 3) float; lengths : (n,) float, m, of the elements
    """
    x, slope = nodes[:, :, 0], nodes[:, :, 1]
    of_elements = 0.5 * (x[:, 1:] + x[:, :-1]) + lengths[:, None] / 12.0 * (slope[:, :-1] - slope[:, 1:])
    found: Array = np.einsum("e,tec->tc", lengths / lengths.sum(), of_elements)
    return found


def spread_rate(view: View, row: Any, nodes: Array) -> Array:
    """Rate (nt,), rad/s, with which a torque spread over a beam's mass does work: the mean turn about its axis.

    With a pitch p the rate along the screw motion, p/J z . L beside it, L the linear momentum.

    Notes
    -----
    Force per mass T z x (r - c)/J, J = int |z x (r - c)|^2 dm: power T/J z . H, H the angular momentum about c. J is
    the angular momentum about the axis of the velocities z x (r - c).
    """
    z, c, beam = row["axis"], row["centre"], view.model.flexible.beams[row["beam"]]
    sums, first = view.beam_sums(int(row["beam"])), int(beam["first_element"])
    last, at, size = first + int(beam["elements"]), int(beam["iv"]), nodes[0].size
    arms = nodes.copy()
    arms[:, :, 0] -= c
    turning = cross(z, arms).reshape(view.t.size, size)
    inertia, out = np.empty(view.t.size), np.empty(6)
    for k, y in enumerate(view.y.copy()):
        y[at : at + size], out[:] = turning[k], 0.0
        flexible.beam_momenta(y, first, last, view.model, out[:3], out[3:])
        inertia[k] = z @ (out[3:] - np.cross(c, out[:3]))
    found: Array = ((sums.angular - cross(c, sums.linear)) @ z + float(row["pitch"]) * (sums.linear @ z)) / inertia
    return found


def _add_vector(found: Observed, values: Array, x: Array, what: str) -> None:
    unit = "N" if what == "force" else "N m"
    text = "force on the slope" if what == "generalized_force" else what
    found.vector(what, values, unit, f"{text} that acts, inertial axes")
    found.vector("position", x, "m", "where it acts, inertial axes")
    found.drawn = [{"forces": {"points": "position", "vectors": what, "unit": unit}}]
    found.plots = [what]


def _add_work(
    found: Observed, view: View, power: Array, times: Times | None = None, *, along: Array | None = None
) -> None:
    """Power of a load, and its work.

    Parameters
    ----------
    power : (nt,) float, W, of the load at the factor 1
    times : start, end, ramp and profile, on which the factor depends (`strength`); None where it is always 1
    along : (nt,) float, J, integral of `power`, where it is known at the samples
    """
    factor = np.ones(view.t.size) if times is None else strength(view, *times)
    work = np.zeros(view.t.size)
    np.cumsum(_work_of_intervals(view, power, times, along), out=work[1:])
    found.scalar("power", factor * power, "W", "power of the load")
    text = "work since the first sample, of the power interpolated between the samples times the load's course in time"
    found.scalar("work", work, "J", text)


def _work_of_intervals(view: View, power: Array, times: Times | None, along: Array | None) -> Array:
    """Work between samples, (nt - 1,), by Gauss' rule on the pieces between the breaks of the load.

    The power at the factor 1 is linear between the samples, or the slope of the cubic through its integrals.
    """
    t, n = view.t, max(view.t.size - 1, 0)
    if times is None or n == 0:
        return np.asarray(0.5 * (power[1:] + power[:-1]) * np.diff(t))
    start, end, ramp, _ = times
    breaks = np.array([start, start + ramp, end, *view.model.breaks])
    breaks = breaks[(breaks > t[0]) & (breaks < t[-1])]
    edges = np.unique(np.concatenate([t, breaks]))
    h = np.diff(edges)
    place = np.clip(np.searchsorted(t, 0.5 * (edges[1:] + edges[:-1])) - 1, 0, n - 1)
    points, weights = np.polynomial.legendre.leggauss(4)
    found, step = np.zeros(n), np.diff(t)
    for point, weight in zip(points, weights, strict=True):
        at = edges[:-1] + 0.5 * (1.0 + point) * h
        s, p0, p1 = (at - t[place]) / step[place], power[place], power[place + 1]
        rate = (1.0 - s) * p0 + s * p1
        if along is not None:
            mean = (along[place + 1] - along[place]) / step[place]
            rate = rate + 6.0 * s * (1.0 - s) * (mean - 0.5 * (p0 + p1))
        np.add.at(found, place, 0.5 * weight * h * strength_at(view, at, *times) * rate)
    return found
