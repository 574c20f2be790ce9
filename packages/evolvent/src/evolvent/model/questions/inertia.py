"""Masses."""

from __future__ import annotations

import dataclasses

from evolvent.model.questions.base import Call


@dataclasses.dataclass(frozen=True)
class Inertia:
    """Masses of a family's records: their forces, their part in impulses and in steady turns. All are compiled.

    Attributes
    ----------
    force, tangent : forces of inertia less those that act on the masses, after all forces, and their derivatives
    turning : accelerations of a steady turn, but those of vectors in `Model.blocks` (`solvers.static.equilibrium`)
    turning_tangent : derivatives of the forces by the accelerations of a steady turn
    lock : masses before impulses, after `kinematics`
    kick : velocities jump, as impulses say
    """

    force: Call = None
    tangent: Call = None
    turning: Call = None
    turning_tangent: Call = None
    lock: Call = None
    kick: Call = None
