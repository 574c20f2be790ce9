"""Reaction wheels, thrusters and controllers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.families.attitude import attitude, attitude_tangent
from evolvent.kernels import calls, rigid, turning
from evolvent.kernels.blocks import RATE, SCALAR
from evolvent.kernels.drive import LAW
from evolvent.kernels.ends import of_bodies
from evolvent.kernels.extremes import note_extremes
from evolvent.model.family import Family, Kind, Records, record
from evolvent.model.powers import DRIVEN, MARKER_LOADS, SPRINGS
from evolvent.model.questions import (
    DRIVE,
    AdjointSupport,
    Block,
    Bound,
    Coordinates,
    Coupling,
    Explicit,
    Friction,
    Implicit,
    Inertia,
    Law,
    Moment,
    Parts,
    Samples,
    Stability,
    State,
    Statics,
    Step,
    calls_law,
    never,
)
from evolvent.model.shares import LOAD, Rule, Shares

Array = np.ndarray
_3 = (3,)


@calls.force
def actuator_force(interval, model):
    """Torques of wheels and pushes of thrusters; the work of motors is that of `attitude.end_actuator_step`."""
    _, given, _ = attitude.actuator_forces(interval.step.tm, interval.ym, model)
    interval.powers[MARKER_LOADS] += given


@calls.tangent
def actuator_tangent(interval, model, matrix):
    """Derivatives of `actuator_force`."""
    attitude_tangent.add_actuator_tangents(interval.step.tm, interval.ym, interval.step.c_rate, model, matrix)


@calls.force
def inertia(interval, model):
    """Inertia of wheels in a state."""
    attitude.add_wheel_residual(interval.ym, interval.dv, model.info.nq, model, model.F)


@calls.force
def step_inertia(interval, model):
    """Inertia of wheels over a step."""
    attitude.add_wheel_step(interval.step.h, interval.dv, interval.ym, model.info.nq, model, model.F)


@calls.tangent
def inertia_tangent(interval, model, matrix):
    """Derivatives of `inertia`."""
    step = interval.step
    attitude.add_wheel_tangent(interval.ym, step.c_mass, step.c_rate, model.info.nq, model, matrix)


@calls.tangent
def step_inertia_tangent(interval, model, matrix):
    """Derivatives of `step_inertia`."""
    attitude.add_wheel_step_tangent(interval.step.c_mass, model.info.nq, interval.R0, interval.R1, model, matrix)


@calls.energy
def energy(interval, model, out):
    """Kinetic energy of all wheels."""
    attitude.add_wheel_energy(interval.ym, model, out, 0)


@calls.momentum
def momentum(y, model, out):
    """Angular momentum of all wheels."""
    attitude.add_wheel_momenta(y, model, out[3:])


@calls.force
def explicit_force(interval, model):
    """Torques of wheels, and pushes of thrusters, onto bodies."""
    powers = interval.powers
    lost, given, driven = attitude.actuator_forces(interval.step.t, interval.ym, model)
    attitude.add_wheels(interval.ym, model)
    powers[SPRINGS] += lost
    powers[MARKER_LOADS] += given
    powers[DRIVEN] += driven


@calls.force
def explicit_end(interval, model):
    """Rates of wheels and of the impulses of thrusters."""
    attitude.actuator_rates(interval.ym, model, interval.rates)


@calls.force
def evaluate(interval, model):
    """Wheels, thrusters and controllers."""
    attitude.evaluate_actuators(interval.step.t, interval.ym, model)


@calls.force
def end_step(interval, model):
    """Impulses of thrusters; work of friction in wheels, and of their motors."""
    step = interval.step
    lost, driven = attitude.end_actuator_step(step.h, 0.5 / step.share, interval.dq, interval.y1, model)
    interval.powers[SPRINGS] += lost
    interval.powers[DRIVEN] += driven


@calls.until_turn
def until_turn(y0, y, h, model):
    """Where a wheel turns back, whose friction is that of a stiff damper below the rate `slip`."""
    wheels, part = model.wheels, turning.NO_TURN
    for k in range(wheels.size):
        if wheels[k].friction > 0.0:
            part = min(part, turning.until_reversal(y0[wheels[k].iv], y[wheels[k].iv], wheels[k].slip))
    return part


def _wheel_refused(row: Any, part: Any, spins: bool) -> str:
    turns = row["torque"] != 0.0 or row["profile"] >= 0 or row["law"] != 0
    rubs = part.rate != 0.0 and (row["viscous"] != 0.0 or row["friction"] != 0.0)
    if turns or rubs:
        return "is a wheel with a motor or with friction, which turns its body"
    return "is a wheel in a steady turn, which it resists by its momentum" if spins else ""


def _without_thrust(model: Any) -> dict[str, Array]:
    found = model.thrusters.copy()
    found["force"], found["profile"] = 0.0, -1
    return {"thrusters": found}


def _at_rotor(model: Any, k: int, moment: Moment, _: bool) -> Iterator[tuple[Any, ...]]:
    row, (time, y, _s) = model.wheels[k], moment
    yield float(y[row["iq"]]), float(y[row["iv"]]), time


def _angles(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    for k, wheel in enumerate(records("wheels")):
        yield Block(SCALAR, wheel["iq"], wheel["iv"], k, wheel["inertia"])


def _impulses(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    for k, thruster in enumerate(records("thrusters")):
        yield Block(RATE, -1, thruster["iv"], k, 0.0)


def _wheels_bound(model: Any, _: Array, felt: Mapping[str, Array]) -> Iterator[Bound]:
    """Friction; a rotor on a light body counts with the body's share."""
    for k, row in enumerate(model.wheels):
        slope = row["viscous"] + (row["friction"] / row["slip"] if row["friction"] > 0.0 else 0.0)
        n, b = np.array(row["axis"]), int(row["body"])
        J = np.array(model.bodies["inertia"][b])
        left = 1.0 / float(n @ np.linalg.solve(J, n)) - row["inertia"] if np.linalg.det(J) > 0.0 else row["inertia"]
        yield k, 0.0, float(slope * (1.0 / row["inertia"] + 1.0 / left))


