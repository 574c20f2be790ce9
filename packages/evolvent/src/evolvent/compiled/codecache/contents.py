"""What machine code of this package follows from, as a digest: of a function, and of all that goes into it.

A function that is linked in counts with its content, one that is called by address with its signature and its place in
the table alone: a change of a kernel changes the digests of that kernel and of what it goes into. Lines, comments and
docstrings do not count. What compiled code makes of known functions and types is defined in `evolvent.compiled`, whose
sources are in the name of the cache folder.
"""

from __future__ import annotations

import dis
import functools
import hashlib
import sys
from collections.abc import Collection
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.core.extending import _Intrinsic
from numba.core.typing import Signature

from evolvent.compiled.codecache.folder import is_own
from evolvent.compiled.codecache.linked import Linked, names_in
from evolvent.compiled.pointer import Struct, StructType

_NOTHING = {dis.opmap["CACHE"], dis.opmap["NOP"]}
_CONSTANT, _LOAD_GLOBAL = frozenset(dis.hasconst), dis.opmap["LOAD_GLOBAL"]
_LOAD_ATTRIBUTE = {dis.opmap[name] for name in ("LOAD_ATTR", "LOAD_METHOD") if name in dis.opmap}
_SHIFT = 0 if sys.version_info < (3, 12) else 1
_PLAIN = (type(None), bool, int, float, complex, str, bytes, type(Ellipsis))
_NONE: frozenset[str] = frozenset()
#: Fields of structs that code reads which does not name them: of the table of addresses.
_UNNAMED = frozenset({"addresses"})


class Content(NamedTuple):
    """Digest of a value, and what it depends on beside.

    Attributes
    ----------
    digest : bytes
    names : names that its functions refer to, those of fields among them
    structs : structs that it refers to
    """

    digest: bytes
    names: frozenset[str] = frozenset()
    structs: frozenset[type[Struct]] = frozenset()


class Unknown(TypeError):
    """A function refers to something whose content cannot be told."""


def digest(function: Any, signature: Any, options: str) -> str:
    """Digest of what the machine code of a function of this package follows from.

    Parameters
    ----------
    function : plain function
    signature : tuple of numba types, or a signature
    options : str, how it is compiled

    Raises
    ------
    Unknown
        If it refers to a value of a kind that is not known here.
    """
    found = _several("entry", options, parts=[_function(function), _value(signature, _NONE)])
    return _with_layouts(found).hex()


def linked_digest(function: Linked) -> str:
    """Digest of a function of this package that is linked into one of a user."""
    return _with_layouts(_linked(function)).hex()


def types_digest(signature: Any) -> str:
    """Digest of the types of a signature, with all fields of its structs."""
    return _with_layouts(_value(signature, _NONE), every=True).hex()


def _with_layouts(found: Content, *, every: bool = False) -> bytes:
    """Digest of a content and of where the fields that it names, or every one, stand in its structs."""
    names = found.names | _UNNAMED
    structs: set[type[Struct]] = set()
    waiting = list(found.structs)
    while waiting:
        one = waiting.pop()
        if one in structs:
            continue
        structs.add(one)
        waiting += [f.struct for name, f in one._fields.items() if f.struct is not None and (every or name in names)]
    ordered = sorted(structs, key=lambda one: one.__name__)
    return _join(found.digest, *(_layout(one, frozenset(one._fields) if every else names) for one in ordered))


def _join(*words: str | bytes) -> bytes:
    found = hashlib.sha256()
    for word in words:
        content = word if isinstance(word, bytes) else word.encode("utf-8", "surrogatepass")
        found.update(len(content).to_bytes(8, "little") + content)
    return found.digest()


def _layout(kind: Any, names: frozenset[str]) -> bytes:
    """Where the fields of these names stand in a struct, and of what kind they are."""
    return _join(kind.__name__, *(text for name, text in _places(kind).items() if name in names))


@functools.cache
def _places(kind: Any) -> dict[str, str]:
    """Place and kind of each field of a struct."""
    found, at = {}, 0
    for name, field in kind._fields.items():
        inner = "" if field.struct is None else field.struct.__name__
        found[name] = f"{name} {at} {field.ndim} {inner} {_dtype(field.dtype)}"
        at += field.words
    return found


def _dtype(dtype: Any) -> str:
    """Text of a dtype that tells offsets, size and alignment."""
    if dtype is None or dtype.fields is None:
        return repr(dtype)
    return f"{dtype!r} {dtype.itemsize} {[(name, *map(str, place)) for name, place in dtype.fields.items()]}"


# ---------------------------------------------------------------------------------------------- functions

#: Contents that were found, by address of what they are of, which is kept beside them so that no other gets it.
_found: dict[int, tuple[Any, Content]] = {}


def _function(function: Any) -> Content:
    """Content of a plain function, with all that goes into it."""
    known = _found.get(id(function))
    if known is not None:
        return known[1]
    code, space = function.__code__, function.__globals__
    names = names_in(code)
    parts = [_value(function.__defaults__, names), _value(function.__kwdefaults__, names)]
    words, loads = scan(code)
    for name, cell in zip(code.co_freevars, function.__closure__ or (), strict=True):
        words.append(name)
        parts.append(_value(cell.cell_contents, names))
    for name, asked in sorted(loads.items()):
        if name in space:
            words.append(name)
            parts.append(_value(space[name], names, asked))
    found = _several("function", *words, parts=parts, names=names)
    _found[id(function)] = function, found
    return found


def _several(*words: str | bytes, parts: list[Content], names: frozenset[str] = _NONE) -> Content:
    return Content(
        _join(*words, *(one.digest for one in parts)),
        names.union(*(one.names for one in parts)),
        frozenset().union(*(one.structs for one in parts)),
    )


