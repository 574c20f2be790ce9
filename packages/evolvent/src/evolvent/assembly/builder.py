"""Builder: collects what parts write about themselves and turns it into the Model's flat arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.assembly import needs
from evolvent.assembly.assembled import Array, Assembly, Pose
from evolvent.assembly.blocks import blocks_of
from evolvent.assembly.checks import check_constraints
from evolvent.assembly.constraints import constraint_families, constraints_of
from evolvent.assembly.ends import mark_outside
from evolvent.assembly.references import Location, Named, split_reference
from evolvent.assembly.state import has_causes, number_accounts, number_switches, stops, totals
from evolvent.compiled import laws
from evolvent.compiled.pointer import zeros_record
from evolvent.equations.implicit import add_weight
from evolvent.kernels import ancf, markers, rigid
from evolvent.model.registry import asked, constraining, families, is_by_rates, watched
from evolvent_base.columns import Column
from evolvent_base.dense import product
from evolvent_base.errors import InputError, nearest

#: Pools of constants of elements in `Model`, with the dimensions of one entry.
_POOLS = {"H": 2, "h": 1, "U0": 0, "B": 2, "M": 2}
#: Families that follow from the others.
_DERIVED = ("info", "blocks", "constraints", "watches", "rows", "row_sides", "row_pairs")


class Builder:
    """What parts write into: rows of families, coordinates with their initial values, parameters, laws."""

    def __init__(self, gravity: Array) -> None:
        self.gravity = gravity
        self.rows: dict[str, list[dict[str, Any]]] = {name: [] for name in mdl.RECORDS if name not in _DERIVED}
        self.names: dict[str, tuple[str, int]] = {}
        self.specs: dict[str, Any] = {}
        self.part = ""
        self.row_parts: list[tuple[str, str]] = []  # family and writer of each record that is a row of constraint
        self.poses: list[Pose] = []
        self.body_points: dict[str, dict[str, Any]] = {}
        self.q: list[float] = []
        self.v: list[float] = []
        self.released: list[int] = []
        self.values: list[Any] = []
        self.breaks: set[float] = set()
        self.laws: dict[int, Any] = {}
        self.expressions: dict[int, tuple[Any, str]] = {}
        self.relaxations: dict[int, tuple[str, Any]] = {}
        #: Indices of parameters that hold indices in the velocities, counted from their start while parts are written.
        self.velocity_parameters: list[int] = []
        self.pools: dict[str, list[Any]] = {name: [] for name in _POOLS}
        #: Called with the builder once all parts are written.
        self.at_end: list[Callable[[Builder], None]] = []
        self._pooled: dict[Any, int] = {}
        self._places, self._near = asked("parts.place"), asked("parts.near")
        self._ground()

    def _ground(self) -> None:
        """The first body: fixed, at the origin of the inertial frame."""
        self.poses.append(Pose(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3)))
        index = self.add(
            "bodies",
            motion=rigid.DRIVEN,
            iq=-1,
            iv=-1,
            mass=0.0,
            inertia=np.zeros((3, 3)),
            axis=np.array([0.0, 0.0, 1.0]),
            R0=np.eye(3),
            x0=np.zeros(3),
            rate=0.0,
            spin_inertia=0.0,
        )
        self.names["ground"] = ("bodies", index)

    def write(self, name: str, part: Any) -> None:
        """Let a part write itself."""
        self.specs[name] = part
        self.part = name
        part.write(self, name)

    def add(self, family: str, **fields: Any) -> int:
        """Append one row to `family`; returns its index."""
        self.rows[family].append(fields)
        if family in constraining():
            self.row_parts.append((family, self.part))
        return len(self.rows[family]) - 1

    def writers(self, family: str) -> list[str]:
        """Part that wrote each record so far of a family whose records are rows of constraint."""
        return [part for name, part in self.row_parts if name == family]

    def coordinates(self, q: Sequence[float], v: Sequence[float]) -> tuple[int, int]:
        """Reserve coordinates with their initial values; returns their offsets (velocities relative to theirs)."""
        at = len(self.q), len(self.v)
        self.q.extend(float(x) for x in q)
        self.v.extend(float(x) for x in v)
        return at

    def parameters(self, values: Sequence[Any]) -> tuple[int, int]:
        """Store parameters; returns the range of their indices."""
        first = len(self.values)
        try:
            self.values.extend(x if isinstance(x, Column) else float(x) for x in values)
        except (TypeError, ValueError):
            raise InputError(f"parameters is {values!r}; it must be a sequence of numbers") from None
        return first, len(self.values)

    def pooled(self, **entries: Any) -> int:
        """Index of entries, of equal index in several pools of the model; equal ones are stored once."""
        arrays = {name: np.array(value, dtype=float) for name, value in entries.items()}
        key = tuple((name, value.tobytes()) for name, value in arrays.items())
        if key not in self._pooled:
            self._pooled[key] = len(self.pools[next(iter(arrays))])
            for name, value in arrays.items():
                self.pools[name].append(value)
        return self._pooled[key]

    def law(self, law: Any, kind: str, *, key: str = "") -> int:
        """Address of a user's law, which is kept alive with the model.

        Parameters
        ----------
        kind : of `compiled.laws.FORMS`, such as "spring"
        key : that holds it, for messages; ``law`` of the part if left out
        """
        compiled = laws.required(law, kind, key or f"{self.part}.law")
        # the position of a torque has the attitude too
        address = laws.law_address(compiled, "force" if kind == "torque" else kind)
        self.laws[address] = compiled
        return address

    def expression(self, run: Any, kind: str, code: Sequence[float], text: str, slope: Any = None) -> dict[str, int]:
        """Store an expression as the law of a row; returns the row's fields.

        Parameters
        ----------
        run : compiled function of `evolvent.kernels.expression` with the signature of a law of that kind
        code : its parameters
        text : what messages call it
        slope : compiled function, its derivative along a direction
        """
        first, last = self.parameters(code)
        self.expressions[first] = run, text
        return {"law": laws.law_address(run, kind, slope), "first": first, "last": last}

    def find(self, name: str, family: str) -> int:
        """Index of an already added part."""
        if name not in self.names or self.names[name][0] != family:
            raise self.not_found(name, family)
        return self.names[name][1]

    def not_found(self, name: str, family: str) -> InputError:
        """The refusal of a name that no part of a family has."""
        known = [n for n, (f, _) in self.names.items() if f == family]
        what = {"bodies": "body"}.get(family, family.removesuffix("s"))
        return InputError(f"no {what} is called {name!r}; {nearest(str(name), known)}")

    def location(self, where: Any, key: str = "a point") -> Location:
        """Where a reference to a point is, at the start.

        Parameters
        ----------
        where : str, (str, (3,) float) or (3,) float
            "hub" (a body's origin, a point), "hub.left" (a point of a body), "boom.root", "boom.tip" or "boom[5]" (a
            beam's node), "tether.tip" (the end of a thread), ("hub", position in its axes), ("panel", position in
            inertial axes of a node), or a position on the ground.
        key : str, what the reference is given for, such as "spring.a"

        Raises
        ------
        InputError
            If there is no such point; the message names the nearest one.
        """
        if isinstance(where, str):
            name, on = split_reference(where)
            family, index = self._owner(name, where, key)
            found: Location = self._places[family](self, Named(where, key, name, index, on))
            return found
        if not isinstance(where, tuple | list | np.ndarray) or len(where) not in (2, 3):
            raise InputError(
                f"{key} is {where!r}; it must be a part's name, 'boom.tip', ('hub', (0, 0, 1)), or a "
                f"position on the ground"
            )
        if len(where) == 3:
            return self.on_body(self.names["ground"][1], where)
        family, index = self._owner(where[0], where, key)
        if family in self._near:
            nearest_to: Location = self._near[family](self, Named(where, key, where[0], index, None), where[1])
            return nearest_to
        if family != "bodies":
            raise InputError(f"{key} is {where!r}; {where[0]!r} is not a body, and only a body takes a position")
        return self.on_body(index, where[1])

    def _owner(self, name: Any, where: Any, key: str) -> tuple[str, int]:
        """Family and index of the part that a point is on."""
        family, index = self.names.get(name, ("", -1))
        if family not in self._places:
            if name in self.specs:
                kind = type(self.specs[name]).__name__
                raise InputError(f"{key} is {where!r}; {name!r} is a {kind}, not a body, point or beam")
            known = [n for n, (f, _) in self.names.items() if f in self._places]
            raise InputError(
                f"{key} is {where!r}; no body, point, beam or rod is called {name!r}; {nearest(str(name), known)}"
            )
        return family, index

    def on_body(self, index: int, local: Any, alone: bool = False) -> Location:
        """A point (3,) of a body, m, body axes; `alone` where the body was named without a point."""
        at, pose = np.array(local, dtype=float), self.poses[index]
        d = product(pose.R, at)
        return Location("bodies", index, at, -1, -1, -1, pose.x + d, pose.v + np.cross(pose.w, d), alone)

    def on_coordinates(self, family: str, row: int, iq: int, iv: int, beam: int = -1) -> Location:
        """A point whose position and velocity are coordinates, from `iq` and `iv` on; `beam`: kind of its beam."""
        x, v = np.array(self.q[iq : iq + 3]), np.array(self.v[iv : iv + 3])
        return Location(family, row, np.zeros(3), iq, iv, beam, x, v, False)

    def velocity_of(self, where: Any, key: str = "a point") -> Array:
        """Velocity of a point at the start (`location`), m/s, inertial axes."""
        return self.location(where, key).v

    def marker(self, where: Any, key: str = "a point", *, nodes: bool = False) -> int:
        """Marker of a point (`location`) on a body or of a point; a node of a beam is refused, unless `nodes`."""
        at = self.location(where, key)
        if at.beam >= 0 and nodes:
            points = self.rows["points"]
            same = (i for i, row in enumerate(points) if row["mass"] == 0.0 and row["iq"] == at.iq)
            index = next(same, -1)
            if index < 0:
                index = self.add("points", iq=at.iq, iv=at.iv, mass=0.0, compliance=0.0)
            return self.add("markers", kind=markers.ON_POINT, index=index, local=at.local)
        if at.beam >= 0:
            raise InputError(
                f"{key} is {where!r}, a node of a beam, which this part cannot act on; add a Point with at={where!r} "
                f"and name that"
            )
        kind = markers.ON_BODY if at.family == "bodies" else markers.ON_POINT
        return self.add("markers", kind=kind, index=at.row, local=at.local)

    def marker_state(self, marker: int) -> tuple[Array, Array]:
        """Position and velocity of a marker at the start."""
        row = self.rows["markers"][marker]
        if row["kind"] == markers.ON_POINT:
            point = self.rows["points"][row["index"]]
            return np.array(self.q[point["iq"] :][:3]), np.array(self.v[point["iv"] :][:3])
        at = self.on_body(row["index"], row["local"])
        return at.x, at.v

    # -------------------------------------------------------------------------------------------- assembly

    def build(self) -> Assembly:
        """All families as arrays, constraint rows ordered for a narrow band, scratch memory, initial state."""
        for finish in self.at_end:
            finish(self)
        n_q, n_v = len(self.q), len(self.v)
        found = {name: self._records(name, rows) for name, rows in self.rows.items()}
        for check in asked("parts.check").values():
            check(self)
        s = number_switches(found, self)
        accounts, rubbed = number_accounts(found, n_q + n_v)
        scratch = self._scratch(found, s)
        found["constraints"] = constraints_of(found)
        stopping = np.concatenate(watched(found))
        found["watches"] = mdl.zeros("watches", stopping.size)
        found["watches"]["stops"] = stopping
        found |= constraint_families(found, scratch["masses"], n_q)
        of = found["row_sides"]["row"]
        bandwidth = int((of[found["row_pairs"]["a"]] - of[found["row_pairs"]["b"]]).max(initial=0))
        y = np.concatenate([self.q, self.v, accounts])
        info = zeros_record(
            mdl.RECORDS["info"], nq=n_q, nv=n_v, ny=y.size, ns=s.size, bandwidth=bandwidth, gravity=self.gravity,
            rubbed=rubbed, causes=has_causes(found), **totals(found),
            penalties=np.sum(found["constraints"]["stiffness"] > 0.0),
        )  # fmt: skip
        mark_outside(found, info)
        values = np.array(self.values, dtype=float)
        values[self.velocity_parameters] += n_q
        model = mdl.Model(
            info=info,
            breaks=np.array(sorted(self.breaks | stops(found)), dtype=float),
            parameters=values,
            blocks=blocks_of(found, self.pools),
            A=np.zeros((found["rows"].size, bandwidth + 1)),
            la=np.zeros(found["rows"].size),
            watched=np.zeros(stopping.size),
            scratch=np.zeros((3, 3)),
            pose=np.zeros(12),
            dy=np.zeros((2, y.size)),
            sums=np.zeros((2, mdl.N_INVENTORY)),
            **scratch,
            **found,
        )
        model.info.generalized = is_by_rates(model)
        if np.any(self.gravity):
            needs.load(model, add_weight)
            add_weight(self.gravity, n_q, model, model.G)
        assembly = Assembly(
            model, y, s, dict(self.names), dict(self.laws),
            [part for name in constraining() for part in self.writers(name)], dict(self.specs),
            dict(self.expressions), dict(self.relaxations),
        )  # fmt: skip
        check_constraints(assembly)
        return assembly

    def _scratch(self, found: dict[str, Array], s: Array) -> dict[str, Array]:
        """Pools of constants that elements share, and scratch memory."""
        n_v = len(self.v)
        of_families = [scratch(found.__getitem__, self) for scratch in asked("parts.scratch").values()]
        return dict(
            G=np.zeros(n_v),
            switches=s.copy(),
            F=np.zeros(n_v),
            P=np.zeros(n_v),
            work=np.zeros(ancf.WORK),
            e=np.zeros((3, 24)),
            f=np.zeros(24),
            K24=np.zeros((24, 24)),
            K12=np.zeros((12, 12)),
            J=np.zeros((3, 3, 9)),
            **{name: _stacked(self.pools[name], ndim) for name, ndim in _POOLS.items()},
            **{name: value for own in of_families for name, value in own.items()},
        )

    def _records(self, name: str, rows: list[dict[str, Any]]) -> Array:
        """One record a row; scratch fields stay zero, but those of `Parts.initial`."""
        own = families().get(name)
        initial, offsets = ({}, ()) if own is None else (own.parts.initial, own.offsets)
        found = mdl.zeros(name, len(rows))
        for k, row in enumerate(rows):
            for field, other in initial.items():
                found[field][k] = row[other]
            for field, value in row.items():
                if field in offsets:
                    value = np.where(np.asarray(value) >= 0, np.asarray(value) + len(self.q), value)
                found[field][k] = value
        return found


def _stacked(entries: list[Any], ndim: int) -> Array:
    """Arrays as one, each in the first places of the shape of the largest, 0 elsewhere."""
    shape = tuple(max((value.shape[k] for value in entries), default=0) for k in range(ndim))
    found = np.zeros((len(entries), *shape))
    for k, value in enumerate(entries):
        own: tuple[Any, ...] = (k, *(slice(size) for size in value.shape))
        found[own] = value
    return found
