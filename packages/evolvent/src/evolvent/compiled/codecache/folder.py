"""The folder of stored machine code, and for which processor it is compiled.

It is named by the versions of numba and Python, the processor and a hash of the sources of `evolvent.compiled`, which
define how functions are compiled. What a function is compiled from is in the key of its file (`codecache.contents`).
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import os
import pathlib
import platform
import shutil
import stat
import sys
import tempfile

import numba
from llvmlite import binding
from numba import config

from evolvent.compiled.codecache.files import may_be_changed, say_once
from evolvent_base import packages

_PACKAGE = pathlib.Path(__file__).parents[2]
#: Environment variable that names the folder in which the cache is kept.
VARIABLE = "EVOLVENT_CACHE"
#: Baselines by machine: LLVM's name of the processor, and the features of a host that has all of it.
_BASELINES = {"x86_64": ("x86-64-v3", ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"))}
_BASELINES["AMD64"] = _BASELINES["x86_64"]
#: Symbolic links that a path is followed through, at most.
_MOST_LINKS = 40
#: What Windows calls a link to a folder that is no symbolic link.
_JUNCTION = 0xA0000003


def _baseline() -> str | None:
    """LLVM's name of the processor to compile for; None where it is the host's own, or ``$NUMBA_CPU_NAME``."""
    if config.CPU_NAME is not None or config.CPU_FEATURES is not None:
        return None
    name, needed = _BASELINES.get(platform.machine(), ("", ("none",)))
    try:
        features = binding.get_host_cpu_features()
    except RuntimeError:  # a host that LLVM does not know
        return None
    return name if all(features.get(feature) for feature in needed) else None


#: What the source of a module has that declares compiled functions.
_DECLARE = ("evolvent.compiled.jit", "@calls.")


def sources() -> dict[str, pathlib.Path]:
    """Modules that declare compiled functions, of all packages of evolvent that are installed: names and files."""
    found = {}
    for package, folder in packages.folders().items():
        for path in sorted(folder.rglob("*.py")):
            if any(words in path.read_text(encoding="utf-8") for words in _DECLARE):
                parts = path.relative_to(folder).with_suffix("").parts
                found[".".join((package, *parts)).removesuffix(".__init__")] = path
    return found


def is_own(module: str) -> bool:
    """Whether a module is one of evolvent, whose functions are kept by what they are compiled from."""
    return packages.is_own(module)


def _source_hash() -> str:
    digest = hashlib.sha256()
    for path in sorted((_PACKAGE / "compiled").rglob("*.py")):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def folder_name() -> str:
    """Name of the folder for this numba, Python, processor and package."""
    python = f"{sys.implementation.name}{sys.version_info[0]}{sys.version_info[1]}"
    processor = BASELINE or config.CPU_NAME or binding.get_host_cpu_name()
    return f"numba-{numba.__version__}-{python}-{sys.platform}-{processor}-{_source_hash()}"


def refusal(path: str) -> str:
    """Why a folder must not hold code that is run; '' where it may, or does not exist yet.

    The folder itself must be the user's own, and nobody else may write to it. The same holds for every folder on the
    way to it below the temporary folder, or below any other folder that others may write to; no symbolic link is
    followed there. What belongs to the administrator counts as the user's own. On Windows the rights of others cannot
    be seen; the temporary folder is the user's own there.
    """
    temporary = pathlib.Path(os.path.realpath(_temporary()))
    parts = list(pathlib.Path(os.path.abspath(path)).parts)
    reached, exposed, links = pathlib.Path(parts.pop(0)), False, 0
    while parts:
        here = reached / parts.pop(0)
        try:
            found = here.lstat()
        except FileNotFoundError:
            return ""
        except OSError as error:
            return f"{os.fspath(here)!r} cannot be read ({(error.strerror or str(error)).lower()})"
        if stat.S_ISLNK(found.st_mode) or getattr(found, "st_reparse_tag", 0) == _JUNCTION:
            links += 1
            if exposed or links > _MOST_LINKS:
                return f"{os.fspath(here)!r} is a symbolic link"
            target = pathlib.Path(os.path.abspath(reached / os.readlink(here)))
            reached, parts = pathlib.Path(target.parts[0]), [*target.parts[1:], *parts]
            continue
        if not stat.S_ISDIR(found.st_mode):
            return f"{os.fspath(here)!r} is not a folder"
        why = may_be_changed(found)
        if why and (exposed or not parts):
            return f"{os.fspath(here)!r} {why}"
        shared = bool(why) and bool(found.st_mode & (stat.S_IWGRP | stat.S_IWOTH))
        exposed = exposed or shared or here == temporary
        reached = here
    return ""


def _made(base: str, name: str) -> tuple[pathlib.Path | None, str]:
    """The folder `name` below `base`, made where it is missing; None and why where nothing can be written to it."""
    folder = pathlib.Path(os.path.abspath(base)) / name
    if why := refusal(base):
        return None, why
    try:
        folder.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError as error:
        return None, f"{os.fspath(folder)!r} cannot be made ({(error.strerror or str(error)).lower()})"
    if not os.access(folder, os.W_OK):
        return None, f"{os.fspath(folder)!r} cannot be written to"
    why = refusal(os.fspath(folder))
    return (None, why) if why else (folder, "")


def _read_only(base: str, name: str) -> pathlib.Path | None:
    """The folder `name` below `base` where it is there and nobody else may change it, but it cannot be written to."""
    folder = pathlib.Path(os.path.abspath(base)) / name
    return folder if folder.is_dir() and not refusal(os.fspath(folder)) and not os.access(folder, os.W_OK) else None


def _find_cache_dir() -> pathlib.Path:
    """First usable one of ``$EVOLVENT_CACHE``, the user's cache folder and one of theirs in the temporary folder.

    Those before it that cannot be written to, but hold functions already, are read: see `READ_ONLY`.

    One that others can change is named on stderr, as is a given one that cannot be used. The processes that this one
    starts then use the same folder as it does.
    """
    name, given = folder_name(), os.environ.get(VARIABLE)
    user = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    last = os.path.join(_temporary(), f"evolvent-{os.getuid() if hasattr(os, 'getuid') else 'user'}")
    was_refused = False
    for base in filter(None, (given, os.path.join(user, "evolvent"), last)):
        folder, why = _made(base, name)
        if folder is not None:
            if was_refused:
                os.environ[VARIABLE] = base
            return folder
        if (found := _read_only(base, name)) is not None:
            _found_read_only.append(found)
            continue
        if base == given or refusal(base):
            was_refused = True
            hint = f"name a folder of your own, which nobody else may write to, in {VARIABLE}"
            say_once(base, f"compiled functions are not stored in {base!r}: {why}; {hint}")
    return _of_this_process(name)


def _temporary() -> str:
    """The temporary folder; the current one where there is none."""
    try:
        return tempfile.gettempdir()
    except OSError:
        return os.curdir


def _of_this_process(name: str) -> pathlib.Path:
    """A folder for this process and those that it starts."""
    try:
        base = tempfile.mkdtemp(prefix="evolvent-cache-")
    except OSError as error:
        say_once("none", f"compiled functions cannot be stored anywhere: {(error.strerror or str(error)).lower()}")
        return pathlib.Path(os.devnull) / name
    atexit.register(shutil.rmtree, base, ignore_errors=True)
    os.environ[VARIABLE] = base
    return pathlib.Path(base) / name


_found_read_only: list[pathlib.Path] = []
BASELINE = _baseline()
CACHE_DIR = _find_cache_dir()
#: Folder of compiled functions that the package was shipped with; it may be absent, or of other versions.
SHIPPED = _PACKAGE / "_kernels" / CACHE_DIR.name
#: Folders that are only read, in this order before `CACHE_DIR`, and whether their files must be the user's own.
READ_ONLY = (*([(SHIPPED, False)] if SHIPPED.is_dir() else []), *((one, True) for one in _found_read_only))


def is_warm(name: str) -> bool:
    """Whether what goes by `name` has been compiled into this cache folder, or one that is only read, before."""
    if config.DISABLE_JIT or SHIPPED.is_dir():
        return True
    return any((base / f"warm-{name}").exists() for base in (CACHE_DIR, *(one for one, _ in READ_ONLY)))


def mark_warm(name: str) -> None:
    """Remember that what goes by `name` is in the cache folder."""
    if not config.DISABLE_JIT:
        with contextlib.suppress(OSError):
            CACHE_DIR.mkdir(mode=0o700, parents=True, exist_ok=True)
            (CACHE_DIR / f"warm-{name}").touch()