class Scan(NamedTuple):
    """Instructions of a function and of those in it.

    Attributes
    ----------
    words : what its digest is of; without lines and without the places of constants, which a docstring takes part in
    loads : names of the globals that it loads, with the attributes that it asks of each
    """

    words: list[str | bytes]
    loads: dict[str, set[str]]


def scan(code: CodeType) -> Scan:
    """Read the instructions, ten times faster than `dis.get_instructions`."""
    numbers = (code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)
    names = (code.co_name, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
    done, inner = bytearray(), []
    loads: dict[str, set[str]] = {}
    words: list[str | bytes] = [repr(numbers), repr(names), code.co_exceptiontable]
    high, last, instructions, constants = 0, None, code.co_code, code.co_consts
    for at in range(0, len(instructions), 2):
        opcode = instructions[at]
        if opcode in _NOTHING:
            continue
        argument = instructions[at + 1] | high << 8
        if opcode == dis.EXTENDED_ARG:
            high = argument
            continue
        high = 0
        done.append(opcode)
        if opcode in _CONSTANT:
            constant = constants[argument]
            if isinstance(constant, CodeType):
                inner.append(constant)
            else:
                words.append(_constant(constant))
        else:
            done += argument.to_bytes(4, "little")
        if opcode == _LOAD_GLOBAL:
            last = loads.setdefault(code.co_names[argument >> 1], set())  # the lowest bit asks for a null on the stack
            continue
        if last is not None and opcode in _LOAD_ATTRIBUTE:
            last.add(code.co_names[argument >> _SHIFT])
        last = None
    words.append(bytes(done))
    for one in inner:
        found = scan(one)
        words += found.words
        for name, asked in found.loads.items():
            loads.setdefault(name, set()).update(asked)
    return Scan(words, loads)


def _constant(constant: Any) -> str:
    if isinstance(constant, frozenset):
        return repr(sorted(map(repr, constant)))
    return f"{type(constant).__name__} {constant!r}"


# ---------------------------------------------------------------------------------------------- values


def _value(value: Any, names: frozenset[str], asked: Collection[str] = ()) -> Content:
    """Content of what a function refers to; of a module of this package its attributes that are `asked`."""
    if type(value) in _PLAIN:
        return Content(_join(type(value).__name__, repr(value)))
    if isinstance(value, Linked):
        return _linked(value)
    if isinstance(value, ModuleType):
        own = sorted(asked) if is_own(value.__name__) else []
        return _several("module", value.__name__, *own, parts=[_value(getattr(value, one), _NONE) for one in own])
    if isinstance(value, np.ndarray | np.generic):
        if value.dtype.hasobject:
            raise Unknown(f"an array of {value.dtype}")
        flags = repr(value.flags.c_contiguous) if isinstance(value, np.ndarray) else ""
        return Content(_join(type(value).__name__, _dtype(value.dtype), repr(value.shape), flags, value.tobytes()))
    if isinstance(value, tuple | list):
        return _several(type(value).__name__, parts=[_value(one, names) for one in value])
    if isinstance(value, dict):
        pairs = [_value(one, names) for pair in value.items() for one in pair]
        return _several("dict", parts=pairs)
    if isinstance(value, set | frozenset) and all(type(one) in _PLAIN for one in value):
        return Content(_join(type(value).__name__, repr(sorted(map(repr, value)))))
    return _type_or_name(value, names)


def _linked(value: Any) -> Content:
    """A function that is linked in, or one that is called by its address."""
    if hasattr(value, "slot"):
        kinds = _value(value.signature, _NONE)
        return _several("by address", str(value.slot), value.options, parts=[kinds])
    return _several("linked", value.options, parts=[_function(value.py_func)])


def _type_or_name(value: Any, names: frozenset[str]) -> Content:
    """A type by its parts, or something of another package by its name."""
    if isinstance(value, StructType):
        return _type_or_name(value.struct, names)
    if isinstance(value, type) and issubclass(value, Struct):
        return Content(_join("struct", value.__name__), structs=frozenset({value}))
    if isinstance(value, types.BaseTuple):
        fields = repr(getattr(value, "fields", ""))
        return _several(str(value), fields, parts=[_value(one, names) for one in value])
    if isinstance(value, Signature):
        return _several("signature", parts=[_value(one, names) for one in (value.return_type, *value.args)])
    if isinstance(value, types.Type | np.dtype | slice):
        return Content(_join(type(value).__qualname__, _dtype(value) if isinstance(value, np.dtype) else repr(value)))
    if isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields"):
        defaults = _value(getattr(value, "_field_defaults", {}), names)
        return _several(value.__module__, value.__qualname__, repr(value._fields), parts=[defaults])
    if isinstance(value, _Intrinsic):
        defined = value._defn
        if is_own(defined.__module__) and not defined.__module__.startswith("evolvent.compiled."):
            raise Unknown(f"the intrinsic {defined.__qualname__}")
        cells = [_value(cell.cell_contents, names) for cell in defined.__closure__ or ()]
        return _several("intrinsic", defined.__module__, defined.__qualname__, parts=cells)
    if isinstance(value, np.ufunc):
        return Content(_join("ufunc", value.__name__))
    if isinstance(value, type | FunctionType | BuiltinFunctionType):
        module, name = str(value.__module__), value.__qualname__
        if not is_own(module) or module.startswith("evolvent.compiled."):
            return Content(_join("name", module, name))
        if isinstance(value, FunctionType):
            return _function(value)
    raise Unknown(f"{type(value).__qualname__} {str(value)[:80]}")
