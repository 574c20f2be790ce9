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


def _layers(size: float, depth: float, axis: tuple[float, float, float], law: dict[str, Any], **moves: Any) -> System:
    """A panel of one element that guides hold along an axis, on one that stands still, as deep as given."""
    found = System(gravity=(0.0, 0.0, -G))
    wall: dict[str, Any] = {"elements": (1, 1), "thickness": THICK, "material": SOFT}
    at = -0.5 * (size - SIDE)
    found.add(parts.Shell(size=(size, size), position=(at, at, 0.0), clamped=("x0", "x1"), **wall), "floor")
    height = THICK - depth
    found.add(parts.Shell(size=(SIDE, SIDE), position=(0.0, 0.0, height), **wall, **moves), "panel")
    for k, (x, y) in enumerate(((0.0, 0.0), (0.0, SIDE), (SIDE, 0.0), (SIDE, SIDE))):
        found.add(parts.Joint(type="prismatic", a=(x, y, height), b=f"panel[{k}]", axis=axis), f"guide {k}")
    found.add(parts.Contact(a="panel", b="floor", initial_overlap=1.0, **law), "touch")
    return found


def _middle(assembly: Assembly, y: Array, i: int) -> Array:
    """Mean of a coordinate of the panel's nodes."""
    bodies = bodies_of(assembly.model, "shells", assembly.names["panel"][1])
    own = [int(assembly.model.bodies["iq"][b]) for b in bodies]
    return np.asarray(np.mean([y[..., q + i : q + i + 1] for q in own], axis=0))


@of("a contact of shells")
def layers() -> Case:
    """A panel oscillates on another one, each node on the spring of its area."""
    k = 1e4
    w, sag = math.sqrt(k / HEAVY), HEAVY * G / k
    return Case(
        part="touch", system=lambda: _layers(SIDE, 0.5 * sag, (0.0, 0.0, 1.0), {"stiffness": k}),
        seen=lambda assembly, y: _middle(assembly, y, 2) - THICK, end=0.2, step=1e-3,
        motion=lambda t: columns(-sag * (1.0 - 0.5 * np.cos(w * t))), still=(-sag,), poles=(1j * w,),
    )  # fmt: skip


@of("a contact of shells with friction")
def sliding_layers() -> Case:
    """A panel that slides on a larger one slows down by friction."""
    k, mu, stick, speed = 1e5, 0.3, 1e7, 0.5
    sag = HEAVY * G / (0.5 * k)  # on its nodes alone, which have half of the stiffness
    law = {"stiffness": k, "friction": mu, "bristle_stiffness": stick}
    return Case(
        part="touch", system=lambda: _layers(4.0 * SIDE, sag, (1.0, 0.0, 0.0), law, velocity=(speed, 0.0, 0.0)),
        seen=lambda assembly, y: _middle(assembly, y, 0) - 0.5 * SIDE, end=0.15, step=1e-3, theory=1e-3,
        motion=lambda t: columns(speed * t - 0.5 * mu * G * np.square(t)), still=(0.0,),
        poles=(1j * math.sqrt(0.5 * stick / HEAVY),),
    )  # fmt: skip
