"""Poses of bodies where coordinates of joints have moved to given values, and all other joints with them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
import scipy

from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.kernels import axial, rigid
from evolvent.kernels.impulse import prepare
from evolvent.kernels.sides import ON_BODY
from evolvent_base.errors import InputError

Array = np.ndarray
#: Parts of the way in which coordinates move first, and the smallest.
_PART, _LEAST = 0.125, 1.0 / 512.0
#: Most iterations for a part of the way, and the change, beside the size of the linkage, after which the next one, that
#: of a method of second order, would be round-off.
_MOST, _CHANGE = 20, 1e-9
#: Gap of a joint, beside the size of the linkage, that counts as closed; what is added to the squares of singular
#: values, beside the largest, where joints are redundant.
_CLOSED, _FLOOR = 1e-8, 1e-12


class _Group(NamedTuple):
    """Bodies that move as one.

    Attributes
    ----------
    bodies : list of int, none where it stands
    spins : bool, whether it is one that spins
    first : int, first of its six twists, or its one; -1 where it stands
    """

    bodies: list[int]
    spins: bool
    first: int


class Linkage:
    """Bodies and what joins them, whose coordinates can be moved.

    Parameters
    ----------
    assembly : Assembly, whose model it evaluates; joints are those of its start that are constraints
    groups : bodies that move as one each, such as the nodes of a rod

    Attributes
    ----------
    y : (ny,) float, state, in which the poses are

    Notes
    -----
    Coordinates move from their values at the start in parts of the way. In each the gaps of all joints and what the
    coordinates lack are made zero by Newton's method, with the twists of least norm where these leave motions open.
    What floats stays where its first body is.
    """

    def __init__(self, assembly: Assembly, groups: Iterable[Iterable[int]]) -> None:
        self._model, self._s, self.y = assembly.model, assembly.s, assembly.y.copy()
        needs.load(self._model, prepare)
        bodies = self._model.bodies
        of = {int(b): k for k, group in enumerate(groups) for b in group}
        own: dict[int, list[int]] = {}
        for b in range(bodies.size):
            own.setdefault(of.get(b, -1 - b), []).append(b)
        self._at = np.zeros(bodies.size, dtype=int)  # number of the group of each body
        for k, group in enumerate(own.values()):
            self._at[group] = k
        self._evaluate()
        self.size = float(np.ptp(bodies["x"], axis=0).max()) or 1.0
        stands = self._standing(list(own.values()))
        self._groups, width = list[_Group](), 0
        for k, group in enumerate(own.values()):
            spins = bool(np.any(bodies["motion"][group] == rigid.SPIN))
            self._groups.append(_Group([], False, -1) if stands[k] else _Group(group, spins, width))
            width += 0 if stands[k] else (1 if spins else 6)

    def _standing(self, groups: list[list[int]]) -> list[bool]:
        """Which groups stand: those with a driven body, and the first of those that no joints connect with one."""
        n, sides = len(groups), self._model.row_sides
        found = [bool(np.any(self._model.bodies["motion"][group] == rigid.DRIVEN)) for group in groups]
        if np.any(sides["reduced"] >= 0):
            raise InputError("joints on reduced bodies cannot be moved; give rigid bodies or rods")
        at = np.where(sides["body"] >= 0, self._at[sides["body"]], 0)  # what is no body stands, as the ground does
        first = self._model.rows["first"]
        pairs = np.stack([at[first[sides["row"]]], at])
        near = scipy.sparse.coo_matrix((np.ones(at.size), pairs), shape=(n, n))
        labels = scipy.sparse.csgraph.connected_components(near, directed=False)[1]
        stands = {int(labels[k]) for k in range(n) if found[k]}
        for k, label in enumerate(labels.tolist()):
            found[k] = found[k] or label not in stands
            stands.add(label)
        return found

    def _evaluate(self) -> None:
        prepare(0.0, self.y, self._s, self._model)

    def values(self) -> Array:
        """Angles (nearest to those at the start, rad) and travels (m) of all coordinates between bodies, else NaN."""
        bodies, rows = self._model.bodies, self._model.coordinates
        found = np.full(rows.size, np.nan)
        for k, row in enumerate(rows):
            if row["on"] != ON_BODY:
                continue
            a, b = bodies[row["body"]], bodies[row["other"]]
            axis, zero, local = a["R"] @ row["axis"], a["R"] @ row["zero"], b["R"] @ row["local"]
            if row["kind"] == axial.ANGLE:
                angle = float(np.arctan2(local @ np.cross(axis, zero), local @ zero))
                found[k] = angle + 2.0 * np.pi * np.round((self._before(k) - angle) / (2.0 * np.pi))
            else:
                found[k] = axis @ (b["x"] + local - a["x"] - zero)
        return found

    def _before(self, k: int) -> float:
        return float(self._model.coordinates["angle"][k])

    def move(self, wanted: Mapping[int, float]) -> str:
        """Move coordinates, by their rows, to values, rad or m; returns '' or what is not met there.

        The angles of all coordinates follow in `coordinates.angle` over any number of turns.
        """
        start = {k: self._before(k) for k in wanted}
        at, part = 0.0, _PART
        while at < 1.0:
            now, kept = min(1.0, at + part), self.y.copy()
            off = self._close({k: start[k] + now * (wanted[k] - start[k]) for k in wanted})
            if off <= _CLOSED:
                at, part = now, min(2.0 * part, _PART)
                values = self.values()
                known = np.isfinite(values)
                self._model.coordinates["angle"][known] = values[known]
                continue
            self.y = kept
            self._evaluate()
            part *= 0.5
            if part < _LEAST:
                return f"other joints stop them after {100.0 * at:.3g} % of the way"
        return ""

    def _close(self, wanted: Mapping[int, float]) -> float:
        """Find poses with all joints closed; returns the largest gap, beside the size."""
        for _ in range(_MOST):
            A, r = self._system(wanted)
            whole = A @ A.T
            floor = scipy.sparse.identity(len(r)) * (_FLOOR * whole.diagonal().max(initial=0.0) + 1e-300)
            move = -(A.T @ scipy.sparse.linalg.splu((whole + floor).tocsc()).solve(r))
            if not np.all(np.abs(move) <= 1.0):
                return np.inf
            self._displace(move)
            if np.abs(move).max(initial=0.0) <= _CHANGE:
                break
        return float(np.abs(self._system(wanted)[1]).max(initial=0.0))

    def _system(self, wanted: Mapping[int, float]) -> tuple[scipy.sparse.csr_matrix, Array]:
        """Derivatives by the twists of groups (m/size, rad), and gaps (of m/size, or rad)."""
        model, L = self._model, self.size
        bodies, rows, sides = model.bodies, model.rows, model.row_sides[model.row_sides["body"] >= 0]
        n, own = rows.size, model.constraints[rows["index"]]
        scale = np.where(own["turns"] != 0, 1.0, 1.0 / L)
        moved = model.coordinates[list(wanted)]
        a, b, angles = moved["body"], moved["other"], moved["kind"] == axial.ANGLE
        axes = np.einsum("kij,kj->ki", bodies["R"][a], moved["axis"])
        at = bodies["x"][b] + np.einsum("kij,kj->ki", bodies["R"][b], moved["local"])
        force = np.where(angles[:, None], 0.0, axes / L)
        turns = [np.where(angles[:, None], axes, np.cross(at - bodies["x"][end], force)) for end in (b, a)]
        numbers, part = n + np.arange(len(wanted)), -scale[sides["row"]][:, None] * sides["J"]
        A = self._by_twists(
            np.concatenate([sides["row"], numbers, numbers]), np.concatenate([sides["body"], b, a]),
            np.concatenate([part[:, :3], force, -force]), np.concatenate([part[:, 3:], turns[0], -turns[1]]),
            n + len(wanted),
        )  # fmt: skip
        off = self.values()[list(wanted)] - np.array(list(wanted.values()))
        return A, np.concatenate([own["gap"] * scale, np.where(angles, off, off / L)])

    def _by_twists(self, row: Array, body: Array, force: Array, moment: Array, n: int) -> scipy.sparse.csr_matrix:
        """What wrenches (k, 3) at the origins of bodies do in the twists of their groups: (n, number of twists)."""
        bodies, group = self._model.bodies, self._at[body]
        columns = np.array([one.first for one in self._groups])[group]
        centre = np.array([one.bodies[0] if one.bodies else 0 for one in self._groups])[group]
        spins = np.array([one.spins for one in self._groups])[group]
        values = np.hstack([self.size * force, moment + np.cross(bodies["x"][body] - bodies["x"][centre], force)])
        values[spins, 0] = np.einsum(
            "ki,kij,kj->k", moment[spins], bodies["R"][body[spins]], bodies["axis"][body[spins]]
        )
        used = (columns >= 0)[:, None] & (~spins[:, None] | (np.arange(6) == 0))
        places = columns[:, None] + np.arange(6)
        width = sum((1 if one.spins else 6) for one in self._groups if one.bodies)
        rows = np.broadcast_to(row[:, None], places.shape)
        return scipy.sparse.csr_matrix((values[used], (rows[used], places[used])), shape=(n, width))

    def _displace(self, move: Array) -> None:
        """Move the groups by their twists, and evaluate."""
        bodies = self._model.bodies
        for group in self._groups:
            at = group.first
            if not group.bodies:
                continue
            if group.spins:
                self.y[bodies["iq"][group.bodies[0]]] += move[at]
                continue
            centre, turn = bodies["x"][group.bodies[0]].copy(), _turn(move[at + 3 : at + 6])
            R = scipy.spatial.transform.Rotation.from_quat(turn, scalar_first=True).as_matrix()
            for b in group.bodies:
                q = slice(int(bodies["iq"][b]), int(bodies["iq"][b]) + 3)
                self.y[q] = centre + self.size * move[at : at + 3] + R @ (bodies["x"][b] - centre)
                q = slice(q.stop, q.stop + 4)
                self.y[q] = _product(turn, self.y[q])
        self._evaluate()


def _turn(w: Array) -> Array:
    """Quaternion of a rotation vector, scalar part first."""
    angle = float(np.linalg.norm(w))
    return np.array([np.cos(0.5 * angle), *(0.5 * np.sinc(0.5 * angle / np.pi) * w)])


def _product(p: Array, q: Array) -> Array:
    """Product of two quaternions, of length 1."""
    found = np.array([p[0] * q[0] - p[1:] @ q[1:], *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])
    return np.asarray(found / np.linalg.norm(found))
