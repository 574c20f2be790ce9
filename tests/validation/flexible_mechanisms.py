"""Benchmarks of flexible multibody dynamics after Bauchau et al. (2016), made of beams of one kind or another.

O. A. Bauchau, P. Betsch, A. Cardona, J. Gerstmayr, B. Jonker, P. Masarati, V. Sonneville: Validation of flexible
multibody dynamics beam formulations using benchmark problems, Multibody System Dynamics 37 (2016) 29-48.
"""

from __future__ import annotations

import math
from typing import Any

from evolvent import System, law, parts
from evolvent.elements import General, Material

Y = (0.0, 1.0, 0.0)


def member(
    kind: str, stiffness: tuple[float, ...], E: float, nu: float, density: float, elements: int, **keys: Any
) -> Any:
    """A beam ("beam") or rod ("rod") with given EA, GA_y, GA_z, GJ, EI_y, EI_z (N, N m^2)."""
    EA, GAy, GAz, GJ, EIy, EIz = stiffness
    G, A = E / (2.0 * (1.0 + nu)), EA / E
    section = General(area=A, Iy=EIy / E, Iz=EIz / E, J=GJ / G, shear_y=GAy / (G * A), shear_z=GAz / (G * A))
    part = parts.Beam if kind == "beam" else parts.Rod
    material = Material(young_modulus=E, poisson_ratio=nu, density=density)
    return part(section=section, material=material, elements=elements, **keys)


@law
def half_turn(t, parameters):  # type: ignore[no-untyped-def]
    """From 0 to pi in the time T, by a cosine."""
    T = parameters[0]
    w = math.pi / T
    if t >= T:
        return math.pi, 0.0, 0.0
    if t <= 0.0:
        return 0.0, 0.0, 0.0
    return (
        0.5 * math.pi * (1.0 - math.cos(w * t)),
        0.5 * math.pi * w * math.sin(w * t),
        0.5 * math.pi * w * w * math.cos(w * t),
    )


def lateral_buckling(kind: str, elements: int) -> System:
    """A thin beam of 1 m whose tip a crank and a link push up in 0.4 s, 0.1 mm beside its axis."""
    system = System()
    system.add(
        member(kind, (73e6, 5.025e6, 23.40e6, 877.2, 60830.0, 608.3), 73e9, 0.3, 2680.0, elements, length=1.0), "beam"
    )
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="clamp"), "root")
    system.add(parts.RigidBody(mass=1e-3, inertia=1e-7, position=(1.0, 0.0, 0.0)), "tip")
    system.add(parts.Joint(a="tip", b="beam.tip", type="clamp"), "end")
    system.add(
        parts.RigidBody(mass=1.212 * 0.25, inertia=(6.31e-3 / 4.0,) * 2 + (2e-5,), position=(1.0, 1e-4, -0.125)), "link"
    )
    system.add(parts.Joint(a=("tip", (0.0, 1e-4, 0.0)), b="link", type="spherical"), "top")
    system.add(
        parts.RigidBody(motion="spin", inertia=1e-3, axis=(0.0, -1.0, 0.0), position=(0.95, 1e-4, -0.25)), "crank"
    )
    system.add(parts.Joint(a="link", b="crank", position=(1.0, 1e-4, -0.25), type="revolute", axis=Y), "pin")
    drive = parts.LawDrive(law=half_turn, parameters=(0.4,))
    system.add(parts.Joint(a="ground", b="crank", type="revolute", axis=(0.0, -1.0, 0.0), drive=drive), "motor")
    return system


#: EA, GA_y, GA_z, GJ, EI_y, EI_z of bars of 16 x 16 and of 8 x 8 mm.
THICK = (5.29920e7, 1.68803e7, 1.68803e7, 733.488, 1130.50, 1130.50)
THIN = (1.32480e7, 4.22008e6, 4.22008e6, 45.8430, 70.6560, 70.6560)


def four_bar(kind: str, elements: int) -> System:
    """A four-bar of 0.12, 0.24 and 0.12 m, driven at 0.6 rad/s, whose third hinge is off by 5 degrees.

    Were the bars rigid, it could not move.
    """
    system = System()
    common = {"E": 207e9, "nu": 0.3, "density": 7800.0, "elements": elements}
    system.add(member(kind, THICK, length=0.12, position=(0.0, 0.0, 0.0), direction=(0.0, 0.0, 1.0), **common), "AB")
    system.add(member(kind, THICK, length=0.24, position=(0.0, 0.0, 0.12), direction=(1.0, 0.0, 0.0), **common), "BC")
    system.add(member(kind, THIN, length=0.12, position=(0.24, 0.0, 0.12), direction=(0.0, 0.0, -1.0), **common), "CD")
    system.add(parts.RigidBody(motion="spin", inertia=1e-3, axis=Y), "motor")
    system.add(parts.Joint(a="motor", b="AB.root", type="clamp"), "A")
    system.add(parts.Joint(a="AB.tip", b="BC.root", type="revolute", axis=Y), "B")
    off = math.radians(5.0)
    system.add(parts.Joint(a="BC.tip", b="CD.root", type="revolute", axis=(math.sin(off), -math.cos(off), 0.0)), "C")
    system.add(parts.Joint(a=(0.24, 0.0, 0.0), b="CD.tip", type="revolute", axis=Y), "D")
    drive = parts.RampDrive(rate=0.0, steps=[(0.0, 1.0, 0.6)])
    system.add(parts.Joint(a="ground", b="motor", type="revolute", axis=Y, drive=drive), "drive")
    return system