def _controllers_bound(model: Any, _: Array, felt: Mapping[str, Array]) -> Iterator[Bound]:
    """Gains are felt by the body."""
    for row in model.controllers:
        b = int(row["body"])
        R = np.array(model.bodies["R"][b])
        for what, gains in enumerate((row["proportional"], row["derivative"])):
            felt["bodies"][what, b, 3:, 3:] += R @ np.diag(gains) @ R.T
    return iter(())


def _sizes(model: Any, _: float) -> Iterator[tuple[Any, Any]]:
    """The angle that turns the body by 1 rad."""
    for wheel in model.wheels:
        body, n = model.bodies[wheel["body"]], wheel["axis"]
        about = n @ body["inertia"] @ n if body["motion"] == rigid.FREE else body["spin_inertia"]
        yield int(wheel["iv"]), max(1.0, float(about / wheel["inertia"]))


@calls.turning
def turning_wheels(factor, spin, y, model, a):
    """Minus that of the body about the axis, after bodies: a steady turn asks for no torque there."""
    n_q, wheels, bodies = model.info.nq, model.wheels, model.bodies
    for k in range(wheels.size):
        if bodies[wheels[k].body].motion == rigid.FREE:
            at, n = bodies[wheels[k].body].iv - n_q + 3, wheels[k].axis
            a[wheels[k].iv - n_q] = -(n[0] * a[at] + n[1] * a[at + 1] + n[2] * a[at + 2])


#: Torque on a wheel that is round-off, N m.
STILL = 1e-12


def _not_at_rest(model: Any) -> Iterator[tuple[int, str]]:
    """Wheels that friction or a motor accelerates, but those that a controller commands."""
    wheels, controllers, p = model.wheels, model.controllers, model.parameters
    own = controllers[controllers["actuators"] == attitude.WHEELS]
    commanded = {int(i) for row in own for i in p[row["place"] :][: row["count"]]}
    for k in range(wheels.size):
        torque = wheels["motor"][k] - wheels["drag"][k] if k not in commanded else 0.0
        if abs(torque) > STILL:
            why = (
                f"has torques of motor and friction that add up to {torque:.6g} N m, which changes its rate: there is "
                f"no equilibrium; take its `rate`, its friction or its torque away"
            )
            yield k, why


@calls.momentum
def own_rates(y, model, rates):
    """Thrusts, which are the rates of the impulses; these are noted at the end of a step."""
    for k in range(model.thrusters.size):
        rates[model.thrusters[k].iv - model.info.nq] = y[model.thrusters[k].iv]


@calls.note_extremes
def note_motors(s, model):
    """Extremes of the motor torques of all wheels."""
    for i in range(model.wheels.size):
        note_extremes(model.wheels[i].extremes, 0, model.wheels[i].motor)


