"""How parts write records, and whose they are."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from evolvent.model.questions.base import Array, Records


class TouchPoint(NamedTuple):
    """A point of a body by which a part touches surfaces: a sphere.

    Attributes
    ----------
    body : int; place : (3,) float, m, of the sphere's centre, axes of the body
    radius : float, m, half the thickness of the part; 0 where the part's contact states it
    weight : float, share of the part's stiffness that the point has; 1 where the stiffness is that of each point
    spacing : float, m, between points: what is narrower passes between them; 0 where this is not checked
    """

    body: int
    place: Array
    radius: float = 0.0
    weight: float = 1.0
    spacing: float = 0.0


class TouchFace(NamedTuple):
    """A face of a part between four bodies, in their order round it, that nodes touch.

    Attributes
    ----------
    bodies : (4,) int
    along : (8, 3) float, m, two vectors of each body to the next one, and to that beside it, along the surface; axes of
        the body
    radius : float, m, half the thickness
    rest : (4, 3) float, m, positions of the bodies without stress
    """

    bodies: Array
    along: Array
    radius: float
    rest: Array


@dataclasses.dataclass(frozen=True)
class Parts:
    """Parts that write a family's records, asked by assembly and its variants.

    Attributes
    ----------
    owner : function of the assembly and the index of a record to the part that wrote it, by its name, or by the family
        and the index of a record of its own
    several : whether a part writes several records, named by the first of them
    consists : function of a record and its index to the bodies that it consists of, which have its name
    is_motion : whether its records are motions between parts, with an `angle` each, which have margins and latches
    place : function of the builder and a reference (`assembly.references.Named`) to the point of a part that it names
        (`assembly.references.Location`), for families on whose parts there are points
    near : function of the builder, a reference that names a part alone, and a position, m, inertial axes, to the node
        of the part that is there at the start; None where positions on a part are those in its axes, or there are none
    touches : function of the builder and the name of a part to the points (`TouchPoint`) by which it touches surfaces,
        in their order from where it is held; None where it has none that are points of bodies
    faces : function of the builder and the name of a part to the faces (`TouchFace`) that nodes touch; None where it
        has none
    heat : function of the builder, the name of a part and a thermal load on it; writes the constants of its elements
        among the parameters, and returns the fields of a record of `thermal_loads` that are its own; None where no
        thermal load acts
    check : function of the builder that refuses what its parts cannot be together with others; None for none
    unmet : function of the name of a part, and of gap, rate and value of its row of constraint and whether it moves at
        the start, to a sentence on why the start does not meet the constraint; '' where it does. None of
        parts that are no constraints of their own
    changes : str, fields that a part writes and solvers alone read: a variant with other values of them and of
        parameters takes a copy of the model. None where more follows: then it is assembled whole
    reads_inertia : whether its parts or checks read the mass or inertia of others; None: as those of the family to
        which it belongs, else they do
    initial : fields of the record with what its scratch fields are at the start, by these
    scratch : function of `Records` and the builder to arrays of the model that its records need, whether there are some
        or none; None for none
    totals : numbers of its records that are added up in fields of the model's `info`, functions of the records by field
    calls : functions that call others by slots in its records, with the fields of these
    """

    owner: Callable[[Any, int], str | tuple[str, int]] | None = None
    several: bool = False
    consists: Callable[[Any, int], range] | None = None
    is_motion: bool = False
    place: Callable[[Any, Any], Any] | None = None
    near: Callable[[Any, Any, Any], Any] | None = None
    touches: Callable[[Any, str], Iterable[TouchPoint]] | None = None
    faces: Callable[[Any, str], Iterable[TouchFace]] | None = None
    heat: Callable[[Any, str, Any], dict[str, int]] | None = None
    check: Callable[[Any], None] | None = None
    unmet: Callable[[str, float, float, float, bool], str] | None = None
    changes: str | None = None
    reads_inertia: bool | None = None
    initial: Mapping[str, str] = dataclasses.field(default_factory=dict)
    scratch: Callable[[Records, Any], Mapping[str, Array]] | None = None
    totals: Mapping[str, Callable[[Array], int]] = dataclasses.field(default_factory=dict)
    calls: Mapping[Any, str] | None = None
