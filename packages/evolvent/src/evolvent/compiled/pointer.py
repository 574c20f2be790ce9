"""Structs of arrays that compiled code receives as one pointer.

A `Struct` names arrays of fixed type, records and other structs. Python sees ordinary attributes. Compiled code sees
the address of a block of machine words, the headers: data pointer and sizes of an array, data pointer of a record,
address of a struct. An attribute loads its words from there, each marked invariant, so that LLVM takes them out of
loops.

Notes
-----
A NamedTuple would be unpacked into the arguments of every compiled function, some 150 words for a model, which costs
compilation, cache and calls. The headers are filled when a struct is made, therefore its attributes cannot be set:
`_replace` makes another struct. Under ``NUMBA_DISABLE_JIT=1`` there are no headers.
"""

from __future__ import annotations

import ctypes
import functools
import inspect
import itertools
from collections.abc import Collection, Iterator
from typing import Any, ClassVar, NamedTuple

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import NativeValue, intrinsic, lower_cast, models, register_model, typeof_impl, unbox

from evolvent.compiled.lane_types import LANES, lane_dtype, numba_dtype


class Field(NamedTuple):
    """Type of an attribute: an array of `ndim` dimensions, a record (`ndim` 0), or a struct (by its class).

    `value` is that of an attribute that all instances share; copies share that of a `constant` one.
    """

    dtype: Any
    ndim: int
    struct: type[Struct] | None = None
    value: np.ndarray | None = None
    constant: bool = False

    @property
    def words(self) -> int:
        """Machine words in the block of headers."""
        return 1 + self.ndim


def array(ndim: int, dtype: Any = np.float64, *, constant: bool = False) -> Any:
    """Declare an array of `ndim` dimensions as an attribute of a `Struct`; a `constant` one is never written to."""
    return Field(np.dtype(dtype), ndim, constant=constant)


def record(dtype: np.dtype) -> Any:
    """Declare a single record: its fields are read and set as attributes, in Python and in compiled code."""
    return Field(dtype, 0)


def struct(kind: type[Struct]) -> Any:
    """Declare another struct as an attribute."""
    return Field(None, 0, struct=kind)


def shared(value: np.ndarray) -> Any:
    """Declare an array that all instances refer to."""
    return Field(value.dtype, value.ndim, value=value)


class StructType(types.Type):
    """The numba type of a `Struct`, known by its name."""

    def __init__(self, name: str) -> None:
        super().__init__(name=name)

    @property
    def struct(self) -> type[Struct]:
        """The class."""
        return _STRUCTS[self.name]

    @property
    def fields(self) -> dict[str, Field]:
        """Declared attributes."""
        return self.struct._fields


#: Classes by the name of their numba type.
_STRUCTS: dict[str, type[Struct]] = {}
register_model(StructType)(models.OpaqueModel)


class _OfLayout:
    """A part of a class's layout, which is complete only once it is needed."""

    def __init__(self, part: int) -> None:
        self._part = part

    def __get__(self, instance: Any, owner: Any) -> Any:
        return owner._layout()[self._part]


