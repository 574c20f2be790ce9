"""What a family says of margins: the shares of its parts in what drives and resists along a coordinate.

Forces are on the left of the equations of motion, as residuals have them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray

#: Categories of what drives or resists.
SPRING, FRICTION, INERTIA, ACCELERATION = "spring", "friction", "inertia", "acceleration"
ELASTIC = "elastic parts"
LOAD, MOTOR, DAMPING = "load", "motor", "damping"
HARNESS, ADHESION, MOTOR_LOSSES = "harness", "adhesion", "motor losses"
#: Shares of a contact.
NORMAL, RUBS = "normal", "friction"
#: Function of the mechanism, the share, the position, the direction, and whether the mechanism is at rest.
Evaluated = Callable[[Any, Any, Any, Any, bool], Any]


class Rule(NamedTuple):
    """A share of each part of a family.

    Attributes
    ----------
    category : str
    aspect : str, name of the share after that of the part, '' for the part as a whole
    fields : fields that a record keeps of all those that the family's rules name; the others are 0. There is no share
        of a part where they are 0
    which : function of the first record of a part to whether it has the share; None for all
    rates : bool, of the forces of velocities alone, or (False) of those without any; None for both
    stored : bool, whether it stores the energy that it takes, in what held coordinates do not determine; None: springs
        and elastic parts do
    """

    category: str
    aspect: str = ""
    fields: tuple[str, ...] = ()
    which: Callable[[Any], bool] | None = None
    rates: bool | None = None
    stored: bool | None = None

    @property
    def stores(self) -> bool:
        """Whether it stores the energy that it takes."""
        return self.category in (SPRING, ELASTIC) if self.stored is None else self.stored


class Strained(NamedTuple):
    """Strains of parts, and how their stresses can be those of other strains.

    Attributes
    ----------
    records : str, array of the model with the strains
    measured : function of these records to the strains of the last residual (n, k)
    shift : function of the records, to be changed, those of the model itself, and what is added to the strains (n, k)
    """

    records: str
    measured: Callable[[Any], Array]
    shift: Callable[[Any, Any, Array], None]


class Elastic(NamedTuple):
    """How parts follow the coordinates by their stiffness.

    Attributes
    ----------
    stiff : function of the model, that without forces, and the index of a record to the arrays of the latter with which
        the part resists its strains
    alone : bool, whether they are of that record alone, else of all
    pushing : function of the model to the arrays with which what goes slack pushes as well; none where nothing does
    strained : Strained, of parts with strains that are far stiffer than others
    """

    stiff: Callable[[Any, Any, int], Mapping[str, Array]]
    alone: bool = False
    pushing: Callable[[Any], Mapping[str, Array]] | None = None
    strained: Strained | None = None


class Pressing(NamedTuple):
    """How contacts press and rub.

    Attributes
    ----------
    pressing : function of records, and whether friction slips at any rate, to records with the elastic normal force
    undetermined : function of a record to why its force does not follow from the coordinates, '' where it does
    """

    pressing: Callable[[Array, bool], Array]
    undetermined: Callable[[Any], str] | None = None


class Tie(NamedTuple):
    """Coordinates that keep a sum: of their values times `ratios`, rad or m."""

    motions: tuple[int, ...]
    ratios: tuple[float, ...]
    value: float


class Shares(NamedTuple):
    """Shares of the parts of a family, and how they are evaluated.

    What stores energy helps or resists, what takes it always resists: they are shares of their own, or one would cancel
    the other before the factors.

    Attributes
    ----------
    rules : of its shares; none where it makes no force of its own along a motion that the constraints allow
    place : float, place of its shares among those of other families
    unforced : function of the model to its arrays without the family's forces; None: without its records, and those
        that belong to them and act between parts, where it has shares
    prepare : called with the mechanism, a share, the position, the direction, and a copy of its records with the fields
        of the share alone
    force : as `Evaluated`, generalised forces (nv,) with those of the model without forces, or None where they are
        those of its records
    power : as `Evaluated`, virtual power (N m or N, above 0 where it drives), or None where it is that of its force
    together : where its powers follow from the forces of others as well, function of the mechanism, all shares, the
        direction, the position, the coordinates that are held (the one with the margin first), and the multipliers of
        the joints in a motion, None at rest, to the powers by the labels of its shares
    standing : bool, whether its forces are those of an equilibrium (with a load factor)
    elastic : Elastic, of elastic parts, one record each; contact : Pressing
    pulling : function of the model to the rows (n,) int of its records that only pull: with a `stiffness` (N/m) times
        the `extension` (m) beyond the `length` without tension, and none below where `slack` is 1; the energy of each
        is a convex function of the places of its ends
    tie : function of a record to the coordinates that it ties to one another, in positions and directions
    measured : str, field with the index of a coordinate that a record measures alone, which has no margin
    refused : function of a record, its part, and whether everything turns steadily, to why it has no place in the
        tables, '' of one that has
    remark : str, sentence on its parts in tables, with their {names}
    """

    rules: tuple[Rule, ...] = ()
    place: float = math.inf
    unforced: Callable[[Any], Mapping[str, Array]] | None = None
    prepare: Callable[[Any, Any, Any, Any, Array], None] | None = None
    force: Evaluated | None = None
    power: Evaluated | None = None
    together: Callable[[Any, Any, Any, Any, list[int], Any], Mapping[str, float]] | None = None
    standing: bool = False
    elastic: Elastic | None = None
    contact: Pressing | None = None
    pulling: Callable[[Any], Array] | None = None
    tie: Callable[[Any], Tie] | None = None
    measured: str = ""
    refused: Callable[[Any, Any, bool], str] | None = None
    remark: str = ""

    @property
    def fields(self) -> tuple[str, ...]:
        """All fields that its rules name."""
        return tuple(dict.fromkeys(field for rule in self.rules for field in rule.fields))
