"""Reduced models of Nastran: matrices and interface points of an external superelement, by the package pyYeti.

Nastran reduces a model by Craig and Bampton, writes its matrices (`EXTSEOUT`, as OUTPUT4, OUTPUT2 or DMIG) and the
points whose coordinates they have as bulk data: grids, scalar points of the modes, coordinate systems, and the order on
the entries SECONCT or EXTRN.
"""

from __future__ import annotations

import pathlib
import re
from typing import Any

import numpy as np

from evolvent.elements.reduced_models import ReducedModel
from evolvent_base import safe_open
from evolvent_base.errors import InputError

#: Endings of files with matrices: OUTPUT4, OUTPUT2, and bulk data with DMIG entries; and of files of points beside.
MATRICES, DMIG = (".op4", ".op2"), (".pch", ".bdf", ".dat", ".nas")
ENDINGS = (*MATRICES, *DMIG)
POINTS = (".asm", *DMIG)
#: Names of stiffness and mass, most usual first.
NAMES = (("kaa", "maa"), ("kxx", "mxx"), ("kaax", "maax"), ("k", "m"))
#: Name of the matrix that recovers element forces.
FORCES = "mef1"

#: Name of an entry of bulk data; names that say where points are, or in which order; and those of them that are read.
_NAME = re.compile(r"([A-Z][A-Z0-9]{0,7})")
_MATTERS = re.compile(r"GRI?D|CORD|[A-Z]POINT|CSUP|SEQGP|SELOC|SEMPLN|INCLUDE")
_READ = ("GRID", "SPOINT", "CORD2R", "CORD2C", "CORD2S")
#: What to write in place of entries that are not read.
_INSTEAD = {
    "GRDSET": "write its coordinate systems on the entries GRID",
    "INCLUDE": "put the file into this one",
    "CORD1R": "write CORD2R", "CORD1C": "write CORD2C", "CORD1S": "write CORD2S",
}  # fmt: skip
_OTHERS = f"points are read of {', '.join(_READ[:-1])} and {_READ[-1]}"
#: Points that ranges of bulk data stand for, at most.
MOST = 100_000
_RANGE = re.compile(r"(\d+)[\s,]*THRU[\s,]*(\d+)")

Rows = list[tuple[int, int]]


def read_nastran(path: str, bulk: str | None = None) -> ReducedModel:
    """A reduced model of Nastran's files, in the units of the files and basic coordinates.

    Parameters
    ----------
    path : str, with the matrices (`ENDINGS`): KAA and MAA, KXX and MXX, or KAAX and MAAX
    bulk : str, optional; bulk data with the points, where they are not in the file of the matrices or in one beside
        it of the same name

    Returns
    -------
    ReducedModel, not checked: nodes are called `grid` and their number; results of the recovery matrix MEF1 of an
    OUTPUT4 file `element_force1` and so on

    Raises
    ------
    InputError
        Where the files cannot be read, a matrix or point is missing, or a grid has not all six components; one
        sentence.
    """
    nastran = _library()
    points = bulk or _beside(path)
    for file in dict.fromkeys((path, points)):
        _check_entries(nastran, file, safe_open.content(file))
    ending = pathlib.Path(path).suffix.lower()
    for file in dict.fromkeys((points, *([path] if ending in DMIG else []), *_extrn_beside(path))):
        _check_ranges(file)
    found = _matrices(nastran, path) if ending in MATRICES else {}
    K, M, rows = _pair(path, found) if found else _dmig(nastran, path)
    table = _call(points, lambda: nastran.bulk2uset(points, follow_includes=False)[0])
    if not rows:
        rows = _order(nastran, path, points, table)
    if len(rows) != len(K):
        raise InputError(f"the points of {points!r} have {len(rows)} components, but the matrices of {path!r} have "
                         f"{len(K)} rows; give the bulk data of the interface by the key bulk")  # fmt: skip
    return _model(nastran, points, K, M, rows, table, found.get(FORCES))


def real(matrix: Any, file: str, name: str) -> np.ndarray:
    """A matrix of real numbers.

    Raises
    ------
    InputError
        Where it has imaginary parts, such as structural damping.
    """
    found = np.asarray(matrix)
    if np.iscomplexobj(found) and np.any(found.imag):
        raise InputError(
            f"{file}: {name} has imaginary parts, such as structural damping, which a reduced body does not take; give "
            f"the real part, and damping by damping_ratio"
        )
    return np.array(found.real, dtype=float)


