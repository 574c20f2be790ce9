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
from evolvent.assembly.ends import ends_of
from evolvent.assembly.families import owner
from evolvent.base.errors import InputError
from evolvent.kernels import axial, beam_loads, joint, loads, rigid, sides, springs
from evolvent.model.family import acting

Array = np.ndarray
#: Sines of angles, and parts of a length, that are round-off.
_OFF = 1e-9
#: Types of joints that hold what they join against any turn.
_CLAMPS = ("clamp", "fixed")


class Turn:
    """A steady turn of an assembly: `still` bodies do not take part in it."""

    def __init__(self, assembly: Assembly, spin: Array) -> None:
        self.assembly, self.model = assembly, assembly.model
        self.rate = float(np.linalg.norm(spin[:3]))
        self.axis, self.centre = spin[:3] / self.rate, spin[3:]
        bodies = self.model.bodies
        self.still = np.array([row["motion"] == rigid.DRIVEN and not self._turns(row) for row in bodies])
        for name, spec in assembly.parts.items():
            if getattr(spec, "kind", "") == "joint" and spec.type in _CLAMPS:
                family, first = assembly.names.get(name, ("", -1))
                if family == "joints":
                    self.still[[i for what, i in self._ends("joints", first) if what == "bodies"]] = False

    def _turns(self, row: Any) -> bool:
        own = row["R0"] @ row["axis"] * row["rate"] - self.rate * self.axis
        return row["path"] == 0 and float(np.linalg.norm(own)) <= _OFF * self.rate and self.on_axis(row["x0"])

    def _ends(self, name: str, k: int) -> list[tuple[str, int]]:
        rows = getattr(self.model, name)
        return list(ends_of(name, rows[k], lambda other: getattr(self.model, other)))

    def along(self, vector: Array) -> bool:
        """Whether a vector, inertial axes, is along the axis, or zero."""
        return float(np.linalg.norm(np.cross(self.axis, vector))) <= _OFF * float(np.linalg.norm(vector))

    def on_axis(self, x: Array) -> bool:
        """Whether a point is on the axis."""
        arm = np.asarray(x) - self.centre
        return float(np.linalg.norm(np.cross(self.axis, arm))) <= _OFF * max(1.0, float(np.linalg.norm(arm)))

    def place(self, body: int, local: Array) -> Array:
        """A point of a driven body, inertial axes."""
        row = self.model.bodies[body]
        return np.asarray(row["x0"] + row["R0"] @ local)

    def uneven(self) -> Iterator[str]:
        """Names of parts that are not the same about the axis."""
        model, groups = self.model, dict[tuple[Any, ...], list[int]]()
        for name in (family.name for family in acting()):
            for k, row in enumerate(getattr(model, name)):
                if not any(what == "bodies" and self.still[i] for what, i in self._ends(name, k)):
                    continue
                if name == "joints" and row["kind"] in (joint.POINT, joint.DIRECTION, joint.ALONG):
                    groups.setdefault(self._group(k), []).append(k)
                elif not self._is_even(name, row):
                    yield owner(self.assembly, name, k)
        for rows in groups.values():
            if not self._are_even(rows):
                yield owner(self.assembly, "joints", rows[0])
        for name in ("loads", "beam_loads", "controllers"):
            for k, row in enumerate(getattr(model, name)):
                if not self._is_even_load(name, row):
                    yield owner(self.assembly, name, k)

    def _is_even(self, name: str, row: Any) -> bool:
        """Whether a record with an end on a body that does not turn is the same about the axis."""
        model = self.model
        if name == "springs":
            own = [model.markers[row[key]] for key in "ab"]
            held = [m for m in own if m["kind"] == springs.ON_BODY and self.still[m["index"]]]
            places = [self.place(m["index"], m["local"]) for m in held]
            lateral = row["lateral_stiffness"] == 0.0 or self.along(row["axis"])
            return bool(lateral and row["lateral_damping"] == 0.0 and all(self.on_axis(x) for x in places))
        if name == "joints" and row["kind"] in joint.LENGTHS:
            held = [s for s in range(3) if row["on"][s] == sides.ON_BODY and self.still[row["index"][s]]]
            return all(self.on_axis(self.place(row["index"][s], row["local"][s])) for s in held)
        if name == "coordinates":  # a travel along the axis
            own = model.bodies[row["body"]]
            return bool(row["kind"] != axial.ANGLE and self.along(own["R0"] @ row["axis"]) and self.still[row["body"]])
        return name in ("motors", "drivetrains", "resistances", "synchronizations")  # on coordinates, which are asked

    def _group(self, k: int) -> tuple[Any, ...]:
        """What rows must share to be the same about the axis together: their part, kind and what moves."""
        row, moving = self.model.joints[k], []
        for side in range(3):
            still = row["on"][side] == sides.ON_BODY and self.still[row["index"][side]]
            if row["on"][side] != sides.ON_NOTHING and not still:
                turned = tuple(np.round(row["local"][side], 12)) if row["kind"] == joint.DIRECTION or side == 2 else ()
                moving.append((side, *(int(row[key][side]) for key in ("on", "index", "iq")), turned))
        return (owner(self.assembly, "joints", k), int(row["kind"]), *moving)

    def _are_even(self, rows: list[int]) -> bool:
        """Whether rows of constraint together are the same about the axis: so is the space of their directions."""
        directions, value, x = [], 0.0, None
        for k in rows:
            row = self.model.joints[k]
            held = [s for s in range(3) if row["on"][s] == sides.ON_BODY and self.still[row["index"][s]]]
            if row["path"] != joint.STILL:
                return False
            for s in held:
                R, local = self.model.bodies["R0"][row["index"][s]], row["local"][s]
                if row["kind"] == joint.DIRECTION or s == 2:
                    directions.append(R @ local)
                else:
                    x = self.place(row["index"][s], local)
            if row["kind"] == joint.POINT:
                directions.append(row["along"])
            if row["kind"] == joint.ALONG and 2 not in held and (x is None or not self.on_axis(x)):
                return False
            value = max(value, abs(float(row["value"])))
        if not directions:
            return True
        Q, d, _ = np.linalg.svd(np.array(directions).T, full_matrices=False)
        Q = Q[:, d > 1e-9 * d[0]]
        P, W = Q @ Q.T, np.cross(np.eye(3), self.axis)
        even = float(np.abs(P @ W - W @ P).max()) <= _OFF
        if value > _OFF and not all(self.along(one) for one in directions):
            return False
        arm = np.zeros(3) if x is None else x - self.centre
        off = float(np.linalg.norm(P @ np.cross(self.axis, arm)))
        return even and off <= _OFF * max(1.0, float(np.linalg.norm(arm)))

    def _is_even_load(self, name: str, row: Any) -> bool:
        """Whether a load turns with what it acts on, or is along the axis."""
        if name == "controllers":  # which hold an attitude against the stars
            return False
        if name == "beam_loads":
            if row["kind"] == beam_loads.FIELD:
                return self.along(row["axis"]) and self.on_axis(row["centre"])
            return bool(row["law"] == 0 and (row["frame"] != 0 or self.along(row["axis"])))
        if row["law"] != 0 or row["kind"] == loads.LAW:
            return False
        p = self.model.parameters[row["first"] : row["last"]]
        fixed = row["kind"] in (loads.RADIATION, loads.PANEL) or p[loads.FRAME] == 0.0
        return not fixed or self.along(p[:3])


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