class Struct:
    """Base of a class whose attributes are declared by `array`, `record` and `struct`.

    Raises
    ------
    TypeError
        For a missing or unknown attribute, or an array of another type, layout or alignment.
    """

    #: Those that stand in the body of the class.
    _declared: ClassVar[dict[str, Field]] = {}
    #: All attributes.
    _fields: ClassVar[Any] = _OfLayout(0)
    #: Index of the first header of every attribute that is an instance's own.
    _places: ClassVar[Any] = _OfLayout(1)
    _numba_type_: ClassVar[StructType]
    #: Of the headers; 0 without compiled code.
    address: int

    def __init_subclass__(cls) -> None:
        found = {name: value for name, value in vars(cls).items() if isinstance(value, Field)}
        for name in found:
            delattr(cls, name)
        cls._declared = found
        cls._numba_type_ = StructType(cls.__name__)
        _STRUCTS[cls.__name__] = cls

    @classmethod
    def _further(cls) -> dict[str, Field]:
        """Attributes that follow those of the class's body, asked for once, when the first of all is needed."""
        return {}

    @classmethod
    @functools.cache
    def _layout(cls) -> tuple[dict[str, Field], dict[str, int]]:
        """Attributes, and the places of an instance's own among the headers."""
        found = cls._declared | cls._further()
        ends = itertools.accumulate((field.words for field in found.values()), initial=0)
        places = zip(found.items(), ends, strict=False)
        return found, {name: at for (name, field), at in places if field.value is None}

    def __init__(self, **values: Any) -> None:
        own = self._own()
        if values.keys() != set(own):
            raise TypeError(f"{type(self).__name__} has the attributes {', '.join(own)}")
        words: list[int] = []
        for name, field in self._fields.items():
            value: Any = values[name] if field.value is None else field.value
            if field.struct is not None:
                words.append(value.address)
            else:
                if not _fits(value, field):
                    _refuse(f"{type(self).__name__}.{name}", value, field)
                words.append(address(value))
                words.extend(value.shape)
            self.__dict__[name] = value
        if not config.DISABLE_JIT:
            self.__dict__["_headers"] = headers = np.array(words, dtype=np.int64)
            self.__dict__["address"] = headers.__array_interface__["data"][0]
        else:
            self.__dict__["address"] = 0

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{type(self).__name__}.{name} cannot be set; use _replace")

    @classmethod
    def _own(cls) -> list[str]:
        """Names of the attributes that are an instance's own."""
        return [name for name, field in cls._fields.items() if field.value is None]

    def __iter__(self) -> Iterator[Any]:
        return (self.__dict__[name] for name in self._own())

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild, (type(self), self._asdict())

    def _asdict(self) -> dict[str, Any]:
        """Attributes by name."""
        return {name: self.__dict__[name] for name in self._own()}

    def _replace(self, **values: Any) -> Any:
        """Another struct with some attributes replaced; the other arrays are shared."""
        return type(self)(**(self._asdict() | values))

    def copy(self) -> Any:
        """A struct with arrays of its own; those without entries are shared."""
        found = object.__new__(type(self))
        own = found.__dict__
        own.update(self.__dict__)
        if not config.DISABLE_JIT:
            own["_headers"] = headers = self.__dict__["_headers"].copy()
            own["address"] = address(headers)
        fields = self._fields
        for name, at in self._places.items():
            value = own[name]
            if isinstance(value, np.ndarray) and (not value.size or fields[name].constant):
                continue
            own[name] = copied = _copy(value)
            if not config.DISABLE_JIT:
                headers[at] = copied.address if isinstance(copied, Struct) else address(copied)
        return found

    def take(self, other: Struct, *, without: Collection[str] = ()) -> None:
        """Take the values of another struct, whose arrays are as large, but for some attributes."""
        for to, of, size in self.moves(other, without=without):
            ctypes.memmove(to, of, size)

    def moves(self, other: Struct, *, without: Collection[str] = ()) -> list[tuple[int, int, int]]:
        """Address, address in another struct, and bytes of what `take` copies, to do so many times."""
        own: Any
        others: Any
        places: Any = self._places
        if config.DISABLE_JIT:
            own, others = ({name: address(value) for name, value in one.__dict__.items()} for one in (self, other))
            places = {name: name for name in self._places}
        else:
            own, others = self.__dict__["_headers"].tolist(), other.__dict__["_headers"].tolist()
        found, fields = [], self._fields
        for name, at in places.items():
            value = self.__dict__[name]
            if name in without or fields[name].constant:
                continue
            if isinstance(value, Struct):
                found += value.moves(other.__dict__[name])
            elif value.nbytes:
                found.append((own[at], others[at], value.nbytes))
        return found


class LaneStruct(Struct):
    """Base of the structs for copies side by side: lane numbers where the struct of one model, `of`, has floats."""

    of: ClassVar[type[Struct]] = Struct

    @classmethod
    def _further(cls) -> dict[str, Field]:
        return {name: _lane_field(field) for name, field in cls.of._fields.items()}


def lane_struct(kind: Any) -> type[LaneStruct]:
    """The struct for lanes of a struct of one model."""
    name = f"{kind.__name__}Lanes"
    found: Any = _STRUCTS.get(name)
    return found if found is not None and found.of is kind else type(name, (LaneStruct,), {"of": kind})


def _lane_field(field: Field) -> Field:
    if field.struct is not None:
        return field._replace(struct=lane_struct(field.struct))
    return field if field.value is not None else field._replace(dtype=lane_dtype(field.dtype))


def _rebuild(kind: type[Struct], values: dict[str, Any]) -> Any:
    return kind(**values)


def _copy(value: Any) -> Any:
    """A copy of an array, a record or a struct; of an array of records ten times faster than field by field."""
    if isinstance(value, np.recarray) and value.size and value.ndim == 1:
        return np.frombuffer(bytearray(value), value.dtype).view(np.recarray)
    return value.copy()


def address(value: Any) -> int:
    """Address of the data of an array or a record, 0 of an empty one; several times faster than by their interface."""
    if not isinstance(value, np.ndarray):
        return int(np.asarray(value).ctypes.data)
    return ctypes.addressof(ctypes.c_char.from_buffer(value)) if value.nbytes else 0  # type: ignore[arg-type]


