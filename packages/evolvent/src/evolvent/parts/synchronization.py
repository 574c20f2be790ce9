"""Cables that synchronize the hinges of an array, or the stages of a telescope."""

from __future__ import annotations

import itertools
from typing import Literal

from evolvent.assembly.builder import Builder
from evolvent.parts.base import CoordinateNames, Part
from evolvent.parts.checks import check_units
from evolvent.parts.find_coordinate import find_coordinate
from evolvent_base import units
from evolvent_base.errors import InputError


class Synchronization(Part):
    """Closed cable loops that couple the coordinates of joints, one loop between each two successive joints.

    Parameters
    ----------
    joints : list of str
        Two or more names, each of a `RotationalSpring` or `TranslationalSpring`, or of a revolute or prismatic `Joint`;
        all of them angles, or all travels.
    ratios : list of float, optional
        One for each joint, not 0: the loops keep the change of ratio times coordinate equal for all. 1 if left out.
    stiffness, damping : float, N m/rad and N m s/rad, or N/m and N s/m
        Stiffness and damping of each loop, for the stretch ratio_2 x_2 - ratio_1 x_1.

    Notes
    -----
    For a cable of stiffness k (N/m, of both runs together) on pulleys of radii r_1 and r_2, the ratios are r_1/r and
    r_2/r and the stiffness is k r^2, with any r. A panel that opens by -180 deg while the panel before it opens by
    90 deg has the ratio -1 if that panel has the ratio 2. The cables are without force at the start.
    """

    kind: Literal["synchronization"] = "synchronization"
    joints: CoordinateNames
    ratios: units.Numbers | None = None
    stiffness: units.CoordinateStiffnessOrZero
    damping: units.CoordinateDampingOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write a row of the family `synchronizations` for each loop."""
        count = len(self.joints)
        if count < 2:
            raise InputError(f"{name}.joints is {list(self.joints)!r}; a synchronization needs two joints or more")
        if len(set(self.joints)) < count:
            twice = next(hinge for hinge in self.joints if self.joints.count(hinge) > 1)
            raise InputError(f"{name}.joints names {twice!r} twice")
        ratios = self.ratios if self.ratios is not None else (1.0,) * count
        if len(ratios) != count:
            raise InputError(f"{name}.ratios has {len(ratios)} numbers; {name}.joints has {count}")
        if 0.0 in ratios:
            raise InputError(f"{name}.ratios is {list(ratios)!r}; none of them can be 0")
        if self.stiffness == 0.0 and self.damping == 0.0:
            raise InputError(f"{name}.stiffness is 0.0; a cable needs a stiffness above 0")
        found = [find_coordinate(builder, f"{name}.joints", hinge) for hinge in self.joints]
        rows = [builder.rows["coordinates"][k] for k in found]
        if len({row["kind"] for row in rows}) > 1:
            raise InputError(f"{name}.joints has both angles and travels; they must all be of one kind")
        check_units(f"{name}.stiffness", self.stiffness, rows[0]["kind"])
        check_units(f"{name}.damping", self.damping, rows[0]["kind"])
        first = len(builder.rows["synchronizations"])
        for i, j in itertools.pairwise(range(count)):
            builder.add(
                "synchronizations",
                a=found[i],
                b=found[j],
                ratio_a=ratios[i],
                ratio_b=ratios[j],
                offset=ratios[j] * rows[j]["angle"] - ratios[i] * rows[i]["angle"],
                stiffness=self.stiffness,
                damping=self.damping,
            )
        builder.names[name] = ("synchronizations", first)
