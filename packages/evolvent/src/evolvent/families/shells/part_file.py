"""Meshes of shells from files of Gmsh and Nastran."""

from __future__ import annotations

import contextlib
import functools
import io
from typing import Any, NamedTuple

import numpy as np

from evolvent_base import safe_open
from evolvent_base.errors import InputError

Array = np.ndarray
#: Endings of files, and what their format is called in the reader.
FORMATS = {".msh": "gmsh", ".bdf": "nastran", ".nas": "nastran", ".fem": "nastran"}
#: Kinds of cells that are no elements of a surface.
_BESIDE = ("line", "vertex")


class Found(NamedTuple):
    """What a file holds: nodes (n, 3) in its unit of length, elements (m, 4), sides (k, 2) of nodes by their names."""

    x: Array
    quads: Array
    sets: dict[str, Array]


@functools.lru_cache(maxsize=8)
def read(path: str, digest: str) -> Found:
    """Quadrilaterals of a file, the nodes that they have, and the physical groups of curves and points by their names.

    Parameters
    ----------
    path : str; digest : str, of its content, by which what was read is known again

    Raises
    ------
    InputError
        If the reader is not installed, or the file cannot be read or has elements that are no quadrilaterals.
    """
    ending = next((one for one in FORMATS if path.lower().endswith(one)), None)
    if ending is None:
        raise InputError(f"{path!r} is no file of a mesh that is read; its name must end with {', '.join(FORMATS)}")
    safe_open.content(path, most=safe_open.LARGEST_TEXT)
    mesh = _mesh(path, FORMATS[ending])
    others = {block.type: len(block.data) for block in mesh.cells if block.type not in ("quad", *_BESIDE)}
    if others:
        kind, count = next(iter(others.items()))
        raise InputError(f"{path!r} has {count} elements of the kind {kind!r}; a shell needs quadrilaterals of four "
                         f"nodes alone: recombine the triangles in the program that made the mesh")  # fmt: skip
    quads = [np.asarray(block.data, dtype=int) for block in mesh.cells if block.type == "quad"]
    if not quads:
        raise InputError(f"{path!r} has no quadrilaterals; a shell needs elements of four nodes")
    points = np.asarray(mesh.points, dtype=float)
    x = np.hstack([points, np.zeros((len(points), 3 - points.shape[1]))])
    whole = np.concatenate(quads)
    used = np.unique(whole)
    number = np.full(len(x), -1)
    number[used] = np.arange(len(used))
    return Found(x[used], number[whole], _sets(mesh, number))


def _mesh(path: str, kind: str) -> Any:
    try:
        import meshio  # an extra
    except ImportError:
        raise InputError("files of meshes need the package meshio: pip install 'evolvent[mesh]'") from None
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            return meshio.read(path, file_format=kind)
    except (Exception, SystemExit) as error:  # noqa: BLE001  (the library raises what its parsing runs into)
        why = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"cannot read {path!r} as a mesh of {kind.capitalize()}: {why}") from None


def _sets(mesh: Any, number: Array) -> dict[str, Array]:
    """Sides of the physical groups of curves and points that are on the surface."""
    names = {(int(tag), int(size)): name for name, (tag, size) in mesh.field_data.items()}
    groups = mesh.cell_data.get("gmsh:physical", [])
    found: dict[str, list[Array]] = {}
    for block, tags in zip(mesh.cells, groups, strict=False):
        if block.type not in _BESIDE:
            continue
        sides = number[np.asarray(block.data, dtype=int)][:, [0, -1]]
        for tag in np.unique(tags):
            name = names.get((int(tag), _BESIDE[::-1].index(block.type)))
            own = sides[(np.asarray(tags) == tag) & (sides >= 0).all(axis=1)]
            if name is not None and len(own):
                found.setdefault(name, []).append(own)
    return {name: np.concatenate(own) for name, own in found.items()}
