"""Views and scratch vectors in compiled code that cost nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import config, f8, types
from numba.core import cgutils
from numba.extending import intrinsic


def _matrix_view(values: Any, at: int, rows: int, columns: int) -> Any:
    return values[at : at + rows * columns].reshape(rows, columns)


@intrinsic
def _compiled_view(typingctx, values, at, rows, columns):  # type: ignore[no-untyped-def]
    kind = types.Array(values.dtype, 2, "C")

    def codegen(context, builder, signature, args):  # type: ignore[no-untyped-def]
        source = context.make_array(signature.args[0])(context, builder, args[0])
        shape = [context.cast(builder, args[k], signature.args[k], types.intp) for k in (2, 3)]
        offset = context.cast(builder, args[1], signature.args[1], types.intp)
        view = context.make_array(kind)(context, builder)
        view.data = builder.gep(source.data, [offset])
        view.shape = cgutils.pack_array(builder, shape)
        view.strides = cgutils.pack_array(builder, [builder.mul(shape[1], source.itemsize), source.itemsize])
        view.nitems, view.itemsize = builder.mul(*shape), source.itemsize
        view.meminfo = context.get_constant_null(types.MemInfoPointer(values.dtype))
        view.parent = context.get_constant_null(types.pyobject)
        return view._getvalue()

    return kind(values, at, rows, columns), codegen


#: ``matrix_view(values, at, rows, columns)``: consecutive entries of a vector, from index `at`, as a matrix; the bounds
#: are not checked. A slice and a reshape would cost more than the arithmetic of a block of six.
matrix_view = _matrix_view if config.DISABLE_JIT else _compiled_view


#: Size of a `local_vector`.
LOCAL = 40


def _plain_vector() -> np.ndarray:
    return np.empty(LOCAL)


@intrinsic
def _local_vector(typingctx):  # type: ignore[no-untyped-def]
    kind = types.Array(f8, 1, "C")

    def codegen(context, builder, signature, args):  # type: ignore[no-untyped-def]
        number = context.get_value_type(f8)
        size = context.get_constant(types.intp, LOCAL)
        data = cgutils.alloca_once(builder, number, size=LOCAL)
        view = context.make_array(kind)(context, builder)
        item = context.get_constant(types.intp, 8)
        view.data, view.itemsize, view.nitems = data, item, size
        view.shape = cgutils.pack_array(builder, [size])
        view.strides = cgutils.pack_array(builder, [item])
        view.meminfo = context.get_constant_null(types.MemInfoPointer(f8))
        view.parent = context.get_constant_null(types.pyobject)
        return view._getvalue()

    return kind(), codegen


#: ``local_vector()``: (LOCAL,) float, scratch memory of the function that asks for it, for as long as that runs.
local_vector = _plain_vector if config.DISABLE_JIT else _local_vector
