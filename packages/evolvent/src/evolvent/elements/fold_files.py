"""Crease patterns in files of the format FOLD, and the pattern of Miura as such a file.

FOLD is JSON (Demaine, Ku and Lang 2016, "A new file standard to represent folded structures"; specification 1.2). The
key frame is the flat pattern; `file_frames` may hold folded states of it. Angles are in degrees, positive of valleys,
which bring the sides together from which faces go counterclockwise. What is not named here is not read.
"""

from __future__ import annotations

import functools
import json
import math
import pathlib
from collections import Counter
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from evolvent_base import files, safe_open
from evolvent_base.errors import InputError, nearest

Array = np.ndarray
ENDING = ".fold"
#: Folder of the patterns that are shipped.
SHIPPED = pathlib.Path(__file__).parent / "models"
#: Lengths that `frame_unit` may say, m; "unit" says none.
LENGTHS = {"in": 0.0254, "pt": 0.0254 / 72.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "μm": 1e-6, "nm": 1e-9}
#: Signs of the fold angles by the assignment of an edge.
SIGNS = {"M": -1.0, "V": 1.0}
#: Assignments: mountain, valley, unassigned; flat and joined, which do not fold; boundary and cut, which join nothing.
_FOLDS, _STAYS, _ENDS = ("M", "V", "U"), ("F", "J"), ("B", "C")
#: What a key frame may be off the plane, beside its size.
_FLAT = 1e-9


class Crease(NamedTuple):
    """An edge between two facets.

    Attributes
    ----------
    edge : int, number in the file; begin, end : int, its vertices
    left, right : int, facets on its left and right, seen from where facets go counterclockwise
    assignment : str, "M", "V", "U", or "F", "J" of one that does not fold
    share : float, of its fold angle beside that of others, with its sign, where folding begins
    """

    edge: int
    begin: int
    end: int
    left: int
    right: int
    assignment: str
    share: float

    @property
    def folds(self) -> bool:
        """Whether it is a hinge."""
        return self.assignment in _FOLDS


class Pattern(NamedTuple):
    """A flat crease pattern.

    Attributes
    ----------
    x : (n, 2) float, vertices, in the unit of the file
    facets : vertices of each, counterclockwise
    creases : edges between facets, but cuts
    unit : float, m, None where the file does not say it
    frames : mapping, title or number -> (n, 3) float, vertices of a folded state
    """

    x: Array
    facets: tuple[tuple[int, ...], ...]
    creases: tuple[Crease, ...]
    unit: float | None
    frames: Mapping[str, Array]


def path_of(name: str) -> str:
    """Path of a file, or of a pattern that is shipped, by its name without an ending."""
    return str(SHIPPED / f"{name}{ENDING}") if name in shipped_patterns() else name


def shipped_patterns() -> list[str]:
    """Names of the patterns that are shipped."""
    return sorted(path.stem for path in SHIPPED.glob(f"*{ENDING}"))


