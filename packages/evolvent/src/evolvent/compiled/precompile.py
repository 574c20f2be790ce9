"""Compile all functions of the package ahead of use, for a wheel that carries them.

    python -m evolvent.compiled.precompile FOLDER

FOLDER gets what `evolvent/_kernels` holds in such a wheel. Functions in the cache folder are copied; the others are
compiled into it first.
"""

from __future__ import annotations

import importlib
import pathlib
import sys
from typing import Any

from evolvent.compiled import codecache, compilers, jit
from evolvent_base import progress


def compile_all() -> list[Any]:
    """Compile what is not in the cache of all functions that the package compiles, and return all of them."""
    for name in codecache.sources():
        importlib.import_module(name)
    found = jit.functions()
    jit.load(one for one in found if not compilers.is_kept(one.dispatcher, one.signature))
    return found


def write_kernels(folder: pathlib.Path) -> int:
    """Write all compiled functions to `folder`, and return how many there are."""
    functions, place = compile_all(), folder / codecache.folder_name()
    for function in functions:
        function.dispatcher._cache.copy(function.signature, place)
    return len(functions)


def _show(state: progress.Compilation) -> None:
    left = f", about {state.left:.0f} s left" if 0 < state.done < state.needed else ""
    print(f"compiled {state.done} of {state.needed} functions{left}", file=sys.stderr, flush=True)


def main() -> None:
    """Write the folder that the command names."""
    folder = pathlib.Path(sys.argv[1])
    if codecache.BASELINE is None:
        sys.exit("this processor lacks what the kernels of a wheel are compiled for (x86-64-v3)")
    with progress.compilation_shown_by(_show):
        count = write_kernels(folder)
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    print(f"{count} compiled functions, {size / 1e6:.1f} MB", file=sys.stderr)


if __name__ == "__main__":
    main()
