"""Cases of viscoelastic parts: one strain, or strains that all relax alike, so that every mode is on its own."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import expm

from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.elements.viscoelastic import Viscoelastic
from families import shells
from families.beams import BETA, ORIGIN, SIGMA
from families.case import Array, Case, at, columns, of, springs_poles
from families.lumped import G, hanging_squares, outer_node, reeled, with_spool
from families.rods import EI, FLAT, MASS, SOFT, node
from implicit.rigs import coordinates

#: Shares and relaxation times, s.
PRONY = [(0.2, 0.1), (0.3, 2.0)]
SHARES, TIMES = np.array(PRONY).T
RELAXING = SOFT.model_copy(update={"viscoelastic": Viscoelastic(prony=PRONY)})


def rates(square: float) -> Array:
    """Matrix (2 + n, 2 + n) of x, v and the strains u of the springs of branches: v' = -square (left x + sum g u)."""
    A = np.zeros((2 + SHARES.size,) * 2)
    A[0, 1], A[1, 0], A[1, 2:] = 1.0, -square * (1.0 - SHARES.sum()), -square * SHARES
    A[2:, 1], A[2:, 2:] = 1.0, -np.diag(1.0 / TIMES)
    return A


def decay(t: Array, square: float) -> Array:
    """Displacement x of that motion, which begins at rest at 1, with springs of branches that have not relaxed."""
    start = np.array([1.0, 0.0, *np.ones(SHARES.size)])
    return np.array([(expm(rates(square) * s) @ start)[0] for s in t])


def creep(t: Array, square: float) -> Array:
    """Displacement under a constant load that would move it by 1 at once, from rest."""
    A = np.pad(rates(square), ((0, 1), (0, 1)))
    A[1, -1] = square
    return np.array([expm(A * s)[0, -1] for s in t])


def pole(square: float) -> complex:
    """The pole that oscillates."""
    found = np.linalg.eigvals(rates(square))
    return complex(found[np.argmax(found.imag)])


@of("a Prony term")
def prony_term() -> Case:
    """A body on a joint spring turns to the angle of rest, and beyond it."""
    c, J, rest = 2.0, 0.5, 0.4

    def system() -> System:
        found = System()
        found.add(parts.RigidBody(motion="spin", inertia=J), "wheel")
        law = {"prony": PRONY}
        found.add(parts.JointSpring(a="ground", b="wheel", stiffness=c, rest=rest, viscoelastic=law), "spring")
        return found

    return Case(
        part="spring", system=system, seen=at("wheel"), end=3.0, step=5e-3,
        motion=lambda t: columns(rest * (1.0 - decay(t, c / J))), still=(rest,), poles=(pole(c / J),), damped=True,
    )  # fmt: skip


def sinks(t: Array, sag: float, w: Array) -> Array:
    """Displacement of the tip of a cantilever under its weight from its modes; `sag` at once without inertia."""
    shares = SIGMA / BETA**5 * np.array([1.0, -1.0, 1.0, -1.0])
    modes = [share * creep(t, square) for share, square in zip(shares / shares.sum(), w**2, strict=True)]
    return columns(-sag * np.sum(modes, axis=0))


@of("a viscoelastic rod")
def rod() -> Case:
    """A cantilever, held by penalties, sinks under its weight by q L^4/(8 E I) at once, and creeps."""
    sag = 5e-3
    gravity = 8.0 * EI * sag / MASS

    def system() -> System:
        found = System(gravity=(0.0, -gravity, 0.0))
        found.add(parts.Rod(length=1.0, section=FLAT, material=RELAXING, elements=4), "rod")
        found.add(parts.Joint(a=ORIGIN, b="rod.root", type="clamp", stiffness=1e5, rotational_stiffness=1e3), "root")
        return found

    w = BETA**2 * math.sqrt(EI / MASS)
    return Case(
        part="rod", system=system, seen=lambda assembly, y: node(assembly, y, "rod", -1)[..., 1:2], end=1.5, step=1e-4,
        theory=4e-3, motion=lambda t: sinks(t, sag, w), still=(-sag,), poles=(pole(w[0] ** 2),), damped=True,
    )  # fmt: skip


