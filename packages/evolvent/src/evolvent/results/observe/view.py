"""View: positions, velocities and attitudes of bodies, points, beam nodes and sides of joints, over all samples."""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent.assembly import families, needs
from evolvent.compiled.pointer import address
from evolvent.equations.sampling import evaluate_samples
from evolvent.kernels import markers, rigid, sides
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.kernels.drive import drive
from evolvent.model import RECORDS, RESULTS, registry
from evolvent.model.family import EXTREMES
from evolvent.model.memory import take
from evolvent.model.powers import N_POWERS
from evolvent.model.registry import is_by_rates
from evolvent.results.observe.variables import FamilyFields, cross, turned
from evolvent.results.observe.wrenches import fill_wrenches
from evolvent.results.rotations import rotation_matrices
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.common.standing import end_ramps
from evolvent.solvers.time.explicit.plan import METHODS

Array = np.ndarray


class Pose(NamedTuple):
    """Motion of a body: position (nt, 3), rotation (nt, 3, 3) from body to inertial axes, velocity and rate (nt, 3)."""

    x: Array
    R: Array
    v: Array
    w: Array


class Side(NamedTuple):
    """One end of a joint, inertial axes.

    Attributes
    ----------
    u : (nt, 3) float, position or direction
    rate : (nt, 3) float, its rate
    body : int, of a body, else -1
    """

    u: Array
    rate: Array
    body: int


@functools.cache
def _results() -> dict[str, list[tuple[str, int, tuple[int, ...]]]]:
    """Fields that are results, by family: name, bytes from the start of a record, and shape."""
    return {
        family: [
            (field, int(RECORDS[family].fields[field][1]), RECORDS[family][field].shape)  # type: ignore[index]
            for field in fields
        ]
        for family, fields in RESULTS.items()
    }


class Fields(dict[str, FamilyFields]):
    """Fields of records at samples, by family, evaluated as they are asked for.

    Parameters
    ----------
    evaluated : returns values (nt, n), of `evaluate_samples`, and their layout, for the family that is asked for
    kept : returns values, by field, that replace those of a family
    noted : returns the extremes over all steps of fields of a family that stores some, as of `FamilyFields`
    """

    def __init__(
        self, evaluated: Callable[[str], tuple[Array, _Layout]], kept: Callable[[str], Mapping[str, Array]],
        noted: Callable[[str], Array],
    ) -> None:  # fmt: skip
        super().__init__()
        self._evaluated, self._kept, self._noted = evaluated, kept, noted

    def __missing__(self, family: str) -> FamilyFields:
        values, layout = self._evaluated(family)
        nt, places = len(values), layout.places.get(family)
        if places is None:
            return FamilyFields({name: np.empty((nt, 0, *shape)) for name, _, shape in _results().get(family, ())})
        found = {field: values[:, at : at + math.prod(shape)].reshape(nt, *shape) for field, at, shape in places}
        found |= self._kept(family)
        noted = registry.families()[family].samples.extremes
        self[family] = FamilyFields(found, noted, self._noted(family) if noted else None)
        return self[family]


class _Layout(NamedTuple):
    """Where fields that are results stand among the numbers of `evaluate_samples`.

    Attributes
    ----------
    families : list of str, those that the model has
    family : (m,) int, of each field, its index among them; offset, stride, rows, numbers : (m, 4) int, as
        `evaluate_samples` takes them, addresses counted from the family's first record
    places : mapping, family -> field, its first number, and shape (rows, ...)
    """

    families: list[str]
    family: Array
    table: Array
    places: dict[str, list[tuple[str, int, tuple[int, ...]]]]


@functools.lru_cache(maxsize=32)
def _layout(sizes: tuple[tuple[str, int], ...]) -> _Layout:
    """The layout of a model that has so many records of each family."""
    owner, table, at = [], [], 0
    places: dict[str, list[tuple[str, int, tuple[int, ...]]]] = {}
    for k, (family, size) in enumerate(sizes):
        for field, offset, shape in _results()[family]:
            numbers = math.prod(shape)
            owner.append(k)
            table.append((offset, RECORDS[family].itemsize, size, numbers))
            places.setdefault(family, []).append((field, at, (size, *shape)))
            at += size * numbers
    return _Layout(
        [family for family, _ in sizes], np.array(owner, dtype=int), np.array(table, dtype=np.int64).reshape(-1, 4),
        places,
    )  # fmt: skip


