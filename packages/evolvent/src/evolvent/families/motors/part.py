"""Motor on the coordinate of a joint."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

from evolvent.assembly.builder import Builder
from evolvent.families.coordinates import coordinate_laws
from evolvent.families.joints.part_coordinate import PRESLIDING, check_units, find_coordinate
from evolvent.families.joints.part_release import ReleaseName, release_fields
from evolvent.parts.applies import OF_LAW, Applies, given, left_out
from evolvent.parts.base import CoordinateName, Group, Part
from evolvent.parts.drive import FreeSpool
from evolvent.parts.law import Constants, Parameters, PathDrive, SpringLaw, write_law
from evolvent.parts.profile import AS_PROFILE, Profile, write_profile
from evolvent_base import units
from evolvent_base.errors import InputError

#: Keys of which a motor has one.
WAYS = ("torque", "law", "motion", "voltage", "current")
_TorqueOrForceProfile = Annotated[Profile[units.TorqueOrForce], AS_PROFILE]
_VoltageProfile = Annotated[Profile[units.Voltage], AS_PROFILE]
_CurrentProfile = Annotated[Profile[units.Current], AS_PROFILE]


class Motor(Part):
    """A motor that drives the angle of a revolute joint (torque, N m) or the travel of a prismatic one (force, N).

    Parameters
    ----------
    joint : str
        A `JointSpring`, whose coordinate is driven, or a revolute or prismatic `Joint`,
        whose coordinate is then 0 at the start.
    torque : profile, N m or N
        Function of time: a table of rows [time, value], or one of the keys ramp, sine, pulse, constant, expression.
    law : expression or function
        Torque in place of a profile: an expression of the coordinate x (rad or m), its rate v and t (s), or a function
        under ``@evolvent.law``: ``law(x, v, t, parameters) -> torque``.
    parameters : list of float
        Of a Python law.
    constants : mapping of names to float
        Of an expression.
    motion : a drive of `evolvent.parts`, rad or m
        Reference r for the coordinate x, with the torque of a PD law: position_gain (r - x) + velocity_gain (r' - v).
    position_gain, velocity_gain : float, N m/rad and N m s/rad, or N/m and N s/m
        Gains of the PD law.
    limit : float, N m or N, optional
        Largest absolute value of the torque or force.
    rate_limit : float, rad/s or m/s, optional
        With `motion`: largest absolute value of the commanded rate r' + position_gain/velocity_gain (r - x).
    voltage : profile, V
        Voltage U at the winding, in place of `torque`: the current is (U - K n v)/R, with the back-EMF K n v.
    current : profile, A
        Current i of the winding, in place of `torque`.
    torque_constant : float, N m/A
        K of the rotor, which is also the constant of the back-EMF (V s/rad). The joint's torque is n K i.
    resistance : float, ohm
        R of the winding.
    ratio : float
        Turn of the rotor for that of the coordinate, n (rad/rad, or rad/m of a travel).
    detent_torque : float, N m
        Amplitude A of the rotor's detent torque (cogging), which has an energy and loses none.
    detents : int
        Cycles of the detent torque in a turn of the rotor. The rotor starts at rest in one of them.
    hysteresis_torque : float, N m
        Of the rotor: magnetic hysteresis, and friction of the rotor's bearings.
    eddy_damping : float, N m s/rad
        Of the rotor: eddy currents.
    efficiency : float
        Of the gear where the motor drives.
    back_efficiency : float
        Of the gear where the load drives; 0: the gear locks itself, up to `holding_torque`.
    holding_torque : float, N m or N
        Torque or force at the joint that a gear which locks itself holds.
    bristle_stiffness : float, N m/rad or N/m, optional
        Stiffness of stiction of hysteresis and gear; by default they slip after 1e-4 rad or 1e-5 m.
    until : float, s, optional
        Time at which the motor is switched off (its winding is open, its losses remain); never if left out.
    released_by : str, optional
        `Event` that switches the motor off, or spring whose latch does so when it locks.

    Notes
    -----
    Give one of `torque`, `law`, `motion`, `voltage` and `current`. Inductance is neglected. The inertia of a rotor is
    not that of a motor: add a spinning body and a joint of type "gear". Losses and gear take from the torque of any
    motor; `torque`, `law`, `motion` and `limit` are those before that. The torque acts between the two parts of the
    joint; a positive torque increases the coordinate. Its work counts as work of drives. A motor that is switched off
    has no torque: it leaves the coordinate free.
    """

    applies: ClassVar[Applies] = {
        **{way: (left_out(*(other for other in WAYS if other != way)),) for way in WAYS},
        **OF_LAW,
        **{key: (given("motion"),) for key in ("position_gain", "velocity_gain", "rate_limit")},
        **{key: (given("voltage", "current"),) for key in ("torque_constant", "resistance")},
        "detents": (given("detent_torque"),),
        "holding_torque": (given("back_efficiency"),),
    }
    kind: Literal["motor"] = "motor"
    group = Group.CONTROL
    symbol = "motor"
    joint: CoordinateName
    torque: _TorqueOrForceProfile | None = None
    law: SpringLaw | None = None
    parameters: Parameters = ()
    constants: Constants | None = None
    motion: PathDrive | None = None
    position_gain: units.CoordinateStiffnessOrZero = 0.0
    velocity_gain: units.CoordinateDampingOrZero = 0.0
    voltage: _VoltageProfile | None = None
    current: _CurrentProfile | None = None
    torque_constant: units.TorqueConstant | None = None
    resistance: units.Resistance | None = None
    ratio: units.PositiveNumber = 1.0
    detent_torque: units.TorqueOrZero = 0.0
    detents: Annotated[int, units.Whole(least=1, most=100_000)] | None = None
    hysteresis_torque: units.TorqueOrZero = 0.0
    eddy_damping: units.RotationalDampingOrZero = 0.0
    efficiency: units.Fraction = 1.0
    back_efficiency: units.Fraction = 1.0
    holding_torque: units.TorqueOrForceLimit | None = None
    bristle_stiffness: units.CoordinateStiffness | None = None
    limit: units.TorqueOrForceLimit | None = None
    rate_limit: units.RateLimit | None = None
    until: units.Duration | None = None
    released_by: ReleaseName | None = None

    def _check(self, name: str) -> None:
        """Refuse keys that do not go together."""
        ways = [key for key in WAYS if getattr(self, key) is not None]
        if len(ways) != 1:
            found = f"has {' and '.join(ways)}" if ways else "has no torque"
            given = ", ".join(f"{name}.{key}" for key in WAYS[:-1])
            raise InputError(f"{name} {found}; give one of {given} and {name}.{WAYS[-1]}")
        self._check_losses(name, ways[0])
        if self.motion is None:
            for key in ("position_gain", "velocity_gain", "rate_limit"):
                if getattr(self, key):
                    raise InputError(f"{name}.{key} belongs to {name}.motion, but {name}.{ways[0]} is given")
        elif isinstance(self.motion, FreeSpool):
            raise InputError(f"{name}.motion is a free spool, which prescribes no motion; give another drive")
        elif self.position_gain == 0.0 and self.velocity_gain == 0.0:
            raise InputError(f"{name}.position_gain and {name}.velocity_gain are 0; one of them must be above 0")
        elif self.rate_limit is not None and self.velocity_gain == 0.0:
            raise InputError(f"{name}.velocity_gain is 0; {name}.rate_limit needs it above 0")
        if self.law is None:
            for key in ("parameters", "constants"):
                if getattr(self, key):
                    raise InputError(f"{name}.{key} belongs to {name}.law, but {name}.{ways[0]} is given")

    def _check_losses(self, name: str, way: str) -> None:
        """Refuse electric keys without the others, detents without their number, and gears that cannot be."""
        electric = way in ("voltage", "current")
        for key in ("torque_constant", "resistance"):
            if electric and getattr(self, key) is None:
                raise InputError(f"{name}.{key} is missing; {name}.{way} needs it")
            if not electric and getattr(self, key) is not None:
                raise InputError(f"{name}.{key} belongs to {name}.voltage or {name}.current, but {name}.{way} is given")
        if (self.detent_torque > 0.0) != (self.detents is not None):
            raise InputError(f"{name}.detent_torque and {name}.detents go together; give both or neither")
        if self.efficiency == 0.0:
            raise InputError(f"{name}.efficiency is 0.0; a gear that turns needs one above 0")
        if (self.back_efficiency == 0.0) != (self.holding_torque is not None):
            raise InputError(
                f"{name}.holding_torque belongs to a gear that locks itself, with {name}.back_efficiency 0; give both "
                f"or neither"
            )

    @property
    def rubs(self) -> bool:
        """Whether the motor loses anything as friction does."""
        return bool(self.hysteresis_torque or self.efficiency < 1.0 or self.back_efficiency < 1.0)

    @property
    def has_drivetrain(self) -> bool:
        """Whether the motor has a winding, or loses anything before its joint."""
        return bool(self.rubs or self.detent_torque or self.eddy_damping or self.torque_constant is not None)

    def _add_drivetrain(self, builder: Builder, name: str, h: int, motor: int) -> None:
        """Write the row of the family `drivetrains`."""
        row = builder.rows["coordinates"][h]
        stick = self.bristle_stiffness
        if not self.rubs:
            stick = 1.0  # nothing slips
        elif stick is None:
            stick = self._most() / PRESLIDING[row["kind"]]
        if stick == 0.0:
            raise InputError(
                f"{name}.bristle_stiffness is missing; it does not follow from {name}.hysteresis_torque, {name}.limit "
                f"or the size of the torque, voltage or current"
            )
        builder.add(
            "drivetrains", coordinate=h, motor=motor, ratio=self.ratio, detent=self.detent_torque,
            detents=float(self.detents or 0), offset=row["angle"], hysteresis=self.hysteresis_torque,
            eddy=self.eddy_damping, forward=self.efficiency, backward=self.back_efficiency,
            holds=self.holding_torque or 0.0, stick=stick, anchor=row["angle"],
        )  # fmt: skip

    def _most(self) -> float:
        """Torque at the joint that the motor has at most, as far as its keys say; 0 where they do not."""
        rotor = self.ratio * (self.hysteresis_torque + self.detent_torque)
        by_current = self.ratio * (self.torque_constant or 0.0)
        found = [rotor, float(self.holding_torque or 0.0), float(self.limit or 0.0), _largest(self.torque)]
        found += [by_current * _largest(self.current), by_current * _largest(self.voltage) / (self.resistance or 1.0)]
        return max(found)

    def write(self, builder: Builder, name: str) -> None:
        """Write the row of the family `motors`."""
        self._check(name)
        hinge = find_coordinate(builder, f"{name}.joint", self.joint)
        for key in (
            "torque",
            "motion",
            "position_gain",
            "velocity_gain",
            "holding_torque",
            "bristle_stiffness",
            "limit",
            "rate_limit",
        ):
            check_units(f"{name}.{key}", getattr(self, key), builder.rows["coordinates"][hinge]["kind"])
        row: dict[str, Any] = {"drive": 0, "law": 0}
        kinds = {"torque": coordinate_laws.BY_PROFILE, "voltage": coordinate_laws.BY_VOLTAGE}
        kinds |= {"current": coordinate_laws.BY_CURRENT}
        way = next((key for key in kinds if getattr(self, key) is not None), None)
        if way is not None:
            first, last = builder.parameters(write_profile(builder, f"{name}.{way}", getattr(self, way)))
            row |= {"kind": kinds[way], "first": first, "last": last}
        elif self.law is not None:
            row |= {"kind": coordinate_laws.BY_LAW}
            row |= write_law(builder, name, self.law, "spring", self.parameters, self.constants)
        elif self.motion is not None:
            drive = self.motion.write(builder, f"{name}.motion")
            row |= {"kind": coordinate_laws.BY_MOTION, "drive": drive.kind, "law": drive.law}
            row |= {"first": drive.first, "last": drive.last}
        index = builder.add(
            "motors",
            coordinate=hinge,
            position_gain=self.position_gain,
            velocity_gain=self.velocity_gain,
            limit=math.inf if self.limit is None else self.limit,
            rate_limit=math.inf if self.rate_limit is None else self.rate_limit,
            **row,
            constant=self.ratio * (self.torque_constant or 0.0),
            resistance=self.resistance or 0.0,
            **release_fields(builder, name, self),
        )
        if self.has_drivetrain:
            self._add_drivetrain(builder, name, hinge, index)
        builder.names[name] = ("motors", index)


def _largest(profile: Profile[Any] | None) -> float:
    """Largest size of a profile; 0 of one by an expression, or of none."""
    if profile is None:
        return 0.0
    sizes = [0.0, profile.constant or 0.0]
    if profile.table is not None:
        sizes += [value for _, value in profile.table]
    if profile.ramp is not None:
        sizes += [profile.ramp.initial, profile.ramp.final]
    if profile.pulse is not None:
        sizes.append(profile.pulse.value)
    if profile.sine is not None:
        sizes.append(abs(profile.sine.amplitude) + abs(profile.sine.offset))
    return float(max(abs(value) for value in sizes))
