"""What a process of the command line does before it loads large libraries, so that it starts quickly."""

from __future__ import annotations

import contextlib
import gc
import importlib
import os
import sys
from collections.abc import Iterator
from typing import Any

#: What the linear algebra is limited to: its matrices are small, and threads only get into each other's way.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
#: Variable by which pydantic leaves out plug-ins, for which it reads the files of all packages that are installed.
_PLUGINS = "PYDANTIC_DISABLE_PLUGINS"
#: Allocations between two collections: loading libraries allocates some 500 000 objects that stay, and looking through
#: them again and again takes a tenth of the time.
_ALLOCATIONS = 1_000_000
#: Array libraries that xarray loads where they are installed, to distinguish their arrays from NumPy's: half a second.
ARRAY_LIBRARIES = ("cupy", "dask", "distributed", "pint", "sparse")


def prepare_process() -> None:
    """Limit threads and collections of garbage; for a process of our own that has loaded no library yet."""
    for name in _THREADS:
        os.environ.setdefault(name, "1")
    os.environ.setdefault(_PLUGINS, "__all__")
    gc.set_threshold(_ALLOCATIONS, *gc.get_threshold()[1:])


def prepare_end() -> None:
    """Leave what is loaded out of the collections of garbage at the end of a process of our own.

    They look through some million objects again and again: 0.4 s of processor time after a run. Files are closed and
    what is registered for the end is called all the same.
    """
    gc.freeze()


@contextlib.contextmanager
def hidden(*names: str) -> Iterator[None]:
    """Libraries that other libraries do not find in here, as if they were not installed; those loaded stay."""
    absent = [name for name in names if name not in sys.modules]
    for name in absent:
        sys.modules[name] = None  # type: ignore[assignment]  # what importlib documents for a module not to be found
    try:
        yield
    finally:
        for name in absent:
            if sys.modules.get(name, sys) is None:
                del sys.modules[name]


def array_libraries_hidden() -> contextlib.AbstractContextManager[None]:
    """`ARRAY_LIBRARIES` hidden, for xarray to load without them; none where it is loaded, and may know of them."""
    return hidden(*(() if "xarray" in sys.modules else ARRAY_LIBRARIES))


def load(name: str) -> Any:
    """A library that may be hidden."""
    if sys.modules.get(name, sys) is None:
        del sys.modules[name]
    return importlib.import_module(name)


def load_drawing() -> None:
    """Load matplotlib's figures without the tables of properties in docstrings and signatures, 0.4 of the time."""
    if "matplotlib.figure" in sys.modules:
        return
    artist: Any = importlib.import_module("matplotlib.artist")
    described = "_update_set_signature_and_docstring"
    table, describe = artist.kwdoc, vars(artist.Artist).get(described)
    artist.kwdoc = lambda _: ""
    if describe is not None:
        setattr(artist.Artist, described, classmethod(lambda _: None))
    try:
        importlib.import_module("matplotlib.figure")
        importlib.import_module("matplotlib.backends.backend_agg")
    finally:
        artist.kwdoc = table
        if describe is not None:
            setattr(artist.Artist, described, describe)
