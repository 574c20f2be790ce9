"""Structs in one block of memory: what shares memory shares it in every copy, and nothing is shared between copies."""

from __future__ import annotations

import numpy as np

from evolvent.compiled.pointer import Struct, array, record, struct, zeros_record
from evolvent.model.memory import Memory, take

PAIR = np.dtype([("a", np.int64), ("b", np.float64)], align=True)


class Inner(Struct):
    """A struct within another."""

    x: np.ndarray = array(1)
    y: np.ndarray = array(1)


class Outer(Struct):
    """A struct with one inside, which has its arrays as well."""

    one: np.record = record(PAIR)
    x: np.ndarray = array(1)
    rows: np.ndarray = array(1, PAIR)
    fixed: np.ndarray = array(1, constant=True)
    none: np.ndarray = array(2)
    inner: Inner = struct(Inner)


def outer() -> Outer:
    x = np.arange(4.0)
    return Outer(
        one=zeros_record(PAIR, a=3, b=0.5), x=x, rows=np.zeros(2, dtype=PAIR), fixed=np.ones(3), none=np.zeros((0, 2)),
        inner=Inner(x=x[:2], y=np.full(3, 7.0)),
    )  # fmt: skip


def test_copies_share_what_their_struct_shares_and_nothing_else() -> None:
    of = outer()
    memory = Memory({"outer": of})
    blocks = memory.room(3)
    memory.fill(blocks, np.arange(3))
    assert blocks.ctypes.data % 128 == 0
    assert memory.size % 128 == 0
    first, second = (memory.views(blocks[k])["outer"] for k in (0, 2))
    first.x[1] = 9.0
    assert first.inner.x[1] == 9.0  # a part of the same array
    assert second.x[1] == of.x[1] == 1.0
    assert first.fixed is of.fixed
    assert first.one.a == 3
    first.one.b = 2.5
    assert memory.values(blocks, "outer", "one")["b"].tolist() == [2.5, 0.5, 0.5]
    values = memory.values(blocks, "outer", "rows")
    values["b"][:, 1] = [1.0, 2.0, 3.0]
    assert second.rows["b"].tolist() == [0.0, 3.0]
    assert memory.values(blocks, "outer", "inner", "y").shape == (3, 3)
    take(second, first)
    assert second.x.tolist() == [0.0, 9.0, 2.0, 3.0]
    second.x[0] = 4.0
    take(second, first)
    assert second.x[0] == 0.0


def test_arrays_that_are_written_later_keep_what_stood_there() -> None:
    """And what shares their memory is filled with the rest."""
    of = outer()
    memory = Memory({"outer": of}, {("outer", "rows"), ("outer", "x")})
    assert memory.filled < memory.size
    blocks = memory.room(2)
    both = np.arange(2)
    memory.fill(blocks, both)
    own = memory.views(blocks[1])["outer"]
    assert own.x.tolist() == [0.0, 1.0, 2.0, 3.0]  # a part of which `inner` has
    own.rows["b"], own.inner.y[:], own.x[3] = 5.0, 1.0, 8.0
    memory.fill(blocks, both)
    assert own.rows["b"].tolist() == [5.0, 5.0]
    assert own.inner.y.tolist() == [7.0] * 3
    assert own.x[3] == 3.0


def test_headers_of_copies_point_into_their_own_block() -> None:
    of = outer()
    memory = Memory({"outer": of})
    blocks = memory.room(2)
    memory.fill(blocks, np.array([1]))
    view = memory.views(blocks[1])["outer"]
    if not view.address:  # without compilation
        return
    assert memory.addresses(blocks, "outer")[1] == view.address
    fresh = Outer(**view._asdict())
    headers, own = fresh.__dict__["_headers"], view.__dict__["_headers"]
    others = [at for name, at in Outer._places.items() if name != "none"]
    assert np.array_equal(headers[others], own[others])