def sinking(formulation: str, elements: int, theory: float) -> Case:
    """The same of a beam."""
    sag = 5e-3
    gravity = 8.0 * EI * sag / MASS

    def system() -> System:
        found = System(gravity=(0.0, -gravity, 0.0))
        found.add(
            parts.Beam(length=1.0, section=FLAT, material=RELAXING, elements=elements, formulation=formulation), "beam"
        )
        found.add(parts.Joint(a=ORIGIN, b="beam.root", type="clamp"), "root")
        return found

    def tip(assembly: Assembly, y: Array) -> Array:
        return np.asarray(coordinates(assembly, y, "beam")[..., -1, 0, 1:2])

    w = BETA**2 * math.sqrt(EI / MASS)
    return Case(
        part="beam", system=system, seen=tip, end=1.5, step=1e-4, theory=theory,
        motion=lambda t: sinks(t, sag, w), still=(-sag,), poles=(pole(w[0] ** 2),), damped=True,
    )  # fmt: skip


@of("a viscoelastic beam")
def beam() -> Case:
    """With sections."""
    return sinking("assumed_strain", elements=8, theory=1e-2)


@of("a viscoelastic shell")
def shell() -> Case:
    """A strip that is clamped at one end creeps under its weight from q L^4/(8 E I)."""
    sag, stiffness, density = 5e-3, shells.EI, shells.MASS
    material = shells.SOFT.model_copy(update={"viscoelastic": RELAXING.viscoelastic})
    gravity = 8.0 * stiffness * sag / density

    def system() -> System:
        found = System(gravity=(0.0, 0.0, -gravity))
        found.add(
            parts.Shell(size=(1.0, 0.125), elements=(8, 1), thickness=0.02, material=material, clamped=("x0",)), "strip"
        )
        return found

    w = BETA**2 * math.sqrt(stiffness / density)
    return Case(
        part="strip", system=system, seen=shells.tip, end=1.5, step=1e-4, theory=1e-2,
        motion=lambda t: sinks(t, sag, w), still=(-sag,), poles=(pole(w[0] ** 2),), damped=True,
    )  # fmt: skip


@of("a viscoelastic cable")
def cable() -> Case:
    """Without."""
    return sinking("cable", elements=4, theory=4e-3)


@of("a viscoelastic thread")
def thread() -> Case:
    """As `lumped.spring_thread`: under its weight it creeps along; across, its tension stays."""
    c, m, v = 200.0, 0.55, 0.2
    x, along, across = hanging_squares(c, np.array([m, 0.1]), np.array([1.0, 0.2]))

    def motion(t: Array) -> Array:
        return columns(np.where(t < 1.0, 0.8 + v * t + m * G / c * creep(t, c / m), np.nan), 0.0, 0.0)

    return Case(
        part="thread", seen=outer_node, end=1.5, step=1e-3, motion=motion, still=(x, 0.0, 0.0), time=2.0, damped=True,
        poles=np.append([pole(square) for square in along], springs_poles(*across, *across)),
        system=lambda: reeled(
            parts.ConstantDrive(rate=v / 0.1, angle=8.0), gravity=(G, 0.0, 0.0), length=2.0, nodes=2, stiffness=c,
            viscoelastic={"prony": PRONY},
        ),
    )  # fmt: skip


@of("a viscoelastic thread on a free spool")
def thread_on_a_free_spool() -> Case:
    """As `lumped.free_spool`: the spring creeps under the part of the weight that turns the drum."""
    c, m, inertia, r = 200.0, 0.75, 0.01, 0.1
    w = math.sqrt(c * (1.0 / m + r**2 / inertia))

    def motion(t: Array) -> Array:
        stretch = G / w**2 * creep(t, w**2)
        angle = r * c / (inertia * w**2) * (0.5 * G * t**2 - stretch)
        return columns(0.5 + r * angle + stretch, 0.0, 0.0, 5.0 + angle)

    return Case(
        part="thread", seen=with_spool, end=0.5, step=5e-4, motion=motion,
        system=lambda: reeled(
            parts.FreeSpool(inertia=inertia, angle=5.0), gravity=(G, 0.0, 0.0), length=5.0, nodes=1, stiffness=c,
            viscoelastic={"prony": PRONY},
        ),
    )  # fmt: skip
