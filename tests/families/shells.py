"""A case of shells."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent import System, elements, parts
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import bodies_of
from families.beams import BETA, SIGMA
from families.case import Array, Case, columns, of

SOFT = elements.Material(young_modulus=2e6, poisson_ratio=0.0, density=1000.0)
#: Bending stiffness and mass of a strip of 1 m by 0.125 m.
EI, MASS = 2e6 * 0.125 * 0.02**3 / 12.0, 2.5


def _tip(assembly: Assembly, y: Array) -> Array:
    """Height of the strip's last node."""
    body = bodies_of(assembly.model, "shells", assembly.names["strip"][1])[-1]
    q = int(assembly.model.bodies["iq"][body])
    return np.asarray(y[..., q + 2 : q + 3])


@of("a shell")
def shell() -> Case:
    """A strip that is clamped at one end sinks under its weight by q L^4/(8 E I)."""
    sag = 5e-3
    gravity = 8.0 * EI * sag / MASS

    def system() -> System:
        found = System(gravity=(0.0, 0.0, -gravity))
        found.add(
            parts.Shell(size=(1.0, 0.125), elements=(8, 1), thickness=0.02, material=SOFT, clamped=("x0",)), "strip"
        )
        return found

    w = BETA**2 * math.sqrt(EI / MASS)
    shares = SIGMA / BETA**5 * np.array([1.0, -1.0, 1.0, -1.0])
    shares = shares / shares.sum()
    return Case(
        part="strip", system=system, seen=_tip, end=1.5, step=1e-4, theory=1e-2,
        motion=lambda t: columns(-sag * np.sum(shares * (1.0 - np.cos(np.outer(t, w))), axis=1)),
        still=(-sag,), poles=(1j * w[0],),
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ shells on shells

#: Of a panel, m, kg, and m/s2.
SIDE, THICK, HEAVY, G = 0.5, 0.05, 0.5 * 0.5 * 0.05 * 1000.0, 10.0


def _layers(size: float, gravity: float, **law: Any) -> System:
    """A panel of one element on a panel that stands still, which it touches at the start."""
    found = System(gravity=(0.0, 0.0, -gravity))
    wall: dict[str, Any] = {"elements": (1, 1), "thickness": THICK, "material": SOFT}
    at = -0.5 * (size - SIDE)
    found.add(parts.Shell(size=(size, size), position=(at, at, 0.0), clamped=("x0", "x1"), **wall), "floor")
    depth = law.pop("depth", 0.0)
    found.add(
        parts.Shell(size=(SIDE, SIDE), position=(0.0, 0.0, THICK - depth), **law.pop("moves", {}), **wall), "panel"
    )
    found.add(parts.Contact(a="panel", b="floor", **law), "touch")
    return found


def _middle(assembly: Assembly, y: Array) -> Array:
    """Mean displacement of the panel's nodes along x and z."""
    bodies = bodies_of(assembly.model, "shells", assembly.names["panel"][1])
    own = [int(q) for q in assembly.model.bodies["iq"][list(bodies)]]
    return np.stack([np.mean([y[..., q + i] for q in own], axis=0) for i in (0, 2)], axis=-1)


@of("a contact of shells")
def layers() -> Case:
    """A panel oscillates on another one, each node on the spring of its area."""
    k = 1e5
    w, sag = math.sqrt(k / HEAVY), HEAVY * G / k

    def seen(assembly: Assembly, y: Array) -> Array:
        return _middle(assembly, y)[..., 1:] - THICK

    return Case(
        part="touch", system=lambda: _layers(SIDE, G, stiffness=k), seen=seen, end=0.06, step=1e-3, theory=1e-6,
        motion=lambda t: columns(-sag * (1.0 - np.cos(w * t))), still=(-sag,), poles=(1j * w,),
    )  # fmt: skip


@of("a contact of shells with friction")
def sliding_layers() -> Case:
    """A panel that slides on a larger one slows down by friction, or stands on the bristles against a load."""
    k, mu, stick, speed = 1e5, 0.3, 1e7, 0.5
    sag = HEAVY * G / (0.5 * k)  # on its nodes alone, which have half of the stiffness

    def seen(assembly: Assembly, y: Array) -> Array:
        return _middle(assembly, y)[..., :1] - 0.5 * SIDE

    def system() -> System:
        law = {"stiffness": k, "friction": mu, "bristle_stiffness": stick, "initial_overlap": 1.0}
        return _layers(4.0 * SIDE, G, depth=sag, moves={"velocity": (speed, 0.0, 0.0)}, **law)

    return Case(
        part="touch", system=system, seen=seen, end=0.15, step=1e-3, theory=1e-3, kink=1e-3,
        motion=lambda t: columns(speed * t - 0.5 * mu * G * np.square(t)), still=(0.0,),
        poles=(1j * math.sqrt(0.5 * stick / HEAVY),),
    )  # fmt: skip