def _check_entries(nastran: Any, path: str, raw: bytes) -> None:
    """Refuse entries that place or order points and are not read, and points that are given twice."""
    if pathlib.Path(path).suffix.lower() in MATRICES:
        return
    for line in raw.decode("latin-1").upper().splitlines():
        name = _NAME.match(line)
        if name is None or not _MATTERS.match(name[1]):
            continue
        if name[1] not in _READ:
            raise InputError(f"{path!r} has an entry {name[1]}, which is not read; {_INSTEAD.get(name[1], _OTHERS)}")
        if "\t" in line:
            raise InputError(f"{path!r} has an entry {name[1]} with tabs, which are not read; write blanks or commas")
    for what, pattern in (("GRID", r"grid\b"), ("coordinate system", r"cord2[rcs]\b")):
        cards = _call(path, lambda pattern=pattern: nastran.rdcards(
            path, pattern, return_var="list", regex=True, no_data_return=[], follow_includes=False))  # fmt: skip
        numbers = [card[0] for card in cards if card]
        twice = (
            next((one for one in numbers if numbers.count(one) > 1), None) if len(set(numbers)) < len(numbers) else None
        )
        if twice is not None:
            raise InputError(f"{path!r} has {what} {twice} twice; leave one of them out")


def _library() -> Any:
    try:
        from pyyeti import nastran  # an extra
    except ImportError:
        raise InputError("files of Nastran need the package pyyeti: pip install 'evolvent[nastran]'") from None
    return nastran


def _call(path: str, read: Any) -> Any:
    """What a reader of the library returns; any failure of it as one sentence."""
    try:
        return read()
    except Exception as error:  # noqa: BLE001  (the library raises what its parsing runs into)
        why = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"cannot read {path!r} as a file of Nastran: {why}") from None


def _beside(path: str) -> str:
    """The file of points of the same name, or the file itself where it is bulk data."""
    given = pathlib.Path(path)
    if given.suffix.lower() in DMIG:
        return path
    if found := beside(path):
        return found[0]
    names = " or ".join(given.with_suffix(ending).name for ending in POINTS)
    raise InputError(f"{path!r} has matrices alone; the points they belong to must be in {names} beside it, or in the "
                     f"file of the key bulk")  # fmt: skip


def beside(path: str) -> list[str]:
    """Files of points of the same name as a file of matrices, that which is taken first."""
    names = [str(pathlib.Path(path).with_suffix(ending)) for ending in POINTS]
    return [name for name in names if name != path and pathlib.Path(name).is_file()]


def _matrices(nastran: Any, path: str) -> dict[str, np.ndarray]:
    """Matrices of an OUTPUT4 or OUTPUT2 file by their names; none where an OUTPUT2 file has only DMIG entries."""
    if path.lower().endswith(".op4"):
        _, sizes, *_ = _call(path, lambda: nastran.op4.dir(path, verbose=False))
        declared = sum(16 * rows * columns for rows, columns in sizes)
        safe_open.check_declared(declared, len(safe_open.content(path)), path)
        return {name.lower(): value for name, value in _call(path, lambda: nastran.op4.read(path)).items()}

    def read() -> dict[str, np.ndarray]:
        with nastran.OP2(path) as file:
            return dict(file.rdop2mats(lower=True))

    return _call(path, read)


def _pair(path: str, found: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, Rows]:
    for stiffness, mass in NAMES:
        if stiffness in found and mass in found:
            K, M = (real(found[name], repr(path), name.upper()) for name in (stiffness, mass))
            return K, M, []
    wanted = ", ".join(f"{k.upper()} and {m.upper()}" for k, m in NAMES)
    raise InputError(f"{path!r} has no pair of matrices {wanted}; it has {', '.join(sorted(found)).upper()}")


def _dmig(nastran: Any, path: str) -> tuple[np.ndarray, np.ndarray, Rows]:
    """Stiffness, mass and their rows (number of a point, component) of DMIG entries."""
    found = _call(path, lambda: nastran.rddmig(path, square=True, follow_includes=False))
    for names in NAMES:
        if all(name in found for name in names):
            for name in names:
                real(found[name].to_numpy(), repr(path), name.upper())
            K, M = (found[name] for name in names)
            rows = sorted(set(K.index) | set(M.index))
            K, M = (one.reindex(index=rows, columns=rows, fill_value=0.0).to_numpy().real for one in (K, M))
            return K, M, [(int(point), int(component)) for point, component in rows]
    raise InputError(f"{path!r} has no DMIG entries KAAX and MAAX; it has {', '.join(sorted(found)).upper() or 'none'}")