@functools.lru_cache(maxsize=16)
def read(name: str, digest: str) -> Pattern:
    """The pattern of a file.

    Parameters
    ----------
    name : str, as of `path_of`; digest : str, of its content, by which what was read is known again

    Raises
    ------
    InputError
        Where the file cannot be read, or is no flat pattern of facets with two sides; one sentence.
    """
    path = path_of(name)
    if not path.lower().endswith(ENDING):
        raise InputError(
            f"{name!r} is no file of a crease pattern; its name must end with {ENDING}, or be that of a shipped one: "
            f"{', '.join(shipped_patterns())}"
        )
    try:
        content = json.loads(safe_open.text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(f"cannot read {name!r} as JSON: {error}") from None
    if not isinstance(content, dict):
        raise InputError(
            f"{name!r} is no object of JSON; a file of FOLD is one, with vertices_coords and edges_vertices"
        )
    at = _positions(name, content, "the key frame")
    thick = np.ptp(at[:, 2]) if len(at) else 0.0
    if thick > _FLAT * np.ptp(at, axis=0).max(initial=0.0):
        raise InputError(
            f"the key frame of {name!r} is not flat, its z coordinates differ by {thick:.3g}; it must be the crease "
            f"pattern, and folded states of it must be in file_frames"
        )
    x = at[:, :2]
    edges, assignments, angles = _edges(name, content, len(x))
    facets = _facets(name, content, x, edges)
    return Pattern(x, facets, _creases(name, facets, edges, assignments, angles), _unit(name, content),
                   _frames(name, content, len(x)))  # fmt: skip


def _array(name: str, content: Mapping[str, Any], key: str, where: str = "") -> list[Any]:
    found = content.get(key)
    if not isinstance(found, list) or not found:
        what = "has none" if found is None else "it is no list, or an empty one"
        raise InputError(f"{name!r} needs {key}{where}; {what}")
    return found


def _positions(name: str, content: Mapping[str, Any], where: str) -> Array:
    """Vertices (n, 3) of a frame."""
    rows = _array(name, content, "vertices_coords", f" of {where}")
    found = np.zeros((len(rows), 3))
    for k, row in enumerate(rows):
        numbers = isinstance(row, list) and all(isinstance(v, int | float) and math.isfinite(v) for v in row)
        if not numbers or len(row) not in (2, 3):
            raise InputError(f"vertices_coords[{k}] of {where} of {name!r} is {row!r}; it must be two or three numbers")
        found[k, : len(row)] = row
    return found


def _numbers(name: str, key: str, k: int, row: Any, least: int, count: int) -> tuple[int, ...]:
    """Numbers of vertices."""
    whole = isinstance(row, list) and all(isinstance(v, int) and 0 <= v < count for v in row)
    if not whole or len(row) < least or len(set(row)) != len(row):
        raise InputError(
            f"{key}[{k}] of {name!r} is {row!r}; it must be {least} {'' if least == 2 else 'or more '}different "
            f"vertices from 0 to {count - 1}"
        )
    return tuple(row)


def _edges(name: str, content: Mapping[str, Any], count: int) -> tuple[Array, list[str], Array]:
    """Vertices (k, 2), assignments and fold angles (k,), degrees, of the edges."""
    rows = _array(name, content, "edges_vertices")
    edges = np.array([_numbers(name, "edges_vertices", k, row, 2, count)[:2] for k, row in enumerate(rows)])
    twice = next((pair for pair, n in Counter(map(tuple, np.sort(edges, axis=1).tolist())).items() if n > 1), None)
    if twice is not None:
        raise InputError(f"edges_vertices of {name!r} has the edge {list(twice)} twice; each must be there once")
    beside: dict[str, list[Any]] = {}
    for key, default in (("edges_assignment", "U"), ("edges_foldAngle", 0.0)):
        beside[key] = content.get(key) or [default] * len(edges)
        if not isinstance(beside[key], list) or len(beside[key]) != len(edges):
            raise InputError(f"{key} of {name!r} must be a list with an entry for each of the {len(edges)} edges")
    known, words = (*_FOLDS, *_STAYS, *_ENDS), beside["edges_assignment"]
    for k, (word, angle) in enumerate(zip(words, beside["edges_foldAngle"], strict=True)):
        if word not in known:
            raise InputError(f"edges_assignment[{k}] of {name!r} is {word!r}; it must be one of {', '.join(known)}")
        if angle is not None and not (isinstance(angle, int | float) and abs(angle) <= 180.0):
            raise InputError(f"edges_foldAngle[{k}] of {name!r} is {angle!r}; it must be degrees from -180 to 180")
        if angle and SIGNS.get(word, angle) * angle < 0.0:
            raise InputError(
                f"edges_foldAngle[{k}] of {name!r} is {angle!r}, but its edges_assignment is {word!r}; angles of "
                f"valleys are above 0, those of mountains below"
            )
    return edges, words, np.array([angle or 0.0 for angle in beside["edges_foldAngle"]])


def _facets(name: str, content: Mapping[str, Any], x: Array, edges: Array) -> tuple[tuple[int, ...], ...]:
    """Vertices of the facets, counterclockwise; those between the edges where the file does not say them."""
    rows = content.get("faces_vertices")
    if rows is None:
        found = _between(x, edges)
    else:
        _array(name, content, "faces_vertices")
        found = [_numbers(name, "faces_vertices", k, row, 3, len(x)) for k, row in enumerate(rows)]
    if not found:
        raise InputError(f"the edges of {name!r} enclose no facet; give faces_vertices, or edges that do")
    size = float(np.ptp(x, axis=0).max()) ** 2
    areas = [_area(x[list(facet)]) for facet in found]
    flat = next((k for k, area in enumerate(areas) if abs(area) <= 1e-12 * size), None)
    if flat is not None:
        raise InputError(f"facet {flat} of {name!r}, with the vertices {list(found[flat])}, has no area")
    return tuple(facet if area > 0.0 else facet[::-1] for facet, area in zip(found, areas, strict=True))


def _area(x: Array) -> float:
    """Area of a polygon (n, 2), positive where it goes counterclockwise."""
    after = np.roll(x, -1, axis=0)
    return 0.5 * float(np.sum(x[:, 0] * after[:, 1] - x[:, 1] * after[:, 0]))


def _between(x: Array, edges: Array) -> list[tuple[int, ...]]:
    """Polygons (vertices counterclockwise) between edges that do not cross."""
    near: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        near.setdefault(a, []).append(b)
        near.setdefault(b, []).append(a)
    for a, own in near.items():
        own.sort(key=lambda b: math.atan2(*(x[b] - x[a])[::-1]))
    left, found = {(a, b) for a, own in near.items() for b in own}, []
    while left:
        a, b = start = min(left)
        around = []
        while (a, b) in left:
            left.remove((a, b))
            around.append(a)
            own = near[b]
            a, b = b, own[own.index(a) - 1]  # the next one clockwise from where the edge came
        if (a, b) == start and len(set(around)) == len(around) > 2 and _area(x[around]) > 0.0:
            found.append(tuple(around))
    return found


def _creases(
    name: str, facets: tuple[tuple[int, ...], ...], edges: Array, assignments: list[str], angles: Array
) -> tuple[Crease, ...]:
    """Edges between two facets that are not cut."""
    on: dict[tuple[int, int], list[int]] = {}
    for k, facet in enumerate(facets):
        for pair in zip(facet, facet[1:] + facet[:1], strict=True):
            on.setdefault(pair, []).append(k)
    known = {tuple(sorted(edge)) for edge in edges.tolist()}
    for (a, b), own in on.items():
        whole = own + on.get((b, a), [])
        if len(whole) > 2:
            raise InputError(
                f"{name!r} has {len(whole)} facets, {', '.join(map(str, whole))}, at the edge between vertices {a} and "
                f"{b}; two at most are allowed"
            )
        if len(own) > 1:
            raise InputError(f"facets {own[0]} and {own[1]} of {name!r} lie on one another at the edge from {a} to {b}")
        if tuple(sorted((a, b))) not in known:
            raise InputError(f"facet {own[0]} of {name!r} has a side between vertices {a} and {b}, which is no edge")
    largest, found = float(np.abs(angles).max(initial=0.0)), []
    for k, (a, b) in enumerate(edges.tolist()):
        left, right = on.get((a, b), []), on.get((b, a), [])
        if not left and not right:
            raise InputError(f"edge {k} of {name!r}, between vertices {a} and {b}, is the side of no facet")
        if not (left and right) or assignments[k] == "C":
            continue
        if assignments[k] == "B":
            raise InputError(
                f"edge {k} of {name!r} is assigned B, boundary, but facets {left[0]} and {right[0]} meet there"
            )
        share = angles[k] / largest if largest else SIGNS.get(assignments[k], 0.0)
        found.append(Crease(k, a, b, left[0], right[0], assignments[k], float(share)))
    return tuple(found)


def _unit(name: str, content: Mapping[str, Any]) -> float | None:
    word = content.get("frame_unit", "unit")
    if word != "unit" and word not in LENGTHS:
        raise InputError(f"frame_unit of {name!r} is {word!r}; {nearest(str(word), ['unit', *LENGTHS])}")
    return LENGTHS.get(word)


def _frames(name: str, content: Mapping[str, Any], count: int) -> dict[str, Array]:
    """Vertices of the frames after the key frame, by their titles, or numbers from 1."""
    found = {}
    for k, frame in enumerate(content.get("file_frames") or [], start=1):
        if not isinstance(frame, dict) or "vertices_coords" not in frame:
            continue
        title = str(frame.get("frame_title") or k)
        x = _positions(name, frame, f"frame {title!r}")
        if len(x) == count:  # others are of other patterns
            found[title] = x
    return found


def write_miura(
    path: str, *, facets: tuple[int, int], sides: tuple[float, float], angle: float, title: str = ""
) -> None:
    """Write the crease pattern of Miura as a file of FOLD.

    Parameters
    ----------
    path : str, ending with .fold
    facets : (2,) int, along the straight creases (x) and along the zigzag creases (y)
    sides : (2,) float, m, of a facet, along both
    angle : float, degrees, between the sides of a facet, above 0 and below 90
    """
    if not path.lower().endswith(ENDING):
        raise InputError(f"{path!r} is no file of a crease pattern; its name must end with {ENDING}")
    if min(facets) < 1 or min(sides) <= 0.0 or not 0.0 < angle < 90.0:
        raise InputError(
            f"facets is {facets!r}, sides {sides!r}, angle {angle!r}; facets must be 1 or more, sides above 0 m, "
            f"the angle between 0 and 90 deg"
        )
    content = {"file_spec": 1.2, "file_creator": "evolvent", "file_classes": ["singleModel"],
               "frame_title": title or f"Miura-ori, {facets[0]} x {facets[1]} facets",
               "frame_classes": ["creasePattern"], "frame_attributes": ["2D"], "frame_unit": "m"}  # fmt: skip
    files.write_file(path, (json.dumps(content | _miura(facets, sides, math.radians(angle))) + "\n").encode())


def _miura(facets: tuple[int, int], sides: tuple[float, float], angle: float) -> dict[str, Any]:
    """Vertices, edges, assignments and faces; vertex (i, j) has the number i (facets[1] + 1) + j."""
    (m, n), (a, b) = facets, sides
    x = [[i * a + (j % 2) * b * math.cos(angle), j * b * math.sin(angle)] for i in range(m + 1) for j in range(n + 1)]
    k = np.arange((m + 1) * (n + 1)).reshape(m + 1, n + 1)
    edges, words = [], []
    for i in range(m + 1):
        for j in range(n + 1):
            zigzag = "VM"[i % 2]  # of one zigzag line all are alike
            if i < m:
                straight = "B" if j in (0, n) else "MV"[(i + j) % 2]
                edges.append([int(k[i, j]), int(k[i + 1, j])])
                words.append(straight)
            if j < n:
                edges.append([int(k[i, j]), int(k[i, j + 1])])
                words.append("B" if i in (0, m) else zigzag)
    faces = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    return {"vertices_coords": x, "edges_vertices": edges, "edges_assignment": words, "faces_vertices": faces.tolist()}
