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
    return _case("strip", clamped=("x0",))


@of("a seam")
def seam() -> Case:
    """The same strip, whose edge a seam clamps to the ground."""
    return _case("seam")


def _case(part: str, **keys: Any) -> Case:
    sag = 5e-3
    gravity = 8.0 * EI * sag / MASS

    def system() -> System:
        found = System(gravity=(0.0, 0.0, -gravity))
        found.add(parts.Shell(size=(1.0, 0.125), elements=(8, 1), thickness=0.02, material=SOFT, **keys), "strip")
        if part == "seam":
            found.add(parts.Seam(a="strip.x0", type="clamp"), "seam")
        return found

    w = BETA**2 * math.sqrt(EI / MASS)
    shares = SIGMA / BETA**5 * np.array([1.0, -1.0, 1.0, -1.0])
    shares = shares / shares.sum()
    return Case(
        part=part, system=system, seen=_tip, end=1.5, step=1e-4, theory=1e-2,
        motion=lambda t: columns(-sag * np.sum(shares * (1.0 - np.cos(np.outer(t, w))), axis=1)),
        still=(-sag,), poles=(1j * w[0],),
    )  # fmt: skip
