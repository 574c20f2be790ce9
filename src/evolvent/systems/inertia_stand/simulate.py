"""From a case to the motion, the sensors' signals and a tree of results."""

from __future__ import annotations

import dataclasses
import time as clock
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import analysis, batch, cases
from evolvent import model as mdl
from evolvent.batch.rates import DISSIPATED, Q, V, W, X
from evolvent.errors import InputError, RunFailed, in_keys, naming_keys
from evolvent.inertia import NormalModes, energy
from evolvent.motion import quaternions, rotation_matrices
from evolvent.observe import View
from evolvent.observe.lumped import observe_spring
from evolvent.solvers.solution import Solution
from evolvent.systems._common import refuse_laws
from evolvent.systems.inertia_stand.case import Case
from evolvent.systems.inertia_stand.prepare import (
    COMPONENTS,
    Prepared,
    distinct,
    heave_roll_pitch,
    least_energies,
    prepare,
)
from evolvent.systems.inertia_stand.structure import system_of

if TYPE_CHECKING:
    import xarray as xr

#: Numerical gain or loss of energy, of the motion's, above which a run has failed, and above which it is told.
ENERGY_LIMIT, ENERGY_TOLD = 0.1, 1e-3
#: Rounding errors of the potential energy over its size at rest.
ROUNDING = 1e-13
#: Change of length of a spring, of its natural one, above which it is told.
STRETCH = 1.0
#: What a mode can mostly be.
KINDS = ("sway along x", "heave", "sway along z", "roll", "yaw", "pitch")


def plan(case: Case, *, laws: Mapping[str, Any] | None = None) -> cases.Plan:
    """Check and prepare a case: motion, sensors, identification.

    Raises
    ------
    InputError
        If laws are given (this system places none), or the case cannot be run.
    """
    refuse_laws(laws, case.system)
    item = prepare(case)

    def run(progress: Callable[[float], None] | None = None) -> xr.DataTree:
        return _finish(item, _move([item], progress)[0])

    solver = "dopri5" if item.steps == 0 else batch.NAME
    return cases.Plan(duration=(case.sensors.samples - 1) / case.sensors.rate, run=run, solver=solver)


def run_batch(batch: Sequence[Case]) -> list[xr.DataTree | Exception]:
    """Runs of many cases, integrated together in compiled batches; a case gives the same bits as alone.

    Returns
    -------
    list, of the same length
        A run, or the error that a case ended with.
    """
    found: list[Any] = []
    for case in batch:
        try:
            found.append(prepare(case))
        except InputError as error:
            found.append(error)
    ready = [k for k, item in enumerate(found) if isinstance(item, Prepared)]
    for k, solution in zip(ready, _move([found[k] for k in ready], None), strict=True):
        try:
            found[k] = _finish(found[k], solution)
        except InputError as error:
            found[k] = error
    return found


def _adaptive(item: Prepared, progress: Callable[[float], None] | None) -> Solution:
    """The motion by the general engine."""
    case, keys = item.case, cases.solver_keys(item.case)
    samples = np.arange(case.sensors.samples) / case.sensors.rate
    options = {"tolerance": case.solver.rtol, "absolute_tolerance": case.solver.atol}
    with naming_keys(keys):
        prepared, _ = analysis.plan(system_of(item).assemble(), samples, method="dopri5", **options)
        solution: Solution = prepared.run(progress)
    if not solution.success:
        raise RunFailed(in_keys(solution.message, keys), None)
    return solution


