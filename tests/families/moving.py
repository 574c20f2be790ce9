"""Systems with every family on bodies that move: free, spinning and driven ones, all with velocities."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import evolvent
from evolvent import System, parts
from evolvent.assembly.builder import Builder
from evolvent.families.joints.part_sides import point_side
from evolvent.parts.base import unit
from implicit.test_tangent import JOINTS, beam, bodies, together

FREE, SPIN, DRIVEN = ("free", (0.1, 0.2, -0.3)), ("spin", (0.2, -0.1, 0.3)), ("driven", (0.1, 0.2, -0.3))
#: Pairs of places on bodies, points and the ground.
PAIRS: list[tuple[Any, Any]] = [
    (FREE, SPIN), (DRIVEN, "point"), ("point", FREE), ((0.1, 0.7, 0.3), "other"), (SPIN, DRIVEN), (FREE, DRIVEN)
]  # fmt: skip
INERTIA = [[0.2, 0.01, 0.02], [0.01, 0.3, -0.02], [0.02, -0.02, 0.25]]
TWIST = (0.3, 0.2, 0.9)
#: Of position and velocity.
LAW = ["-2*x*y + 0.5*vy + 0.3", "1.5*sin(z) - 0.4*vx*vz", "x - 3*z*y + 0.2*vz"]
SYSTEMS: dict[str, Callable[[], System]] = {}


def enter(
    name: str, gravity: tuple[float, float, float] = (0.3, -1.0, 0.2)
) -> Callable[[Callable[[System], None]], Callable[[System], None]]:
    """Enter a function that adds parts to the bodies of each motion under a name."""

    def entered(add: Callable[[System], None]) -> Callable[[System], None]:
        def system() -> System:
            found = System(gravity=gravity)
            bodies(found)
            add(found)
            return found

        SYSTEMS[name] = system
        return add

    return entered


@evolvent.law
def rubbing(extension, rate, t, p):  # type: ignore[no-untyped-def]
    return p[0] * extension + p[1] * extension**3 + p[2] * rate * abs(rate)


@evolvent.law
def coupled(t, x, v, p, f):  # type: ignore[no-untyped-def]
    """A spring and a damper along the line between two points."""
    length = 0.0
    for c in range(3):
        length += (x[3 + c] - x[c]) ** 2
    length = length**0.5
    rate = 0.0
    for c in range(3):
        rate += (v[3 + c] - v[c]) * (x[3 + c] - x[c]) / length
    for c in range(3):
        pull = (p[0] * (length - 0.4) + p[1] * rate) * (x[3 + c] - x[c]) / length
        f[c] += pull
        f[3 + c] -= pull
    return 0.5 * p[0] * (length - 0.4) ** 2, p[1] * rate * rate


@enter("springs")
def springs(system: System) -> None:
    """Of every kind, with dampers."""
    for k, (a, b) in enumerate(PAIRS):
        kind: dict[str, Any] = {"stiffness": 30.0, "damping": 4.0}
        if k % 2:
            kind = {"law": rubbing, "parameters": (30.0, 20.0, 3.0)}
        system.add(parts.Spring(a=a, b=b, length=0.4, **kind))
    lateral = {"stiffness": 10.0, "damping": 1.0, "lateral_stiffness": 5.0, "lateral_damping": 3.0}
    system.add(parts.Spring(a=(0.5, 0.1, 0.2), b=FREE, axis=(0.3, 0.2, 0.9), **lateral))


def relaxing(slack: bool) -> Callable[[System], None]:
    """Viscoelastic springs, of which some are slack at the start, cords, and a harness and tapes on hinges."""

    def add(system: System) -> None:
        law = {"prony": [(0.3, 0.05), (0.2, 2.0)]}
        for k, (a, b) in enumerate(PAIRS):
            system.add(
                parts.Spring(
                    a=a, b=b, length=0.4 + 1.2 * (k % 2), stiffness=30.0, damping=4.0, slack=slack, viscoelastic=law
                )
            )
        if slack:
            return
        for a, b in PAIRS[:3]:
            system.add(parts.Joint(a=a, b=b, type="distance", stiffness=50.0, damping=2.0, viscoelastic=law))
        angles(system)
        curve = [(-9.0, -9.0), (-5.0, -3.0), (4.0, 7.0), (9.0, 9.0)]
        system.add(parts.Resistance(joint="hinge 0", type="harness", torque=curve, viscoelastic=law))
        tape = {"straight": [(-20.0, -9.0), (5.0, 3.0)], "folded": [(4.0, 1.0), (9.0, 1.0)], "state": "straight"}
        system.add(parts.Resistance(joint="hinge 1", type="tape-spring", viscoelastic=law, **tape))

    return add


enter("viscoelastic parts")(relaxing(slack=False))
enter("viscoelastic springs that only pull")(relaxing(slack=True))


@enter("custom forces")
def custom(system: System) -> None:
    """Between bodies and points."""
    for a, b in PAIRS:
        system.add(parts.CustomForce(points=[a, b], law=coupled, parameters=(30.0, 4.0)))


@enter("a node of a beam")
def nodes(system: System) -> None:
    """Springs and custom forces between nodes and bodies."""
    system.add(beam("assumed_strain"), "beam")
    system.add(parts.Spring(a=FREE, b="beam.tip", stiffness=3.0, damping=0.4, length=0.2))
    system.add(parts.CustomForce(points=[SPIN, "beam[1]"], law=coupled, parameters=(3.0, 0.4)))


def angles(system: System) -> None:
    """Hinges between bodies of every kind."""
    given = {"axis": TWIST, "stiffness": 4.0, "damping": 0.5, "rest": 0.3, "low": -0.2, "high": 0.1, "stop": 30.0}
    for k, (a, b) in enumerate((("ground", "free"), ("free", "spin"), ("spin", "free"), ("driven", "free"))):
        system.add(parts.JointSpring(a=a, b=b, **given), f"hinge {k}")


def travels(system: System) -> None:
    """Slides between bodies and points of every kind."""
    given = {"axis": (0.3, 1.0, -0.2), "stiffness": 40.0, "rest": 0.3, "damping": 3.0, "start": 0.7}
    sides = (("ground", FREE), ("free", SPIN), ("spin", "point"), ("driven", FREE), ("free", DRIVEN), ("spin", FREE))
    for k, (a, b) in enumerate(sides):
        system.add(parts.JointSpring(a=a, b=b, motion="translation", **given), f"slide {k}")


@enter("angles")
def angles_alone(system: System) -> None:
    """Hinges, and those of beams' nodes."""
    angles(system)
    system.add(beam("cable", position=(1.0, 1.6, 0.8)), "cable")
    system.add(beam("assumed_strain", position=(1.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0)), "beam")
    for body, node in (("free", "cable.root"), ("spin", "beam.root"), ("free", "beam.tip")):
        system.add(parts.JointSpring(a=body, b=node, axis=(0.0, 0.6, 0.8), stiffness=4.0, damping=0.5))


