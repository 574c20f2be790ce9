"""Contact of shells with shells and with themselves: nodes of each side on faces of the other."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from evolvent.assembly.builder import Builder
from evolvent.families.contact import face_patch
from evolvent.families.contact.part_shapes import check_skip
from evolvent.model.questions import TouchFace, TouchPoint
from evolvent.model.registry import families
from evolvent_base.errors import InputError, counted

Array = np.ndarray
#: Distance within which nodes are looked for beyond the touch, of the longest side of a face.
_REACH = 0.25
#: Distance along its surface within which a shell does not touch itself, if not given: longest sides of its faces, and
#: thicknesses.
_SIDES, _THICKNESSES = 2.0, 4.0
#: Hermite cubics and their derivatives, of arrays.
_CUBICS, _SLOPES = (getattr(one, "py_func", one) for one in (face_patch.cubics, face_patch.slopes))
#: Iterations by which the distance at the start is found.
_STEPS = 12
#: Groups of faces: of `a` and of `b`.
_A, _B = 0, 1


def add_faces(part: Any, builder: Builder, name: str) -> None:
    """Write nodes of shells and the faces of shells that they touch."""
    itself = part.a == (part.b,)
    if not itself and part.b in part.a:
        raise InputError(
            f"{name}.a holds the shell {part.b!r}, which is {name}.b too; give the contact with itself a part of its "
            f"own"
        )
    sides: list[tuple[Any, ...]] = [tuple(part.a)] if itself else [tuple(part.a), (part.b,)]
    first, first_face = len(builder.rows["face_points"]), len(builder.rows["faces"])
    faces = [{owner: _asked(builder, owner, "faces") for owner in side} for side in sides]
    found = [[one for own in side.values() for one in own] for side in faces]
    for group, side in enumerate(found):
        for one in side:
            radius = one.radius + 0.5 * part.clearance
            builder.add("faces", nodes=one.bodies, t=one.along, radius=radius, group=group, next=-1)
    every = [one for side in found for one in side]
    longest, thick = max(map(_longest, every)), max(one.radius for one in every)
    if thick == 0.0 and part.clearance == 0.0:
        raise InputError(f"{name}.clearance is 0; between walls without a thickness it must be above 0")
    reach = 2.0 * thick + part.clearance + _REACH * longest
    apart = part.apart
    if apart is None:
        apart = _SIDES * longest + 2.0 * _THICKNESSES * thick if itself else 0.0
    mean = _area(found[_A]) / len(sides[_A])
    for group, owners in enumerate(sides):
        target = group if itself else 1 - group
        from_face, rest = first_face + (len(found[_A]) if target == _B else 0), _rest(found[group])
        for owner in owners:
            own = _asked(builder, owner, "touches")
            check_skip(part, name, owner, len(own))
            share = 0.5 * _area(faces[group][owner]) / mean
            near = _apart([one.body for one in own], rest, found[target], apart, itself)
            _check_start(part, builder, name, owner, own, found[target], near)
            for one, excluded in list(zip(own, near, strict=True))[part.skip :]:
                listed = len(builder.rows["face_apart"])
                for f in sorted(excluded):
                    builder.add("face_apart", face=from_face + int(f))
                for _ in range(2):
                    builder.add(
                        "face_points", body=one.body, target=target, first_apart=listed,
                        last_apart=listed + len(excluded), face0=-1, face1=-1, reach=reach,
                        sense=0.0 if itself else 1.0 if group == _A else -1.0, radius=one.radius + 0.5 * part.clearance,
                        viscous=part.viscosity(float(builder.rows["bodies"][one.body]["mass"])),
                        way=builder.poses[one.body].R[:, 2], distance=np.inf, distance0=np.inf, gap=np.inf, gap1=np.inf,
                        **part.law_fields(share * one.weight),
                    )  # fmt: skip
    last = len(builder.rows["face_points"])
    cells = 1 << max(4, int(2 * sum(map(len, found)) - 1).bit_length())
    first_cell = len(builder.rows["face_cells"])
    for _ in range(cells):
        builder.add("face_cells", head=-1)
    index = builder.add(
        "face_contacts", first=first, last=last, first_face=first_face, last_face=len(builder.rows["faces"]),
        first_cell=first_cell, last_cell=first_cell + cells, reach=reach, law=part.law_fields()["law"],
        friction=part.friction,
    )  # fmt: skip
    builder.names[name] = ("face_contacts", index)


def _asked(builder: Builder, owner: Any, question: str) -> list[Any]:
    """Faces or points of a part."""
    return list(getattr(families()[builder.names[owner][0]].parts, question)(builder, owner))


def _longest(face: TouchFace) -> float:
    """Longest side of a face, m."""
    return float(np.linalg.norm(face.along, axis=1).max())


def _area(found: list[TouchFace]) -> float:
    """Area of faces, m2."""
    x = np.array([one.rest for one in found])
    return float(0.5 * np.linalg.norm(np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]), axis=1).sum())


def _check_start(
    part: Any, builder: Builder, name: str, owner: Any, own: list[TouchPoint], found: list[TouchFace], near: list[Any]
) -> None:
    """Refuse nodes that start too deep in faces."""
    x = np.array([builder.poses[one.body].x for one in own])
    V = np.zeros((len(found), 12, 3))
    for f, one in enumerate(found):
        for a, body in enumerate(one.bodies):
            pose = builder.poses[body]
            V[f, 3 * a], V[f, 3 * a + 1 : 3 * a + 3] = pose.x, one.along[2 * a : 2 * a + 2] @ pose.R.T
    middles = V[:, ::3].mean(axis=1)
    size = float(np.linalg.norm(V[:, ::3] - middles[:, None], axis=2).max())
    radii, thick = np.array([one.radius for one in found]), np.array([one.radius for one in own])
    touch = float(radii.max() + thick.max()) + part.clearance
    listed = [set(map(int, excluded)) for excluded in near]
    hits = scipy.spatial.cKDTree(x).query_ball_point(middles, size + touch)
    pairs = np.array([(k, f) for f, nodes in enumerate(hits) for k in nodes if f not in listed[k]]).reshape(-1, 2)
    if not len(pairs):
        return
    node, face = pairs.T
    depth = thick[node] + radii[face] + part.clearance - _distances(V[face], x[node])
    deepest, unit = int(depth.argmax()), 0.5 * touch
    allowed = 0.1 if part.initial_overlap is None else part.initial_overlap
    if depth[deepest] > allowed * unit:
        raise InputError(
            f"{name!r} starts with '{owner}[{node[deepest]}]' {depth[deepest]:.3g} m inside what it touches, "
            f"{counted(float(depth[deepest] / unit), 'half thickness', 'half thicknesses')}; move the shells apart, or "
            f"allow it by `initial_overlap`, now {allowed:g}, or by `apart` where they are joined"
        )


def _distances(V: Array, x: Array) -> Array:
    """Distances of points (n, 3) from faces with the vectors V (n, 12, 3) (`face_patch.closest`), m."""
    s, t = np.full(len(x), 0.5), np.full(len(x), 0.5)
    for _ in range(_STEPS):
        f, g, df, dg = _CUBICS(s), _CUBICS(t), _SLOPES(s), _SLOPES(t)
        X, u, v = (np.einsum("wn,nwi->ni", _weights(*own), V) for own in ((f, g), (df, g), (f, dg)))
        off = x - X
        a, b, c = (np.sum(p * q, axis=1) for p, q in ((u, u), (u, v), (v, v)))
        p, q = np.sum(off * u, axis=1), np.sum(off * v, axis=1)
        det = a * c - b * b
        ds, dt = (c * p - b * q) / det, (a * q - b * p) / det
        ds = np.where(((t == 0.0) & (dt < 0.0)) | ((t == 1.0) & (dt > 0.0)), p / a, ds)
        dt = np.where(((s == 0.0) & (ds < 0.0)) | ((s == 1.0) & (ds > 0.0)), q / c, dt)
        s, t = np.clip(s + ds, 0.0, 1.0), np.clip(t + dt, 0.0, 1.0)
    X = np.einsum("wn,nwi->ni", _weights(_CUBICS(s), _CUBICS(t)), V)
    return np.asarray(np.linalg.norm(x - X, axis=1))


def _weights(f: Any, g: Any) -> Array:
    """Weights (12, n) of points of faces by cubics of xi and eta."""
    own = ((f[i] * g[j], f[2 + i] * g[j], f[i] * g[2 + j]) for i, j in face_patch.CORNERS)
    return np.array([one for node in own for one in node])


def _rest(found: list[TouchFace]) -> dict[int, Array]:
    """Positions of bodies without stress, m."""
    return {int(body): x for one in found for body, x in zip(one.bodies, one.rest, strict=True)}


def _apart(nodes: list[int], rest: dict[int, Array], found: list[TouchFace], apart: float, itself: bool) -> list[Any]:
    """Faces that nodes do not touch, without stress within `apart` of them: along the surface, or in space."""
    if apart == 0.0:
        return [()] * len(nodes)
    if itself:
        first = min(rest)
        x = np.array([rest[body] for body in sorted(rest)])
        quads = np.array([one.bodies for one in found]) - first
        away = _along(x, quads, np.array(nodes) - first, apart)
        return [np.flatnonzero(np.isfinite(row[quads]).any(axis=1)) for row in away]
    corners = np.array([one.rest for one in found])
    middles, x = corners.mean(axis=1), np.array([rest[body] for body in nodes])
    size = np.linalg.norm(corners - middles[:, None], axis=2).max()
    hits = scipy.spatial.cKDTree(x).query_ball_point(middles, apart + size)
    near: list[list[int]] = [[] for _ in nodes]
    pairs = np.array([(k, f) for f, own in enumerate(hits) for k in own]).reshape(-1, 2)
    if len(pairs):
        for k, f in pairs[_distances(_flat(corners)[pairs[:, 1]], x[pairs[:, 0]]) <= apart].tolist():
            near[k].append(f)
    return near


def _flat(corners: Array) -> Array:
    """Vectors (n, 12, 3) of faces with straight sides between the corners (n, 4, 3)."""
    along, across = (
        corners[:, [1, 1, 2, 2]] - corners[:, [0, 0, 3, 3]],
        corners[:, [3, 2, 2, 3]] - corners[:, [0, 1, 1, 0]],
    )
    return np.stack([corners, along, across], axis=2).reshape(-1, 12, 3)


def _along(x: Array, quads: Array, nodes: Array, apart: float) -> Array:
    """Distances of nodes from all others along sides and diagonals of faces, m; infinite beyond `apart`."""
    pairs = np.concatenate([quads[:, [i, j]] for i in range(4) for j in range(i)])
    low, high = pairs.min(axis=1), pairs.max(axis=1)
    _, once = np.unique(low * len(x) + high, return_index=True)
    low, high = low[once], high[once]
    lengths = np.linalg.norm(x[low] - x[high], axis=1)
    graph = scipy.sparse.coo_matrix((lengths, (low, high)), shape=(len(x), len(x))).tocsr()
    return np.asarray(scipy.sparse.csgraph.dijkstra(graph, directed=False, indices=nodes, limit=apart))