def _move(prepared: Sequence[Prepared], progress: Callable[[float], None] | None) -> list[Solution]:
    """The motion of each."""
    moved: list[Any] = [None] * len(prepared)
    groups: dict[tuple[Any, ...], list[int]] = {}
    for k, item in enumerate(prepared):
        if item.steps == 0:
            moved[k] = _adaptive(item, progress)
            continue
        sensors = item.case.sensors
        key = (item.steps, sensors.rate, sensors.samples, item.case.solver.method, len(item.stand.stiffness))
        groups.setdefault(key, []).append(k)
    for (steps, rate, samples, method, _), members in groups.items():
        began = clock.perf_counter()
        batch.warm_up()
        compiled = clock.perf_counter()
        states = batch.integrate(
            [prepared[k].suspended for k in members],
            every=1.0 / rate,
            samples=samples,
            steps=steps,
            method=method,
            progress=progress,
        )
        each = (clock.perf_counter() - compiled) / len(members)
        for row, k in enumerate(members):
            highest = float(prepared[k].modes.natural_frequency.max())
            statistics = {
                "steps": float(steps * (samples - 1)),
                "rhs_evaluations": float(steps * (samples - 1) * batch.scheme(method).evaluations),
                "step": 1.0 / rate / steps,
                "stability_limit": batch.stability_limit(method) / highest,
            }
            moved[k] = solution_of(prepared[k], states[row], statistics, each, compiled - began)
    return moved


def solution_of(
    item: Prepared, states: np.ndarray, statistics: dict[str, float], wall: float, compiling: float
) -> Solution:
    """States (samples, 14) of a batch as a solution of the same case composed of parts, up to the last finite one."""
    finite = np.all(np.isfinite(states), axis=1)
    kept = int(np.argmin(finite)) if not np.all(finite) else len(states)
    states, assembly = states[:kept], system_of(item).assemble()
    at = int(assembly.model.info.nq + assembly.model.info.nv)
    y = np.zeros((kept, assembly.y.size))
    y[:, : V + 3] = states[:, : V + 3]
    y[:, W : W + 3] = np.einsum("tij,ti->tj", rotation_matrices(states[:, Q : Q + 4]), states[:, W : W + 3])
    fallen = states[:, X : X + 3] - states[:1, X : X + 3]
    y[:, at + mdl.LOAD] = item.suspended.mass * (fallen @ item.suspended.gravity)
    y[:, at + mdl.DISSIPATED] = states[:, DISSIPATED]
    status, message, method = "success", "the run reached its end", item.case.solver.method
    if kept < len(finite):
        end, status = (kept - 1) / item.case.sensors.rate, "failed"
        message = f"the state stopped being finite after t = {end:.6g} s with {method}; {_advice(item, statistics)}"
    return Solution(
        assembly=assembly, method=method, t=np.arange(kept) / item.case.sensors.rate, y=y,
        s=np.zeros((kept, assembly.s.size), dtype=assembly.s.dtype), status=status, message=message,
        statistics=statistics, event_times=np.zeros(0), event_kinds=np.zeros(0, dtype=int), wall_time=wall,
        compile_time=compiling,
    )  # fmt: skip


def _advice(item: Prepared, statistics: dict[str, float]) -> str:
    return f"take a smaller step than {statistics.get('step', 0.0):.3g} s" if item.steps else "tighten solver.rtol"


