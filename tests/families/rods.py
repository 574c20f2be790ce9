"""Cases of geometrically exact rods."""

from __future__ import annotations

import math

import numpy as np

from evolvent import System, elements, parts
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import bodies_of
from evolvent.families.rods.family import arms
from families.beams import BETA, ORIGIN, SIGMA
from families.case import Array, Case, columns, of

FLAT = elements.Rectangle(thickness=0.02, width=0.05)
SOFT = elements.Material(young_modulus=2e6, poisson_ratio=0.0, density=1000.0)
EI, MASS = 2e6 * 0.05 * 0.02**3 / 12.0, 1.0


def node(assembly: Assembly, y: Array, name: str, which: int) -> Array:
    """Place (..., 3) of a node of a rod, m."""
    index = assembly.names[name][1]
    body = bodies_of(assembly.model, "rods", index)[which]
    q = int(assembly.model.bodies["iq"][body])
    x, (w, *v) = y[..., q : q + 3], np.moveaxis(y[..., q + 3 : q + 7], -1, 0)
    arm, vector = arms(assembly.model, index)[which], np.stack(v, axis=-1)
    twice = 2.0 * np.cross(vector, np.broadcast_to(arm, vector.shape))
    return np.asarray(x + arm + w[..., None] * twice + np.cross(vector, twice))


@of("a rod")
def rod() -> Case:
    """A cantilever, held by penalties, sinks under its weight by q L^4/(8 E I)."""
    sag = 5e-3
    gravity = 8.0 * EI * sag / MASS

    def system() -> System:
        found = System(gravity=(0.0, -gravity, 0.0))
        found.add(parts.Rod(length=1.0, section=FLAT, material=SOFT, elements=4), "rod")
        found.add(parts.Joint(a=ORIGIN, b="rod.root", type="clamp", stiffness=1e5, rotational_stiffness=1e3), "root")
        return found

    w = BETA**2 * math.sqrt(EI / MASS)
    shares = SIGMA / BETA**5 * np.array([1.0, -1.0, 1.0, -1.0])
    shares = shares / shares.sum()
    return Case(
        part="rod", system=system, seen=lambda assembly, y: node(assembly, y, "rod", -1)[..., 1:2], end=1.5, step=1e-4,
        theory=4e-3, motion=lambda t: columns(-sag * np.sum(shares * (1.0 - np.cos(np.outer(t, w))), axis=1)),
        still=(-sag,), poles=(1j * w[0],),
    )  # fmt: skip


@of("a tape-spring rod")
def tape() -> Case:
    """A cantilever sinks under its weight by q L^4/(8 E I), E I of the shallow arc, whose section flattens by 1e-4."""
    sag, section = 5e-3, elements.TapeSection(radius=0.05, angle=math.pi / 2.0, thickness=2e-3)
    s = section.radius * section.angle
    stiffness = SOFT.E * (section.thickness * s**5 / (720.0 * section.radius**2) + s * section.thickness**3 / 12.0)
    mass = SOFT.density * section.thickness * s
    gravity = 8.0 * stiffness * sag / mass

    def system() -> System:
        found = System(gravity=(0.0, -gravity, 0.0))
        found.add(parts.Rod(length=1.0, section=section, material=SOFT, elements=8), "tape")
        found.add(parts.Joint(a=ORIGIN, b="tape.root", type="clamp"), "root")
        return found

    w = BETA**2 * math.sqrt(stiffness / mass)
    shares = SIGMA / BETA**5 * np.array([1.0, -1.0, 1.0, -1.0])
    shares = shares / shares.sum()
    return Case(
        part="tape", system=system, seen=lambda assembly, y: node(assembly, y, "tape", -1)[..., 1:2], end=1.5,
        step=1e-4, theory=1e-2,
        motion=lambda t: columns(-sag * np.sum(shares * (1.0 - np.cos(np.outer(t, w))), axis=1)),
        still=(-sag,), poles=(1j * w[0],),
    )  # fmt: skip


@of("a rod that pays out")
def paid_out() -> Case:
    """A straight cantilever that is extruded without a load; its frequency is that of the length that is out."""

    def system() -> System:
        found, drive = System(), {"expression": "0.5 + 0.1*t**3"}
        found.add(parts.Rod(length=1.0, section=FLAT, material=SOFT, elements=8, payout=drive), "boom")
        found.add(parts.Joint(a=ORIGIN, b="boom.root", type="clamp", stiffness=1e5, rotational_stiffness=1e3), "root")
        return found

    return Case(
        part="boom", system=system, seen=lambda assembly, y: node(assembly, y, "boom", -1)[..., :1], end=0.8,
        step=5e-5, theory=1e-2, motion=lambda t: columns(0.5 + 0.1 * t**3), still=(0.5,),
        poles=(1j * BETA[0] ** 2 * math.sqrt(EI / MASS) / 0.25,),
    )  # fmt: skip


@of("a thermal load on a rod")
def heated_rod() -> Case:
    """A rod that is heated slowly beside its own period grows by alpha T L.

    Its stiffness is that of its length without load: its frequency of bending falls as it grows.
    """
    expansion, change = 1e-3, 50.0
    material = SOFT.model_copy(update={"thermal_expansion": expansion})

    def system() -> System:
        found = System()
        found.add(parts.Rod(length=1.0, section=FLAT, material=material, elements=4), "rod")
        found.add(parts.Joint(a=ORIGIN, b="rod.root", type="clamp", stiffness=1e5, rotational_stiffness=1e3), "root")
        found.add(parts.ThermalLoad(part="rod", temperature={"ramp": {"final": change, "duration": 1.0}}), "heat")
        return found

    def length(t: Array) -> Array:
        s = np.clip(t, 0.0, 1.0)
        return columns(1.0 + expansion * change * s**3 * (10.0 - 15.0 * s + 6.0 * s * s))

    w = BETA[0] ** 2 * math.sqrt(EI / MASS)
    return Case(
        part="heat", system=system, seen=lambda assembly, y: node(assembly, y, "rod", -1)[..., :1], end=1.2, step=1e-4,
        theory=3e-3, motion=length, still=(1.0 + expansion * change,), poles=(1j * w / (1.0 + expansion * change),),
        time=1.2,
    )  # fmt: skip
