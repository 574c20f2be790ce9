"""Attitude hardware: reaction wheels, thrusters, and controllers that command them."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import scipy

from evolvent.assembly.builder import Builder
from evolvent.families.attitude import attitude as kernels
from evolvent.kernels import drive as drives, rigid
from evolvent.parts.applies import OF_LAW, Applies, given
from evolvent.parts.base import BodyName, Group, Part, PointReference, Reference, unit
from evolvent.parts.checks import check_rotor
from evolvent.parts.expression import Constants, Parameters, SpringLaw, refuse_without_law, write_law
from evolvent.parts.law import Drive
from evolvent.parts.profile import ForceProfile, TorqueProfile, write_profile
from evolvent_base import units
from evolvent_base.errors import InputError, counted, nearest

Actuators = Annotated[tuple[str, ...], Reference(what="reaction wheels or thrusters", several=True)]


def _moving(builder: Builder, name: str, body: str, motions: tuple[int, ...], what: str) -> int:
    """Index of a body that moves in one of these ways; InputError for others."""
    index = builder.find(body, "bodies")
    if builder.rows["bodies"][index]["motion"] not in motions:
        found = "the ground" if body == "ground" else f"a {_motion(builder, index)} body"
        raise InputError(f"{name} is {body!r}, {found}; it must be {what}")
    return index


def _motion(builder: Builder, index: int) -> str:
    return {rigid.DRIVEN: "driven", rigid.SPIN: "spinning", rigid.FREE: "free"}[builder.rows["bodies"][index]["motion"]]


def _profile(builder: Builder, name: str, profile: Any) -> int:
    """Index of a profile among the parameters, -1 for none."""
    return -1 if profile is None else builder.parameters(write_profile(builder, f"{name}.profile", profile))[0]


class ReactionWheel(Part):
    """A wheel in a body, turned by a motor that reacts on the body.

    Parameters
    ----------
    body : str
        Free or spinning body on which the wheel is mounted.
    inertia : float, kg m2
        Moment of inertia about the wheel's axis. The inertia of the body includes that of the wheel at rest.
    axis : (3,) float
        Axis of the wheel, body axes.
    rate : float, rad/s
        Angular velocity relative to the body at the start.
    torque : float, N m
        Constant torque of the motor on the wheel; the opposite torque acts on the body.
    profile : optional
        Torque of the motor as a function of time, N m, added to `torque`.
    law : optional
        Torque of the motor, N m, added to both: an expression of the wheel's angle x (rad), its rate v (rad/s) and t
        (s), or a function under ``@evolvent.law``: ``law(angle, rate, t, parameters) -> torque``.
    parameters : list of float
        Of a Python law.
    constants : mapping of names to float
        Of an expression.
    torque_limit : float, N m, optional
        Largest torque of the motor, including that of a controller.
    rate_limit : float, rad/s, optional
        Largest rate to which the motor accelerates the wheel. The torque decreases to zero over the last 1 % of it.
    viscous_damping : float, N m s/rad
        Coefficient of viscous friction.
    friction_torque : float, N m
        Coulomb friction, friction_torque tanh(rate/slip_rate).
    slip_rate : float, rad/s
        Rate at which Coulomb friction reaches three quarters of `friction_torque`.
    centre : (3,) float, m
        Centre of the wheel in drawings, body axes. The body's mass includes that of the wheel.
    radius : float, m, optional
        Radius of the wheel in drawings; a symbol is drawn if left out.

    Notes
    -----
    With the body's inertia J, the wheel's J_w about its axis n (body axes), the rate W and the torque Q of motor and
    friction: J w' + J_w W' n + w x (J w + J_w W n) = T and J_w (W' + n . w') = Q. Energy-momentum keeps the energy of
    both and their angular momentum exactly. In equilibria and modes a wheel keeps its rate W at the start, whose
    momentum acts on a body that turns; its angle is an unknown, so that Q = 0 in an equilibrium.
    """

    applies: ClassVar[Applies] = {
        **OF_LAW,
        "slip_rate": (given("friction_torque"),),
    }
    kind: Literal["reaction-wheel"] = "reaction-wheel"
    group = Group.CONTROL
    symbol = "wheel"
    body: BodyName
    inertia: units.Inertia
    axis: units.Direction = (0.0, 0.0, 1.0)
    rate: units.AngularRate = 0.0
    torque: units.Torque = 0.0
    profile: TorqueProfile | None = None
    law: SpringLaw | None = None
    parameters: Parameters = ()
    constants: Constants | None = None
    torque_limit: units.TorqueOrZero | None = None
    rate_limit: units.AngularRate | None = None
    viscous_damping: units.RotationalDampingOrZero = 0.0
    friction_torque: units.TorqueOrZero = 0.0
    slip_rate: units.AngularRate = 0.1
    centre: units.Position = (0.0, 0.0, 0.0)
    radius: units.Length | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write the wheel into the family `wheels`."""
        body = _moving(builder, f"{name}.body", self.body, (rigid.FREE, rigid.SPIN), "a free or spinning body")
        axis = unit(self.axis)
        check_rotor(builder.rows["bodies"][body], axis, self.inertia, f"{name}.inertia", self.body)
        for key in ("rate_limit", "slip_rate"):
            value = getattr(self, key)
            if value is not None and value <= 0.0:
                raise InputError(f"{name}.{key} is {value!r} rad/s; it must be above 0")
        if self.rate_limit is not None and abs(self.rate) > self.rate_limit:
            raise InputError(f"{name}.rate is {self.rate!r} rad/s; {name}.rate_limit is {self.rate_limit!r} rad/s")
        law = {"law": 0, "first": 0, "last": 0}
        if self.law is None:
            refuse_without_law(name, self)
        else:
            law = write_law(builder, name, self.law, "spring", self.parameters, self.constants)
        q, v = builder.coordinates([0.0], [self.rate])
        index = builder.add(
            "wheels", body=body, iq=q, iv=v, axis=axis, inertia=self.inertia, torque=self.torque,
            torque_limit=math.inf if self.torque_limit is None else self.torque_limit,
            rate_limit=math.inf if self.rate_limit is None else self.rate_limit,
            viscous=self.viscous_damping, friction=self.friction_torque, slip=self.slip_rate,
            profile=_profile(builder, name, self.profile), **law,
        )  # fmt: skip
        builder.names[name] = ("wheels", index)


