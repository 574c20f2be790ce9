"""Quantities of the field: signals of the sensors, the linear model, what identification finds; warnings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent.results.observe import View
from evolvent.results.observe.view import Pose
from evolvent.results.rotations import quaternions
from evolvent_massprops import batch
from evolvent_massprops.excitation_keys import least_energies
from evolvent_massprops.identification import recorded
from evolvent_massprops.inertia import NormalModes, best_point, energy, partial_frequencies
from evolvent_massprops.inertia.stand import MOMENTS
from evolvent_massprops.inertia_stand.case import Case
from evolvent_massprops.inertia_stand.identify import distinct, identified
from evolvent_massprops.inertia_stand.structure import Setup, setup_of

if TYPE_CHECKING:
    from evolvent.analysis.definition import Variables
    from evolvent.solvers.common.solution import Solution

#: Change of length of a spring, of its natural one, above which there is a warning.
STRETCH = 1.0


def findings(case: Case, solution: Solution) -> tuple[Variables, str]:
    """Variables of the root, and the warning of the run."""
    setup, view = setup_of(case), View(solution)
    rest, body = setup.equilibrium_pose, view.pose(view.index("body"))
    true = _displacement(case, setup, body.x, body.R)
    sensors = case.sensors
    measured = recorded(true, noise=sensors.noise, quantisation=sensors.quantisation, seed=sensors.seed)
    step = solution.statistics.get("step", 0.0) if case.solver.method in batch.METHODS else 0.0
    numbers, warnings = identified(case, setup, measured, true, step)
    potential = energy(setup.stand, setup.body, body.x, body.R)
    potential = potential - energy(setup.stand, setup.body, rest.position, rest.rotation)
    axis, sensor = ("time", "axis"), ("time", "sensor")
    turned = quaternions(np.einsum("tij,kj->tik", body.R, rest.rotation))
    text = "displacement of the centre of mass from equilibrium, level axes"
    data: Variables = {
        "component": (("component",), np.array([name[1:] for name in MOMENTS]), "1", "component of the inertia tensor"),
        "spring": (("spring",), np.arange(1, len(setup.stand.stiffness) + 1), "1", "spring"),
        "sensor": (("sensor",), np.arange(1, true.shape[1] + 1), "1", "sensor"),
        "displacement": (axis, body.x - rest.position, "m", text),
        "rotation": (("time", "quaternion"), turned, "1", "rotation from equilibrium, level axes, scalar first"),
        "energy_potential": (
            ("time",),
            potential,
            "J",
            "energy of the springs and of the weight above that at equilibrium",
        ),
        "sensor_displacement": (sensor, measured, "m", "displacement from equilibrium as the sensor reads it"),
        "sensor_true": (sensor, true, "m", "displacement from equilibrium along the sensor"),
        **_linear(case, setup),
        **numbers,
    }
    moving = max(float(solution.balance.kinetic.max()), float(potential.max()), 1e-300)
    every = [batch.warning_of(solution, moving), _at_limits(setup, body), _coinciding(setup.modes), *warnings]
    return data, "; ".join(text for text in every if text)


def _displacement(case: Case, setup: Setup, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """(nt, c) m, displacement of the sensors' points from the rest along their directions."""
    rest, arm = setup.equilibrium_pose, case.sensor_points - setup.body.centre
    moved = position[:, None] - rest.position + np.einsum("tij,cj->tci", rotation - rest.rotation, arm)
    return np.einsum("tci,ci->tc", moved, case.sensor_directions)


