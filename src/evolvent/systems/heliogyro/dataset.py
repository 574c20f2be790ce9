"""The data set of a run: its variables, their layout, and warnings about the run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases
from evolvent.systems.heliogyro.case import Case
from evolvent.systems.heliogyro.structure import law_and_parameters

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.builder import Assembly
    from evolvent.solvers import Solution

#: Share of the energy at the start that its balance may lack without a warning.
LARGEST_DEFECT = 1e-5


def layout(case: Case) -> dict[str, dict[str, int | None]]:
    """Variables that every run has, with the sizes of their dimensions; None for any size."""
    time: dict[str, int | None] = {"time": None}
    blade = time | {"blade": case.body.blades}
    node = blade | {"node": case.blade.nodes}
    found = dict.fromkeys(("time", "body_rate", "body_angle", "energy_balance", "angular_momentum"), time)
    found |= dict.fromkeys(("energy_kinetic", "energy_elastic", "energy_dissipated", "energy_released"), time)
    found |= dict.fromkeys(("spool_work", "load_work", "drive_work"), time)
    found |= {f"angular_momentum_{name}": time for name in ("body", "released", "wound", "jumps")}
    found |= dict.fromkeys(("let_go", "deployed_length", "hub_tension"), blade)
    found |= dict.fromkeys(("tension", "lag_angle", "signed_lag", "released"), node)
    found |= {"position": node | {"axis": 3}, "velocity": node | {"axis": 3}}
    if case.body.motion != "driven":
        found |= dict.fromkeys(("body_rate_paper", "body_rate_corrected"), time)
    if case.body.motion == "free":
        found |= {"body_quaternion": time | {"quaternion": 4}, "body_position": time | {"axis": 3}}
        found |= {"linear_momentum": time | {"axis": 3}}
    return found


def dataset_of(case: Case, assembly: Assembly, solution: Solution, laws: Mapping[str, Any]) -> xr.Dataset:
    """The run as a Dataset."""
    import xarray as xr

    from evolvent import model as mdl
    from evolvent.results import label, variable

    model, n, N = assembly.model, case.blade.nodes, case.body.blades
    seen = solution.observations
    b = assembly.index("body", "bodies")
    R, X, V, w = (a[:, b] for a in (seen.body_rotation, seen.body_position, seen.body_velocity, seen.body_rate))
    arm = seen.position - X[:, None]
    relative = seen.velocity - V[:, None] - np.cross(w[:, None], arm)
    position = _per_blade(np.einsum("tji,tnj->tni", R, arm), n, N)
    velocity = _per_blade(np.einsum("tji,tnj->tni", R, relative), n, N)
    threads = model.threads.size
    out = np.broadcast_to(solution.s[:, :threads], (solution.t.size, N))
    gone = np.broadcast_to(solution.s[:, threads : 2 * threads] != 0, (solution.t.size, N))
    released = np.arange(n) < out[:, :, None]
    tension = np.broadcast_to(seen.tension.reshape(solution.t.size, threads, n), released.shape)
    tension = np.where(released, tension, np.nan)
    turned = np.broadcast_to(seen.spool[:, :, 0], out.shape)
    deployed = np.where(gone, case.blade.length, np.clip(case.spool.radius * turned, 0.0, case.blade.length))
    rate = np.einsum("ti,ti->t", R[:, :, 2], w)
    slack = _slack(case, solution.t, tension)
    lag, signed = _lag(case, position, released)
    time, blade = ("time",), ("time", "blade")
    node = ("time", "blade", "node")
    data = {
        "position": variable((*node, "axis"), position, "m", "position of the node, body axes from the body's centre"),
        "velocity": variable((*node, "axis"), velocity, "m s-1", "velocity relative to the rotating body, body axes"),
        "tension": variable(
            node, tension, "N", "tension of the segment inwards of the node (NaN while wound)", slack=slack
        ),
        "lag_angle": variable(node, lag, "rad", "lag angle in the frame of the blade's own spool, eq. 19"),
        "signed_lag": variable(node, signed, "rad", "lag angle in the plane of the spin, negative ahead of the spool"),
        "released": variable(node, released, "1", "whether the node has left its spool"),
        "let_go": variable(blade, gone, "1", "whether the whole thread has left its spool"),
        "spool_angle": variable(blade, turned, "rad", "angle that the spool has turned; at zero all would be wound"),
        "deployed_length": variable(blade, deployed, "m", "length of thread paid out"),
        "hub_tension": variable(blade, _hub(tension, out, gone), "N", "tension of the segment at the spool"),
        "body_rate": variable(time, rate, "rad s-1", "rate of the body about its spin axis"),
        "body_angle": variable(time, _angle(R, rate, solution.t), "rad", "angle of the body about Z, unwrapped"),
    }
    data |= _energies_and_momenta(case, solution, seen.inventory, int(model.info.nq + model.info.nv), laws)
    if case.body.motion != "driven":
        for name, corrected, what in (
            ("body_rate_paper", False, "rate of the body by (18)"),
            ("body_rate_corrected", True, "rate of the body by (18) with the offset of the spools"),
        ):
            inertia = straight_inertia(case, deployed, corrected=corrected)
            formula = np.where(np.any(gone, axis=1), np.nan, case.body.rate * inertia[0] / inertia)
            data[name] = variable(time, formula, "rad s-1", what)
    if case.body.motion == "free":
        at = int(model.bodies["iq"][b])
        data["body_position"] = variable(("time", "axis"), X, "m", "position of the body's centre, inertial axes")
        data["body_quaternion"] = variable(
            ("time", "quaternion"), solution.y[:, at + 3 : at + 7], "1", "attitude, body to inertial, scalar first"
        )
        data["linear_momentum"] = variable(
            ("time", "axis"), seen.inventory[:, mdl.P_ALL : mdl.P_ALL + 3], "kg m s-1", "linear momentum of all parts"
        )
    dataset = xr.Dataset(
        data,
        {
            "time": variable(time, solution.t, "s", "time"),
            "blade": variable(("blade",), np.arange(1, N + 1), "1", "blade"),
            "node": variable(("node",), np.arange(1, n + 1), "1", "node, 1 is the tip"),
            "axis": ("axis", ["x", "y", "z"]),
        },
    )
    names = {name: getattr(law_and_parameters(laws, name)[0], "__name__", repr(laws[name])) for name in laws}
    label(
        dataset,
        system="heliogyro",
        case=cases.to_yaml(case),
        method=case.solver.method,
        solution=solution,
        laws=names,
    )
    warnings = [text for text in (slack, _wraps(case, seen.spool), _lacks(dataset)) if text]
    if warnings:
        dataset.attrs["warning"] = "; ".join(warnings)
    return dataset


def _energies_and_momenta(
    case: Case, solution: Solution, inventory: np.ndarray, at: int, laws: Mapping[str, Any]
) -> dict[str, xr.Variable]:
    """Energies, momenta and their balances."""
    from evolvent import model as mdl
    from evolvent.results import variable
    from evolvent.solvers import balance as eb

    time, rows = ("time",), solution.balance
    dissipated = eb.dissipated(rows) - eb.dissipated(rows[0])
    work = {name: rows[name] - rows[name][0] for name in eb.WORK}
    largest = max(float(np.abs(values).max()) for values in (solution.energy, dissipated, *work.values()))
    largest = max(largest, 1e-300)
    body, thread, wound = (inventory[:, k : k + 3] for k in (mdl.H_BODY, mdl.H_RELEASED, mdl.H_WOUND))
    total = body + thread + (wound if case.carried else 0.0)
    jumps = solution.y[:, at + mdl.JUMP_ANGULAR :][:, :3] - solution.y[0, at + mdl.JUMP_ANGULAR :][:3]
    J, H = "J", "kg m2 s-1"
    data = {
        "energy_kinetic": variable(time, rows.kinetic, J, "kinetic energy of all that the model moves"),
        "energy_elastic": variable(time, rows.elastic, J, "strain energy of the segments"),
        "energy_dissipated": variable(time, dissipated, J, "energy dissipated so far"),
        "energy_released": variable(time, work["released"], J, "energy that nodes brought in at their release so far"),
        "spool_work": variable(
            time, work["spools"], J, "work of the spools on the thread so far, negative where they hold it back"
        ),
        "load_work": variable(time, work["loads"], J, "work of the loads so far"),
        "drive_work": variable(time, work["drives"], J, "work of what drives the body so far"),
        "energy_balance": variable(
            time,
            solution.energy_defect / largest,
            "1",
            "what the energy balance lacks, over the largest energy",
            scale_J=largest,
        ),
        "angular_momentum": variable(time, total[:, 2], H, "angular momentum about Z of all that the model moves"),
        "angular_momentum_body": variable(time, body[:, 2], H, "angular momentum about Z of the body"),
        "angular_momentum_released": variable(time, thread[:, 2], H, "angular momentum about Z of the released thread"),
        "angular_momentum_wound": variable(
            time,
            wound[:, 2],
            H,
            "angular momentum about Z of the wound thread" + ("" if case.carried else " (ignored by the model)"),
        ),
        "angular_momentum_jumps": variable(time, jumps[:, 2], H, "angular momentum about Z that releases brought in"),
    }
    if case.body.motion == "free":
        data["angular_momentum_vector"] = variable(
            ("time", "axis"), total, H, "angular momentum about the inertial origin of all that the model moves"
        )
    if case.body.motion != "driven" and case.sunlight is None and "force" not in laws:
        lost = np.linalg.norm((total - total[0] - jumps)[:, 0 if case.body.motion == "free" else 2 :], axis=1)
        scale = float(np.linalg.norm(total[0]))
        data["momentum_balance"] = variable(
            time,
            lost / scale if scale > 0.0 else lost,
            "1",
            "what the balance of angular momentum lacks, over the start",
        )
    return data


def straight_inertia(case: Case, deployed: np.ndarray, *, corrected: bool) -> np.ndarray:
    """Moment of inertia of body and straight radial blades about the spin axis, kg m2.

    Parameters
    ----------
    deployed : (nt, blades) float, m
    corrected : bool, with the spools' distance from the spin axis and, where it is carried, the wound thread;
        without, as in (18)
    """
    rho, tip = case.blade.line_density, case.blade.tip_mass
    L0 = case.body.spool_offset if corrected else 0.0
    each = rho * ((L0 + deployed) ** 3 - L0**3) / 3.0 + tip * (L0 + deployed) ** 2
    if corrected and case.carried:
        each = each + rho * (case.blade.length - deployed) * L0**2
    return case.body.spin_inertia + each.sum(axis=1)


def _per_blade(values: np.ndarray, n: int, blades: int) -> np.ndarray:
    """Vectors of all threads' nodes as (nt, blades, n, 3); copies of one thread are turned about Z."""
    shaped = values.reshape(values.shape[0], -1, n, 3)
    if shaped.shape[1] == blades:
        return shaped
    turns = 2.0 * np.pi * np.arange(blades) / blades
    c, s, one, zero = np.cos(turns), np.sin(turns), np.ones(blades), np.zeros(blades)
    turn = np.array([[c, -s, zero], [s, c, zero], [zero, zero, one]])
    return np.einsum("ijb,tnj->tbni", turn, shaped[:, 0])


