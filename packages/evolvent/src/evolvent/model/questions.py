"""Answers of families that are more than one value: the users' laws, coordinates, and support by the adjoint."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray
#: Records of a family by its name.
Records = Callable[[str], Any]
#: A time (s) and the states y and s at it.
Moment = tuple[float, Array, Array]
#: Kinds of laws that are no forces: of time alone, and values whose zeros are events.
DRIVE, EVENT = "drive", "event"


class Block(NamedTuple):
    """Coordinates of one kind that stand together.

    Attributes
    ----------
    kind : int, of `kernels.blocks`
    iq, iv : int, their first indices in the state, iq -1 without a coordinate
    owner : int, record to which they belong
    inertia : float or (3,) float, of the velocities, diagonal of the mass matrix
    node : int, number of the record's node, -1 of what is none
    switch : int, of how many nodes move, counted as `node`; -1 of what always moves, -2 of what is fixed to a part
    """

    kind: int
    iq: int
    iv: int
    owner: int
    inertia: Any
    node: int = 0
    switch: int = -1


@dataclasses.dataclass(frozen=True)
class Coordinates:
    """Coordinates of a family's records.

    Attributes
    ----------
    blocks : function of `Records` and of pools of arrays by name to the blocks, record by record
    order : float, place among those of all families: in this order an implicit method numbers its unknowns
    loose : function of the records to how many of their motions statics may find without any stiffness
    spins : whether rates go on in statics, since their momentum is felt by what turns
    first : float, mass of a node beside that of the first one, which stands for all; 0 where each stands for itself
    """

    blocks: Callable[[Records, Mapping[str, Any]], Iterator[Block]]
    order: float
    loose: Callable[[Array], int]
    spins: bool = False
    first: float = 0.0


class Positions(NamedTuple):
    """A model with positions as coordinates, where explicit methods have others.

    Attributes
    ----------
    records, added : by family, those that differ, and constraints that stand behind those of the model
    owners : records whose parts own the constraints
    write : function of a time, a state, its switches and the model of explicit methods, which writes positions and
        velocities in place of their coordinates
    count_nodes : function of that model, a time and switches, which counts there the nodes that move then
    refused : str, what does not support redundant constraints, and what to do; `{name}` stands for the first owner
    """

    records: Mapping[str, Array]
    added: Mapping[str, Array]
    owners: list[int]
    write: Callable[[float, Array, Array, Any], None]
    count_nodes: Callable[[Any, float, Array], None]
    refused: str


class Equations(NamedTuple):
    """Functions of the equations of explicit methods, for what carries out events (`Family.releases`).

    Attributes
    ----------
    event_values, apply_event, rhs : of `evolvent.equations.events` and `evolvent.equations.rhs`
    load : function of a model and of such functions, which loads them
    """

    event_values: Callable[..., None]
    apply_event: Callable[..., int]
    rhs: Callable[..., None]
    load: Callable[..., None]


class LinearizedPoint(NamedTuple):
    """A point, and the linear maps from the displacements u (nv,) of the velocities' coordinates to its motion.

    Attributes
    ----------
    position : (3,) float, m, in the state that the maps belong to
    where : slice, the coordinates of u that move it
    displacement : (3, n) float, m in inertial axes per unit of u[where]; None of a body on a fixed axis
    rotation : (3, n) float, rad about inertial axes per unit of u[where]; None of a point
    """

    position: Array
    where: slice
    displacement: Array | None
    rotation: Array | None


def along(name: str, found: list[LinearizedPoint]) -> Iterator[tuple[str, LinearizedPoint]]:
    """Names of the nodes along a part: "boom[0]" to "boom[n]", "boom.root", "boom.tip"."""
    yield from ((f"{name}[{i}]", node) for i, node in enumerate(found))
    yield f"{name}.root", found[0]
    yield f"{name}.tip", found[-1]


def skew(a: Array) -> Array:
    """Matrix of the vector product by a, (3, 3)."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


#: Record, square of a frequency (rad2/s2) and damping rate (1/s) of a mode.
Bound = tuple[int, float, float]


@dataclasses.dataclass(frozen=True)
class Felt:
    """How records answer the stiffness and damping that they feel.

    Attributes
    ----------
    size : int, of the blocks: displacements, then turns, inertial axes
    which : function of the records to a mask of those that move
    answer : function of the model, the index of a record and blocks (2, size, size) of stiffness and damping to these
        times the inverse of its mass matrix
    """

    size: int
    which: Callable[[Array], Array]
    answer: Callable[[Any, int, Array], Array]


def never(turn: Any, rows: list[int]) -> Iterator[int]:
    """No record, as `Family.uneven`."""
    return iter(())


@dataclasses.dataclass(frozen=True)
class Law:
    """A user's law that some records of a family call.

    Attributes
    ----------
    kind : str, of `compiled.laws.RETURNS`; one of time alone is a `DRIVE`
    which : function of the records to a mask of those that call one
    arguments : function of the model, the index of a record and a moment to the arguments of each call, but for the
        parameters, after `kernels.impulse.prepare`; with True as the fourth argument at all places, else at one of
        them; not asked of a drive
    field : str, of the record, with the number of the law
    before : str, of the fields `first` and `last` with the range of the law's parameters
    room : function of a record to how many values the law writes into its last argument, of kind "element"
    stated : str, field of the record that notes whether the law gives an energy or a power, of kind "element"
    as_left : whether it is called where the last evaluation of the forces has put it, not at the state of a moment
    """

    kind: str
    which: Callable[[Array], Array]
    arguments: Callable[[Any, int, Moment, bool], Iterator[tuple[Any, ...]]] | None = None
    field: str = "law"
    before: str = ""
    room: Callable[[Any], int] | None = None
    stated: str = ""
    as_left: bool = False

    @property
    def is_of_time(self) -> bool:
        """Whether it is a function of time alone."""
        return self.kind == DRIVE

    @property
    def is_force(self) -> bool:
        """Whether its values are forces."""
        return self.kind not in (DRIVE, EVENT)


def calls_law(found: Array) -> Array:
    """Which records have a law in the field `law`: (n,) bool."""
    return np.asarray(found["law"] != 0)


@dataclasses.dataclass(frozen=True)
class AdjointSupport:
    """Why a family is supported by the adjoint: its tangent is exact, and nothing in its records goes on from a step.

    Attributes
    ----------
    reason : str, why that is so
    timed : whether its forces or constraints are functions of time: for all of its records, or a mask of them
    filtered : str, what energy-momentum filters over two steps, which has no adjoint; "" for nothing
    refused : half sentences on records that are not supported, to a function of the records to a mask of these
    cubic : whether its forces are cubic in its coordinates, so that wide differences of the fourth order are exact,
        beside which nothing may happen at once
    """

    reason: str
    timed: bool | Callable[[Array], Array] = True
    filtered: str = ""
    refused: Mapping[str, Callable[[Array], Array]] = dataclasses.field(default_factory=dict)
    cubic: bool = False
