"""Where compiled functions are kept, and how they are compiled.

Every compiled function is kept on disk in the folder that `codecache.folder` finds, by a digest of all that it is
compiled from (`codecache.contents`). Folders that are only read, such as that of a wheel, come first. What a user
writes is compiled with the values that it refers to (`codecache.snapshots`), and kept likewise, or not at all.

Functions are compiled for a baseline of the processor's family where it has that, so that the folder serves other
machines of its kind. Nothing of this changes what other users of numba in the process get.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import pathlib
import pickle
import re
import threading
from types import FunctionType
from typing import Any

from llvmlite import binding
from numba import types
from numba.core import codegen
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult, compile_result
from numba.core.registry import cpu_target
from numba.core.serialize import dumps
from numba.core.targetconfig import TargetConfig

from evolvent.compiled.codecache import contents, files, folder
from evolvent.compiled.codecache.snapshots import Snapshot, foreign_overloads

#: Functions and laws of one name that are kept, at most: those that were compiled last.
_MOST, _MOST_LAWS = 10, 100


class _MachineCode:
    """Machine code of a function that was compiled before; in place of numba's library.

    Numba would keep LLVM's intermediate code too, which is longer than the machine code and takes most of the time of
    loading, to link it into other functions. Functions of this package are called by address.
    """

    def __init__(self, code: bytes, compiler: Any) -> None:
        self.codegen, self._code = compiler, code
        engine = compiler._engine._ee
        engine.add_object_file(binding.ObjectFileRef.from_data(code))
        engine.finalize_object()

    def get_pointer_to_function(self, name: str) -> int:
        """Address of a function of that name in the machine code."""
        return int(self.codegen._engine.get_function_address(name))


class _Store(_Cache):
    """Files of one function: one for each signature that it is compiled for.

    Parameters
    ----------
    name : str, of the function, for people
    place : str, name of the folder in that of the cache
    """

    #: How many of one name are kept: those that were compiled last.
    most = _MOST

    def __init__(self, name: str, place: str) -> None:
        self._name = re.sub(r"[^\w.-]", "", name)[:80]  # a user may give a module any name
        self._place = place
        self._held: dict[str, bytes] = {}

    def _content(self, signature: Any) -> str:
        """What tells it from others of its name, and from what it was before."""
        raise NotImplementedError

    @property
    def cache_path(self) -> str:
        """Folder of its files."""
        return str(folder.CACHE_DIR / self._place)

    def enable(self) -> None:
        """It is never disabled."""

    disable = flush = enable

    def _key(self, signature: Any, compiler: Any) -> str:
        return repr((self._place, self._name, self._content(signature), str(signature), compiler.magic_tuple()))

    def _path(self, base: pathlib.Path, key: str) -> pathlib.Path:
        digest = hashlib.sha256(key.encode("utf-8", "surrogatepass")).hexdigest()[:24]
        return base / self._place / f"{self._name}-{digest}.nbc"

    def _read(self, key: str) -> bytes | None:
        """What is kept by a key: in a folder that is only read, or in that of the cache."""
        for base, is_own in folder.READ_ONLY:
            content = files.read(self._path(base, key), key, is_own=is_own)
            if content is not None:
                return content
        return files.read(self._path(folder.CACHE_DIR, key), key)

    def is_kept(self, signature: Any, target_context: Any) -> bool:
        """Whether the function is kept for a signature."""
        key = self._key(signature, target_context.codegen())
        if key not in self._held and (content := self._read(key)) is not None:
            self._held[key] = content
        return key in self._held

    def _load(self, key: str, target_context: Any) -> Any:
        """What is kept by a key, as a compiled function; None where there is none that can be used."""
        content = self._held.pop(key, None) or self._read(key)
        if content is None:
            return None
        try:
            return self._rebuild(target_context, pickle.loads(content))
        except Exception as error:  # noqa: BLE001  (of an unpickled object)
            return files.cannot_load(self._path(folder.CACHE_DIR, key), error)

    def _rebuild(self, target_context: Any, kept: tuple[Any, ...]) -> Any:
        raise NotImplementedError

    def _reduce(self, result: Any) -> tuple[Any, ...]:
        raise NotImplementedError

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Compiled function, or None."""
        return self._load(self._key(signature, target_context.codegen()), target_context)

    def save_overload(self, signature: Any, result: Any) -> None:
        """Keep a compiled function, unless its machine code refers to this process; forget the oldest of its name."""
        if result.library.has_dynamic_globals or any(not one.can_cache for one in result.lifted):
            return
        key = self._key(signature, result.codegen)
        try:
            content = dumps(self._reduce(result))
        except Exception:  # noqa: BLE001  (a constant of a user that cannot be pickled)
            return
        files.write(self._path(folder.CACHE_DIR, key), key, content)
        with contextlib.suppress(OSError):
            own = pathlib.Path(self.cache_path).glob(f"{self._name}-{'?' * 24}.nbc")
            for path in sorted(own, key=lambda path: path.stat().st_mtime)[: -self.most]:
                path.unlink()