@enter("travels")
def travels_alone(system: System) -> None:
    """Slides, and one of a beam's node."""
    travels(system)
    system.add(beam("cable"), "cable")
    system.add(parts.JointSpring(a="free", b="cable.tip", axis=TWIST, motion="translation", stiffness=4.0, damping=0.5))


def bearings_between(**given: float) -> Callable[[System], None]:
    """Bearings of hinges and slides between bodies of every kind, some of which stick."""

    def add(system: System) -> None:
        sides = (((0.1, 0.7, 0.3), "free"), (SPIN, "free"), (FREE, "spin"))
        keys: list[dict[str, Any]] = [
            {"journal_radius": 0.3, "thrust_radius": 0.4, "span": 0.5, "coefficient": 0.3, "bristle_stiffness": 1e5},
            {"span": 0.4, "width": 0.6, "preload": 0.2, "coefficient": 0.5, "bristle_stiffness": 1e5},
            {"journal_radius": 0.2, "thrust_radius": 0.1, "preload": 1e3, "coefficient": 0.4, "bristle_stiffness": 20},
        ]
        for k, (a, b) in enumerate(sides):
            for n, own in enumerate(keys):
                type_ = "prismatic" if n == 1 else "revolute"
                system.add(parts.Joint(a=a, b=b, type=type_, axis=TWIST, **given), f"joint {k} {n}")
                system.add(parts.Bearing(joint=f"joint {k} {n}", **own), f"bearing {k} {n}")

    return add


enter("bearings")(bearings_between())
enter("bearings of soft joints")(bearings_between(stiffness=30.0, rotational_stiffness=20.0, damping=2.0))


@enter("motors and synchronizations")
def driven(system: System) -> None:
    """On hinges and slides."""
    angles(system)
    travels(system)
    system.add(parts.Motor(joint="hinge 1", law="2*sin(x) - 0.4*v*v"))
    system.add(parts.Motor(joint="hinge 0", motion=parts.ConstantDrive(rate=0.3), position_gain=3.0, velocity_gain=0.5))
    system.add(parts.Motor(joint="slide 1", law="3*x*v - 2"))
    for one, two in (("hinge 0", "hinge 1"), ("slide 1", "slide 2"), ("hinge 3", "hinge 1")):
        system.add(
            parts.Joint(type="synchronization", joints=[one, two], ratios=(1.0, -2.0), stiffness=20.0, damping=3.0)
        )