def _linear(case: Case, setup: Setup) -> Variables:
    """The linear model at equilibrium, of the stand as it is tilted."""
    modes, mode = setup.modes, ("linear_mode",)
    at_springs = modes.amplitude(setup.start.z, setup.stand.points).real
    at_sensors = np.abs(modes.amplitude(setup.start.z, case.sensor_points, case.sensor_directions))
    energies = modes.energy(setup.start.z)
    true = np.array([case.body.tensor[i, j] for i, j in MOMENTS.values()])
    sensor, spring, axis = ("linear_mode", "sensor"), ("linear_mode", "spring"), ("linear_mode", "axis")
    points, directions = modes.axes()
    partial = partial_frequencies(setup.stand, setup.body)
    nearest = "point of the mode's axis of rotation nearest to the centre of mass, from the stiffness centre, body axes"
    data: Variables = {
        "linear_kind": (mode, np.array(modes.kinds), "1", "dominant motion of the mode"),
        "linear_frequency": (mode, modes.frequency, "rad s-1", "frequency of the linear model at equilibrium"),
        "linear_decay_rate": (mode, modes.decay_rate, "s-1", "decay rate of the linear model"),
        "linear_energy": (mode, energies, "J", "energy that the excitation gives the mode"),
        "linear_amplitude": (sensor, at_sensors, "m", "amplitude at the sensor, linear model"),
        "linear_spring_amplitude": (spring, at_springs, "m", "vertical amplitude at the spring at t = 0, linear model"),
        "linear_axis_point": (axis, points, "m", f"{nearest}; nan for a translation"),
        "linear_axis_direction": (axis, directions, "1", "direction of the mode's axis of rotation, body axes"),
        "partial_motion": (("partial_motion",), np.array(["heave", "roll", "pitch"]), "1", "motion without the others"),
        "partial_frequency": (("partial_motion",), partial, "rad s-1", "frequency of the motion without the others"),
        "static_tilt": ((), setup.equilibrium_pose.tilt, "rad", "angle of the body's y axis to the vertical at rest"),
        "least_energy": ((), energies[modes.vertical].min(), "J", "energy of the weakest of heave, roll, pitch"),
        "loaded_spring": ((), np.array(setup.excited.spring), "1", "spring at which the excitation acts, 0 for none"),
        "inertia_true": (("component",), true, "kg m2", "inertia of the case"),
    }
    loads = setup.excited.loads
    if loads:
        points = np.array([load.point for load in loads])
        data["load_point"] = (("load", "axis"), points, "m", "where it acts, from the stiffness centre, body axes")
    if case.excitation.acts and case.excitation.loads is None:
        least = least_energies(case.excitation, setup.stand.points, modes)
        data["least_energy_best"] = ((), least.max(), "J", "least energy with the best spring loaded")
        data["best_spring"] = ((), np.array(np.argmax(least) + 1), "1", "number of the best spring to load")
        point = best_point(modes, setup.stand.points, loads[0].vector, impulse=loads[0].impulse)
        least = least_energies(case.excitation, point[None], modes)
        data["least_energy_point"] = ((), least[0], "J", "least energy with the load at the best point")
        data["best_point"] = (("axis",), point, "m", "best point to load between the springs, body axes")
    return data


def _at_limits(setup: Setup, body: Pose) -> str:
    """A sentence where springs reach their natural length, at which a real one goes slack, or stretch beyond reason."""
    stand, rest, found = setup.stand, setup.equilibrium_pose, []
    numbers, at_rest = np.arange(1, len(stand.stiffness) + 1), _extension(setup, rest.position, rest.rotation)
    extension = _extension(setup, body.x, body.R)
    passed = numbers[np.any(extension * np.sign(at_rest) < 0.0, axis=0)]
    if passed.size:
        found.append(f"{_listed(passed)} through the natural length, where a real one hangs loose; swing less")
    stretch = np.abs(extension).max(axis=0) / stand.length
    far = numbers[stretch > STRETCH]
    if far.size:
        found.append(
            f"{_listed(far)} up to {1.0 + stretch.max():.4g} times the natural length; no spring stays linear "
            f"at this stretch"
        )
    return "; ".join(found)


def _extension(setup: Setup, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """(..., n) m, lengths of the springs less the natural ones."""
    ends = position[..., None, :] + (setup.stand.points - setup.body.centre) @ np.swapaxes(rotation, -1, -2)
    return np.linalg.norm(ends - setup.stand.ground_points, axis=-1) - setup.stand.length


def _listed(springs: np.ndarray) -> str:
    return f"spring {springs[0]} goes" if springs.size == 1 else f"springs {', '.join(map(str, springs))} go"


def _coinciding(modes: NormalModes) -> str:
    """A sentence where two of heave, roll and pitch have one frequency."""
    frequency = modes.natural_frequency[modes.vertical]
    same = np.flatnonzero(~distinct(frequency))
    if not same.size:
        return ""
    return (
        f"{same.size + 1} of heave, roll and pitch have the same frequency, {frequency[same[0]]:.6g} rad/s: no signal "
        "distinguishes them, and how their energy is divided between them (linear_energy, least_energy) is arbitrary"
    )