class View:
    """A solution, read by parts.

    Attributes
    ----------
    solution : Solution
    assembly, model, t, y, s : of the solution
    is_of_copies : bool, whether the samples are those of several copies of a run, copy by copy
    explicit : bool, whether an explicit method made it
    wanted : set of str, variables that are asked for, beside which others may be left out; None: all

    Parameters
    ----------
    joints : bool, whether anything of joints is read; without that they are not evaluated
    families : names of those whose fields are read; those of others are evaluated only if one is read in spite of it
    """

    is_of_copies = False

    def __init__(self, solution: Solution, *, joints: bool = True, families: Collection[str] | None = None) -> None:
        self.solution, self.assembly, self.model = solution, solution.assembly, solution.assembly.model
        self.t, self.y, self.s = solution.t, np.ascontiguousarray(solution.y), solution.s
        self.explicit = solution.method in METHODS
        own = solution.assembly.model
        self._joints = own.constraints.size if joints or own.threads.size or own.bearings.size else 0
        self.wanted: set[str] | None = None
        self._families = frozenset(_results() if families is None else families)
        self._poses: dict[int, Pose] = {}
        self._sides: dict[Any, Side] = {}

    @classmethod
    def of(cls, solution: Solution) -> View:
        """The view of a solution, made once: what it has computed is not computed again."""
        found: View | None = solution.__dict__.get("_view")
        if found is None:
            found = solution.__dict__["_view"] = cls(solution)
        return found

    def wants(self, *names: str) -> bool:
        """Whether any of some variables is asked for."""
        return self.wanted is None or not self.wanted.isdisjoint(names)

    def index(self, name: str) -> int:
        """Index of a part in its family."""
        return int(self.assembly.names[name][1])

    def part(self, name: str) -> Any:
        """The part as the user wrote it."""
        return self.assembly.parts[name]

    @functools.cached_property
    def joint_rows(self) -> dict[str, list[int]]:
        """Rows of the family `joints` by the part that has written them."""
        found: dict[str, list[int]] = {}
        for k, owner in enumerate(self.assembly.row_parts[: self.model.joints.size]):
            found.setdefault(owner, []).append(k)
        return found

    @functools.cached_property
    def initial(self) -> View:
        """The assembly's start as one sample at time 0."""
        found = object.__new__(View)
        found.__dict__.update(self.__dict__)
        found.t, found.y, found.s = np.zeros(1), self.assembly.y[None], self.assembly.s[None]
        found._poses, found._sides = {}, {}
        found.__dict__.pop("fields", None)
        return found

    @functools.cached_property
    def fields(self) -> Fields:
        """Fields of records that are results (`model.RESULTS`) at the samples, by family: (nt, n, ...) each."""
        evaluated = functools.cache(self._evaluated)
        return Fields(lambda family: evaluated(family in self._families), self._kept_fields, self._extremes)

    def _extremes(self, family: str) -> Array:
        """Extremes over all steps of fields of a family, as of `FamilyFields`."""
        found: Array = families.records(self.solution.assembly.model, family)[EXTREMES]
        return found

    def _evaluated(self, of_some: bool) -> tuple[Array, _Layout]:
        """Fields at the samples, of the families that are read or of all, and where they stand."""
        la = np.ascontiguousarray(self.solution.la) if self._joints else np.zeros((self.t.size, 0))
        model = self._model_apart()  # after reactions are evaluated
        rows = {
            family: families.records(model, family) for family in _results() if not of_some or family in self._families
        }
        layout = _layout(tuple((family, own.size) for family, own in rows.items() if own.size))
        table = layout.table.copy()
        firsts = np.array([address(rows[family]) for family in layout.families], dtype=np.int64)
        table[:, 0] += firsts[layout.family]
        factors, s = np.resize(self.load_factor, self.t.size), np.ascontiguousarray(self.s)
        values = np.empty((self.t.size, int(table[:, 2] @ table[:, 3])))
        self._evaluate(s, la, factors, model, (layout, table), values)
        return values, layout

    def _evaluate(
        self, s: Array, la: Array, factors: Array, model: Any, fields: tuple[_Layout, Array], values: Array
    ) -> None:  # fmt: skip
        """Evaluate the samples by `evaluate_samples` with a model that may be written to.

        Parameters
        ----------
        s, la, factors : switches, multipliers and load factors of the samples
        fields : layout, and table of the fields that are evaluated
        values : (nt, n) float, output
        """
        needs.load(model, evaluate_samples)
        evaluate_samples(self.t, self.y, s, la, factors, model, fields[1], values)

    def reactions(self, bodies: Array) -> Array | None:
        """Forces and moments (nt, k, 6) that hold bodies (k,) which stand still, N and N m, inertial axes.

        Moments are about the bodies' origins. None of explicit runs with threads: the equations of implicit methods do
        not have their states.
        """
        solution, nt = self.solution, self.t.size
        if self.explicit and self.model.threads.size:
            return None
        model = solution.model.copy()
        if solution.path is not None:
            end_ramps(model)
        needs.load(model, fill_wrenches)
        n_v, n_j = int(model.info.nv), model.constraints.size
        la = np.ascontiguousarray(solution.la) if n_j else np.zeros((nt, 0))
        factors, found = np.resize(np.asarray(self.load_factor, dtype=float), nt), np.empty((nt, len(bodies), 6))
        fill_wrenches(
            self.t, self.y, np.ascontiguousarray(self.s), la, factors, model.parameters.copy(),
            np.asarray(bodies, dtype=np.int64), np.zeros(n_v), np.zeros(n_v + n_j), np.zeros(N_POWERS), model, found,
        )  # fmt: skip
        weight = factors[:, None, None] * self.model.bodies["mass"][bodies][:, None] * np.array(model.info.gravity)
        return -found - np.concatenate([weight, np.zeros_like(weight)], axis=2)

    def _model_apart(self) -> Any:
        """A model with the values of the solution's, whose records may be overwritten; variants share one a thread."""
        own, shared, key = self.solution.model, self.assembly.shared, f"evaluated in {threading.get_ident()}"
        if shared is None or self.solution.path is not None or own.threads.size:
            shared = {}
        if key not in shared:
            shared[key] = own.copy()
            needs.note_alike(own, shared[key])
        else:
            take(shared[key], own)
        if self.solution.path is not None:
            end_ramps(shared[key])
        return shared[key]

    def _kept_fields(self, family: str) -> dict[str, Array]:
        """Fields of a family that the method has stored, or that are evaluated beside the states."""
        kept, found = self.solution.kept, dict[str, Array]()
        if registry.families()[family].samples.kept and (kept is not None or is_by_rates(self.solution.model)):
            found = self._forces.get(family, {})  # else there is nothing to evaluate again
        if family == "contact_points" and kept is not None and kept.points is not None:
            found = {"force": kept.points} | found
        return found

    @functools.cached_property
    def _forces(self) -> dict[str, dict[str, Array]]:
        return self.solution.forces

    @property
    def load_factor(self) -> Array | float:
        """Factor of the loads at the samples: that of the path of equilibria, 1 of a motion."""
        path = self.solution.path
        return 1.0 if path is None else path.factor

    def coordinates(self, at: int, size: int = 3) -> Array:
        """Columns of the state: (nt, size)."""
        found: Array = self.y[:, at : at + size]
        return found

    def pose(self, index: int) -> Pose:
        """Motion of a body."""
        if index not in self._poses:
            self._poses[index] = self._pose(self.model.bodies[index])
        return self._poses[index]

    def poses(self, indices: Sequence[int]) -> Pose:
        """Poses of n bodies: x, v, w (nt, n, 3) and R (nt, n, 3, 3); those of free bodies are computed together."""
        free = [k for k in indices if k not in self._poses and self.model.bodies[k]["motion"] == rigid.FREE]
        if free:
            rows = self.model.bodies[np.array(free)]
            q, x, v, rate = (
                self.y[:, rows[key][:, None] + np.arange(first, first + size)]
                for key, first, size in (("iq", 3, 4), ("iq", 0, 3), ("iv", 0, 3), ("iv", 3, 3))
            )
            R = rotation_matrices(q / np.sqrt(np.einsum("tki,tki->tk", q, q))[..., None])
            w = turned(R.reshape(-1, 3, 3), rate.reshape(-1, 3)).reshape(rate.shape)
            self._poses |= {k: Pose(x[:, j], R[:, j], v[:, j], w[:, j]) for j, k in enumerate(free)}
        found = [self.pose(k) for k in indices]
        return Pose(*(np.stack(own, axis=1) for own in zip(*found, strict=True)))

    def _pose(self, body: Any) -> Pose:
        n, q, at = self.t.size, int(body["iq"]), int(body["iv"])
        if body["motion"] == rigid.FREE:
            R = rotation_matrices(self.attitude_of(body))
            rate = turned(R, self.coordinates(at + 3))
            return Pose(self.coordinates(q), R, self.coordinates(at), rate)
        if body["motion"] == rigid.SPIN:
            angle, rate = self.y[:, q], self.y[:, at]
        else:
            angle, rate = body["rate"] * self.t, np.full(n, body["rate"])
        R = body["R0"] @ about(body["axis"], angle)
        x, v = np.broadcast_to(body["x0"], (n, 3)), np.zeros((n, 3))
        if body["path"] != 0:
            p = self.model.parameters[int(body["path_first"]) : int(body["path_last"])]
            kind, law = int(body["path"]) - 1, int(body["path_law"])
            along = np.array([drive(kind, p, law, t)[:2] for t in self.t.tolist()]).reshape(-1, 2)
            x, v = x + along[:, :1] * body["direction"], along[:, 1:] * body["direction"]
        return Pose(x, R, v, turned(R, body["axis"]) * rate[:, None])

    def attitude_of(self, body: Any) -> Array:
        """Quaternion (nt, 4) of a free body, of unit length, scalar part first."""
        q = self.coordinates(int(body["iq"]) + 3, 4)
        found: Array = q / np.sqrt(np.einsum("ti,ti->t", q, q))[:, None]
        return found

    def angle(self, index: int) -> Array | None:
        """Angle of a spinning or driven body about its axis, over any number of turns: (nt,); None of a free one."""
        body = self.model.bodies[index]
        if body["motion"] == rigid.SPIN:
            return np.asarray(self.y[:, int(body["iq"])])
        return None if body["motion"] == rigid.FREE else np.asarray(body["rate"] * self.t)

    def on_body(self, index: int, local: Array) -> tuple[Array, Array]:
        """Position and velocity (nt, 3) of a point given in body axes."""
        pose = self.pose(index)
        arm = turned(pose.R, local)
        return pose.x + arm, pose.v + cross(pose.w, arm)

    def marker(self, index: int) -> tuple[Array, Array]:
        """Position and velocity (nt, 3) of a marker."""
        row = self.model.markers[index]
        if row["kind"] == markers.ON_POINT:
            point = self.model.points[row["index"]]
            return self.coordinates(int(point["iq"])), self.coordinates(int(point["iv"]))
        return self.on_body(int(row["index"]), row["local"])

    def nodes(self, index: int) -> tuple[Array, Array]:
        """Coordinates and rates of a beam's nodes: (nt, n + 1, vectors, 3), m and 1, m/s and 1/s."""
        row = self.model.beams[index]
        n, k = int(row["nodes"]), self.vectors(row)
        q, v = (self.coordinates(int(row[key]), 3 * k * n) for key in ("iq", "iv"))
        return q.reshape(-1, n, k, 3), v.reshape(-1, n, k, 3)

    def vectors(self, row: Any) -> int:
        """Vectors of each node of a record of beams."""
        return NODE_VECTORS[int(row["kind"])]

    def node_vectors(self, q: int) -> int:
        """Vectors of the node of a beam that has the coordinate q."""
        beams = self.model.beams
        return self.vectors(beams[np.flatnonzero((beams["iq"] >= 0) & (beams["iq"] <= q))[-1]])

    def side(self, joint: Any, which: int, *, is_point: bool) -> Side:
        """An end of a row of the family `joints`."""
        on, index, local = int(joint["on"][which]), int(joint["index"][which]), joint["local"][which]
        q, v = int(joint["iq"][which]), int(joint["iv"][which])
        key = (on, index, q, local.tobytes(), is_point)
        if key not in self._sides:
            self._sides[key] = self.vector(on, index, q, v, local, is_point=is_point)
        return self._sides[key]

    def vector(self, on: int, index: int, q: int, v: int, local: Array, *, is_point: bool) -> Side:
        """Vector of a side (`evolvent.kernels.sides`)."""
        if on == sides.ON_COORDINATES:
            return Side(self.coordinates(q), self.coordinates(v), -1)
        if on == sides.ON_NODE:
            u, rate = (sum(local[i] * self.coordinates(at + 3 * i) for i in range(3)) for at in (q, v))
            return Side(u, rate, -1)
        if is_point:
            return Side(*self.on_body(index, local), index)
        pose = self.pose(index)
        direction = turned(pose.R, local)
        return Side(direction, cross(pose.w, direction), index)


def about(axis: Array, angle: Array) -> Array:
    """Rotation matrices (nt, 3, 3) about a unit vector by angles (nt,), Rodrigues' formula."""
    K = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * K + (1.0 - c) * (K @ K)