def _finish(item: Prepared, solution: Solution) -> xr.DataTree:
    """The run as a tree."""
    from evolvent.results import variable
    from evolvent.systems.inertia_stand.identify import identified

    case, stand, view = item.case, item.stand, View(solution)
    body = view.pose(view.index("body"))
    solution, potential, told = _checked(item, solution, body.x, body.R)
    true = _displacement(item, body.x, body.R)
    measured = _measured(case, true)
    axis, sensor = ("time", "axis"), ("time", "sensor")
    turned = np.einsum("tij,kj->tik", body.R, item.model.pose.rotation)
    n, c = len(stand.stiffness), true.shape[1]
    text = "energy of the springs and of the weight above that at rest"
    data = {
        "component": variable(("component",), list(COMPONENTS), "1", "component of the inertia tensor"),
        "linear_kind": variable(("linear_mode",), kinds(item.modes), "1", "what the mode mostly is"),
        "spring": variable(("spring",), np.arange(1, n + 1), "1", "spring"),
        "sensor": variable(("sensor",), np.arange(1, c + 1), "1", "sensor"),
        "displacement": variable(
            axis, body.x - item.model.pose.position, "m", "displacement of the centre of mass from its rest, level axes"
        ),
        "rotation": variable(
            ("time", "quaternion"), quaternions(turned), "1", "rotation from the rest, level axes, scalar first"
        ),
        "energy_potential": variable(("time",), potential, "J", text),
        "sensor_displacement": variable(sensor, measured, "m", "displacement from the rest as the sensor reads it"),
        "sensor_true": variable(sensor, true, "m", "displacement from the rest along the sensor"),
        **_linear(item),
        **identified(item, measured, true),
    }
    warnings = [told, _overdone(item, view)] + [v.attrs.get("warning", "") for v in data.values()]
    root: dict[str, Any] = {
        name: (v.dims, v.values, v.attrs["units"], v.attrs["long_name"]) for name, v in data.items()
    }
    return analysis.tree(
        solution, case=cases.to_yaml(case), why="as asked for", system=case.system, root=root,
        warning="; ".join(text for text in warnings if text),
    )  # fmt: skip