class Cache(_Store):
    """Cache of one function of this package, or with a digest of another."""

    def __init__(self, function: Any, options: str, digest: str = "") -> None:
        self._function, self._options, self._digest = function, options, digest
        self._contents: dict[str, str] = {}
        super().__init__(function.__qualname__, "users" if digest else function.__module__.removeprefix("evolvent."))

    def _content(self, signature: Any) -> str:
        known = str(signature)
        if known not in self._contents:
            self._contents[known] = (
                f"{self._digest} {self._options} {contents.types_digest(signature)}"
                if self._digest
                else contents.digest(self._function, signature, self._options)
            )
        return self._contents[known]

    def exists(self, signature: Any) -> bool:
        """Whether the function is kept for a signature."""
        with compiling:
            return self.is_kept(signature, cpu_target.target_context)

    def copy(self, signature: Any, base: pathlib.Path) -> None:
        """Copy what is kept for a signature into the folder `base`."""
        with compiling:
            key = self._key(signature, cpu_target.target_context.codegen())
        content = self._read(key)
        if content is None:
            raise FileNotFoundError(f"{self._name} is not in the cache for {signature}")
        files.write(self._path(base, key), key, content)

    def _reduce(self, result: Any) -> tuple[Any, ...]:
        description = result.fndesc
        description.typemap = description.calltypes = None
        return result.library._get_compiled_object(), description, result.environment, result.signature

    def _rebuild(self, target_context: Any, kept: tuple[Any, ...]) -> Any:
        code, description, environment, signature = kept
        library = _MachineCode(code, target_context.codegen())
        called = target_context.get_executable(library, description, environment)
        return compile_result(
            target_context=target_context, library=library, environment=environment, entry_point=called,
            fndesc=description, signature=signature, objectmode=False, lifted=(),
        )  # fmt: skip


