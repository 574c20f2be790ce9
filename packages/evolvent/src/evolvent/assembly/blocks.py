"""The table of coordinates by kind of an assembled model."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.kernels.blocks import ANGLE, POSITION, RATE, ROTATION, SCALAR, SLOPE
from evolvent.model.questions import Coordinates
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
    if family not in owners():
        return
    pools, blocks = {"M": model.M}, model.blocks
    own = np.flatnonzero(is_of(blocks, family) & np.isin(blocks["owner"], list(rows)))
    fresh = [
        block
        for coordinates in families()[family].state.unknowns
        for block in coordinates.blocks(lambda name: getattr(model, name), pools)
        if block.owner in rows
    ]
    for k, block in zip(own, fresh, strict=True):
        blocks["inertia"][k, : _SIZES[block.kind]] = block.inertia