def _fits(value: Any, field: Field) -> bool:
    """Whether a value is one of an attribute."""
    if isinstance(value, np.ndarray):
        flags = value.flags
        alike = value.ndim == field.ndim and (value.dtype is field.dtype or value.dtype == field.dtype)
        return alike and flags.c_contiguous and flags.aligned and flags.writeable
    return isinstance(value, np.record | np.void) and value.dtype == field.dtype and not field.ndim


def _refuse(name: str, value: Any, field: Field) -> None:
    """Raise why a value is none of an attribute."""
    if isinstance(value, np.record | np.void):
        raise TypeError(f"{name} is a record of {value.dtype}; it must be of {field.dtype}")
    if not isinstance(value, np.ndarray) or value.dtype != field.dtype or value.ndim != field.ndim:
        what = f"{value.ndim}-d {value.dtype}" if isinstance(value, np.ndarray) else type(value).__name__
        raise TypeError(f"{name} is {what}; it must be {field.ndim}-d {field.dtype}")
    raise TypeError(f"{name} must be contiguous in rows, aligned and writeable")


def zeros_record(dtype: np.dtype, **values: Any) -> Any:
    """A record of zeros but for the given fields; its fields are attributes."""
    found = np.zeros(1, dtype=dtype).view(np.recarray)[0]
    for name, value in values.items():
        found[name] = value
    return found


# ---------------------------------------------------------------------------------------------- numba


@typeof_impl.register(Struct)
def _typeof(value: Struct, context: Any) -> StructType:
    return value._numba_type_


@unbox(StructType)
def _unbox(kind: StructType, value: Any, c: Any) -> NativeValue:
    address = c.pyapi.object_getattr_string(value, "address")
    number = c.unbox(types.int64, address).value
    c.pyapi.decref(address)
    return NativeValue(c.builder.inttoptr(number, c.context.get_value_type(kind)))


def _numba_type(field: Field) -> types.Type:
    if field.struct is not None:
        return field.struct._numba_type_
    item = numba_dtype(field.dtype)
    return item if field.ndim == 0 else types.Array(item, field.ndim, "C")


@infer_getattr
class _Attributes(AttributeTemplate):
    key = StructType

    def generic_resolve(self, kind: StructType, name: str) -> types.Type | None:
        field = kind.fields.get(name)
        return None if field is None else _numba_type(field)


@lower_cast(types.NestedArray, types.Array)
def _field_as_array(context: Any, builder: Any, from_type: Any, to_type: Any, value: Any) -> Any:
    """An array that is a field of a record, passed where an array is asked for: both are laid out alike."""
    return value


def at_address(kind: StructType) -> Any:
    """Function for compiled code: the struct of a type whose headers are at an address, `Struct.address`.

    Without compilation the struct itself stands for its address.
    """
    if config.DISABLE_JIT:
        return lambda struct: struct

    @intrinsic
    def struct_at(typing_context, address):  # type: ignore[no-untyped-def]
        def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
            return builder.inttoptr(args[0], context.get_value_type(kind))

        return kind(types.int64), codegen

    return struct_at


def on_stack(kind: type[Struct], *arguments: str, **places: str) -> Any:
    """Function for compiled code that makes a struct of arrays and records that are its arguments.

    The headers lie on the stack of the caller, which passes the struct on, outlives it, and reads nothing of it itself:
    what it loads would not follow what it stores.

    Parameters
    ----------
    arguments : names of the arguments
    places : of attributes, the argument that each refers to; the others are empty
    """
    chosen = {name: arguments.index(places[name]) for name in places}
    if config.DISABLE_JIT:

        def plain(*given: Any) -> Any:
            found = object.__new__(kind)
            found.__dict__.update({name: given[at] for name, at in chosen.items()})
            return found

        return plain
    fields = list(kind._fields.items())
    layout = repr([(name, field.words, chosen.get(name)) for name, field in fields])

    def struct_on_stack(typing_context: Any, *kinds: Any) -> Any:
        has_lanes = any(isinstance(one, types.Array) and one.dtype == LANES for one in kinds)
        result = lane_struct(kind)._numba_type_ if has_lanes else kind._numba_type_

        def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            integer, words = ir.IntType(64), []
            for name, field in fields:
                found = [integer(0)] * field.words
                if name in chosen:
                    value, given = values[chosen[name]], signature.args[chosen[name]]
                    if field.ndim:
                        header = context.make_array(given)(context, builder, value)
                        found = [builder.ptrtoint(header.data, integer), *cgutils.unpack_tuple(builder, header.shape)]
                    else:
                        found = [builder.ptrtoint(value, integer)]
                words += found
            block = cgutils.alloca_once(builder, ir.ArrayType(integer, len(words)))
            first = builder.bitcast(block, integer.as_pointer())
            for k, word in enumerate(words):
                builder.store(word, builder.gep(first, [cgutils.intp_t(k)]))
            return builder.bitcast(first, context.get_value_type(result))

        assert layout  # it counts in what is compiled
        return result(*kinds), codegen

    own = [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in ("typing_context", *arguments)]
    struct_on_stack.__signature__ = inspect.Signature(own)  # type: ignore[attr-defined]
    return intrinsic(struct_on_stack)