class LawCache(_Store):
    """Cache of a law of a user, with all that numba needs to link it into other functions."""

    most = _MOST_LAWS

    def __init__(self, found: Snapshot) -> None:
        function = found.function
        name = f"{function.__module__}.{function.__name__}"
        super().__init__(name, "laws")
        self._digest, self._signed = found.digest, found.signed

    def _content(self, signature: Any) -> str:
        return self._digest

    def exists(self, signature: Any) -> bool:
        """Whether the law is kept for a signature, or cannot be kept."""
        return not self._digest or self.is_kept(signature, cpu_target.target_context)

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Compiled law, or None; then its helpers are ready to be compiled with it."""
        found = None
        if self._digest:
            target_context.refresh()
            found = super().load_overload(signature, target_context)
        if found is None:
            for helper, signatures in self._signed:
                for one in signatures:
                    helper.compile(one)
                helper.disable_compile()
        return found

    def save_overload(self, signature: Any, result: Any) -> None:
        """Keep a compiled law, and forget the oldest ones of its name."""
        if self._digest and not foreign_overloads():
            super().save_overload(signature, result)

    def _reduce(self, result: Any) -> tuple[Any, ...]:
        return result._reduce()

    def _rebuild(self, target_context: Any, kept: tuple[Any, ...]) -> Any:
        return CompileResult._rebuild(target_context, *kept)


def without_path(function: Any) -> Any:
    """The same function, recorded as if from a file of the package and not of this machine.

    Exceptions that machine code raises carry the name of the file.
    """
    name = pathlib.PurePosixPath(*function.__module__.split(".")).with_suffix(".py")
    code = function.__code__.replace(co_filename=str(name))
    found = FunctionType(code, function.__globals__, function.__name__, function.__defaults__, function.__closure__)
    return functools.update_wrapper(found, function)


# ---------------------------------------------------------------------------------------------- compiling


class _BaselineCodegen(codegen.JITCPUCodegen):
    """Machine code for the baseline."""

    def _get_host_cpu_name(self) -> str:
        return str(folder.BASELINE)

    def _customize_tm_features(self) -> str:
        return ""


def _index(context: Any, builder: Any, kind: Any, index: Any, _: Any) -> Any:
    """An index into an array as a machine word; it is not negative."""
    return context.cast(builder, index, kind, types.intp)


def _fix_slice(builder: Any, bounds: Any, size: Any) -> None:
    """Cut a slice off at the end of its array; its bounds are not negative."""
    bounds.stop = builder.select(builder.icmp_signed("<", bounds.stop, size), bounds.stop, size)


class _Compiling:
    """A context in which numba compiles and loads for this package, one thread at a time.

    Notes
    -----
    It compiles for the baseline, through its own code generator. Indices and bounds of slices are taken as they
    are: numba tests each for an index counted from the end, of which kernels make no use, and that took 8 to 25 % of a
    step (``NUMBA_BOUNDSCHECK=1`` checks all of them; it needs its own cache folder). And compiler flags are hashed
    and compared quickly: numba 0.68 does so for every operator that it types, by building a dictionary option by
    option, which is a fifth of the time of compilation. The functions here return the same.
    """

    def __init__(self) -> None:
        self._depth, self._lock = 0, threading.RLock()
        self._codegen: Any = None
        self._outer: tuple[Any, ...] = ()
        self._indices: list[tuple[Any, str, Any]] = []
        self._defaults: dict[Any, dict[str, Any]] = {}
        self._hashes: dict[Any, int] = {}
        hash_slowly = TargetConfig.__hash__

        def values(flags: Any) -> dict[str, Any]:
            kind = type(flags)
            if kind not in self._defaults:
                self._defaults[kind] = {name: option.default for name, option in kind.options.items()}
            return self._defaults[kind] | flags._values

        def hash_of(flags: Any) -> int:
            kind = type(flags)
            if kind not in self._hashes:
                self._hashes[kind] = hash_slowly(flags)  # of the names of the options alone
            return self._hashes[kind]

        self._fast = values, hash_of

    def __enter__(self) -> None:
        self._lock.acquire()
        self._depth += 1
        if self._depth > 1:
            return
        context = cpu_target.target_context
        self._outer = TargetConfig.values, TargetConfig.__hash__, context._internal_codegen
        TargetConfig.values, TargetConfig.__hash__ = self._fast
        if folder.BASELINE is not None:
            if self._codegen is None:
                self._codegen = _BaselineCodegen("evolvent")
            context._internal_codegen = self._codegen

    def __exit__(self, *exception: Any) -> None:
        self._depth -= 1
        if self._depth == 0:
            TargetConfig.values, TargetConfig.__hash__, cpu_target.target_context._internal_codegen = self._outer
            for module, name, function in self._indices:
                setattr(module, name, function)
            self._indices.clear()
        self._lock.release()

    def take_indices(self) -> None:
        """Have indices taken as they are in what is compiled in this context; loading alone need not set numba up."""
        if not self._indices:
            from numba.cpython import slicing  # a tenth of a second
            from numba.np import arrayobj

            for module, name, function in ((arrayobj, "fix_integer_index", _index), (slicing, "fix_slice", _fix_slice)):
                self._indices.append((module, name, getattr(module, name)))
                setattr(module, name, function)


compiling = _Compiling()
