"""Quantities of the field, from the motion of ribs and hub, and warnings about a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent.analysis import closure
from evolvent.families.bodies.observer import attitude
from evolvent.families.contact.observer_surfaces import touching_span
from evolvent.results.observe import View
from evolvent.results.observe.variables import turned_back, unwrapped
from evolvent.view.drawing import smooth
from evolvent_papers.wrapped_rib import case_checks
from evolvent_papers.wrapped_rib.case import Case
from evolvent_papers.wrapped_rib.initial_state import Start

if TYPE_CHECKING:
    from evolvent.results.observe import View
    from evolvent.solvers.common.solution import Solution

Array = np.ndarray
#: Pivot, over the largest entry of its column, below which a run warns.
PIVOT_WARNED = 1e-13
#: Points of each element along which the angle of a rib about the hub is followed.
FOLLOWED = 8


def derived(case: Case, begin: Start, solution: Solution) -> dict[str, tuple[tuple[str, ...], Array, str, str]]:
    """Wound and touching angle, radius and largest speed of the tips, angle and torque of the hub, the end state."""
    view, count, length = View.of(solution), case.rib.count, case.rib.element_length
    ribs = [view.nodes(view.index(f"rib-{k + 1}")) for k in range(count)]
    speed = np.stack([np.linalg.norm(rates[:, -1, 0], axis=-1) for _, rates in ribs], axis=1)
    fastest = np.argmax(speed, axis=0)
    hub, index = view.pose(view.index("hub")), view.index("hub")
    lines = np.stack([smooth(x[:, :, 0], x[:, :, 1], length, FOLLOWED) for x, _ in ribs], axis=1)
    path = np.einsum("tji,tbnj->tbni", hub.R, lines - hub.x[:, None, None])  # in the hub's axes
    q, rate = attitude(view, view.model.bodies[index]), turned_back(hub.R, hub.w)
    angle = unwrapped(solution.t, 2.0 * np.arctan2(q[:, 3], q[:, 0]), rate[:, 2])
    torque = turned_back(hub.R, solution.wrenches[:, index, 3:6])
    if case.hub.motion == "free":  # whose wrench holds the gyroscopic torque as well
        torque = torque + np.cross(rate, rate @ view.model.bodies[index]["inertia"])
    per_rib, node = ("time", "rib"), ("rib", "node", "vector", "axis")
    return {
        "rib": (("rib",), np.arange(1, count + 1), "1", "rib"),
        "tip_radius": (per_rib, np.hypot(path[..., -1, 0], path[..., -1, 1]), "m", "distance of the tip from the "
                       "hub's axis"),
        "wrap_angle": (per_rib, wrap_angle(path, case.hub.radius), "rad", "angle by which the rib is wound about the "
                       "hub, as if its tail were straight along the tangent; negative in the other sense"),
        "touching_angle": (per_rib, _touching_angle(view, path, case), "rad", "angle of the hub from the root to the "
                           "last place at which the rib touches it; negative in the other sense"),
        "tip_speed_peak": (("rib",), speed[fastest, np.arange(count)], "m s-1", "largest speed of the tip, between "
                           "samples too"),
        "tip_speed_peak_time": (("rib",), solution.t[fastest], "s", "time of the largest speed of the tip"),
        "hub_torque": (("time",), torque[:, 2], "N m", "torque of the ribs on the hub about its axis"),
        "hub_angle": (("time",), angle, "rad", "angle of the hub about its axis, over any number of turns"),
        "end_coordinates": (node, np.stack([x[-1] for x, _ in ribs]), "1", "nodes at the end: positions (m), slopes "
                            "(1)"),
        "end_velocities": (node, np.stack([v[-1] for _, v in ribs]), "s-1", "rates of the nodes at the end"),
        "hinge_rest": (("rib",), begin.rest, "rad", "direction without moment of a spring in the root's hinge, from "
                       "outwards"),
    }  # fmt: skip


def wrap_angle(path: Array, radius: float) -> Array:
    """Angle by which each rib is wound, as if its tail were straight, rad; `path` (nt, ribs, n, 3) in the hub's axes.

    The tip's angle about the axis from the root on, followed along the rib, less acos(R/r) of its distance r, which is
    that of a straight tail along the tangent; negative where the rib lies the other way round. A tail that is bent
    towards the hub leaves it before: `touching_angle` is the angle up to the last place that touches.
    """
    angle = np.unwrap(np.arctan2(path[..., 1], path[..., 0]), axis=-1)
    tip = np.maximum(np.hypot(path[..., -1, 0], path[..., -1, 1]), radius)
    turned = angle[..., -1] - angle[..., 0]
    found: Array = np.sign(turned) * np.clip(np.abs(turned) - np.arccos(radius / tip), 0.0, None)
    return found


def touching_angle(path: Array, last: Array, length: float) -> Array:
    """Angle of the hub from the root to the place `last`, rad, (nt,).

    Parameters
    ----------
    path : (nt, n, 3) float, m, in the hub's axes, at even steps along the rib
    last : (nt,) float, m, length from the root to the last place that touches
    length : float, m, of the rib
    """
    angle = np.unwrap(np.arctan2(path[..., 1], path[..., 0]), axis=-1)
    step = length / (angle.shape[1] - 1)
    k = np.minimum((last / step).astype(int), angle.shape[1] - 2)
    each, part = np.arange(len(angle)), last / step - k
    found: Array = (1.0 - part) * angle[each, k] + part * angle[each, k + 1] - angle[:, 0]
    return found


def _touching_angle(view: View, path: Array, case: Case) -> Array:
    """The same of every rib, (nt, ribs), by its contact with the hub."""
    points, arc = case.contact.points, case.rib.element_length / case.contact.points
    found = []
    for b in range(case.rib.count):
        row = view.model.contact_surfaces[view.index(f"contact-{b + 1}")]
        gap = view.fields["contact_points"]["apart"][:, int(row["first"]) : int(row["last"])]
        _, last = touching_span(arc * np.arange(1, points * case.rib.elements + 1), gap)
        found.append(touching_angle(path[:, b], last, case.rib.length))
    return np.stack(found, axis=1)


def warning(case: Case, begin: Start, solution: Solution) -> str:
    """Warnings about a case and its run, sentences joined by semicolons."""
    view, t = View.of(solution), solution.t
    found = [begin.warning, *case_checks.warnings(case)]
    strain = np.abs(view.fields["elements"]["strain"].mean(axis=2)).max(axis=1)
    if strain.max() > case_checks.STRAIN_WARNED:
        at = f"at t = {t[np.argmax(strain)]:.6g} s"
        found.append(f"the rib was strained by up to {100.0 * strain.max():.3g} %, {at}, {case_checks.BEYOND}")
    hubs = [view.model.contact_surfaces[view.index(f"contact-{k + 1}")] for k in range(case.rib.count)]
    apart = view.fields["contact_points"]["apart"]
    gaps = np.concatenate([apart[:, int(row["first"]) : int(row["last"])] for row in hubs], axis=1)
    gap = np.fmin.reduce(gaps, axis=1, initial=np.inf)
    if gap.min() < -case_checks.SUNK_WARNED * case.hub.radius:
        sunk = f"the rib sank {-gap.min():.3g} m into the hub at t = {t[np.argmin(gap)]:.6g} s"
        found.append(f"{sunk}; use a greater contact.stiffness, or auto")
    pivot = solution.statistics.get("smallest_pivot", 1.0)
    if pivot < PIVOT_WARNED:
        found.append(
            f"the equations were nearly singular in some step (smallest pivot {pivot:.2g}, round-off from 1e-16); "
            f"results that depend on it may be wrong"
        )
    found.append(closure.unresolved(solution) or closure.unclosed(solution))
    return "; ".join(text for text in found if text)