@enter("drivetrains")
def electric(system: System) -> None:
    """Motors with windings, detents, magnetic losses and gears, which slip and stick, on hinges and slides."""
    angles(system)
    travels(system)
    given = {"torque_constant": 0.3, "resistance": 2.0, "ratio": 2.0, "hysteresis_torque": 0.01, "eddy_damping": 0.02}
    given |= {"detent_torque": 0.05, "detents": 3, "efficiency": 0.8, "back_efficiency": 0.6}
    for joint, stick in (("hinge 0", 300.0), ("hinge 1", 0.1), ("slide 1", 300.0), ("slide 2", 0.1)):
        drive = {"voltage": {"constant": 9.0}} if joint.endswith("1") else {"current": {"constant": 0.9}}
        system.add(parts.Motor(joint=joint, **drive, **given, bristle_stiffness=stick))


@enter("resistances")
def resisted(system: System) -> None:
    """Harnesses whose bristles slip and stick, tapes and an adhesion, on hinges and slides."""
    angles(system)
    travels(system)
    for law, stick in (("slip", 0.5), ("dahl", 3.0)):
        for joint in ("hinge 0", "slide 1"):
            keys = {"bristles": [(stick, 40.0), (8.0 * stick, 0.01)], "law": law}
            system.add(
                parts.Resistance(joint=joint, type="harness", torque=[(-9.0, -9.0), (0.0, 0.2), (9.0, 5.0)], **keys)
            )
    tape = {"straight": [(-20.0, -9.0), (5.0, 3.0)], "folded": [(4.0, 1.0), (9.0, 0.5)], "state": "straight"}
    for joint in ("hinge 1", "slide 2"):
        system.add(parts.Resistance(joint=joint, type="tape-spring", **tape))
    system.add(parts.Resistance(joint="hinge 3", type="adhesion", strength=0.7, distance=0.3))


def geared(**given: float) -> Callable[[System], None]:
    """Gears between angles and travels of bodies that move."""

    def add(system: System) -> None:
        turned = {"inertia": INERTIA, "mass": 1.5, "velocity": (0.2, -0.1, 0.3), "angular_velocity": (0.3, -0.2, 0.4)}
        system.add(parts.RigidBody(**turned), "second")
        system.add(parts.RigidBody(**turned, position=(0.3, 0.1, 0.2)), "third")
        for name, a, b, kind in (
            ("hinge", "free", "second", "revolute"), ("pin", "spin", "third", "revolute"),
            ("slide", "free", "third", "prismatic"), ("way", "spin", "second", "prismatic"),
        ):  # fmt: skip
            joint = parts.Joint(a=(a, (0.1, 0.2, -0.3)), b=(b, (0.0, 0.0, 0.0)), type=kind, axis=TWIST)
            system.add(together(system, joint), name)
        for a, b, ratio in (
            ("hinge", "pin", 1.5), ("spin", "hinge", -2.0), ("slide", "way", 0.7), ("pin", "slide", 0.3),
            ("way", "spin", 1.3),
        ):  # fmt: skip
            system.add(parts.Joint(a=a, b=b, type="gear", ratio=ratio, **given))

    return add


enter("gears")(geared())
enter("soft gears")(geared(stiffness=50.0, damping=7.0))


@enter("penalties")
def penalties(system: System) -> None:
    """Of joints of every kind, with dampers."""
    for joints in JOINTS.values():
        for joint in joints:
            fitted = together(system, joint)
            fields = {f: getattr(fitted, f) for f in ("a", "b", "type", "axis")}
            system.add(parts.Joint(**fields, stiffness=300.0, damping=20.0))
    system.add(together(system, parts.Joint(a=FREE, b=SPIN, type="prismatic", axis=TWIST, stiffness=50.0, damping=9.0)))


