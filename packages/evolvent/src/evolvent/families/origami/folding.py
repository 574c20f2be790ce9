"""Folded states of a crease pattern with rigid facets.

Facets follow one another from a first one over a tree of creases. Each crease beside the tree closes a loop: with its
own fold angle the facet on its left must lie where the tree puts it. Newton's method, with steps of least norm, finds
fold angles that close all loops; from a small fold on in the senses of the assignments the fold grows in steps.

Literature: Tachi 2009, Simulation of rigid origami; Belcastro and Hull 2002, Modelling the folding of paper into three
dimensions.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from evolvent.elements.fold_files import SIGNS, Pattern, read
from evolvent_base.errors import InputError

Array = np.ndarray
#: Fold angle of the crease that folds most where folding begins, and by how much it grows, rad.
_FIRST, _STEP = 0.3, 0.5
#: Gap of loops that are closed, beside the size of the pattern, and one that round-off may leave.
_CLOSED, _ROUND_OFF = 1e-13, 1e-10
#: Iterations of Newton's method at most.
_MOST = 40
#: Fold angle that is round-off, rad.
_NO_FOLD = 1e-9
#: Edges of a quadrilateral facet that is a shell, counterclockwise from its first vertex, and 1 if the nodes of the
#: edge are in this order, else -1.
EDGES = (("y0", 1.0), ("x1", 1.0), ("y1", -1.0), ("x0", -1.0))


def edge_of(facet: tuple[int, ...], begin: int) -> tuple[str, float]:
    """Edge of a facet that follows a vertex counterclockwise, and 1 if its nodes are in this order, else -1."""
    return EDGES[facet.index(begin)]


class Folded(NamedTuple):
    """A folded state.

    Attributes
    ----------
    angles : (k,) float, rad, fold angles of the creases, positive of valleys
    R : (m, 3, 3) float, t : (m, 3) float, of the facets: R p + t is where the point p of the flat pattern is
    """

    angles: Array
    R: Array
    t: Array

    def at(self, facet: int, p: Array) -> Array:
        """Where points (.., 2) of the flat pattern are on a facet, (.., 3)."""
        return p @ self.R[facet, :, :2].T + self.t[facet]


def _turn(axis: Array, angle: float) -> Array:
    """Rotation about an axis in the plane of the pattern."""
    x, y = axis
    K = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * (K @ K)


class Loops:
    """The loops of a pattern.

    Parameters
    ----------
    name : str, of the file, for messages
    pattern : Pattern
    base : int, facet that lies where it is in the pattern
    """

    def __init__(self, name: str, pattern: Pattern, base: int = 0) -> None:
        self.name, self.pattern, self.base = name, pattern, base
        creases = pattern.creases
        self.size = float(np.ptp(pattern.x, axis=0).max())
        self.begins = np.array([pattern.x[one.begin] for one in creases]).reshape(-1, 2)
        along = np.array([pattern.x[one.end] - pattern.x[one.begin] for one in creases]).reshape(-1, 2)
        self.axes = along / np.linalg.norm(along, axis=1, keepdims=True)
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
        self.checked = np.stack([self.begins, self.begins + along, self.begins + across], axis=1)  # points of a loop
        self.folds = np.array([one.folds for one in creases], dtype=bool)
        self.tree, self.beside = self._tree()

    def _tree(self) -> tuple[list[tuple[int, int, int, float]], list[int]]:
        """Creases from facet to facet (crease, from, to, sign), in the order of the facets, and those beside."""
        at: dict[int, list[int]] = {}
        for k, one in enumerate(self.pattern.creases):
            at.setdefault(one.left, []).append(k)
            at.setdefault(one.right, []).append(k)
        seen, tree = {self.base}, []
        waiting = [self.base]
        for facet in waiting:
            for k in at.get(facet, []):
                one = self.pattern.creases[k]
                other, sign = (one.left, 1.0) if one.right == facet else (one.right, -1.0)
                if other not in seen:
                    seen.add(other)
                    waiting.append(other)
                    tree.append((k, facet, other, sign))
        apart = next((k for k in range(len(self.pattern.facets)) if k not in seen), None)
        if apart is not None:
            raise InputError(
                f"facet {apart} of {self.name!r} is not connected with facet {self.base}; a sheet is of one piece"
            )
        used = {k for k, *_ in tree}
        return tree, [k for k in range(len(self.pattern.creases)) if k not in used]

    def placed(self, angles: Array) -> tuple[Array, Array]:
        """R (m, 3, 3) and t (m, 3) of the facets, along the tree."""
        count = len(self.pattern.facets)
        R, t = np.empty((count, 3, 3)), np.empty((count, 3))
        R[self.base], t[self.base] = np.eye(3), 0.0
        for k, a, b, sign in self.tree:
            own, begin = _turn(self.axes[k], sign * float(angles[k])), np.append(self.begins[k], 0.0)
            R[b] = R[a] @ own
            t[b] = R[a] @ (begin - own @ begin) + t[a]
        return R, t

    def gaps(self, angles: Array) -> tuple[Array, Array]:
        """Gaps (9 l,) of the loops and their derivatives (9 l, k) by the fold angles."""
        R, t = self.placed(angles)
        count, creases = len(self.pattern.facets), len(angles)
        axes, places, sense = np.zeros((creases, 3)), np.zeros((creases, 3)), np.zeros((count, creases))
        for k, a, b, sign in self.tree:
            axes[k], places[k] = R[a, :, :2] @ self.axes[k], R[a, :, :2] @ self.begins[k] + t[a]
            sense[b] = sense[a]
            sense[b, k] = sign
        ends = {side: [getattr(self.pattern.creases[k], side) for k in self.beside] for side in ("left", "right")}
        p = self.checked[self.beside]
        own = np.array([_turn(self.axes[k], float(angles[k])) for k in self.beside]).reshape(-1, 3, 3)
        begin = np.pad(self.begins[self.beside], ((0, 0), (0, 1)))[:, None]
        turned = begin + (np.pad(p, ((0, 0), (0, 0), (0, 1))) - begin) @ np.swapaxes(own, 1, 2)
        left = p @ np.swapaxes(R[ends["left"], :, :2], 1, 2) + t[ends["left"], None]
        right = turned @ np.swapaxes(R[ends["right"]], 1, 2) + t[ends["right"], None]
        across = np.cross(axes[:, None], np.eye(3)[None])  # (k, 3, 3): the axis times each unit vector
        slopes = np.zeros((len(self.beside), 3, creases, 3))
        for sign, y, side in ((1.0, left, "left"), (-1.0, right, "right")):
            moved = np.tensordot(y, across, axes=(2, 1)) - np.cross(axes, places)
            slopes += sign * sense[ends[side]][:, None, :, None] * moved
        begin = begin @ np.swapaxes(R[ends["right"]], 1, 2) + t[ends["right"], None]
        hinges = np.einsum("lij,lj->li", R[ends["right"], :, :2], self.axes[self.beside])
        slopes[np.arange(len(self.beside)), :, self.beside] -= np.cross(hinges[:, None], right - begin)
        return (left - right).reshape(-1), np.swapaxes(slopes, 2, 3).reshape(-1, creases)

    def closed(self, angles: Array, held: int | None = None) -> tuple[Array, float]:
        """Fold angles that close the loops, from others nearby, and the largest gap that is left.

        Parameters
        ----------
        held : int, a crease whose angle stays
        """
        free = self.folds.copy()
        if held is not None:
            free[held] = False
        best, least = angles, np.inf
        for _ in range(_MOST):
            gap, slope = self.gaps(angles)
            off = float(np.abs(gap).max(initial=0.0))
            if off < least:
                best, least = angles, off
            elif least < _ROUND_OFF * self.size:
                break
            if off <= _CLOSED * self.size or not free.any():
                break
            step = np.linalg.lstsq(slope[:, free], -gap, rcond=1e-10)[0]
            angles = angles.copy()
            angles[free] += step * min(1.0, 0.5 / max(float(np.abs(step).max()), 1e-300))
        return best, least

    def folded(self, largest: float) -> Folded:
        """The state in which the crease that folds most has the fold angle `largest`, rad, from flat by assignments.

        Raises
        ------
        InputError
            Where the facets cannot fold so far, or not as assigned.
        """
        shares = np.array([one.share if one.folds else 0.0 for one in self.pattern.creases])
        angles = np.zeros(len(shares))
        if largest > 0.0 and not np.any(shares):
            raise InputError(
                f"{self.name!r} says of no crease how it folds; give edges_assignment with M and V, or edges_foldAngle"
            )
        if largest > 0.0:
            first = min(_FIRST, largest)
            angles, off = self.closed(first * shares / np.abs(shares).max())
            most = int(np.abs(angles).argmax())
            steps = max(1, math.ceil((largest - first) / _STEP))
            for target in [first, *np.linspace(first, largest, steps + 1)[1:].tolist()]:
                angles, most, off = self._grown(angles, most, target)
                self._check(angles, off, target)
        return Folded(angles, *self.placed(angles))

    def _grown(self, angles: Array, most: int, target: float) -> tuple[Array, int, float]:
        """Angles of which the largest is a target, which crease has it, and the gap that is left."""
        for _ in range(3):  # another crease may become the largest
            tangents = np.tan(0.5 * angles)  # those of vertices of four creases that fold flat keep their ratios
            angles = 2.0 * np.arctan(tangents * (math.tan(0.5 * target) / abs(float(tangents[most]))))
            angles[most] = math.copysign(target, angles[most])
            angles, off = self.closed(angles, most)
            now = int(np.abs(angles).argmax())
            if abs(angles[now]) <= target * (1.0 + _NO_FOLD):
                break
            most = now
        return angles, most, off

    def _check(self, angles: Array, off: float, target: float) -> None:
        """Refuse loops that stay open, and creases that do not fold as they are assigned."""
        if off > _ROUND_OFF * self.size:
            raise InputError(
                f"the rigid facets of {self.name!r} do not fold to {math.degrees(target):.4g} deg: a gap of {off:.3g} "
                f"in the unit of the file stays open; give a lower angle, or a pattern that folds as it is assigned"
            )
        for one, angle in zip(self.pattern.creases, angles, strict=True):
            if one.assignment in SIGNS and SIGNS[one.assignment] * angle < _NO_FOLD:
                raise InputError(
                    f"edge {one.edge} of {self.name!r} is assigned {one.assignment}, but the facets fold it by "
                    f"{math.degrees(angle):.3g} deg where the others fold as assigned; correct its assignment"
                )

    def of_frame(self, title: str, gap: float) -> Folded:
        """The state of a frame: its fold angles, by which loops close.

        Parameters
        ----------
        gap : float, most that a vertex may be off its place in the frame, beside the size of the pattern
        """
        if title not in self.pattern.frames:
            known = ", ".join(map(repr, self.pattern.frames)) or "it has none"
            raise InputError(f"{self.name!r} has no frame {title!r} with all vertices of the pattern; frames: {known}")
        x = self.pattern.frames[title]
        angles, off = self.closed(np.array([_fold_angle(self.pattern, x, k) for k in range(len(self.folds))]))
        found = Folded(angles, *self.placed(angles))
        facet = list(self.pattern.facets[self.base])
        R, t = _moved(found.at(self.base, self.pattern.x[facet]), x[facet])
        found = Folded(angles, R @ found.R, found.t @ R.T + t)
        for k, own in enumerate(map(list, self.pattern.facets)):
            apart = np.linalg.norm(found.at(k, self.pattern.x[own]) - x[own], axis=1)
            off = max(off, float(apart.max()))
            if off > gap * self.size:
                vertex = own[int(apart.argmax())]
                raise InputError(
                    f"frame {title!r} of {self.name!r} is no state of its rigid facets: vertex {vertex} is {off:.3g} "
                    f"in the unit of the file from where facet {k} has it; at most {gap * self.size:.3g} is allowed"
                )
        return found


def _fold_angle(pattern: Pattern, x: Array, k: int) -> float:
    """Fold angle of a crease where the vertices are at x (n, 3)."""
    one = pattern.creases[k]
    left, right = (_normal(x[list(pattern.facets[facet])]) for facet in (one.left, one.right))
    axis = x[one.end] - x[one.begin]
    return math.atan2(float(np.cross(right, left) @ axis) / float(np.linalg.norm(axis)), float(left @ right))


def _normal(x: Array) -> Array:
    """Unit normal of a polygon (n, 3)."""
    found = np.cross(x, np.roll(x, -1, axis=0)).sum(axis=0)
    return np.asarray(found / np.linalg.norm(found))


def _moved(a: Array, b: Array) -> tuple[Array, Array]:
    """Rotation and translation by which points a (n, 3) come closest to b."""
    U, _, V = np.linalg.svd((b - b.mean(axis=0)).T @ (a - a.mean(axis=0)))
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ V))]) @ V
    return R, b.mean(axis=0) - R @ a.mean(axis=0)


@functools.lru_cache(maxsize=64)
def state(name: str, digest: str, base: int, largest: float | str, gap: float = 0.0) -> Folded:
    """The state of a file's pattern with a largest fold angle, rad, or of a frame; found once for each content."""
    loops = Loops(name, read(name, digest), base)
    return loops.of_frame(largest, gap) if isinstance(largest, str) else loops.folded(largest)
