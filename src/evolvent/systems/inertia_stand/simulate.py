"""From a case to the motion, the sensors' signals and a data set."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evolvent import batch, cases
from evolvent.batch.rates import DISSIPATED, Q, V, W, X
from evolvent.errors import InputError
from evolvent.inertia import NormalModes, energy
from evolvent.motion import quaternions, rotation_matrices
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


class Outcome(NamedTuple):
    """How a motion ended, as `evolvent.results.label` wants it."""

    status: str
    message: str
    statistics: dict[str, float]
    wall_time: float
    compile_time: float


# ------------------------------------------------------------------------------------------------ runs


def plan(case: Case, *, laws: Mapping[str, Any] | None = None) -> cases.Plan:
    """Check and prepare a case: motion, sensors, identification.

    Raises
    ------
    InputError
        If laws are given (this system places none), or the case cannot be run.
    """
    refuse_laws(laws, case.system)
    item = prepare(case)

    def run(progress: Callable[[float], None] | None = None) -> xr.Dataset:
        return _finish(item, *_move([item], progress)[0])

    solver = "dopri5" if item.steps == 0 else batch.NAME
    return cases.Plan(duration=(case.sensors.samples - 1) / case.sensors.rate, run=run, solver=solver)


def run_batch(batch: Sequence[Case]) -> list[xr.Dataset | Exception]:
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
    for k, moved in zip(ready, _move([found[k] for k in ready], None), strict=True):
        try:
            found[k] = _finish(found[k], *moved)
        except InputError as error:
            found[k] = error
    return found


def _move(
    prepared: Sequence[Prepared], progress: Callable[[float], None] | None
) -> list[tuple[np.ndarray, dict[str, float], float, float]]:
    """States (samples, 14) of each, statistics, and the times of the solve and of compilation, s."""
    moved: list[Any] = [None] * len(prepared)
    groups: dict[tuple[Any, ...], list[int]] = {}
    for k, item in enumerate(prepared):
        if item.steps == 0:
            from evolvent.systems.inertia_stand.adaptive import integrate

            moved[k] = integrate(item, progress)
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
            moved[k] = (states[row], statistics, each, compiled - began)
    return moved


def _finish(
    item: Prepared, states: np.ndarray, statistics: dict[str, float], wall: float, compiling: float
) -> xr.Dataset:
    """The run as a Dataset."""
    import xarray as xr

    from evolvent.results import label, variable
    from evolvent.systems.inertia_stand.identify import identified

    case, stand = item.case, item.stand
    finite = np.all(np.isfinite(states), axis=1)
    kept = int(np.argmin(finite)) if not np.all(finite) else len(states)
    states = states[:kept]
    t = np.arange(kept) / case.sensors.rate
    position, velocity, rate = states[:, X : X + 3], states[:, V : V + 3], states[:, W : W + 3]
    rotation = rotation_matrices(states[:, Q : Q + 4])
    account, outcome = _account(item, states, rotation, statistics, wall, compiling, complete=bool(np.all(finite)))
    true = _displacement(item, position, rotation)
    measured = _measured(case, true)
    time, axis, sensor = ("time",), ("time", "axis"), ("time", "sensor")
    relative = position - item.model.pose.position
    turned = np.einsum("tij,kj->tik", rotation, item.model.pose.rotation)
    data = {
        "position": variable(axis, relative, "m", "displacement of the centre of mass from its rest, level axes"),
        "attitude": variable(
            ("time", "quaternion"), quaternions(turned), "1", "rotation from the rest, level axes, scalar first"
        ),
        "velocity": variable(axis, velocity, "m s-1", "velocity of the centre of mass, level axes"),
        "angular_velocity": variable(axis, rate, "rad s-1", "angular velocity, level axes"),
        "spring_force": variable(
            ("time", "spring"), _pulls(item, position, rotation), "N", "force along the spring, positive where it pulls"
        ),
        "sensor_displacement": variable(sensor, measured, "m", "displacement from the rest as the sensor reads it"),
        "sensor_true": variable(sensor, true, "m", "displacement from the rest along the sensor"),
        **account,
        **_linear(item),
    }
    data["spring_force"].attrs["warning"] = _overdone(item, data["spring_force"].values)
    data |= identified(item, measured, true)
    n, c = len(stand.stiffness), true.shape[1]
    dataset = xr.Dataset(
        data,
        {
            "time": variable(time, t, "s", "time"),
            "axis": ("axis", ["x", "y", "z"]),
            "component": ("component", list(COMPONENTS)),
            "spring": variable(("spring",), np.arange(1, n + 1), "1", "spring"),
            "linear_kind": ("linear_mode", kinds(item.modes)),
            "sensor": variable(("sensor",), np.arange(1, c + 1), "1", "sensor"),
        },
    )
    label(
        dataset,
        system="inertia-stand",
        case=cases.to_yaml(case),
        method=case.solver.method,
        solution=outcome,
        laws={},
    )
    warnings = [w for v in dataset.data_vars.values() if (w := v.attrs.pop("warning", ""))]
    if warnings:
        dataset.attrs["warning"] = "; ".join(warnings)
    return dataset


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


def _pulls(item: Prepared, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """(nt, n) N, elastic force along each spring."""
    stand = item.stand
    ends = position[:, None] + np.einsum("tij,nj->tni", rotation, stand.points - item.body.centre)
    length = np.linalg.norm(ends - stand.ground_points, axis=-1)
    return np.asarray(stand.stiffness * (length - stand.length))


def _overdone(item: Prepared, force: np.ndarray) -> str:
    """A sentence where springs reach their natural length, at which a real one goes slack, or stretch beyond reason."""
    stand, pose = item.stand, item.model.pose
    at_rest = _pulls(item, pose.position[None], pose.rotation[None])[0]
    numbers = np.arange(1, at_rest.size + 1)
    said = []
    passed = numbers[np.any(force * np.sign(at_rest) < 0.0, axis=0)]
    if passed.size:
        said.append(f"{_listed(passed)} through the natural length, where a real one hangs loose; swing less")
    stretch = np.abs(force).max(axis=0) / (stand.stiffness * stand.length)
    far = numbers[stretch > STRETCH]
    if far.size:
        said.append(
            f"{_listed(far)} up to {1.0 + stretch.max():.4g} times the natural length; no spring stays linear so far"
        )
    return "; ".join(said)


def _listed(springs: np.ndarray) -> str:
    return f"spring {springs[0]} goes" if springs.size == 1 else f"springs {', '.join(map(str, springs))} go"


def _account(
    item: Prepared,
    states: np.ndarray,
    rotation: np.ndarray,
    statistics: dict[str, float],
    wall: float,
    compiling: float,
    *,
    complete: bool,
) -> tuple[dict[str, xr.Variable], Outcome]:
    """Energies, their balance, and how the run ended."""
    from evolvent.results import variable

    body, pose = item.body, item.model.pose
    velocity, rate = states[:, V : V + 3], states[:, W : W + 3]
    own = np.einsum("tji,tj->ti", rotation, rate)
    kinetic = 0.5 * body.mass * np.sum(velocity**2, axis=1) + 0.5 * np.einsum("ti,ij,tj->t", own, body.inertia, own)
    rest = energy(item.stand, body, pose.position, pose.rotation)
    potential = energy(item.stand, body, states[:, X : X + 3], rotation) - rest
    dissipated = states[:, DISSIPATED]
    total = kinetic + potential + dissipated
    largest = max(float(kinetic.max()), float(potential.max()), 1e-300)
    fall = float(body.mass * item.stand.gravity) * (np.abs(pose.position).max() + float(item.stand.length.max()))
    rounding = ROUNDING * max(abs(float(rest)), fall)
    balance = (total - total[0]) / largest
    worst = float(np.abs(balance).max())
    time = ("time",)
    data = {
        "energy_kinetic": variable(time, kinetic, "J", "kinetic energy"),
        "energy_elastic": variable(time, potential, "J", "energy of the springs and of gravity above that at rest"),
        "energy_dissipated": variable(time, dissipated, "J", "energy dissipated so far"),
        "energy_balance": variable(time, balance, "1", "what the energy balance lacks, over the largest energy"),
    }
    t = (len(states) - 1) / item.case.sensors.rate
    method = item.case.solver.method
    status, message = "success", "the run reached its end"
    advice = f"take a smaller step than {statistics.get('step', 0.0):.3g} s" if item.steps else "tighten solver.rtol"
    if not complete:
        status = "failed"
        message = f"the state stopped being finite after t = {t:.6g} s with {method}; {advice}"
    elif worst > ENERGY_LIMIT and largest < rounding:
        status = "failed"
        message = (
            f"the motion holds {largest:.2g} J at most, which rounding hides beside the potential energy at rest; "
            "set the body in stronger motion"
        )
    elif worst > ENERGY_LIMIT:
        status = "failed"
        message = f"the energy balance is off by {worst:.2g} of the motion's energy by t = {t:.6g} s; {advice}"
    elif worst > ENERGY_TOLD:
        what = "takes" if balance[-1] < 0.0 else "adds"
        data["energy_balance"].attrs["warning"] = (
            f"{method} itself {what} {100.0 * worst:.2g} % of the energy at this step, which decay rates show; {advice}"
        )
    statistics = {**statistics, "energy_defect": worst}
    return data, Outcome(status, message, statistics, wall, compiling)


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