class Thruster(Part):
    """A thruster on a body: a force in one direction of the body, by a profile or by the command of a controller.

    Parameters
    ----------
    at : point
        Point on a free or spinning body, such as "hub.nozzle".
    direction : (3,) float
        Direction of the force on the body, body axes.
    thrust : float, N
        Largest force.
    profile : optional
        Force as a function of time, N, added to the command of a controller. A negative sum gives no force.

    Notes
    -----
    The decrease of the propellant mass is not modelled.
    """

    kind: Literal["thruster"] = "thruster"
    group = Group.CONTROL
    symbol = "thruster"
    at: PointReference
    direction: units.Direction
    thrust: units.Force
    profile: ForceProfile | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write the thruster into the family `thrusters`."""
        if self.thrust <= 0.0:
            raise InputError(f"{name}.thrust is {self.thrust!r} N; it must be above 0 N")
        place = builder.location(self.at, f"{name}.at")
        if place.family == "bodies" and place.row == builder.names["ground"][1]:
            raise InputError(
                f"{name}.at is {self.at!r}, on the ground, which no load moves; give a point on a free or spinning body"
            )
        if place.family != "bodies":
            raise InputError(f"{name}.at is {self.at!r}; a thruster needs a point on a free or spinning body")
        if builder.rows["bodies"][place.row]["motion"] == rigid.DRIVEN:
            raise InputError(
                f"{name}.at is {self.at!r}, on a driven body, on which forces have no effect; make it free or spinning"
            )
        _, v = builder.coordinates([], [0.0])
        index = builder.add(
            "thrusters", body=place.row, iv=v, local=place.local, direction=unit(self.direction), force=0.0,
            limit=self.thrust, profile=_profile(builder, name, self.profile),
        )  # fmt: skip
        builder.names[name] = ("thrusters", index)


class AttitudeController(Part):
    """A proportional-derivative controller of the attitude of a free body by reaction wheels or thrusters.

    Parameters
    ----------
    body : str
        Free body that is controlled.
    actuators : list of str
        Names of reaction wheels, or of thrusters, on that body.
    proportional : float or (3,) float, N m/rad
        Gains P of the attitude error, about the body's axes.
    derivative : float or (3,) float, N m s/rad
        Gains D of the angular velocity error.
    target : (4,) float, or mapping, optional
        Target attitude, in one of the forms of the ``orientation`` of a body: from body to inertial axes; the attitude
        at the start if left out.
    axis : (3,) float
        Axis of the slew `path`, in the axes of `target`.
    path : a drive of `evolvent.parts`, optional
        Slew angle about `axis`, measured from `target`, as a function of time. Its rate is the target angular velocity.
    limit : float, N m, optional
        Largest commanded torque about each axis.
    dead_band : float, N m
        Torque about an axis below which the command is zero; above it the command is reduced by this value.

    Notes
    -----
    The commanded torque is -(P e + D d), with the rotation vector e from the target to the body, of at most 180
    degrees, and the difference d of the angular velocities, all in body axes. About one axis J e'' + D e' + P e = 0:
    the angular frequency is sqrt(P/J) and the damping ratio D/(2 sqrt(P J)), with the body's inertia J less
    J_w (axis . wheel)^2 of every wheel. The torque is distributed over wheels by the pseudo-inverse of their axes, and
    over thrusters by non-negative least squares for each of the six torques about the body's axes, without a resulting
    force where possible.

    Generalized-alpha evaluates the command at the end of a step, energy-momentum at its middle: both are of second
    order, and of first order in a step in which the command jumps. Newton's method includes the gains.
    """

    kind: Literal["attitude-controller"] = "attitude-controller"
    group = Group.CONTROL
    body: BodyName
    actuators: Actuators
    proportional: units.Gains
    derivative: units.RateGains
    target: units.Quaternion | None = None
    axis: units.Direction = (0.0, 0.0, 1.0)
    path: Drive | None = None
    limit: units.TorqueOrZero | None = None
    dead_band: units.TorqueOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the controller into the family `controllers`."""
        body = _moving(builder, f"{name}.body", self.body, (rigid.FREE,), "a free body")
        family, indices = self._actuators(builder, name, body)
        gains = []
        for key in ("proportional", "derivative"):
            given = np.array(getattr(self, key), dtype=float)
            if given.shape not in ((), (3,)):
                raise InputError(
                    f"{name}.{key} has {counted(given.size, 'value')}; it must be one, or three about the body's axes"
                )
            gains.append(np.broadcast_to(given, 3))
        active = (gains[0] > 0.0) | (gains[1] > 0.0)
        if not np.any(active):
            raise InputError(f"{name}.proportional and {name}.derivative are 0 about every axis; give a gain")
        rows = [builder.rows[family][k] for k in indices]
        shares = _wheel_shares(name, rows, active) if family == "wheels" else _thruster_shares(name, rows, active)
        place, _ = builder.parameters([*indices, *shares.ravel()])
        path = {"path": -1, "first": 0, "last": 0, "law": 0}
        if self.path is not None:
            row = self.path.write(builder, f"{name}.path")
            if row.kind == drives.FREE:
                raise InputError(f"{name}.path is a free spool; it must be a drive that prescribes the angle")
            path = {"path": row.kind, "first": row.first, "last": row.last, "law": row.law}
        index = builder.add(
            "controllers", body=body, actuators=kernels.WHEELS if family == "wheels" else kernels.THRUSTERS,
            count=len(indices), place=place, proportional=gains[0], derivative=gains[1],
            target=self._target(builder, body), axis=unit(self.axis),
            limit=math.inf if self.limit is None else self.limit, dead_band=self.dead_band, **path,
        )  # fmt: skip
        builder.names[name] = ("controllers", index)

    def _target(self, builder: Builder, body: int) -> np.ndarray:
        """Unit quaternion of the target."""
        if self.target is not None:
            return unit(self.target)
        first = builder.rows["bodies"][body]["iq"] + 3
        return unit(builder.q[first : first + 4])

    def _actuators(self, builder: Builder, name: str, body: int) -> tuple[str, list[int]]:
        """Family of the actuators and their indices; all of one kind, on the body."""
        known = [n for n, (family, _) in builder.names.items() if family in ("wheels", "thrusters")]
        if not self.actuators:
            raise InputError(f"{name}.actuators is empty; it needs reaction wheels or thrusters")
        found = []
        for actuator in self.actuators:
            family, index = builder.names.get(actuator, ("", -1))
            if family not in ("wheels", "thrusters"):
                raise InputError(
                    f"{name}.actuators: {actuator!r} is not a reaction wheel or thruster; {nearest(actuator, known)}"
                )
            if builder.rows[family][index]["body"] != body:
                raise InputError(f"{name}.actuators: {actuator!r} is not on {self.body!r}, the controlled body")
            if (family, index) in found:
                raise InputError(f"{name}.actuators names {actuator!r} twice")
            found.append((family, index))
        families = {family for family, _ in found}
        if len(families) > 1:
            raise InputError(f"{name}.actuators has reaction wheels and thrusters; give each kind its own controller")
        return families.pop(), [index for _, index in found]