if config.DISABLE_JIT:

    def number_at(address: int) -> float:
        """The number (float64) at an address."""
        return float(ctypes.c_double.from_address(int(address)).value)

    def word_at(address: int) -> int:
        """The integer (int64) at an address."""
        return int(ctypes.c_int64.from_address(int(address)).value)

    def put_number_at(address: int, value: float) -> None:
        """Write a number (float64) at an address."""
        ctypes.c_double.from_address(int(address)).value = value

    def put_word_at(address: int, value: int) -> None:
        """Write an integer (int64) at an address."""
        ctypes.c_int64.from_address(int(address)).value = value

    def array_at(struct: Struct, place: int) -> int:
        """Address of the array of a struct whose header begins at a word (`Struct._places`)."""
        names = {at: name for name, at in type(struct)._places.items()}
        return address(getattr(struct, names[int(place)]))

else:

    @intrinsic
    def number_at(typing_context, address):  # type: ignore[no-untyped-def]
        """The number (float64) at an address."""

        def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
            return builder.load(builder.inttoptr(args[0], ir.DoubleType().as_pointer()))

        return types.float64(types.int64), codegen

    @intrinsic
    def word_at(typing_context, address):  # type: ignore[no-untyped-def]
        """The integer (int64) at an address."""

        def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
            return builder.load(builder.inttoptr(args[0], ir.IntType(64).as_pointer()))

        return types.int64(types.int64), codegen

    @intrinsic
    def put_number_at(typing_context, address, value):  # type: ignore[no-untyped-def]
        """Write a number (float64) at an address."""

        def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
            builder.store(args[1], builder.inttoptr(args[0], ir.DoubleType().as_pointer()))
            return context.get_dummy_value()

        return types.void(types.int64, types.float64), codegen

    @intrinsic
    def put_word_at(typing_context, address, value):  # type: ignore[no-untyped-def]
        """Write an integer (int64) at an address."""

        def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
            builder.store(args[1], builder.inttoptr(args[0], ir.IntType(64).as_pointer()))
            return context.get_dummy_value()

        return types.void(types.int64, types.int64), codegen

    @intrinsic
    def array_at(typing_context, struct, place):  # type: ignore[no-untyped-def]
        """Address of the array of a struct whose header begins at a word (`Struct._places`)."""

        def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
            words = builder.bitcast(args[0], ir.IntType(64).as_pointer())
            return builder.load(builder.gep(words, [args[1]]))

        return types.int64(struct, types.int64), codegen


def has_addresses(kind: types.Type) -> bool:
    """Whether a type is that of a struct with the table of addresses (see `evolvent.compiled.jit.Indirect`)."""
    return isinstance(kind, StructType) and "addresses" in kind.fields


@lower_getattr_generic(StructType)
def _attribute(context: Any, builder: Any, kind: StructType, value: Any, name: str) -> Any:
    found = load_attribute(context, builder, kind, value, name)
    return found if isinstance(kind.fields[name].ndim, int) and kind.fields[name].ndim == 0 else found._getvalue()


def load_attribute(context: Any, builder: Any, kind: StructType, value: Any, name: str) -> Any:
    """LLVM value of an attribute: an address, or for an array the proxy of numba's array structure."""
    first = 0
    for other, field in kind.fields.items():
        if other == name:
            break
        first += field.words
    found = _numba_type(field)
    integer = ir.IntType(64)

    def word(k: int, as_type: Any) -> Any:
        at = builder.gep(builder.bitcast(value, as_type.as_pointer()), [cgutils.intp_t(first + k)])
        loaded = builder.load(at)
        loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
        return loaded

    if field.ndim == 0:  # a struct, or a record, by its address
        return word(0, context.get_value_type(found))
    shape = [word(1 + k, integer) for k in range(field.ndim)]
    itemsize = context.get_constant(types.intp, field.dtype.itemsize)
    strides, count = [itemsize], shape[-1]
    for k in range(field.ndim - 2, -1, -1):
        strides.insert(0, builder.mul(strides[0], shape[k + 1]))
        count = builder.mul(count, shape[k])
    header = cgutils.create_struct_proxy(found)(context, builder)
    header.data = word(0, context.get_data_type(found.dtype).as_pointer())
    header.nitems, header.itemsize = count, itemsize
    header.shape = cgutils.pack_array(builder, shape, integer)
    header.strides = cgutils.pack_array(builder, strides, integer)
    header.meminfo = context.get_constant_null(types.MemInfoPointer(found.dtype))
    header.parent = context.get_constant_null(types.pyobject)
    return header