def _displacement(item: Prepared, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """(nt, c) m, displacement of the sensors' points from the rest along their directions."""
    pose, arm = item.model.pose, item.case.sensor_points - item.body.centre
    moved = position[:, None] - pose.position + np.einsum("tij,cj->tci", rotation - pose.rotation, arm)
    return np.einsum("tci,ci->tc", moved, item.case.sensor_directions)


def _measured(case: Case, true: np.ndarray) -> np.ndarray:
    """What the sensors read: with noise, then rounded to steps of the quantisation."""
    sensors = case.sensors
    noise = np.broadcast_to(np.array(sensors.noise), true.shape[1:])
    read = true + noise * np.random.default_rng(sensors.seed).standard_normal(true.shape) if noise.any() else true
    step = sensors.quantisation
    return step * np.round(read / step) if step > 0.0 else read


def _overdone(item: Prepared, view: View) -> str:
    """A sentence where springs reach their natural length, at which a real one goes slack, or stretch beyond reason."""
    stand, pose = item.stand, item.model.pose
    numbers = np.arange(1, len(stand.stiffness) + 1)
    every = [observe_spring(view, f"spring-{k}").variables["extension"].values for k in numbers]
    extension = np.stack(every, axis=1)
    ends = pose.position + (stand.points - item.body.centre) @ pose.rotation.T
    at_rest = np.linalg.norm(ends - stand.ground_points, axis=-1) - stand.length
    said = []
    passed = numbers[np.any(extension * np.sign(at_rest) < 0.0, axis=0)]
    if passed.size:
        said.append(f"{_listed(passed)} through the natural length, where a real one hangs loose; swing less")
    stretch = np.abs(extension).max(axis=0) / stand.length
    far = numbers[stretch > STRETCH]
    if far.size:
        said.append(
            f"{_listed(far)} up to {1.0 + stretch.max():.4g} times the natural length; no spring stays linear so far"
        )
    return "; ".join(said)


def _listed(springs: np.ndarray) -> str:
    return f"spring {springs[0]} goes" if springs.size == 1 else f"springs {', '.join(map(str, springs))} go"


def _checked(
    item: Prepared, solution: Solution, position: np.ndarray, rotation: np.ndarray
) -> tuple[Solution, np.ndarray, str]:
    """The solution, failed where its energy balance is off; potential energy above the rest, J; a warning."""
    body, pose = item.body, item.model.pose
    rest = energy(item.stand, body, pose.position, pose.rotation)
    potential = energy(item.stand, body, position, rotation) - rest
    largest = max(float(solution.balance.kinetic.max()), float(potential.max()), 1e-300)
    fall = float(body.mass * item.stand.gravity) * (np.abs(pose.position).max() + float(item.stand.length.max()))
    rounding = ROUNDING * max(abs(float(rest)), fall)
    balance = solution.energy_defect / largest
    worst, t = float(np.abs(balance).max()), float(solution.t[-1])
    method, advice = solution.method, _advice(item, solution.statistics)
    found = dataclasses.replace(solution, statistics={**solution.statistics, "energy_defect": worst})
    if not found.success:
        return found, potential, ""
    if worst > ENERGY_LIMIT:
        message = f"the energy balance is off by {worst:.2g} of the motion's energy by t = {t:.6g} s; {advice}"
        if largest < rounding:
            message = (
                f"the motion holds {largest:.2g} J at most, which rounding hides beside the potential energy at rest; "
                "set the body in stronger motion"
            )
        return dataclasses.replace(found, status="failed", message=message), potential, ""
    told = ""
    if worst > ENERGY_TOLD:
        what = "takes" if balance[-1] < 0.0 else "adds"
        told = (
            f"{method} itself {what} {100.0 * worst:.2g} % of the energy at this step, which decay rates show; {advice}"
        )
    return found, potential, told


def _linear(item: Prepared) -> dict[str, xr.Variable]:
    """The linear model at the true rest."""
    from evolvent.results import variable

    modes, mode = item.modes, ("linear_mode",)
    at_springs = modes.amplitude(item.z, item.stand.points)
    at_sensors = modes.amplitude(item.z, item.case.sensor_points, item.case.sensor_directions)
    tilt = float(modes.model.pose.tilt)
    energies = modes.energy(item.z)
    data = {
        "linear_frequency": variable(mode, modes.frequency, "rad s-1", "frequency of the linear model at the rest"),
        "linear_decay_rate": variable(mode, modes.decay_rate, "s-1", "decay rate of the linear model"),
        "linear_energy": variable(mode, energies, "J", "energy that the excitation gives the mode"),
        "linear_amplitude": variable(
            ("linear_mode", "sensor"), np.abs(at_sensors), "m", "amplitude at the sensor, linear model"
        ),
        "linear_spring_amplitude": variable(
            ("linear_mode", "spring"), at_springs.real, "m", "vertical amplitude at the spring at t = 0, linear model"
        ),
        "static_tilt": variable((), tilt, "rad", "angle of the body's y axis to the vertical at rest"),
        "least_energy": variable(
            (), energies[heave_roll_pitch(modes)].min(), "J", "energy of the weakest of heave, roll, pitch"
        ),
        "loaded_spring": variable((), item.loaded + 1, "1", "spring at which the excitation acts, 0 for none"),
        "inertia_true": variable(
            ("component",), [item.body.inertia[i, j] for i, j in COMPONENTS.values()], "kg m2", "inertia of the case"
        ),
    }
    data["least_energy"].attrs["warning"] = _coinciding(modes)
    if item.case.excitation.force is not None or item.case.excitation.impulse is not None:
        least = least_energies(item.case, item.stand, modes)
        data |= {
            "least_energy_best": variable((), least.max(), "J", "the same, were the best spring loaded"),
            "best_spring": variable((), int(np.argmax(least)) + 1, "1", "spring whose load does that"),
        }
    return data


def _coinciding(modes: NormalModes) -> str:
    """A sentence where two of heave, roll and pitch have one frequency; else nothing."""
    vertical = heave_roll_pitch(modes)
    same = np.flatnonzero(~distinct(modes.natural_frequency[vertical]))
    if not same.size:
        return ""
    return (
        f"{same.size + 1} of heave, roll and pitch have the same frequency, "
        f"{modes.natural_frequency[vertical[same[0]]]:.6g} rad/s: no signal tells them apart, and how their energy is "
        "divided between them (linear_energy, least_energy) is arbitrary"
    )


def kinds(modes: NormalModes) -> list[str]:
    """What each mode mostly is, by the shares of its kinetic energy."""
    shares = modes.shapes * (modes.model.mass @ modes.shapes)
    return [KINDS[int(k)] for k in np.argmax(shares, axis=0)]
