"""The table of coordinates by kind of an assembled model."""

from __future__ import annotations

import collections
import functools
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.kernels.blocks import ANGLE, POSITION, RATE, ROTATION, SCALAR, SLOPE
from evolvent.model.questions import Block, Coordinates
from evolvent.model.registry import families

Array = np.ndarray
#: Numbers of velocities, by kind.
_SIZES = {POSITION: 3, SLOPE: 3, ROTATION: 3, ANGLE: 1, SCALAR: 1, RATE: 1}


@functools.cache
def owners() -> tuple[str, ...]:
    """Families that have coordinates, by their codes in the table."""
    return tuple(name for name, family in families().items() if family.state.unknowns)


def owner_of(block: Any) -> tuple[str, int]:
    """Family and index of the record to which a block belongs."""
    return owners()[block["family"]], int(block["owner"])


def is_of(blocks: Array, family: str) -> Array:
    """Which blocks belong to records of a family: (n,) bool."""
    return np.asarray(blocks["family"] == (owners().index(family) if family in owners() else -1))


def of_part(model: mdl.Model, family: str, records: Any) -> Array:
    """Blocks of some records of a family, but for those of no node."""
    blocks = model.blocks
    found: Array = blocks[is_of(blocks, family) & (blocks["node"] >= 0) & np.isin(blocks["owner"], records)]
    return found


def blocks_of(found: Mapping[str, Array], pools: Mapping[str, Any]) -> Array:
    """Records `blocks` of all coordinates, by `questions.Coordinates.order`."""
    every: list[tuple[float, int, Coordinates]] = [
        (coordinates.order, code, coordinates)
        for code, name in enumerate(owners())
        for coordinates in families()[name].state.unknowns
    ]
    rows = [
        (code, block)
        for _, code, coordinates in sorted(every, key=lambda one: one[:2])
        for block in coordinates.blocks(found.__getitem__, pools)
    ]
    table = mdl.zeros("blocks", len(rows))
    for k, (code, block) in enumerate(rows):
        size = _SIZES[block.kind]
        inertia = np.where(np.arange(3) < size, block.inertia, 0.0)
        table[k] = (block.kind, block.iq, block.iv, size, code, block.owner, block.node, block.switch, inertia)
    return table


def note_inertia(family: str, rows: set[int], model: mdl.Model) -> None:
    """Take over the inertia of records that have changed into the blocks of their coordinates."""
    for k, block in _fresh(family, rows, lambda name: getattr(model, name), model):
        model.blocks["inertia"][k, : _SIZES[block.kind]] = block.inertia


def inertias_of(family: str, rows: Mapping[int, Mapping[str, Any]], model: mdl.Model) -> dict[int, Array]:
    """Inertia of blocks, (3,) by their number, of records of which some have other fields, such as columns of numbers.

    Parameters
    ----------
    rows : number of a record -> field -> what it has
    """
    own: list[Any] = [
        collections.ChainMap(dict(rows[k]), {field: row[field] for field in row.dtype.names}) if k in rows else row
        for k, row in enumerate(getattr(model, family))
    ]
    found = dict[int, Array]()
    for k, block in _fresh(family, {*rows}, lambda name: own if name == family else getattr(model, name), model):
        size = _SIZES[block.kind]
        found[k] = np.concatenate([np.broadcast_to(np.asarray(block.inertia), size), np.zeros(3 - size)])
    return found


def _fresh(
    family: str, rows: set[int], records: Callable[[str], Any], model: mdl.Model
) -> Iterator[tuple[int, Block]]:  # fmt: skip
    """Blocks of some records of a family as they follow from records, with their numbers among all."""
    if family not in owners():
        return
    pools, blocks = {"M": model.M}, model.blocks
    own = np.flatnonzero(is_of(blocks, family) & np.isin(blocks["owner"], list(rows)))
    fresh = [
        block
        for coordinates in families()[family].state.unknowns
        for block in coordinates.blocks(records, pools)
        if block.owner in rows
    ]
    yield from zip(own.tolist(), fresh, strict=True)
