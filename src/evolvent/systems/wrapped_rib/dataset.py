"""The data set of a run: its variables, their layout, and warnings about the run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent import cases
from evolvent.motion import rotation_matrices
from evolvent.systems.wrapped_rib import advice
from evolvent.systems.wrapped_rib.case import IMPLICIT, Case
from evolvent.systems.wrapped_rib.energies import energies_and_momenta
from evolvent.systems.wrapped_rib.kinematics import Motion, along, curvature, joined, motion_of, strain_of, wrap_angle
from evolvent.systems.wrapped_rib.start import Start

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.builder import Assembly
    from evolvent.solvers import Solution

#: What takes energy out of a run.
CAUSES = ("mass damping", "stiffness damping", "contact", "friction", "joints", "numerical")
#: Pivot, over the largest entry of its column, below which a run warns.
PIVOT_WARNED = 1e-13
#: Share of the energy that the method itself may take, or add, without a warning.
NUMERICAL_WARNED, GAIN_WARNED = 0.05, 1e-3


def layout(case: Case) -> dict[str, dict[str, int | None]]:
    """Numeric variables of a run, with their dimensions and sizes, None for any."""
    time: dict[str, int | None] = {"time": None}
    rib = time | {"rib": case.rib.count}
    points = case.rib.elements * case.output.points + 1
    found: dict[str, dict[str, int | None]] = {"arc": {"point": points}, "time": time}
    energies = [f"energy_{kind}" for kind in ("kinetic", "membrane", "bending", "elastic", "contact", "balance")]
    found |= dict.fromkeys([*energies, "work_external", "hub_torque", "hub_angle"], time)
    found |= {"energy_dissipated": time | {"cause": len(CAUSES)}}
    found |= dict.fromkeys(("angular_momentum", "linear_momentum"), time | {"axis": 3})
    names = ("tip_speed", "tip_radius", "wrap_angle", "contact_points", "contact_force", "contact_impulse")
    found |= dict.fromkeys((*names, "turn_points", "turn_force") if case.contact.self else names, rib)
    found |= dict.fromkeys(("curvature", "tension"), rib | {"point": points})
    found |= {"position": rib | {"point": points, "axis": 3}}
    return found


def dataset_of(
    case: Case, begin: Start, assembly: Assembly, solution: Solution, peaks: tuple[np.ndarray, np.ndarray]
) -> xr.Dataset:
    """The run as a Dataset."""
    import xarray as xr

    from evolvent.results import label, variable

    rib, motion = case.rib, motion_of(case, begin, assembly, solution)
    length, per = rib.element_length, case.output.points
    R = rotation_matrices(motion.q)
    xi = np.arange(per) / per
    inner = along(motion.nodes, length, xi)
    position = np.concatenate([inner.reshape(*inner.shape[:2], -1, 3), motion.nodes[:, :, -1:, 0]], axis=2)
    arc = length / per * np.arange(rib.elements * per + 1)
    ends = np.arange(per + 1) / per
    engineering = rib.formulation == "cable_stretch"
    strain = strain_of(motion.nodes, length, per, engineering=engineering)
    stretch = 1.0 if engineering else np.sqrt(np.maximum(1.0 + 2.0 * strain, 0.0))
    thickness = rib.thickness_at(arc / rib.length)
    EA, EI = rib.young_modulus * rib.width * thickness, rib.young_modulus * rib.width * thickness**3 / 12.0
    tension, bent = EA * strain * stretch, joined(curvature(motion, R, length, ends))
    hub = assembly.index("hub", "bodies")
    turning = solution.wrenches[:, hub, 3:6]
    if case.hub.motion == "free":  # which holds the gyroscopic torque as well
        spun = np.einsum("ij,tj->ti", assembly.model.bodies["inertia"][hub], motion.w)
        turning = turning + np.einsum("tij,tj->ti", R, np.cross(motion.w, spun))
    torque = np.einsum("ti,ti->t", turning, R[:, :, 2])
    tip = motion.nodes[:, :, -1, 0]
    own = np.einsum("tji,tbj->tbi", R, tip - motion.x[:, None])
    speed = np.linalg.norm(motion.rates[:, :, -1, 0], axis=-1)
    time, ribs, points = ("time",), ("time", "rib"), ("time", "rib", "point")
    data = {
        "position": variable((*points, "axis"), position, "m", "position of the rib's axis, inertial axes"),
        "tip_speed": variable(ribs, speed, "m s-1", "speed of the tip in inertial space"),
        "tip_speed_peak": variable(("rib",), peaks[0], "m s-1", "largest speed of the tip, between samples too"),
        "tip_speed_peak_time": variable(("rib",), peaks[1], "s", "when the tip had it"),
        "tip_radius": variable(
            ribs, np.hypot(own[..., 0], own[..., 1]), "m", "distance of the tip from the hub's axis"
        ),
        "wrap_angle": variable(
            ribs, wrap_angle(case, motion, R), "rad", "angle of the hub that the rib covers, negative the other way"
        ),
        **_contact(case, begin, assembly, solution, motion, R),
        "hub_torque": variable(time, torque, "N m", "torque of the ribs on the hub about its axis"),
        "hub_angle": variable(time, motion.angle, "rad", "angle of the hub about its axis"),
        "curvature": variable(points, bent, "m-1", "turn per length without stress"),
        "tension": variable(points, tension, "N", "force along the rib, positive where it pulls"),
        "strain": variable(points, strain, "1", "strain of the rib's axis"),
        "bending_moment": variable(points, EI * bent, "N m", "moment about the hub's axis in the rib"),
        "energy_density": variable(
            points,
            0.5 * (EA * strain**2 + EI * bent**2),
            "J m-1",
            "strain energy per length, of stretch and of bending",
        ),
        **energies_and_momenta(case, assembly, solution, motion),
        "end_coordinates": variable(
            ("rib", "node", "vector", "axis"), motion.nodes[-1], "1", "nodes at the end: places (m), slopes (1)"
        ),
        "end_velocities": variable(
            ("rib", "node", "vector", "axis"), motion.rates[-1], "s-1", "their rates: places (m/s), slopes (1/s)"
        ),
        "end_hub": variable(
            ("hub_state",),
            np.concatenate([motion.x[-1], motion.q[-1], motion.v[-1], motion.w[-1], motion.angle[-1:]]),
            "1",
            "hub at the end: place, quaternion, velocity, angular velocity (body axes), angle about its axis",
        ),
        "hinge_rest": variable(("rib",), begin.directions, "rad", "direction at which the root's hinge rests"),
    }
    if case.hub.motion == "free":
        data["hub_position"] = variable(("time", "axis"), motion.x, "m", "position of the hub, inertial axes")
        data["hub_quaternion"] = variable(
            ("time", "quaternion"), motion.q, "1", "attitude of the hub, body to inertial, scalar first"
        )
    dataset = xr.Dataset(
        data,
        {
            "time": variable(time, solution.t, "s", "time"),
            "arc": variable(("point",), arc, "m", "length along the rib from its root, without stress"),
            "element": variable(("element",), np.arange(1, rib.elements + 1), "1", "element, 1 at the root"),
            "rib": variable(("rib",), np.arange(1, rib.count + 1), "1", "rib"),
            "axis": ("axis", ["x", "y", "z"]),
            "cause": ("cause", list(CAUSES)),
        },
    )
    label(dataset, system=case.system, case=cases.to_yaml(case), method=case.solver.method, solution=solution, laws={})
    warnings = [text for text in (begin.told, *advice.warnings(case), *_warnings(case, dataset, strain)) if text]
    if warnings:
        dataset.attrs["warning"] = "; ".join(warnings)
    return dataset


def _contact(
    case: Case, begin: Start, assembly: Assembly, solution: Solution, motion: Motion, R: np.ndarray
) -> dict[str, xr.Variable]:
    """Contact of the ribs with the hub, and of the turns with one another."""
    from evolvent.results import variable

    rows = [assembly.index(f"contact-{b + 1}", "cylinders") for b in range(case.rib.count)]
    touched = solution.cylinders[:, rows]
    ribs = ("time", "rib")
    return {
        "contact_points": variable(ribs, touched[..., 8], "1", "contact points in contact with the hub"),
        **_turns(case, assembly, solution, motion, R),
        "contact_force": variable(ribs, touched[..., 6], "N", "sum of the normal forces on the hub"),
        "contact_resultant": variable((*ribs, "axis"), touched[..., 0:3], "N", "force of the contact on the hub"),
        "contact_moment": variable(
            (*ribs, "axis"), touched[..., 3:6], "N m", "moment of the contact on the hub about its middle"
        ),
        "contact_impulse": variable(ribs, touched[..., 7], "N s", "integral of the normal forces since the start"),
        **_pressed(case, begin, motion, R),
    }


def _pressed(case: Case, begin: Start, motion: Motion, R: np.ndarray) -> dict[str, xr.Variable]:
    """Force of the contact per length of each element, and the least gap of its contact points."""
    from evolvent.results import variable

    contact, length = case.contact, case.rib.element_length
    xi = np.arange(1, contact.points + 1) / contact.points
    at = along(motion.nodes, length, xi) - motion.x[:, None, None, None]
    moves = along(motion.rates, length, xi) - motion.v[:, None, None, None]
    own = np.einsum("tji,tbnkj->tbnki", R, at)
    rates = np.einsum("tji,tbnkj->tbnki", R, moves)  # about its axis the hub's turn changes no gap; its tilt is slow
    distance = np.hypot(own[..., 0], own[..., 1])
    gap = np.where(np.abs(own[..., 2]) <= 0.5 * case.hub.height, distance - case.hub.radius, np.inf)
    rate = (own[..., 0] * rates[..., 0] + own[..., 1] * rates[..., 1]) / np.maximum(distance, 1e-300)
    deep = np.maximum(-gap, 0.0)
    force = begin.stiffness * deep**contact.exponent
    if contact.law == "paper":
        force = np.where(deep > 0.0, force - contact.damping * rate, 0.0)
    else:
        force = np.maximum(force * (1.0 - contact.dissipation * rate), 0.0)
    dims = ("time", "rib", "element")
    return {
        "contact_pressure": variable(dims, force.sum(axis=-1) / length, "N m-1", "normal force on the hub per length"),
        "contact_gap": variable(
            dims, gap.min(axis=-1), "m", "least distance of the element's contact points to the hub"
        ),
    }


def _turns(case: Case, assembly: Assembly, solution: Solution, motion: Motion, R: np.ndarray) -> dict[str, xr.Variable]:
    """Contact of the turns with one another, where it is switched on."""
    from evolvent.results import variable

    if not case.contact.self:
        return {}
    rows = [assembly.index(f"layer-{b + 1}", "cylinders") for b in range(case.rib.count)]
    touched = solution.cylinders[:, rows]
    pressure = _turn_forces(case, assembly, solution, motion, R, rows) / case.rib.element_length
    ribs = ("time", "rib")
    return {
        "turn_points": variable(ribs, touched[..., 8], "1", "contact points in contact with the turn below"),
        "turn_force": variable(ribs, touched[..., 6], "N", "sum of the normal forces on the turns below"),
        "turn_pressure": variable(
            (*ribs, "element"), pressure, "N m-1", "normal force on the turn below per length of the turn above"
        ),
    }


def _turn_forces(
    case: Case, assembly: Assembly, solution: Solution, motion: Motion, R: np.ndarray, rows: list[int]
) -> np.ndarray:
    """Normal forces (nt, ribs, elements) of the elements on the turns below, N, evaluated at every sample."""
    from evolvent.flow import needs
    from evolvent.kernels.layers import add_layers

    model, elements = assembly.model, case.rib.elements
    flexible, bodies = model.flexible, model.bodies
    needs.load_explicit(model)
    hub = assembly.index("hub", "bodies")
    scratch = np.zeros(int(model.info.nv))
    found = np.zeros((solution.t.size, len(rows), elements))
    for k, y in enumerate(solution.y):
        bodies["R"][hub], bodies["x"][hub] = R[k], motion.x[k]
        for b, row in enumerate(rows):
            add_layers(y, 0.0, model, row, scratch)
            points = slice(int(flexible.cylinders["first"][row]), int(flexible.cylinders["last"][row]))
            found[k, b] = flexible.contact_points["force"][points].reshape(elements, -1).sum(axis=-1)
    return found


def _warnings(case: Case, run: xr.Dataset, strain: np.ndarray) -> list[str]:
    """Warnings about a run, a sentence each."""
    from evolvent.results import statistics_of

    found = []
    most = float(np.abs(strain).max())
    if most > advice.STRAIN_WARNED:
        k = int(np.argmax(np.abs(strain).max(axis=(1, 2))))
        found.append(
            f"the rib was strained by up to {100.0 * most:.3g} %, at t = {run.time.values[k]:.6g} s, beyond what "
            f"linear elasticity and most sections bear"
        )
    gap = run.contact_gap.values.min(axis=(1, 2))
    if float(gap.min()) < -advice.SUNK_WARNED * case.hub.radius:
        k = int(np.argmin(gap))
        found.append(
            f"the rib sank {-gap[k]:.3g} m into the hub at t = {run.time.values[k]:.6g} s; take a greater "
            f"contact.stiffness, or auto"
        )
    pivot = statistics_of(run).get("smallest_pivot", 1.0)
    if pivot < PIVOT_WARNED:
        found.append(
            f"the equations were nearly singular in some step (smallest pivot {pivot:.2g}, round-off from 1e-16); what "
            f"hangs on it may be wrong"
        )
    balance = run.energy_balance.values
    implicit = case.solver.method == IMPLICIT
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
