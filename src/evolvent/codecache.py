"""Where compiled functions are kept, and for which processor they are compiled.

Every compiled function is kept on disk in a folder named by the versions of numba and Python, the processor and a hash
of the sources of all modules that hold compiled functions, so that a change in one file can never serve a stale result
in another (numba alone looks at a function's own file). A wheel may ship such a folder, which is then read first.

Functions are compiled for a baseline of the processor's family where it has that, so that the folder serves other
machines of its kind. Nothing of this changes what other users of numba in the process get.
"""

from __future__ import annotations

import functools
import hashlib
import os
import pathlib
import platform
import sys
import tempfile
from types import FunctionType
from typing import Any

import numba
from llvmlite import binding
from numba import config, types
from numba.core import codegen
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, _CacheLocator
from numba.core.compiler import compile_result
from numba.core.registry import cpu_target
from numba.core.targetconfig import TargetConfig

_PACKAGE = pathlib.Path(__file__).parent
#: Modules and packages that may hold compiled functions or constants that these use.
COMPILED = ("codecache", "jit", "laws", "pointer", "model", "kernels", "flow", "solvers", "batch")
#: Baselines by machine: LLVM's name of the processor, and the features of a host that has all of it.
_BASELINES = {"x86_64": ("x86-64-v3", ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"))}
_BASELINES["AMD64"] = _BASELINES["x86_64"]


def _baseline() -> str | None:
    """LLVM's name of the processor to compile for; None where it is the host's own."""
    name, needed = _BASELINES.get(platform.machine(), ("", ("none",)))
    try:
        features = binding.get_host_cpu_features()
    except RuntimeError:  # a host that LLVM does not know
        return None
    return name if all(features.get(feature) for feature in needed) else None


# ---------------------------------------------------------------------------------------------- folders


def sources() -> list[pathlib.Path]:
    """Files of the modules that may hold compiled functions."""
    found = sorted(_PACKAGE.rglob("*.py"))
    return [path for path in found if path.relative_to(_PACKAGE).with_suffix("").parts[0] in COMPILED]


def module_name(path: pathlib.Path) -> str:
    """Dotted name of the module in a file of the package."""
    return ".".join(("evolvent", *path.relative_to(_PACKAGE).with_suffix("").parts))


def _source_hash() -> str:
    digest = hashlib.sha256()
    for path in sources():
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def folder_name() -> str:
    """Name of the folder for this numba, Python, processor and package."""
    python = f"{sys.implementation.name}{sys.version_info[0]}{sys.version_info[1]}"
    processor = BASELINE or binding.get_host_cpu_name()
    return f"numba-{numba.__version__}-{python}-{sys.platform}-{processor}-{_source_hash()}"


def _find_cache_dir() -> pathlib.Path:
    """First writable of ``$EVOLVENT_CACHE``, the user's cache folder and one of theirs in the temporary folder."""
    name = folder_name()
    user = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    shared = os.path.join(tempfile.gettempdir(), f"evolvent-{os.getuid() if hasattr(os, 'getuid') else 'user'}")
    candidates = [os.environ.get("EVOLVENT_CACHE"), os.path.join(user, "evolvent"), shared]
    for base in candidates:
        if not base:
            continue
        folder = pathlib.Path(base) / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                return folder
        except OSError:
            continue
    return pathlib.Path(tempfile.mkdtemp(prefix="evolvent-cache-")) / name


BASELINE = _baseline()
CACHE_DIR = _find_cache_dir()
#: Folder of compiled functions that the package was shipped with; it may be absent, or of other versions.
SHIPPED = _PACKAGE / "_kernels" / CACHE_DIR.name


class _Locator(_CacheLocator):
    """A module's folder below `base`, without any absolute path."""

    def __init__(self, base: pathlib.Path, function: Any) -> None:
        self._path = base / function.__module__.removeprefix("evolvent.")
        self._line = function.__code__.co_firstlineno

    def get_cache_path(self) -> str:
        return os.fspath(self._path)

    def get_source_stamp(self) -> str:
        return CACHE_DIR.name

    def get_disambiguator(self) -> str:
        return str(self._line)


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


def _impl_in(base: pathlib.Path) -> type:
    class Impl(CompileResultCacheImpl):
        def __init__(self, function: Any) -> None:
            self._lineno = function.__code__.co_firstlineno
            self._locator = _Locator(base, function)
            self._filename_base = self.get_filename_base(function.__qualname__, "")

        def reduce(self, result: Any) -> tuple[Any, ...]:
            description = result.fndesc
            description.typemap = description.calltypes = None
            return result.library._get_compiled_object(), description, result.environment, result.signature

        def rebuild(self, target_context: Any, kept: tuple[Any, ...]) -> Any:
            code, description, environment, signature = kept
            library = _MachineCode(code, target_context.codegen())
            called = target_context.get_executable(library, description, environment)
            return compile_result(
                target_context=target_context, library=library, environment=environment, entry_point=called,
                fndesc=description, signature=signature, objectmode=False, lifted=(),
            )  # fmt: skip

    return Impl


class _Folder(FunctionCache):
    """Cache of one function in one folder."""

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Compiled function, or None; unlike numba's, without setting up the compiler, which takes half a second."""
        with self._guard_against_spurious_io_errors():
            return self._load_overload(signature, target_context)

    def read(self, signature: Any) -> tuple[Any, Any]:
        """Key and content of what is kept for a signature; None for the content where nothing is."""
        key = self._index_key(signature, cpu_target.target_context.codegen())
        return key, self._cache_file.load(key)

    def exists(self) -> bool:
        """Whether something of the function is kept."""
        return os.path.exists(self._cache_file._index_path)


class _Shipped(_Folder):
    _impl_class = _impl_in(SHIPPED)


class Cache(_Folder):
    """Cache of one function: what was shipped, then the user's folder; new results go to the user's."""

    _impl_class = _impl_in(CACHE_DIR)

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._shipped = _Shipped(function) if SHIPPED.is_dir() else None

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Compiled function from either folder, or None."""
        found = None if self._shipped is None else self._shipped.load_overload(signature, target_context)
        return super().load_overload(signature, target_context) if found is None else found

    def exists(self) -> bool:
        """Whether something of the function is kept in either folder."""
        return super().exists() or (self._shipped is not None and self._shipped.exists())

    def copy(self, signature: Any, base: pathlib.Path) -> None:
        """Copy what is kept for a signature into the folder `base`."""
        with compiling:
            key, kept = self.read(signature)
            if kept is None and self._shipped is not None:
                key, kept = self._shipped.read(signature)
        if kept is None:
            raise FileNotFoundError(f"{self._name} is not in the cache for {signature}")
        locator = _Locator(base, self._py_func)
        locator.ensure_cache_path()
        name = self._impl.filename_base
        IndexDataCacheFile(locator.get_cache_path(), name, locator.get_source_stamp()).save(key, kept)


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
        return str(BASELINE)

    def _customize_tm_features(self) -> str:
        return ""


def _index(context: Any, builder: Any, kind: Any, index: Any, _: Any) -> Any:
    """An index into an array as a machine word; it is not negative."""
    return context.cast(builder, index, kind, types.intp)


def _fix_slice(builder: Any, bounds: Any, size: Any) -> None:
    """Cut a slice off at the end of its array; its bounds are not negative."""
    bounds.stop = builder.select(builder.icmp_signed("<", bounds.stop, size), bounds.stop, size)


class _Compiling:
    """A context in which numba compiles and loads for this package.

    Notes
    -----
    It compiles for the baseline, through its own code generator. Indices and bounds of slices are taken as they
    are: numba tests each for an index counted from the end, of which kernels make no use, and that took 8 to 25 % of a
    step (``NUMBA_BOUNDSCHECK=1`` checks all of them; it needs its own cache folder). And compiler flags are hashed
    and compared quickly: numba 0.68 does so for every operator that it types, by building a dictionary option by
    option, which is a fifth of the time of compilation. The functions here return the same.
    """

    def __init__(self) -> None:
        self._depth = 0
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
        self._depth += 1
        if self._depth > 1:
            return
        context = cpu_target.target_context
        self._outer = TargetConfig.values, TargetConfig.__hash__, context._internal_codegen
        TargetConfig.values, TargetConfig.__hash__ = self._fast
        if BASELINE is not None:
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

    def take_indices(self) -> None:
        """Have indices taken as they are in what is compiled in this context; loading alone need not set numba up."""
        if not self._indices:
            from numba.cpython import slicing  # a tenth of a second
            from numba.np import arrayobj

            for module, name, function in ((arrayobj, "fix_integer_index", _index), (slicing, "fix_slice", _fix_slice)):
                self._indices.append((module, name, getattr(module, name)))
                setattr(module, name, function)


compiling = _Compiling()


def is_warm(name: str) -> bool:
    """Whether what goes by `name` has been compiled into this cache folder before."""
    return bool(config.DISABLE_JIT) or SHIPPED.is_dir() or (CACHE_DIR / f"warm-{name}").exists()


def mark_warm(name: str) -> None:
    """Remember that what goes by `name` is in the cache folder."""
    if not config.DISABLE_JIT:
        CACHE_DIR.mkdir(parents=True, exist_ok=True)
        (CACHE_DIR / f"warm-{name}").touch()