@law
def two_steps(t, parameters):  # type: ignore[no-untyped-def]
    """Rate by two cosine steps: to 0.8 w in 0.5 s, from 1 s to 1.2 w at 1.25 s."""
    w = parameters[0]
    angle, rate, acceleration = 0.0, 0.0, 0.0
    for start, duration, change in ((0.0, 0.5, 0.8 * w), (1.0, 0.25, 0.4 * w)):
        s = t - start
        if s <= 0.0:
            continue
        if s >= duration:
            angle += change * (s - 0.5 * duration)
            rate += change
        else:
            p = math.pi / duration
            angle += 0.5 * change * (s - math.sin(p * s) / p)
            rate += 0.5 * change * (1.0 - math.cos(p * s))
            acceleration += 0.5 * change * p * math.sin(p * s)
    return angle, rate, acceleration


def rotating_shaft(kind: str, elements: int) -> System:
    """A tube of 6 m with a disc off its axis by 50 mm at the middle, driven through its critical speed (60 rad/s)."""
    system = System()
    E, nu = 210e9, 0.3
    tube = (313.4e6, 60.5e6, 60.5e6, 272.7e3, 354.5e3, 354.5e3)
    mass, radius, thickness = 70.573, 0.24, 0.05
    system.add(member(kind, tube, E, nu, 7800.0, elements, length=6.0), "shaft")
    inertia = (0.5 * mass * radius**2, *(2 * (mass * (radius**2 / 4.0 + thickness**2 / 12.0),)))
    system.add(parts.RigidBody(mass=mass, inertia=inertia, position=(3.0, 0.0, 0.05)), "disc")
    system.add(parts.Joint(a="disc", b=f"shaft[{elements // 2}]", type="clamp"), "fit")
    system.add(parts.RigidBody(motion="spin", inertia=1.0, axis=(1.0, 0.0, 0.0)), "motor")
    system.add(parts.Joint(a="motor", b="shaft.root", type="clamp"), "root")
    system.add(parts.Joint(a=(6.0, 0.0, 0.0), b="shaft.tip", type="cylindrical", axis=(1.0, 0.0, 0.0)), "bearing")
    system.add(
        parts.Joint(
            a="ground",
            b="motor",
            type="revolute",
            axis=(1.0, 0.0, 0.0),
            drive=parts.LawDrive(law=two_steps, parameters=(60.0,)),
        ),
        "drive",
    )
    return system


def slider_crank(kind: str, elements: int) -> System:
    """A crank of 0.15 m at 150 rad/s, a rod of 0.3 m and 8 x 8 mm of steel, a slider of 75.552 g (Simeon 1996)."""
    system = System()
    E, nu, side, rate = 2e11, 0.3, 0.008, 150.0
    area, second = side**2, side**4 / 12.0
    G = E / (2.0 * (1.0 + nu))
    shear = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu) * G * area
    stiffness = (E * area, shear, shear, G * 0.1405770 * side**4, E * second, E * second)
    turn = -rate * 0.15 / 0.3
    system.add(
        member(kind, stiffness, E, nu, 7870.0, elements, length=0.3, position=(0.15, 0.0, 0.0),
               velocity=(0.0, rate * 0.15, 0.0), angular_velocity=(0.0, 0.0, turn)), "rod",
    )  # fmt: skip
    system.add(parts.RigidBody(motion="driven", rate=rate), "crank")
    system.add(parts.Joint(a=("crank", (0.15, 0.0, 0.0)), b="rod.root", type="revolute"), "pin")
    system.add(parts.Point(mass=0.075552, at="rod.tip"), "slider")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.tip", type="point-on-line", axis=(1.0, 0.0, 0.0)), "guide")
    return system


def lee_frame(kind: str, elements: int, load: float) -> System:
    """Lee's frame: a column and a beam of 120, pinned at their ends and clamped to each other; a load at 24 from it."""
    system = System()
    E, nu, thickness, width = 720.0, 0.3, 2.0, 3.0
    area, second = width * thickness, width * thickness**3 / 12.0
    shear = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu) * E / (2.0 * (1.0 + nu)) * area
    stiffness = (E * area, shear, shear, 0.3 * E * second, E * 4.5, E * second)
    common = {"E": E, "nu": nu, "density": 1.0, "elements": elements, "length": 120.0}
    system.add(member(kind, stiffness, direction=(0.0, 1.0, 0.0), normal=(-1.0, 0.0, 0.0), **common), "column")
    system.add(member(kind, stiffness, position=(0.0, 120.0, 0.0), normal=(0.0, 1.0, 0.0), **common), "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="column.root", type="revolute"), "foot")
    system.add(parts.Joint(a="column.tip", b="beam.root", type="clamp"), "corner")
    system.add(parts.Joint(a=(120.0, 120.0, 0.0), b="beam.tip", type="revolute"), "end")
    system.add(parts.Load(at=f"beam[{elements // 5}]", force=(0.0, -load, 0.0)), "load")
    return system
