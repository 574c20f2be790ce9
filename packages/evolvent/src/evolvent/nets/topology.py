"""Topologies of nets: nodes in plan, cords between them, triangles, and the nodes that are held at the rim."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import scipy

from evolvent.nets.error import signed_areas
from evolvent.nets.surface import Surface
from evolvent_base import safe_open, units
from evolvent_base.errors import InputError
from evolvent_base.file_keys import FileKey
from evolvent_base.schema import OneOf, Section

Array = np.ndarray
#: How far the nodes of a file reach at least and at most, beside the radius of the aperture.
_LEAST_REACH, _MOST_REACH = 0.02, 1.5
#: Area of a triangle in plan, beside the square of the diameter, that is none.
_FLAT = 1e-12
Count = Annotated[int, units.Whole(least=1, most=200)]

__all__ = ["Gores", "NetFile", "Rings"]


class Topology(NamedTuple):
    """What is connected in a net.

    Attributes
    ----------
    plan : (n, 2) float, m, x and y of the nodes over the wanted surface
    cords : (m, 2) int, nodes at the ends of the cords
    facets : (k, 3) int, nodes of the triangles, counterclockwise about z
    rim : (r,) int, nodes that are held
    edge : (m,) bool, of cords that belong to one triangle alone
    """

    plan: Array
    cords: Array
    facets: Array
    rim: Array
    edge: Array

    @property
    def free(self) -> Array:
        """Nodes that are not held."""
        return np.setdiff1d(np.arange(len(self.plan)), self.rim)


class Layout(Section):
    """A rule that makes a topology over the aperture of a surface."""

    def topology(self, name: str, surface: Surface) -> Topology:
        """Nodes, cords and triangles."""
        raise NotImplementedError


class Rings(Layout):
    """Triangles in rings about the centre of the aperture.

    Parameters
    ----------
    rings : int
        Number of rings of triangles; ring k has k nodes in each gore.
    gores : int
        Number of gores; with six and the outline of a polygon all triangles are equal.
    outline : {"polygon", "circle"}
        Of the rings.
    held : {"rim", "corners"}
        Whether all nodes of the outermost ring are held, or those between gores alone.
    """

    rings: Count
    gores: Annotated[int, units.Whole(least=3, most=200)] = 6
    outline: Literal["polygon", "circle"] = "circle"
    held: Literal["rim", "corners"] = "rim"

    def topology(self, name: str, surface: Surface) -> Topology:
        """Nodes, cords and triangles."""
        n, g, radius = self.rings, self.gores, 0.5 * surface.diameter
        plan, first = [np.zeros(2)], [0]
        corners = np.array([[np.cos(a), np.sin(a)] for a in 2.0 * np.pi * np.arange(g + 1) / g])
        for k in range(1, n + 1):
            first.append(len(plan))
            for s in range(g):
                for j in range(k):
                    if self.outline == "circle":
                        angle = 2.0 * np.pi * (s + j / k) / g
                        at = np.array([np.cos(angle), np.sin(angle)])
                    else:
                        at = corners[s] + (corners[s + 1] - corners[s]) * (j / k)
                    plan.append(radius * k / n * at)

        def node(k: int, s: int, j: int) -> int:
            return first[k] + (s * k + j) % (g * k) if k else 0

        facets = []
        for k in range(1, n + 1):
            for s in range(g):
                facets += [(node(k - 1, s, j), node(k, s, j), node(k, s, j + 1)) for j in range(k)]
                facets += [(node(k - 1, s, j), node(k, s, j + 1), node(k - 1, s, j + 1)) for j in range(k - 1)]
        rim = [node(n, s, j) for s in range(g) for j in range(n) if self.held == "rim" or j == 0]
        return _of_facets(name, np.array(plan) + np.array([surface.offset, 0.0]), np.array(facets), rim)


class Gores(Layout):
    """Gores between ribs: nodes on the ribs are held, and cords cross the gores; none run along a rib.

    Parameters
    ----------
    ribs : int
        Number of ribs, the first along x.
    stations : int
        Number of lengths along a rib, from its root to the edge of the aperture.
    across : int
        Number of cords across a gore at each station.
    inner_radius : float, m
        Where the net begins, from the centre of the aperture.
    """

    ribs: Annotated[int, units.Whole(least=3, most=500)]
    stations: Count
    across: Count = 1
    inner_radius: units.Length

    def topology(self, name: str, surface: Surface) -> Topology:
        """Nodes, cords and triangles."""
        outer, m = 0.5 * surface.diameter, self.across
        if self.inner_radius >= outer:
            raise InputError(
                f"{name}.topology.inner_radius is {self.inner_radius:g} m; it must be below the radius of the "
                f"aperture, {outer:g} m"
            )
        count = self.ribs * m
        angles = 2.0 * np.pi * np.arange(self.ribs + 1) / self.ribs
        ribs = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        around = np.array([(1.0 - j / m) * ribs[s] + j / m * ribs[s + 1] for s in range(self.ribs) for j in range(m)])
        plan = np.concatenate([r * around for r in np.linspace(self.inner_radius, outer, self.stations + 1)])
        facets: list[tuple[int, int, int]] = []
        for i in range(self.stations):
            for j in range(count):
                a, b = i * count + j, i * count + (j + 1) % count
                c, d = a + count, b + count
                within = (j % m) < m / 2  # diagonals towards the middle of the gore
                facets += [(a, c, d), (a, d, b)] if within else [(a, c, b), (b, c, d)]
        rim = [i * count + s * m for i in range(self.stations + 1) for s in range(self.ribs)]
        own = [(a, a + count) for a in rim[: -self.ribs]]
        return _of_facets(name, plan + np.array([surface.offset, 0.0]), np.array(facets), rim, without=own)


class NetFile(Layout):
    """A net from a file.

    Parameters
    ----------
    file : str
        A JSON file with `nodes` (x and y of each), `cords` (two nodes each, from 0), `rim` (nodes that are held) and,
        if its surface is to be judged, `facets` (three nodes each).
    length_unit : float, m
        Unit of length of the file.
    """

    file: Annotated[str, FileKey(endings=(".json",))]
    length_unit: units.Length = 1.0

    def topology(self, name: str, surface: Surface) -> Topology:
        """Nodes, cords and triangles."""
        key = f"{name}.topology.file"
        try:
            found = json.loads(safe_open.content(self.file, most=safe_open.LARGEST_TEXT))
        except ValueError as error:
            raise InputError(f"{key} is {self.file!r}, which is no JSON: {error}") from None
        if not isinstance(found, dict) or not {"nodes", "cords", "rim"} <= set(found):
            raise InputError(f"{key} is {self.file!r}; it must have the keys nodes, cords and rim")
        plan = _table(key, found, "nodes", (2, 3), float)[:, :2] * self.length_unit
        cords = _table(key, found, "cords", (2,), int)
        rim = found["rim"]
        if not isinstance(rim, list) or not all(type(k) is int for k in rim):
            raise InputError(f"{key}: rim must be a list of numbers of nodes")
        facets = _table(key, found, "facets", (3,), int) if found.get("facets") else np.zeros((0, 3), dtype=int)
        for word, numbers in (("cords", cords), ("rim", np.array(rim)), ("facets", facets)):
            if numbers.size and not (numbers.min() >= 0 and numbers.max() < len(plan)):
                raise InputError(f"{key}: {word} has a node that is none of 0 to {len(plan) - 1}")
        radius, reach = 0.5 * surface.diameter, float(np.hypot(plan[:, 0] - surface.offset, plan[:, 1]).max())
        if not _LEAST_REACH * radius <= reach <= _MOST_REACH * radius:
            raise InputError(
                f"{key}: nodes reach {reach:.4g} m from the centre of the aperture, whose radius is {radius:.4g} m; "
                f"check {name}.topology.length_unit, which is {self.length_unit:g} m"
            )
        empty = np.abs(signed_areas(plan, facets)) <= _FLAT * surface.diameter**2
        if empty.any():
            k = int(empty.argmax())
            raise InputError(f"{key}: facet {k}, of the nodes {facets[k].tolist()}, has no area in the plane x, y")
        return _checked(name, plan, cords, facets, rim)


AnyLayout = Annotated[Layout, OneOf({"rings": Rings, "gores": Gores, "file": NetFile})]


def _table(key: str, found: dict[str, Any], word: str, widths: Sequence[int], kind: type) -> Array:
    """Rows of a file, all of one of the widths."""
    try:
        rows: Array = np.array(found[word], dtype=float)
    except (TypeError, ValueError):
        rows = np.zeros(0)
    whole = kind is not int or (rows == np.rint(rows)).all()
    if rows.ndim != 2 or not np.isfinite(rows).all() or not whole or rows.shape[1] not in widths:
        wanted = " or ".join(str(width) for width in widths)
        what = "whole numbers" if kind is int else "finite numbers"
        raise InputError(f"{key}: {word} must be a list of rows of {wanted} {what}")
    return rows.astype(kind)


def _of_facets(
    name: str, plan: Array, facets: Array, rim: Sequence[int], without: Sequence[tuple[int, int]] = ()
) -> Topology:
    """The topology whose cords are the sides of its triangles, but those between some pairs of nodes."""
    sides = {(int(a), int(b)) for a, b in np.sort(facets[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)}
    return _checked(name, plan, np.array(sorted(sides - set(without))), facets, rim)


def _checked(name: str, plan: Array, cords: Array, facets: Array, rim: Sequence[int]) -> Topology:
    """A topology in which cords connect every node with the rim."""
    n, held = len(plan), np.unique(np.array(rim, dtype=int))
    if held.size < 3:
        raise InputError(f"{name}.topology holds {held.size} nodes at the rim; at least 3 are needed")
    ordered = np.sort(cords, axis=1)
    _, counts = np.unique(ordered, axis=0, return_counts=True)
    if (ordered[:, 0] == ordered[:, 1]).any() or counts.max() > 1:
        raise InputError(f"{name}.topology has a cord twice, or from a node to itself")
    graph = scipy.sparse.coo_matrix((np.ones(len(cords)), cords.T), shape=(n, n))
    labels = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
    loose = ~np.isin(labels, labels[held])
    if loose.any():
        raise InputError(f"{name}.topology: no cords connect node {int(loose.argmax())} with the rim")
    corners = np.sort(facets[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    keys, times = np.unique(corners @ [n, 1], return_counts=True)
    edge = np.isin(ordered @ [n, 1], keys[times == 1])
    return Topology(plan, cords, facets, held, edge)