# rate and angle of a wheel relative to its body, impulse of a thruster at iv; profile: index among the parameters,
# or -1; actuators of a controller: their kind, and `count` numbers from `place` on, then how they share its torque
WHEELS = Family(
    "wheels",
    record(
        "body iq iv profile law first last",
        "axis inertia torque torque_limit rate_limit viscous friction slip",
        "command motor drag coriolis motor0 drag0 angle rate rubs spin momentum kinetic extremes",
        axis=_3, momentum=_3, extremes=(2,),
    ),
    order=390,
    results={
        "angle": ("angle", "rad", "angle of the wheel relative to its body"),
        "rate": ("rate", "rad s-1", "rate of the wheel relative to its body"),
        "motor": ("torque", "N m", "torque of the motor on the wheel"),
        "rubs": ("friction_torque", "N m", "torque of friction on the wheel"),
        "spin": ("wheel_momentum", "kg m2 s-1", "angular momentum relative to the body, about the axis"),
        "momentum": ("angular_momentum", "kg m2 s-1", "angular momentum relative to the body, inertial axes"),
        "kinetic": ("energy_kinetic", "J", "kinetic energy beyond that of the wheel fixed in its body"),
    },
    kinds=(
        Kind("a reaction wheel", symmetric=True),
    ),
    ends=of_bodies("body"),
    isolated=lambda found, records: bool(np.all(records("bodies")["motion"][found["body"]] == rigid.FREE)),
    force=actuator_force,
    tangent=actuator_tangent,
    energy=energy,
    momentum=momentum,
    laws=(Law("spring", calls_law, _at_rotor),),
    shares=Shares(
        refused=_wheel_refused,
        remark="the momentum of {names} does no work at rest, and no motor turns it: no share",
    ),
    smooth=True,
    stiff=False,
    of_step=False,
    adjoint=AdjointSupport("its torque follows from the state and time, with all derivatives"),
    coupling=Coupling(within=True),
    state=State(unknowns=(Coordinates(_angles, 60, len, spins=True),), sizes=_sizes),
    inertia=Inertia(force=inertia, tangent=inertia_tangent, turning=turning_wheels),
    friction=Friction(until_turn=until_turn),
    explicit=Explicit(force=explicit_force, end=explicit_end),
    stability=Stability(by_rates=False, bound=_wheels_bound),
    implicit=Implicit(end_step=end_step),
    step=Step(inertia=step_inertia, inertia_tangent=step_inertia_tangent),
    statics=Statics(not_at_rest=_not_at_rest),
    samples=Samples(local=True, evaluate=evaluate, extremes=("motor",), note_extremes=note_motors),
)  # fmt: skip

THRUSTERS = Family(
    "thrusters",
    record(
        "body iv profile", "local direction force limit", "command push push0 impulse place vector",
        local=_3, direction=_3, place=_3, vector=_3,
    ),
    order=400,
    results={
        "push": ("thrust", "N", "force of the thruster"),
        "impulse": ("impulse", "N s", "integral of the thrust since the start"),
        "place": ("position", "m", "position of the thruster, inertial axes"),
        "vector": ("force", "N", "force on the body, inertial axes"),
    },
    kinds=(
        Kind("a thruster"),
    ),
    force=actuator_force,
    tangent=actuator_tangent,
    shares=Shares((Rule(LOAD),), place=15, unforced=_without_thrust),
    smooth=True,
    stiff=False,
    of_step=False,
    adjoint=AdjointSupport("its force follows from the attitude and time"),
    parts=Parts(changes="force limit", reads_inertia=False),
    state=State(unknowns=(Coordinates(_impulses, 90, lambda found: 0),)),
    inertia=Inertia(force=inertia, tangent=inertia_tangent),
    explicit=Explicit(force=explicit_force, end=explicit_end),
    stability=Stability(by_rates=False),
    implicit=Implicit(end_step=end_step),
    step=Step(rates=own_rates, inertia=step_inertia, inertia_tangent=step_inertia_tangent),
    statics=Statics(uneven=never),
    samples=Samples(local=True, evaluate=evaluate),
)  # fmt: skip

CONTROLLERS = Family(
    "controllers",
    record(
        "body actuators count place path law first last",
        "proportional derivative target axis limit dead_band",
        "error slip torque off",
        proportional=_3, derivative=_3, target=(4,), axis=_3, error=_3, slip=_3, torque=_3,
    ),
    order=280,
    results={
        "error": ("error", "rad", "rotation vector from the target to the body, body axes"),
        "off": ("error_angle", "rad", "angle between the target and the body"),
        "slip": ("rate_error", "rad s-1", "angular velocity relative to the target, body axes"),
        "torque": ("torque", "N m", "commanded torque, body axes"),
    },
    kinds=(
        Kind("an attitude controller"),
    ),
    isolated=True,
    laws=(Law(DRIVE, lambda found: (found["law"] != 0) & (found["path"] == LAW)),),
    of_step=False,
    parts=Parts(changes="proportional derivative limit dead_band"),
    stability=Stability(bound=_controllers_bound),
    samples=Samples(local=True, evaluate=evaluate),
)  # fmt: skip