def _wheel_shares(name: str, rows: list[dict[str, Any]], active: np.ndarray) -> np.ndarray:
    """Torques of the motors for a torque on the body: (wheels, 3)."""
    axes = np.array([row["axis"] for row in rows]).T
    shares = -np.linalg.pinv(axes)
    for c in np.flatnonzero(active):
        if np.linalg.norm(-axes @ shares[:, c] - np.eye(3)[c]) > 1e-9:
            raise InputError(_no_torque_message(name, "xyz"[c], "wheels"))
    return shares


def _thruster_shares(name: str, rows: list[dict[str, Any]], active: np.ndarray) -> np.ndarray:
    """Forces of the thrusters for torques of 1 N m about x, y, z, -x, -y, -z: (thrusters, 6)."""
    forces = np.array([row["direction"] for row in rows]).T
    torques = np.array([np.cross(row["local"], row["direction"]) for row in rows]).T
    reach = max(float(np.abs(torques).max()), 1e-300)
    found = np.zeros((len(rows), 6))
    for k in range(6):
        if not active[k % 3]:
            continue
        wanted = np.eye(3)[k % 3] * (1.0 if k < 3 else -1.0)
        # without a force where that can be, torques and forces of like size
        share, left = scipy.optimize.nnls(np.vstack([torques / reach, forces]), np.concatenate([wanted, np.zeros(3)]))
        if left > 1e-9:
            share, left = scipy.optimize.nnls(torques / reach, wanted)
        if left > 1e-9:
            raise InputError(_no_torque_message(name, ("" if k < 3 else "-") + "xyz"[k % 3], "thrusters"))
        found[:, k] = share / reach
    return found


def _no_torque_message(name: str, axis: str, what: str) -> str:
    return (
        f"{name}.actuators: these {what} cannot produce a torque about {axis} alone; add one, or set the gains about "
        f"{axis.removeprefix('-')} to 0"
    )
