"""Viscoelastic rods for tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent import System, elements, parts


def bent_rod(law: Any, *, curvature: float = 1.0, elements_: int = 4, kind: Any = parts.Rod) -> System:
    """A rod or beam of length 1 m bent to a curvature and clamped at both ends."""
    angle = np.linspace(0.0, curvature, elements_ + 1)
    x = np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=1) / curvature
    along = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    across = np.stack([-np.sin(angle), np.cos(angle), 0.0 * angle], axis=1)
    nodes = np.stack([x, along, across, np.tile([0.0, 0.0, 1.0], (elements_ + 1, 1))], axis=1)
    material = elements.Material(young_modulus=1e9, density=1000.0, viscoelastic=law)
    section = elements.Circle(radius=0.005)
    system = System()
    system.add(kind(length=1.0, elements=elements_, section=section, material=material, nodes=nodes.tolist()), "rod")
    system.add(parts.Joint(a="ground", b="rod.root", type="clamp"), "root")
    system.add(parts.Joint(a="ground", b="rod.tip", type="clamp"), "tip")
    return system