def _order(nastran: Any, path: str, points: str, table: Any) -> Rows:
    """Rows of matrices that do not name them: those of EXTRN, of SECONCT, or all points in the order of numbers."""
    for file in dict.fromkeys((points, *_extrn_beside(path))):
        if _has(file, "EXTRN"):
            found = _call(file, lambda file=file: nastran.rdextrn(file, follow_includes=False))
            return [(int(point), int(component)) for point, component in found]
    scalar = _call(points, lambda: nastran.rdspoints(points, follow_includes=False))
    grids = dict.fromkeys(int(point) for point in table.index.get_level_values("id"))
    known = [*grids, *(int(point) for point in (() if scalar is None else scalar))]
    if _has(points, "SECONCT"):
        numbers = [int(k) for k in _call(points, lambda: nastran.rdseconct(points, follow_includes=False))[0]]
    else:
        numbers = sorted(known)
    return [(point, part) for point in numbers for part in (range(1, 7) if point in grids else (0,))]


def _extrn_beside(path: str) -> list[str]:
    """The punch file beside the matrices, which may have their order."""
    punch = pathlib.Path(path).with_suffix(".pch")
    return [str(punch)] if punch.is_file() else []


def _check_ranges(path: str) -> None:
    """Refuse bulk data whose ranges of numbers, as in ``SPOINT,1,THRU,99``, stand for more than `MOST` points."""
    points = 0
    for line in safe_open.content(path).decode("latin-1").upper().splitlines():
        for first, last in _RANGE.findall(line.partition("$")[0]):
            points += max(int(last[:18]) - int(first[:18]), 0)
        if points > MOST:
            entry = line.split(",")[0].split()[0].strip("*")
            raise InputError(
                f"{path!r}: the range of {entry} stands for more than {MOST} points, which no reduced model has"
            )


def _has(path: str, entry: str) -> bool:
    """Whether bulk data has an entry."""
    text = safe_open.content(path).decode("latin-1").upper()
    return any(line.startswith(entry) for line in text.splitlines())


def _model(nastran: Any, path: str, K: np.ndarray, M: np.ndarray, rows: Rows, table: Any,
           forces: np.ndarray | None) -> ReducedModel:  # fmt: skip
    """The model with its grids first, their coordinates in basic axes, and without rows of no stiffness and mass."""
    at = {row: k for k, row in enumerate(rows)}
    grids = list(dict.fromkeys(point for point, component in rows if component))
    for point in grids:
        have = [part for part in range(1, 7) if (point, part) in at]
        if len(have) < 6:
            raise InputError(f"grid {point} has the components {''.join(map(str, have))} in the matrices; an interface "
                             f"node needs all six, 123456")  # fmt: skip
        if (point, 1) not in table.index:
            raise InputError(f"{path!r} has no entry GRID {point}, which the matrices refer to")
    if not grids:
        raise InputError(f"{path!r} gives the matrices no grid; a reduced model needs at least one interface node")
    order = [at[point, part] for point in grids for part in range(1, 7)]
    others = [k for row, k in at.items() if not row[1] and (K[k].any() or M[k].any())]
    size = len(order) + len(others)
    own = table.loc[[(point, part) for point in grids for part in range(1, 7)]]
    moves = np.asarray(nastran.rbgeom_uset(own))  # (6 p, 6), of rigid motions of basic axes
    T, positions = np.eye(size), np.empty((len(grids), 3))
    for k, point in enumerate(grids):
        positions[k] = own.loc[(point, 1), ["x", "y", "z"]]
        rigid = np.eye(6)
        rigid[:3, 3:] = np.cross(np.eye(3), positions[k]).T
        T[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = moves[6 * k : 6 * k + 6] @ np.linalg.inv(rigid)
    pick = np.ix_([*order, *others], [*order, *others])
    recovery = np.zeros((0, size))
    if forces is not None and forces.shape[1] == len(rows):
        recovery = real(forces, repr(path), FORCES.upper())[:, [*order, *others]] @ T
    return ReducedModel(
        T.T @ K[pick] @ T, T.T @ M[pick] @ T, positions, tuple(f"grid{point}" for point in grids), recovery,
        tuple(f"element_force{k + 1}" for k in range(len(recovery))), ("1",) * len(recovery),
    )  # fmt: skip
