"""What may act on a structure that turns steadily: what is the same about the axis at every angle.

The frame turns with the structure, and the ground does not, nor do bodies that are driven otherwise. Parts between them
and the structure, and loads, are allowed where a turn of all that moves changes neither their energy nor their forces.
A clamp on the ground is taken for one on a base that turns with the frame, and the ground for that base.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.constraints import ends_of_row
from evolvent.assembly.ends import ends_of
from evolvent.assembly.families import owner
from evolvent.kernels import rigid
from evolvent.model.family import Family
from evolvent.model.registry import families
from evolvent_base.errors import InputError

Array = np.ndarray


class Turn:
    """A steady turn of an assembly: `still` bodies do not take part in it."""

    #: Sines of angles, and parts of a length, that are round-off.
    ROUND_OFF = 1e-9

    def __init__(self, assembly: Assembly, spin: Array) -> None:
        self.assembly, self.model = assembly, assembly.model
        self.rate = float(np.linalg.norm(spin[:3]))
        self.axis, self.centre = spin[:3] / self.rate, spin[3:]
        bodies = self.model.bodies
        self.still = np.array([row["motion"] == rigid.DRIVEN and not self._turns(row) for row in bodies])
        for k, name in enumerate(assembly.row_parts):
            spec = assembly.parts.get(name)
            if getattr(spec, "kind", "") == "joint" and getattr(spec, "type", "") == "clamp":
                self.still[[i for what, i in ends_of_row(self.model, k) if what == "bodies"]] = False

    def _turns(self, row: Any) -> bool:
        own = row["R0"] @ row["axis"] * row["rate"] - self.rate * self.axis
        return row["path"] == 0 and float(np.linalg.norm(own)) <= self.ROUND_OFF * self.rate and self.on_axis(row["x0"])

    def _ends(self, name: str, k: int) -> list[tuple[str, int]]:
        rows = getattr(self.model, name)
        return list(ends_of(name, rows[k], lambda other: getattr(self.model, other)))

    def along(self, vector: Array) -> bool:
        """Whether a vector, inertial axes, is along the axis, or zero."""
        return float(np.linalg.norm(np.cross(self.axis, vector))) <= self.ROUND_OFF * float(np.linalg.norm(vector))

    def on_axis(self, x: Array) -> bool:
        """Whether a point is on the axis."""
        arm = np.asarray(x) - self.centre
        return float(np.linalg.norm(np.cross(self.axis, arm))) <= self.ROUND_OFF * max(1.0, float(np.linalg.norm(arm)))

    def place(self, body: int, local: Array) -> Array:
        """A point of a driven body, inertial axes."""
        row = self.model.bodies[body]
        return np.asarray(row["x0"] + row["R0"] @ local)

    def uneven(self) -> Iterator[str]:
        """Names of parts that are not the same about the axis."""
        for family in families().values():
            if not family.coupling.through and not family.of:
                rows = self._asked(family)
                for k in rows if family.statics.uneven is None else family.statics.uneven(self, rows):
                    yield owner(self.assembly, family.name, k)

    def _asked(self, family: Family) -> list[int]:
        """Records that may not be the same about the axis: those of a family with ends that stand on still bodies."""
        found = family.records(self.model)
        if family.ends is None:
            return list(range(found.size))
        outside = np.zeros(found.size, dtype=bool) if family.outside is None else family.outside(found)
        return [
            k
            for k in range(found.size)
            if outside[k] or any(what == "bodies" and self.still[i] for what, i in self._ends(family.name, k))
        ]


def check_turn(assembly: Assembly, spin: Array) -> None:
    """Refuse parts that are not the same about the axis of a steady turn, by name.

    Raises
    ------
    InputError
    """
    name = next(Turn(assembly, spin).uneven(), None)
    if name is not None:
        raise InputError(
            f"{name!r} is not the same at every angle about the axis of the steady turn, since it stands on the ground "
            "or keeps a direction; put it on a body driven at the rate of `rotating`, or along the axis"
        )
