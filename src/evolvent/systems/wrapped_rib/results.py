"""Results of the field beside those of the parts, for the root of a run; and warnings about the run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.observe import View
from evolvent.solvers import balance as eb
from evolvent.systems.wrapped_rib import advice
from evolvent.systems.wrapped_rib.case import IMPLICIT, Case
from evolvent.systems.wrapped_rib.start import Start, along
from evolvent.variables import group_of

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.solvers.solution import Solution

Array = np.ndarray
#: Variables by name: (dimensions, values, units, long name).
Root = dict[str, tuple[tuple[str, ...], np.ndarray, str, str]]
#: What takes energy out of a run.
CAUSES = ("mass damping", "stiffness damping", "contact", "friction", "joints", "numerical")
#: Pivot, over the largest entry of its column, below which a run warns.
PIVOT_WARNED = 1e-13
#: Share of the energy that the method itself may take, or add, without a warning.
NUMERICAL_WARNED, GAIN_WARNED = 0.05, 1e-3
#: Points of each element along which the angle that a rib covers is followed.
FOLLOWED = 8


def derived(case: Case, begin: Start, solution: Solution, peaks: tuple[Array, Array]) -> Root:
    """Variables of the root.

    Parameters
    ----------
    begin : Start of the run
    peaks : largest speed of each tip (m/s), and when (s)
    """
    view, rib, length = View(solution), case.rib, case.rib.element_length
    count = range(1, rib.count + 1)
    motion = [view.nodes(view.index(f"rib-{k}")) for k in count]
    nodes, rates = (np.stack([one[i] for one in motion], axis=1) for i in (0, 1))
    hub = view.pose(view.index("hub"))
    angle = _hub_angle(view, begin)
    arc = length / case.output.points * np.arange(rib.elements * case.output.points + 1)
    thickness = rib.thickness_at(arc / rib.length)
    strain = _strain(view.part("rib-1"), nodes, case.output.points)
    stretch = 1.0 if rib.formulation == "cable_stretch" else np.sqrt(np.maximum(1.0 + 2.0 * strain, 0.0))
    tension = rib.young_modulus * rib.width * thickness * strain * stretch
    path = np.einsum("tji,tbnj->tbni", hub.R, _points(nodes, length, FOLLOWED) - hub.x[:, None, None])
    radius = np.hypot(path[..., -1, 0], path[..., -1, 1])
    speed = np.linalg.norm(rates[:, :, -1, 0], axis=-1)
    own_rate = np.einsum("tji,tj->ti", hub.R, hub.w)
    row = solution.assembly.model.bodies[view.index("hub")]
    attitude = _attitude(view)
    end = np.concatenate([hub.x[-1], attitude[-1], hub.v[-1], own_rate[-1], angle[-1:]])
    turning = solution.wrenches[:, view.index("hub"), 3:6]
    if case.hub.motion == "free":  # which holds the gyroscopic torque as well
        turning = turning + np.einsum("tij,tj->ti", hub.R, np.cross(own_rate, own_rate @ row["inertia"]))
    time, ribs, points = ("time",), ("time", "rib"), ("time", "rib", "point")
    node = ("rib", "node", "vector", "axis")
    speed_text = "largest speed of the tip, between samples too"
    return {
        "rib": (("rib",), np.array(count), "1", "rib"),
        "arc": (("point",), arc, "m", "length along the rib from its root, without stress"),
        "position": ((*points, "axis"), _points(nodes, length, case.output.points), "m", "rib's axis, inertial axes"),
        "tip_speed": (ribs, speed, "m s-1", "speed of the tip in inertial space"),
        "tip_speed_peak": (("rib",), peaks[0], "m s-1", speed_text),
        "tip_speed_peak_time": (("rib",), peaks[1], "s", "when the tip had it"),
        "tip_radius": (ribs, radius, "m", "distance of the tip from the hub's axis"),
        "wrap_angle": (ribs, _wrap_angle(path, case.hub.radius), "rad", "angle of the hub that the rib "
                       "covers, negative the other way"),
        **_contacts(case, view),
        "hub_torque": (time, np.einsum("ti,ti->t", turning, hub.R[:, :, 2]), "N m", "torque of the ribs on the hub "
                       "about its axis"),
        "hub_angle": (time, angle, "rad", "angle of the hub about its axis"),
        "curvature": (points, _curvature(nodes, hub.R, length, case.output.points), "m-1", "turn about the hub's axis "
                      "per length without stress"),
        "tension": (points, tension, "N", "force along the rib, positive where it pulls"),
        "strain": (points, strain, "1", "strain of the rib's axis"),
        **_energies(solution),
        "end_coordinates": (node, nodes[-1], "1", "nodes at the end: positions (m), slopes (1)"),
        "end_velocities": (node, rates[-1], "s-1", "their rates: positions (m/s), slopes (1/s)"),
        "end_hub": (("hub_state",), end, "1", "hub at the end: position, quaternion, velocity, angular velocity (body "
                    "axes), angle about its axis"),
        "hinge_rest": (("rib",), begin.directions, "rad", "direction at which the root's hinge rests"),
    }  # fmt: skip


def peaks_of(case: Case, solution: Solution) -> tuple[Array, Array]:
    """Largest speed of each tip (m/s), and when (s)."""
    view = View(solution)
    tips = [view.nodes(view.index(f"rib-{k}"))[1][:, -1, 0] for k in range(1, case.rib.count + 1)]
    speed = np.linalg.norm(np.stack(tips, axis=1), axis=-1)
    at = np.argmax(speed, axis=0)
    return speed[at, np.arange(case.rib.count)], solution.t[at]


def _attitude(view: View) -> Array:
    from evolvent.observe.lumped import attitude

    return attitude(view, view.model.bodies[view.index("hub")])


def _hub_angle(view: View, begin: Start) -> Array:
    """Angle of the hub about its axis, rad : (nt,)."""
    angle = view.angle(view.index("hub"))
    if angle is None:
        q = _attitude(view)
        angle = np.unwrap(2.0 * np.arctan2(q[:, 3], q[:, 0]))
        angle = angle - angle[0]
    return begin.hub.angle + angle


def _points(nodes: Array, length: float, per: int) -> Array:
    """Positions (nt, ribs, elements per + 1, 3) at `per` points of each element, and of the tip."""
    inner = along(nodes, length, np.arange(per) / per)
    return np.concatenate([inner.reshape(*inner.shape[:2], -1, 3), nodes[:, :, -1:, 0]], axis=2)


def _strain(beam: Any, nodes: Array, per: int) -> Array:
    """Strain of the axis at `per` points of each element and the tip : (nt, ribs, elements per + 1).

    Notes
    -----
    Means over the elements, by the three points at which they take the strain, and straight lines between the elements'
    middles: what varies within an element is mostly what its cubic adds to a bent shape.
    """
    at, weight = np.polynomial.legendre.leggauss(3)
    strain = beam.along(nodes, at=0.5 * (1.0 + at))["strain"]
    mean = strain.reshape(*strain.shape[:-1], -1, 3) @ (0.5 * weight)
    if mean.shape[-1] == 1:
        return np.repeat(mean, per + 1, axis=-1)
    place = np.arange(mean.shape[-1] * per + 1) / per - 0.5
    left = np.clip(place.astype(int), 0, mean.shape[-1] - 2)
    found: Array = mean[..., left] + (place - left) * (mean[..., left + 1] - mean[..., left])
    return found


def _curvature(nodes: Array, R: Array, length: float, per: int) -> Array:
    """Turn about the hub's axis per length without stress, 1/m, positive as it winds : (nt, ribs, elements per + 1).

    Notes
    -----
    The straight line through Gauss's two points, at which an element's cubic is nearest to the shape that it stands
    for; means where elements meet.
    """
    at, _ = np.polynomial.legendre.leggauss(2)
    slope, bend = (along(nodes, length, 0.5 * (1.0 + at), order) for order in (1, 2))
    turn = np.einsum("tbnki,ti->tbnk", np.cross(slope, bend), R[:, :, 2]) / np.einsum("...i,...i", slope, slope)
    mean, tilt = turn.mean(axis=-1), 0.5 * (turn[..., 1] - turn[..., 0]) / at[1]
    values = mean[..., None] + tilt[..., None] * (2.0 * np.arange(per + 1) / per - 1.0)
    values[..., 1:, 0] = values[..., :-1, -1] = 0.5 * (values[..., 1:, 0] + values[..., :-1, -1])
    return np.concatenate([values[..., :-1].reshape(*values.shape[:2], -1), values[..., -1, -1:]], axis=-1)


def _wrap_angle(path: Array, radius: float) -> Array:
    """Angle of the hub that each rib covers, rad; `path` (nt, ribs, n, 3) in the hub's axes.

    Notes
    -----
    Of a straight tail along the tangent: the tip's angle about the axis from the root on, followed along the rib, less
    acos(R/r) of its distance r; negative where the rib lies the other way round.
    """
    angle = np.unwrap(np.arctan2(path[..., 1], path[..., 0]), axis=-1)
    tip = np.maximum(np.hypot(path[..., -1, 0], path[..., -1, 1]), radius)
    turned = angle[..., -1] - angle[..., 0]
    found: Array = np.sign(turned) * np.clip(np.abs(turned) - np.arccos(radius / tip), 0.0, None)
    return found


def _contacts(case: Case, view: View) -> Root:
    """Contacts of the ribs with the hub, and of the turns with one another, where that is switched on."""

    def of(part: str, column: int) -> Array:
        rows = [view.index(f"{part}-{k}") for k in range(1, case.rib.count + 1)]
        found: Array = view.solution.cylinders[:, rows, column]
        return found

    ribs = ("time", "rib")
    found: Root = {
        "contact_points": (ribs, of("contact", 8), "1", "contact points in contact with the hub"),
        "contact_force": (ribs, of("contact", 6), "N", "sum of the normal forces on the hub"),
        "contact_impulse": (ribs, of("contact", 7), "N s", "integral of the normal forces since the start"),
    }
    if case.contact.self:
        found["turn_points"] = (ribs, of("layer", 8), "1", "contact points in contact with the turn below")
        found["turn_force"] = (ribs, of("layer", 6), "N", "sum of the normal forces on the turns below")
    return found


def _energies(solution: Solution) -> Root:
    """Energies by kind, and what dissipates them."""
    rows, gained = solution.balance, solution.energy_defect
    elastic, work = rows.elastic - rows.contact, eb.work(rows)
    causes = [rows.by_mass, rows.by_stiffness, rows.by_contact, rows.by_friction, rows.by_joints + rows.by_springs]
    largest = max(float(solution.energy.max()), float(np.abs(work).max()), 1e-300)
    balance = "what the energy balance has gained over the largest energy; below zero, damping by the method itself"
    time = ("time",)
    return {
        "cause": (("cause",), np.array(CAUSES), "1", "what takes energy"),
        "energy_elastic": (time, elastic, "J", "strain energy of the ribs"),
        "energy_membrane": (time, elastic - rows.bending, "J", "strain energy of all but bending"),
        "energy_bending": (time, rows.bending, "J", "strain energy of bending"),
        "energy_contact": (time, rows.contact, "J", "energy of the contacts' springs"),
        "energy_joints": (time, rows.coupled, "J", "energy of springs in the hinges, and of penalties"),
        "energy_dissipated": ((*time, "cause"), np.stack([*causes, -gained], axis=1), "J", "energy taken so far"),
        "work_external": (time, work, "J", "work of the drive so far"),
        "energy_balance": (time, gained / largest, "1", balance),
    }


def warnings(case: Case, begin: Start, run: xr.DataTree) -> list[str]:
    """Warnings about a case and its run, a sentence each."""
    from evolvent.results import statistics_of

    found = [text for text in (begin.warning, *advice.warnings(case)) if text]
    root = run.to_dataset()
    time = root["time"].values
    strain = np.abs(root.strain.values).max(axis=(1, 2))
    if float(strain.max()) > advice.STRAIN_WARNED:
        found.append(
            f"the rib was strained by up to {100.0 * strain.max():.3g} %, at t = {time[np.argmax(strain)]:.6g} s, "
            f"beyond what linear elasticity and most sections bear"
        )
    gaps = [group_of(run, f"contact-{k + 1}")["gap"].values for k in range(case.rib.count)]
    gap = np.min([np.fmin.reduce(own, axis=1, initial=np.inf) for own in gaps], axis=0)
    if float(gap.min()) < -advice.SUNK_WARNED * case.hub.radius:
        k = int(np.argmin(gap))
        found.append(
            f"the rib sank {-gap[k]:.3g} m into the hub at t = {time[k]:.6g} s; take a greater "
            f"contact.stiffness, or auto"
        )
    pivot = statistics_of(run).get("smallest_pivot", 1.0)
    if pivot < PIVOT_WARNED:
        found.append(
            f"the equations were nearly singular in some step (smallest pivot {pivot:.2g}, round-off from 1e-16); what "
            f"depends on it may be wrong"
        )
    balance, implicit = root.energy_balance.values, case.solver.method == IMPLICIT
    smaller = "solver.tolerance or solver.step" if implicit else "solver.step"
    if float(balance.max()) > GAIN_WARNED:
        found.append(
            f"the run has gained up to {100.0 * balance.max():.2g} % of its energy from nothing; take a smaller "
            f"{smaller}"
        )
    if -float(balance.min()) > NUMERICAL_WARNED:
        found.append(
            f"the method itself has taken {-100.0 * balance.min():.2g} % of the energy; take a smaller {smaller}"
            + (", or a higher solver.spectral_radius" if implicit else "")
        )
    return found