def pulleys(**given: float) -> Callable[[System], None]:
    """Cords over points of bodies of every kind."""

    def add(system: System) -> None:
        cords: list[tuple[Any, Any, Any]] = [
            (FREE, SPIN, (0.9, -0.4, 0.6)), ((0.1, 0.7, 0.3), "other", FREE), ("point", FREE, "other"),
            (SPIN, (1.0, 0.2, 0.1), "point"), ((0.1, 0.7, 0.3), (0.9, -0.4, 0.6), FREE),
        ]  # fmt: skip
        cords += [(DRIVEN, FREE, SPIN), ("point", SPIN, DRIVEN)] if given else []
        for k, (a, b, over) in enumerate(cords):
            system.add(parts.Joint(a=a, b=b, over=over, type="pulley", ratio=1.0 + 0.7 * k, **given))
        system.add(beam("assumed_strain"), "beam")
        system.add(parts.Joint(a=FREE, b="point", over="beam.tip", type="pulley", ratio=0.6, **given))

    return add


enter("pulleys")(pulleys())
enter("soft pulleys")(pulleys(stiffness=300.0, damping=20.0))


@enter("loads on bodies")
def loads(system: System) -> None:
    """By laws, in axes of the body, and light on panels."""
    for at in (FREE, SPIN, "point"):
        for frame in ("inertial", "body") if at != "point" else ("inertial",):
            system.add(parts.Load(at=at, law=LAW, frame=frame))
    for at in ("free", "spin"):
        system.add(parts.Load(at=at, type="torque", law=LAW, frame="body"))
        system.add(parts.Radiation(at=at, area=2.0, normal=TWIST, pressure=1.5, specular=0.5, diffuse=0.3))


@enter("fields", gravity=(0.0, 0.0, 0.0))
def fields(system: System) -> None:
    """On bodies, points, beams and threads."""
    system.add(beam("assumed_strain"), "beam")
    threaded(wound_mass="carried")(system)
    system.add(parts.Field(type="orbit", rate=0.9))
    system.add(parts.Field(law=LAW))


@enter("loads on beams")
def beam_loads(system: System) -> None:
    """Moments, follower forces and loads by laws."""
    system.add(beam("assumed_strain", normal=(0.0, 0.0, 1.0)), "beam")
    system.add(beam("cable", position=(0.0, 1.0, 0.0)), "cable")
    for name in ("beam", "cable"):
        system.add(parts.Load(along=name, law=LAW))
        system.add(parts.Load(at=f"{name}.tip", law=LAW))
        system.add(parts.Load(at=f"{name}[1]", type="torque", law=LAW))
        system.add(parts.Load(at=f"{name}.tip", torque=(0.3, -0.2, 0.5)))
        system.add(parts.Load(along=name, torque=tuple(0.6 * unit(TWIST)), centre=(0.1, -0.3, 0.2), pitch=0.7))
    system.add(parts.Load(at="beam.tip", force=TWIST, frame="body"))
    system.add(parts.Load(at="beam[1]", law=LAW, frame="body"))
    system.add(parts.Load(at="beam[1]", type="torque", law=LAW, frame="body"))


@enter("wheels", gravity=(0.0, 0.0, 0.0))
def wheels(system: System) -> None:
    """Wheels at their limits and below, with friction, and a controller that follows a path."""
    system.add(parts.Field(type="orbit", rate=0.9))
    for k, axis in enumerate(((1.0, 0.2, 0.0), (0.0, 1.0, 0.3), (0.2, 0.0, 1.0))):
        drag = {"viscous_damping": 0.2, "friction_torque": 0.3, "slip_rate": 0.5, "rate_limit": 3.0}
        system.add(
            parts.ReactionWheel(body="free", inertia=0.02, axis=axis, rate=2.98 - 0.5 * k, **drag, torque_limit=9.0),
            f"wheel {k}",
        )
    system.add(parts.ReactionWheel(body="spin", inertia=0.02, axis=TWIST, law="0.5*sin(x) - 0.2*v*v", rate=1.3))
    system.add(
        parts.AttitudeController(
            body="free", actuators=["wheel 0", "wheel 1", "wheel 2"], proportional=(3.0, 2.0, 1.0),
            derivative=(0.5, 0.6, 0.7), axis=TWIST, path=parts.ConstantDrive(rate=0.4),
        )
    )  # fmt: skip


