"""Types of numbers of copies that lie side by side, in memory and in compiled code.

A lane number holds one float of each of `WIDTH` copies of a model; integers are the same in all copies. A record or an
array for lanes has lane numbers where that of one model has floats. Memory is aligned to whole lane numbers.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.typeconv import Conversion
from numba.extending import models, register_model
from numba.np import numpy_support

#: Number of copies.
WIDTH = 8
#: A lane number in memory.
LANE = np.dtype([("lanes", np.float64, (WIDTH,))])
VECTOR_OF_LANES = ir.VectorType(ir.DoubleType(), WIDTH)


class LanesType(types.Type):
    """Type of lane numbers in compiled code."""

    bitwidth = 64 * WIDTH

    def __init__(self) -> None:
        super().__init__(name=f"Lanes{WIDTH}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """A number is the same in all lanes."""
        return Conversion.safe if isinstance(other, types.Number | types.Boolean) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """A variable that is a number elsewhere is a lane number."""
        return self if isinstance(other, types.Number | types.Boolean) else None


LANES = LanesType()


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, VECTOR_OF_LANES)


class LaneRecord(types.Record):
    """Type of a record with lane numbers."""

    @property
    def dtype(self) -> np.dtype:
        """In memory; of its size alone."""
        return np.dtype((np.void, self.size))


register_model(LaneRecord)(models.RecordModel)


@functools.cache
def lane_dtype(dtype: np.dtype) -> np.dtype:
    """What stands in lane memory for a dtype: lane numbers for floats, first in records; integers as they are."""
    if dtype == np.float64:
        return LANE
    if dtype.subdtype is not None:
        base, shape = dtype.subdtype
        return np.dtype((lane_dtype(base), shape))
    if dtype.names is None:
        return dtype
    inner = {name: lane_dtype(dtype[name]) for name in dtype.names}
    if not any(_has_lanes(one) for one in inner.values()):
        return dtype
    names, offsets, at = sorted(inner, key=lambda name: not _has_lanes(inner[name])), [], 0
    for name in names:
        offsets.append(at)
        at += inner[name].itemsize
    return np.dtype(
        {
            "names": names,
            "formats": [inner[name] for name in names],
            "offsets": offsets,
            "itemsize": -(-at // LANE.itemsize) * LANE.itemsize,
        }
    )


@functools.cache
def _has_lanes(dtype: np.dtype) -> bool:
    if dtype.subdtype is not None:
        return _has_lanes(dtype.subdtype[0])
    if dtype.names is None:
        return False
    return dtype == LANE or any(_has_lanes(dtype[name]) for name in dtype.names)


@functools.cache
def numba_dtype(dtype: np.dtype) -> types.Type:
    """Type in compiled code of a dtype, of one model or for lanes."""
    if not _has_lanes(dtype):
        return numpy_support.from_dtype(dtype)
    if dtype == LANE:
        return LANES
    if dtype.subdtype is not None:
        base, shape = dtype.subdtype
        return types.NestedArray(numba_dtype(base), shape)
    places = {name: place[1] for name, place in (dtype.fields or {}).items()}
    fields = [
        (name, {"type": numba_dtype(dtype[name]), "offset": at, "alignment": None}) for name, at in places.items()
    ]
    return LaneRecord(fields, dtype.itemsize, aligned=True)


def lane_zeros(shape: Any, dtype: np.dtype) -> np.ndarray:
    """Zeros of a lane dtype, aligned to whole lane numbers."""
    shape = (shape,) if isinstance(shape, int) else tuple(shape)
    size = int(np.prod(shape, dtype=int)) * dtype.itemsize
    block = np.zeros(size + LANE.itemsize, dtype=np.uint8)
    first = -block.ctypes.data % LANE.itemsize
    return block[first : first + size].view(dtype).reshape(shape)
