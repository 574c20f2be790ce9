"""Coordinates of records, and what follows from them for sizes, modes and points."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from evolvent.model.questions.base import Array, Call, Records


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


@dataclasses.dataclass(frozen=True)
class State:
    """Coordinates of a family's records, asked by assembly, and by solvers for sizes, modes and points.

    Attributes
    ----------
    unknowns : coordinates of its records
    sizes : function of the model and its size, m, to indices of velocities in the state and what counts as 1 of their
        coordinates, but for positions, slopes and turns
    extents : function of its records to lengths, m, that count for the size of the system
    directions : function of the model to first indices of coordinates that are directions, whose length stays
    nodal : function of a record to the shape of its velocities by nodes: their number, then of one node's
    points : function of the assembly, the name and index of a part, its velocities and a state to its points, by name
    axes : function of the model to ranges of the bodies that are nodes along an axis, whose slope their turns follow
        but for shear, part by part
    flows : function of the model to indices of velocities of what material flows through at rest
    positions : function of the model to what differs (`Positions`) in one with positions as coordinates, as implicit
        methods have; None where nothing does
    kinematics : compiled, (t, y, model): what of its records follows from a state, before the places of bodies
        (`kernels.rigid.kinematics`)
    multipliers : function of the right-hand side of explicit methods, the assembly and times, states, switches and
        multipliers of samples, of which it writes those that follow from a state, not from a step
    """

    unknowns: tuple[Coordinates, ...] = ()
    sizes: Callable[[Any, float], Iterator[tuple[Any, Any]]] | None = None
    extents: Callable[[Array], Array] | None = None
    directions: Callable[[Any], Array] | None = None
    nodal: Callable[[Any], tuple[int, ...]] | None = None
    points: Callable[[Any, str, int, slice, Array], Iterator[tuple[str, LinearizedPoint]]] | None = None
    axes: Callable[[Any], Iterator[range]] | None = None
    flows: Callable[[Any], Array] | None = None
    positions: Callable[[Any], Positions | None] | None = None
    multipliers: Callable[..., None] | None = None
    kinematics: Call = None
