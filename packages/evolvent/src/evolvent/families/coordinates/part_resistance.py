"""Resistances on the coordinate of a joint that depend on its path: harness, tape-spring hinge, adhesion."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator

from evolvent.assembly.builder import Builder
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.families.coordinates import part_hysteresis as hysteresis, resistance as kernels
from evolvent.families.coordinates.part_curve import check_folded, energies, least, strain_at
from evolvent.families.joints.part_coordinate import PRESLIDING, check_units, find_coordinate
from evolvent.families.relaxation.family import add_branches, add_terms
from evolvent.kernels.bristle import DAHL, SLIP
from evolvent.parts import table_file
from evolvent.parts.applies import Applies, given, left_out, one_of, refuse_unfit
from evolvent.parts.base import CoordinateName, Group, Part
from evolvent.parts.profile import table_rows
from evolvent_base import tables, units
from evolvent_base.errors import InputError
from evolvent_base.file_keys import FileKey

Array = np.ndarray


#: Mark of a table that may be a file.
_FILE = FileKey(endings=tables.ENDINGS, rows=table_file.rows_of)


def _curve_rows(value: Any) -> Any:
    rows = table_file.rows_of(os.fspath(value)) if isinstance(value, (str, os.PathLike)) else value
    return table_rows(rows, "[angle or travel, torque or force]")


def _bristle_rows(value: Any) -> Any:
    return table_rows(value, "[stiffness, torque or force]", least=1)


CurveTable = Annotated[tuple[tuple[units.AngleOrTravel, units.TorqueOrForce], ...], BeforeValidator(_curve_rows), _FILE]
BristleTable = Annotated[
    tuple[tuple[units.CoordinateStiffness, units.TorqueOrForceLimit], ...], BeforeValidator(_bristle_rows)
]
#: Numbers of bristles of each word of the key `law`.
LAWS = {"slip": SLIP, "dahl": DAHL}


def energy_at(x: Array, torque: Array, at: float) -> float:
    """Energy of a curve at one of its places, 0 at its first row, J."""
    inside = x < at
    own = np.append(x[inside], at), np.append(torque[inside], np.interp(at, x, torque))
    return float(energies(*own)[-1])


def add_curve(
    builder: Builder, x: Array, torque: Array, energy: Array, *,
    low: float = -math.inf, high: float = math.inf, below: int = -1, above: int = -1, zero: float = 0.0,
) -> int:  # fmt: skip
    """Write a curve; returns its index.

    Parameters
    ----------
    x, torque, energy : (n,) float, rows, energy of them as well
    low, high : where it ends; below, above : number of the curve of its resistance behind that
    zero : where the energy of a viscoelastic one is 0
    """
    first, _ = builder.parameters([*x.tolist(), *torque.tolist(), *energy.tolist()])
    ends = {"low": low, "high": high, "below": below, "above": above, "zero": zero}
    return builder.add("curves", first=first, count=x.size, **ends)


def ascending(key: str, table: Sequence[tuple[float, float]], kind: int) -> tuple[Array, Array]:
    """Columns of a curve; refused unless the first one grows."""
    check_units(key, table, kind)
    x, torque = (np.array(column, dtype=float) for column in zip(*table, strict=True))
    down = np.flatnonzero(np.diff(x) <= 0.0)
    if down.size:
        k = int(down[0]) + 1
        raise InputError(f"{key}: row {k + 1} is at {x[k]:.9g}, not above the row before, at {x[k - 1]:.9g}")
    return x, torque


def add_resistance(
    builder: Builder, name: str, h: int, kind: int, curve: int, first: int, start: int = 0, law: Any = None
) -> None:
    """Write the row of the family `resistances`: its curves from `curve` on, and its bristles from `first` on.

    Parameters
    ----------
    h : row of its coordinate
    start : number of the curve on which it starts
    law : evolvent.elements.viscoelastic.Viscoelastic, optional, by which its curves relax
    """
    rows, terms = builder.rows, add_terms(builder, law)
    strain = strain_at(builder, curve + start, float(rows["coordinates"][h]["angle"])) if law is not None else 0.0
    index = builder.add(
        "resistances", coordinate=h, kind=kind, curve=curve, curves=len(rows["curves"]) - curve, first=first,
        last=len(rows["bristles"]), start=start, **terms,
        branch=add_branches(builder, terms, strain, dashpot=True),
    )  # fmt: skip
    builder.names[name] = ("resistances", index)


class Resistance(Part):
    """What resists at a joint by its path: a harness, a tape-spring hinge, or an adhesion that breaks.

    Parameters
    ----------
    joint : str
        A `JointSpring`, or a revolute or prismatic `Joint`, whose coordinate is then 0 at
        the start.
    type : {"harness", "tape-spring", "adhesion"}
        harness (cables, hoses): an elastic curve, hysteresis, and set. tape-spring: a moment-angle curve of the
        straight tape, and another one of the folded tape. adhesion: it holds the joint until it breaks, once, as what a
        release must overcome.
    torque : rows [angle, torque] or [travel, force], optional
        Elastic curve of a harness, the middle of the loop; straight lines between the rows and beyond them. A positive
        torque resists a growing coordinate.
    stiffness : float, N m/rad or N/m
        Of a straight elastic curve, in place of `torque`.
    rest : float, rad or m
        Where the torque of `stiffness` is zero.
    set : float, rad or m
        Set: by how much the elastic curve has moved along the coordinate, towards where the harness was stowed.
    bristles : rows [stiffness, torque] or [stiffness, force], optional
        Hysteresis: springs in series with sliders, each with the torque at which it slips.
    law : {"slip", "dahl"}
        slip: elements of Masing and Iwan. dahl: each bristle goes to its torque exponentially.
    loop : rows [angle, torque] or [travel, force], optional
        A measured loop, in the order of the measurement, which ends where it starts. Gives the elastic curve and the
        bristles, in place of `torque`, `stiffness` and `bristles`.

        This and every other table of a resistance may be the name of a CSV file, whose first line has the units, such
        as ``angle (deg),torque (N m)``.
    misfit : float
        Largest difference of the identified loop from the measured one that is accepted (root mean square, part of the
        range of its torques).
    relaxed_at : float, rad or m, optional
        Coordinate at which the bristles had no torque before the harness was bent to where it starts; if left out, they
        have none at the start, as after a long stowage.
    viscoelastic : mapping, optional
        Relaxation of the curves of a harness or a tape-spring by a Prony series: a torque at a held
        joint falls by the series. Bristles do not relax.
    straight : rows [angle, moment] or [travel, force], optional
        Of the straight tape, until it buckles: at the last row where it folds towards larger angles, at the first row
        where towards smaller ones. A positive moment resists a growing coordinate.
    folded : rows [angle, moment] or [travel, force], optional
        Of the folded tape, from where it snaps back.
    opposite : rows [angle, moment] or [travel, force], optional
        Of the tape that is folded the other way; without it the straight tape does not buckle that way.
    state : {"straight", "folded", "opposite"}, optional
        Of the tape at the start, where it may be either.
    strength : float, N m or N, optional
        Torque or force at which an adhesion breaks, either way.
    distance : float, rad or m, optional
        Way from the start at which it breaks; 1e-4 rad or 1e-5 m if left out. The energy strength distance/2 is lost.

    Notes
    -----
    Between buckling and snap-back a tape has either moment, by where it comes from. The area between both curves is
    what a cycle takes. At a snap the energy falls at once; a table of moments does not say how the two snaps share the
    area: each takes half. Beyond the other rows the curves go on straight.
    """

    applies: ClassVar[Applies] = {
        "torque": (one_of("type", "harness"), left_out("stiffness", "loop")),
        "stiffness": (one_of("type", "harness"), left_out("torque", "loop")),
        "rest": (one_of("type", "harness"), given("stiffness")),
        "set": (one_of("type", "harness"),),
        "bristles": (one_of("type", "harness"), left_out("loop")),
        "law": (one_of("type", "harness"), given("bristles", "loop")),
        "loop": (one_of("type", "harness"), left_out("torque", "stiffness", "bristles")),
        "misfit": (one_of("type", "harness"), given("loop")),
        "relaxed_at": (one_of("type", "harness"),),
        "viscoelastic": (one_of("type", "harness", "tape-spring"),),
        **{key: (one_of("type", "tape-spring"),) for key in ("straight", "folded", "opposite", "state")},
        **{key: (one_of("type", "adhesion"),) for key in ("strength", "distance")},
    }
    kind: Literal["resistance"] = "resistance"
    group = Group.SPRINGS
    joint: CoordinateName
    type: Literal["harness", "tape-spring", "adhesion"]
    torque: CurveTable | None = None
    stiffness: units.CoordinateStiffnessOrZero = 0.0
    rest: units.AngleOrTravel = 0.0
    set: units.AngleOrTravel = 0.0
    bristles: BristleTable | None = None
    law: Literal["slip", "dahl"] = "slip"
    loop: CurveTable | None = None
    misfit: units.PositiveNumber = 0.05
    relaxed_at: units.AngleOrTravel | None = None
    viscoelastic: Viscoelastic | None = None
    straight: CurveTable | None = None
    folded: CurveTable | None = None
    opposite: CurveTable | None = None
    state: Literal["straight", "folded", "opposite"] | None = None
    strength: units.TorqueOrForceLimit | None = None
    distance: units.PositiveAngleOrTravel | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write the row of the family `resistances`, its curves and its bristles."""
        refuse_unfit(name, self)
        h = find_coordinate(builder, f"{name}.joint", self.joint)
        kinds = {"harness": self._write_harness, "tape-spring": self._write_tape, "adhesion": self._write_adhesion}
        kinds[self.type](builder, name, h, builder.rows["coordinates"][h])

    def _needed(self, name: str, key: str) -> Any:
        """The value of a key that its type needs."""
        if getattr(self, key) is None:
            raise InputError(f"{name}.{key} is missing; a resistance of type {self.type!r} needs it")
        return getattr(self, key)

    def _write_harness(self, builder: Builder, name: str, h: int, row: dict[str, Any]) -> None:
        """Write the curve and the bristles of a harness."""
        if self.torque is None and self.loop is None and not self.bristles and not self.stiffness:
            raise InputError(
                f"{name} has no torque; give {name}.loop, or {name}.torque, {name}.stiffness, {name}.bristles"
            )
        for key in ("stiffness", "rest", "set", "bristles", "relaxed_at"):
            check_units(f"{name}.{key}", getattr(self, key), row["kind"])
        bristles = [(float(k), float(L)) for k, L in self.bristles or ()]
        if self.torque is not None:
            x, torque = ascending(f"{name}.torque", self.torque, row["kind"])
        elif self.loop is not None:
            check_units(f"{name}.loop", self.loop, row["kind"])
            found = hysteresis.identified(f"{name}.loop", np.array(self.loop, dtype=float), self.law, self.misfit)
            x, torque, bristles = found.x, found.torque, found.bristles
        else:
            x = self.rest + np.array([0.0, 1.0])
            torque = np.array([0.0, self.stiffness])
        x, zero = x + self.set, 0.0
        if self.viscoelastic is not None:
            if not np.any(torque):
                raise InputError(f"{name}.viscoelastic has no effect: its elastic curve is 0; leave it out")
            x, torque, energy, zero = least(f"{name}.{'loop' if self.loop else 'torque'}", x, torque)
        else:
            energy = energies(x, torque)
        curve = add_curve(builder, x, torque, energy - energy.min(), zero=zero)
        first, start = len(builder.rows["bristles"]), float(row["angle"])
        bent = 0.0 if self.relaxed_at is None else start - float(self.relaxed_at)
        for stick, limit in bristles:
            force = hysteresis.bristle(LAWS[self.law], stick, limit, 0.0, bent)
            fields = {"kind": LAWS[self.law], "stick": stick, "limit": limit, "before": start}
            builder.add("bristles", force0=force, force=force, **fields)
        add_resistance(builder, name, h, kernels.HARNESS, curve, first, law=self.viscoelastic)

    def _write_tape(self, builder: Builder, name: str, h: int, row: dict[str, Any]) -> None:
        """Write the curves of a tape-spring hinge."""
        straight, folded = (self._needed(name, key) for key in ("straight", "folded"))
        x, moment = ascending(f"{name}.straight", straight, row["kind"])
        energy, zero = energies(x, moment), 0.0
        energy -= np.interp(0.0, x, energy)
        if self.viscoelastic is not None:
            both, over = self.opposite is not None, folded[-1][0] > x[-1]
            ends_ = {"low": over and not both, "high": not over and not both}
            x, moment, energy, zero = least(f"{name}.straight", x, moment, **ends_)
        ends: dict[str, Any] = {}
        first, others, keys = len(builder.rows["curves"]), [], list[str]()
        up = folded[-1][0] > x[-1]
        for number, key in enumerate(("folded", "opposite"), 1):
            table = getattr(self, key)
            if table is None:
                continue
            own = ascending(f"{name}.{key}", table, row["kind"])
            others.append((own, self._offset(f"{name}.{key}", (x, moment, energy), own, up), up))
            keys.append(key)
            ends |= {"high": x[-1], "above": number} if up else {"low": x[0], "below": number}
            up = not up
        add_curve(builder, x, moment, energy, **ends, zero=zero)
        for key, (own, offset, upwards) in zip(keys, others, strict=True):
            end = {"low": own[0][0], "below": 0} if upwards else {"high": own[0][-1], "above": 0}
            if self.viscoelastic is not None:
                check_folded(f"{name}.{key}", *own, energies(*own) + offset, upwards)
            add_curve(builder, *own, energies(*own) + offset, **end, zero=-math.inf if upwards else math.inf)
        start = self._start(name, builder.rows["curves"][first:], float(row["angle"]))
        add_resistance(
            builder, name, h, kernels.TAPE_SPRING, first, len(builder.rows["bristles"]), start, self.viscoelastic
        )

    def _offset(self, key: str, straight: tuple[Array, Array, Array], own: tuple[Array, Array], up: bool) -> float:
        """Energy at the first row of a folded curve, such that both snaps take half of the area between the curves."""
        x, moment, energy = straight
        name, _, word = key.rpartition(".")
        buckles, back = (x[-1], own[0][0]) if up else (x[0], own[0][-1])
        beyond = own[0][-1] > x[-1] if up else own[0][0] < x[0]
        if not (beyond and x[0] < back < x[-1]):
            side = "above" if up else "below"
            raise InputError(
                f"{key} goes from {own[0][0]:.9g} to {own[0][-1]:.9g}; it must start within {name}.straight, which "
                f"goes from {x[0]:.9g} to {x[-1]:.9g}, and end {side} it"
            )
        inner, outer = (energy_at(*own, at) for at in (back, buckles))
        lower, upper = (energy[0] + energy_at(x, moment, at) for at in (back, buckles))
        area = (upper - lower) - (outer - inner)
        if area < 0.0:
            raise InputError(
                f"{key} and {name}.straight give {-area:.6g} J a cycle; between snap-back, at {back:.9g}, and "
                f"buckling, at {buckles:.9g}, the straight tape must resist more than the {word} one"
            )
        return float(lower + 0.5 * area - inner)

    def _start(self, name: str, curves: list[dict[str, Any]], angle: float) -> int:
        """Number of the curve at the start."""
        words = ("straight", "folded", "opposite")
        can = [words[k] for k, curve in enumerate(curves) if curve["low"] < angle < curve["high"]]
        if self.state is not None and self.state not in can:
            raise InputError(f"{name}.state is {self.state!r}, but at {angle:.9g} the tape is {' or '.join(can)}")
        if self.state is None and len(can) > 1:
            raise InputError(
                f"{name}.state is missing: at {angle:.9g} the tape may be {' or '.join(can)}; say which it is at the "
                f"start"
            )
        return words.index(self.state or can[0])

    def _write_adhesion(self, builder: Builder, name: str, h: int, row: dict[str, Any]) -> None:
        """Write the curves of an adhesion: before it breaks, and after."""
        strength = float(self._needed(name, "strength"))
        for key in ("strength", "distance"):
            check_units(f"{name}.{key}", getattr(self, key), row["kind"])
        way = PRESLIDING[row["kind"]] if self.distance is None else float(self.distance)
        x = float(row["angle"]) + way * np.array([-1.0, 0.0, 1.0])
        first = len(builder.rows["curves"])
        ends: dict[str, Any] = {"low": x[0], "high": x[-1], "below": 1, "above": 1}
        energy = 0.5 * strength * way
        add_curve(builder, x, strength * np.array([-1.0, 0.0, 1.0]), energy * np.array([1.0, 0.0, 1.0]), **ends)
        add_curve(builder, x, np.zeros(3), np.zeros(3))
        add_resistance(builder, name, h, kernels.ADHESION, first, len(builder.rows["bristles"]))