@enter("thrusters")
def thrusters(system: System) -> None:
    """A controller that holds a body by thrusters."""
    names = []
    for k, axis in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
        for sign in (1.0, -1.0):
            arm = [0.5 * (c == (k + 1) % 3) for c in range(3)]
            direction = tuple(sign * c for c in axis)
            system.add(parts.Thruster(at=("free", tuple(arm)), direction=direction, thrust=50.0), f"jet {len(names)}")
            names.append(f"jet {len(names)}")
            opposite = tuple(-c for c in arm)
            system.add(parts.Thruster(at=("free", opposite), direction=direction, thrust=50.0), f"jet {len(names)}")
            names.append(f"jet {len(names)}")
    gains: dict[str, Any] = {"proportional": (3.0, 2.0, 1.0), "derivative": (0.5, 0.6, 0.7)}
    path = {"axis": TWIST, "path": parts.ConstantDrive(rate=0.4)}
    system.add(parts.AttitudeController(body="free", actuators=names, **gains, **path))
    system.add(parts.Thruster(at=FREE, direction=TWIST, thrust=3.0, profile={"constant": 2.0}))


LOOSE = (("spin", None), ("free", None))
ENDS = (("spin", None), ("free", SPIN), ("free", None), ("spin", "point"), ("driven", FREE))


def threaded(
    *, loaded: bool = False, out: float = 0.5, ends: tuple[Any, ...] = ENDS, **given: Any
) -> Callable[[System], None]:
    """Threads from bodies: with a free tip, of which a part `out` is out, and fastened to bodies and a point."""

    def add(system: System) -> None:
        builder = Builder(np.zeros(3))
        for name, part in system._parts.items():
            part.write(builder, name)
        for k, (body, end) in enumerate(ends):
            own: dict[str, Any] = {"length": 1.2, "line_density": 0.1, "nodes": 4, "stiffness": 50.0} | given
            length, radius = 1.2 * out, 0.05
            more: dict[str, Any] = {"tip_mass": 0.2}
            if end is not None:
                pose, leaves = builder.poses[builder.find(body, "bodies")], np.array((0.5, 0.1, 0.2 + radius))
                length = float(np.linalg.norm(pose.x + pose.R @ leaves - point_side(builder, end).u))
                more = {"end": end, "length": 1.3 * length}
            drive = parts.ConstantDrive(rate=0.3, angle=length / radius)
            system.add(parts.Reel(body=body, centre=(0.5, 0.1, 0.2), radius=radius, drive=drive), f"reel {k}")
            name = f"thread {k}"
            system.add(parts.Thread(reel=f"reel {k}", **(own | more)), name)
            if not loaded:
                continue
            for frame in ("inertial", "body"):
                system.add(parts.Load(along=name, force=(0.3, -0.2, 0.4), frame=frame))
                system.add(parts.Load(at=f"{name}.tip" if end is None else f"{name}[1]", law=LAW, frame=frame))
            system.add(parts.Load(along=name, law=LAW))
            light = {"pressure": 3.0, "width": 0.4, "direction": (0.4, -0.2, 1.0), "specular": 0.6}
            system.add(parts.Radiation(along=name, **light))

    return add


enter("threads")(threaded())
enter("threads all out")(threaded(out=1.0))
enter("threads with dampers")(threaded(damping=3.0))
enter("threads that go slack")(threaded(damping=0.5, slack=True))
enter("threads by length")(threaded(boundary_segment="by-length", wound_mass="carried"))
enter("threads of fixed length")(threaded(segments="inextensible", ends=LOOSE))
enter("loads on threads")(threaded(loaded=True))
enter("loads on threads of fixed length")(threaded(loaded=True, segments="inextensible", ends=LOOSE))
enter("carried threads")(threaded(wound_mass="carried", thickness=1e-3, ends=LOOSE))
enter("threads on a moving mesh")(threaded(mesh="moving", damping=3.0, ends=LOOSE))
enter("loads on threads on a moving mesh")(threaded(mesh="moving", loaded=True, ends=LOOSE))


@enter("free spools")
def spools(system: System) -> None:
    """On a free and a spinning body, with a motor by a law."""
    spools_with(system, wound_mass="carried")


def spools_with(system: System, **given: Any) -> None:
    """Free spools on two bodies, and what their threads have beside the common."""
    for k, body in enumerate(("free", "spin")):
        drive = parts.FreeSpool(inertia=0.01, angle=10.0, rate=0.4, law="0.1*sin(x) - 0.2*v", viscous_damping=0.02)
        system.add(parts.Reel(body=body, centre=(0.5, 0.1, 0.2), radius=0.05, drive=drive), f"reel {k}")
        own: dict[str, Any] = {"length": 1.2, "line_density": 0.1, "nodes": 4, "stiffness": 50.0, "tip_mass": 0.2}
        system.add(parts.Thread(reel=f"reel {k}", damping=0.5, **own | given))


@enter("free spools of threads on a moving mesh")
def feeding_spools(system: System) -> None:
    """On a free and a spinning body."""
    spools_with(system, mesh="moving")