def _lag(case: Case, position: np.ndarray, released: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lag angles by (19), and with their sign in the plane of the spin, rad; NaN for wound nodes and for one at Q."""
    turns = 2.0 * np.pi * np.arange(case.body.blades) / case.body.blades
    c, s = np.cos(turns)[:, None], np.sin(turns)[:, None]
    x = c * position[..., 0] + s * position[..., 1] - case.body.spool_offset
    y = c * position[..., 1] - s * position[..., 0]
    across = np.hypot(y, position[..., 2] - case.spool.radius)
    seen = released & (np.hypot(x, across) > 1e-9)
    behind = y if case.body.rate < 0.0 else -y
    return np.where(seen, np.arctan2(across, x), np.nan), np.where(seen, np.arctan2(behind, x), np.nan)


def _hub(tension: np.ndarray, out: np.ndarray, gone: np.ndarray) -> np.ndarray:
    """Tension at the spool, N; 0 with nothing out, or all gone."""
    last = np.maximum(out - 1, 0)[:, :, None]
    hub = np.take_along_axis(tension, last, axis=2)[:, :, 0]
    return np.where((out > 0) & ~gone, hub, 0.0)


def _angle(R: np.ndarray, rate: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Angle of the body about Z, unwrapped with the help of its rate, rad."""
    angle = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    about = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
    turned = about + np.unwrap(angle - about)
    return turned - turned[0] + angle[0]


def _slack(case: Case, time: np.ndarray, tension: np.ndarray) -> str:
    """A sentence on tensions below zero; '' if there are none."""
    least = np.nanmin(np.where(np.isnan(tension), np.inf, tension), axis=(1, 2))
    if not np.any(least < -1e-9):
        return ""
    k, count = int(np.argmin(least)), int(np.sum(least < -1e-9))
    which = "springs push" if case.blade.segments == "springs" else "links push"
    return (
        f"{which} where a thread would go slack: tension below zero in {count} of {time.size} samples, "
        f"at worst {least[k]:.3g} N at t = {time[k]:.6g} s"
    )


def _wraps(case: Case, spool: np.ndarray) -> str:
    """A sentence on a feed too fast for any steady lag; '' if it is not."""
    fastest = case.spool.radius * float(spool[:, :, 1].max())
    limit = 0.5 * case.body.spool_offset * abs(case.body.rate)
    if fastest < limit or limit == 0.0:
        return ""
    return (
        f"the feed of {fastest:.4g} m/s is not below L0 W0 / 2 = {limit:.4g} m/s: no steady lag exists, "
        f"the blade may wrap back onto the body, which the model does not see"
    )


def _lacks(run: xr.Dataset) -> str:
    """A sentence on an energy balance that does not close; '' if it does."""
    energy = run["energy_kinetic"].values + run["energy_elastic"].values
    scale = float(run.energy_balance.attrs["scale_J"])
    lacks = scale * float(np.abs(run.energy_balance.values).max()) / (float(energy[0]) or scale)
    if lacks <= LARGEST_DEFECT:
        return ""
    smaller = "solver.rtol" if run.attrs["solver"] == "dopri5" else "solver.step"
    return f"the energy balance lacks up to {lacks:.2g} of the energy at the start; take a smaller {smaller}"
