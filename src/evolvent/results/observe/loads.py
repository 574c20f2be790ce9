"""Observations of loads: their values, power and work."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly import families
from evolvent.kernels import beam_loads, loads as kernels
from evolvent.kernels.profile import profile
from evolvent.model import RESULTS
from evolvent.results.observe.threads import copies_drawn
from evolvent.results.observe.variables import Observed, dot
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
        return _observe_rod_load(view, view.index(name), view.assembly.parts[part.part])
    first, last = int(row["first"]), int(row["last"])
    values = view.model.parameters[first:last]
    is_panel = bool(row["kind"] == kernels.PANEL)
    at = first + kernels.PROFILE if values.size > kernels.PROFILE and not is_panel else -1
    times = (float(values[kernels.START]), float(values[kernels.END]), float(values[kernels.RAMP]))
    after = strength(view, *times, at)
    vector, power = fields_of(view, "loads", view.index(name))
    x, _ = view.marker(int(row["target"]))
    is_torque = bool(row["kind"] == kernels.TORQUE)
    _add_vector(found, after[:, None] * vector, x, "torque" if is_torque else "force")
    steady = row["law"] == 0 and not is_panel and not is_torque and values[kernels.FRAME] == 0.0
    _add_work(found, view, power, (*times, at), along=dot(vector, x) if steady else None)
    return found


def fields_of(view: View, family: str, index: int | slice) -> tuple[Array, Array]:
    """Force or torque (nt, 3) and power (nt,) of a load at the factor 1."""
    fields = view.fields[family]
    return fields["vector"][:, index], fields["rate"][:, index]


def _observe_rod_load(view: View, index: int, rod: Any) -> Observed:
    """Resultant of a line load on a rod, whose rows are the forces at its nodes."""
    found, shares = Observed(), rod.centres()[0]
    rows = view.model.loads[index : index + shares.size]
    size = int(rows[0]["last"] - rows[0]["first"])
    values = view.model.parameters[int(rows[0]["first"]) :][:size]
    at = int(rows[0]["first"]) + kernels.PROFILE if size > kernels.PROFILE else -1
    times = (float(values[kernels.START]), float(values[kernels.END]), float(values[kernels.RAMP]))
    after, steady = strength(view, *times, at), rows[0]["law"] == 0
    vectors, powers = fields_of(view, "loads", slice(index, index + shares.size))
    x = np.stack([view.marker(int(row["target"]))[0] for row in rows], axis=1)
    middle = np.einsum("n,tnc->tc", shares / float(rod.length), x)
    _add_vector(found, after[:, None] * vectors.sum(axis=1), middle, "force")
    along = np.einsum("tnc,tnc->t", vectors, x) if steady else None
    _add_work(found, view, powers.sum(axis=1), (*times, at), along=along)
    return found


def observe_thread_load(view: View, index: int) -> Observed:
    """Resultant on the released thread, and the work on all copies that the thread stands for."""
    found, thread = Observed(), view.model.threads[int(view.model.loads["target"][index])]
    vector, power = fields_of(view, "loads", index)
    middle, *words = RESULTS["loads"]["middle"]
    _add_vector(found, vector, view.fields["loads"]["middle"][:, index], "force")
    what = "resultant of the load on the released thread" + (", of one copy" if thread["copies"] > 1 else "")
    found.vector("force", vector, "N", f"{what}, inertial axes")
    found.vector(middle, view.fields["loads"]["middle"][:, index], *words)
    if thread["copies"] > 1:
        found.drawn[0]["forces"]["copies"] = copies_drawn(view, thread)
    _add_work(found, view, power)
    return found


def strength(view: View, start: float, end: float, ramp: float, at: int) -> Array:
    """Factor of a load just after each sample, (nt,), with the load factor of equilibria, where ramps are over.

    It acts from its start to its end, grows smoothly over `ramp`, and follows the profile at the point `at` of the
    parameters (-1 for none): `kernels.profile`.
    """
    ramp = ramp if view.solution.path is None else 0.0
    t, near = view.t.copy(), 1e-9 * max(float(np.ptp(view.t)), 1e-300)
    for stop in (start, end):
        t[np.abs(t - stop) < near] = stop
    found: Array = view.load_factor * strength_at(view, t, start, end, ramp, at)
    return found


def strength_at(view: View, t: Array, start: float, end: float, ramp: float, at: int) -> Array:
    """Factor of a load at times t (n,): `strength`."""
    s = np.clip((t - start) / ramp, 0.0, 1.0) if ramp > 0.0 else np.ones(t.size)
    found = s * s * (3.0 - 2.0 * s)
    if at >= 0:
        found = found * np.array([profile(time, at, view.model) for time in t.tolist()])
    return np.where((t >= start) & (t < end), found, 0.0)


def observe_beam_load(view: View, name: str) -> Observed:
    """Force at a beam's node, resultant force of a line load, or torque of one spread over the mass."""
    found, row = Observed(), view.model.beam_loads[view.index(name)]
    at = int(row["first"]) if row["law"] == 0 and row["last"] > row["first"] else -1
    times = (float(row["start"]), float(row["end"]), float(row["ramp"]))
    after, (vector, power) = strength(view, *times, at), fields_of(view, "beam_loads", view.index(name))
    beam, (nodes, _) = view.model.beams[row["beam"]], view.nodes(int(row["beam"]))
    follows, what = families.follows(view.model.beam_loads)[view.index(name)], "force"
    along: Array | None = None
    if row["kind"] == beam_loads.LINE:
        own = slice(int(beam["first_element"]), int(beam["first_element"] + beam["elements"]))
        place = mean_of(nodes, view.model.elements["length"][own])
        along = None if follows else dot(vector, place)
    elif row["kind"] == beam_loads.FIELD:
        place, what = np.broadcast_to(row["centre"], (view.t.size, 3)), "torque"
    else:
        on = (int(row["iq"]) - int(beam["iq"])) // 3
        place = nodes[:, on // nodes.shape[2], 0]
        along = None if follows else dot(vector, view.coordinates(int(row["iq"])))
        if row["kind"] == beam_loads.MOMENT:
            what = "torque"
        elif on % nodes.shape[2] != 0:
            what = "generalized_force"
    _add_vector(found, after[:, None] * vector, place, what)
    _add_work(found, view, power, (*times, at), along=along)
    return found


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
