"""Builder: collects what parts write about themselves and turns it into the Model's flat arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.assembly import needs
from evolvent.assembly.assembled import Array, Assembly, Pose
from evolvent.assembly.blocks import blocks_of
from evolvent.assembly.checks import check_constraints, factored_masses, off_axis
from evolvent.assembly.constraints import constraint_families
from evolvent.assembly.ends import mark_outside
from evolvent.assembly.references import Location, split_reference
from evolvent.base.errors import InputError, nearest
from evolvent.compiled import laws
from evolvent.compiled.pointer import zeros_record
from evolvent.elements.dense import product
from evolvent.flow.implicit import add_weight
from evolvent.kernels import (
    ancf,
    ancf_beams,
    axial,
    coordinate,
    custom,
    loads,
    rigid,
    rod_strains,
    springs,
)

#: Pools of constants of elements in `Model`, with the dimensions of one entry.
_POOLS = {"H": 2, "h": 1, "U0": 0, "B": 2, "M": 2}
#: Families of parts on which there are points.
_PLACES = ("bodies", "points", "beams", "rods", "reduced_bodies")
#: Families that follow from the others.
_DERIVED = ("info", "blocks", "rows", "row_sides", "row_pairs")
#: Fields that hold an index in the state vector's second part, counted from its start while parts are written.
_VELOCITY_OFFSETS = ("iv", "spool_v")  # of several values each, -1 for none


class Builder:
    """What parts write into: rows of families, coordinates with their initial values, parameters, laws."""

    def __init__(self, gravity: Array) -> None:
        self.gravity = gravity
        self.rows: dict[str, list[dict[str, Any]]] = {name: [] for name in mdl.RECORDS if name not in _DERIVED}
        self.names: dict[str, tuple[str, int]] = {}
        self.specs: dict[str, Any] = {}
        self.part = ""
        self.joint_parts: list[str] = []
        self.poses: list[Pose] = []
        self.body_points: dict[str, dict[str, Any]] = {}
        self.q: list[float] = []
        self.v: list[float] = []
        self.released: list[int] = []
        self.values: list[float] = []
        self.breaks: set[float] = set()
        self.laws: dict[int, Any] = {}
        self.expressions: dict[int, tuple[Any, str]] = {}
        #: Indices of parameters that hold indices in the velocities, counted from their start while parts are written.
        self.velocity_parameters: list[int] = []
        self.pools: dict[str, list[Any]] = {name: [] for name in _POOLS}
        #: Called with the builder once all parts are written.
        self.at_end: list[Callable[[Builder], None]] = []
        self._pooled: dict[Any, int] = {}
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
        if family == "joints":
            self.joint_parts.append(self.part)
        return len(self.rows[family]) - 1

    def coordinates(self, q: Sequence[float], v: Sequence[float]) -> tuple[int, int]:
        """Reserve coordinates with their initial values; returns their offsets (velocities relative to theirs)."""
        at = len(self.q), len(self.v)
        self.q.extend(float(x) for x in q)
        self.v.extend(float(x) for x in v)
        return at

    def parameters(self, values: Sequence[float]) -> tuple[int, int]:
        """Store parameters; returns the range of their indices."""
        first = len(self.values)
        try:
            self.values.extend(float(x) for x in values)
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
        kind : of its decorator, such as "spring"
        key : that holds it, for messages; ``law`` of the part if left out
        """
        laws.require_kind(law, kind, key or f"{self.part}.law")
        address = laws.law_address(law, "force" if kind == "torque" else kind)  # whose position has the attitude too
        self.laws[address] = law
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
        known = [n for n, (f, _) in self.names.items() if f == family]
        if name not in self.names or self.names[name][0] != family:
            what = {"bodies": "body"}.get(family, family.removesuffix("s"))
            raise InputError(f"no {what} is called {name!r}; {nearest(str(name), known)}")
        return self.names[name][1]

    def location(self, where: Any, key: str = "a point") -> Location:
        """Where a reference to a point is, at the start.

        Parameters
        ----------
        where : str, (str, (3,) float) or (3,) float
            "hub" (a body's origin, a point), "hub.left" (a point of a body), "boom.root", "boom.tip" or "boom[5]" (a
            beam's node), "tether.tip" (the end of a thread), ("hub", position in its axes), or a position on the
            ground.
        key : str, what the reference is given for, such as "spring.a"

        Raises
        ------
        InputError
            If there is no such point; the message names the nearest one.
        """
        if isinstance(where, str):
            name, on = split_reference(where)
            if on == "tip" and self.names.get(name, ("",))[0] == "threads":
                found: Location = self.specs[name].tip_location(self, name, where, key)
                return found
            family, index = self._owner(name, where, key)
            if family == "beams":
                return self._node(where, index, name, on, key)
            if family == "rods":
                return self._rod_node(where, index, name, on, key)
            if family == "reduced_bodies":
                return self._interface(where, index, name, on, key)
            if family == "points":
                if on is not None:
                    raise InputError(f"{key} is {where!r}; {name!r} is a point mass, which has no {on!r}")
                row = self.rows["points"][index]
                x, v = np.array(self.q[row["iq"] :][:3]), np.array(self.v[row["iv"] :][:3])
                return Location("points", index, np.zeros(3), row["iq"], row["iv"], -1, x, v, False)
            points = self.body_points.get(name, {})
            if on is not None and on not in points:
                what = f"node {on}" if isinstance(on, int) else f"point {on!r}"
                known = nearest(str(on), points) if points else "its key `points` names none"
                raise InputError(f"{key} is {where!r}; {name!r} has no {what}; {known}")
            return self._on_body(index, points[on] if isinstance(on, str) else (0.0, 0.0, 0.0), on is None)
        if not isinstance(where, tuple | list | np.ndarray) or len(where) not in (2, 3):
            raise InputError(
                f"{key} is {where!r}; it must be a part's name, 'boom.tip', ('hub', (0, 0, 1)), or a "
                f"position on the ground"
            )
        if len(where) == 3:
            return self._on_body(self.names["ground"][1], where, False)
        family, index = self._owner(where[0], where, key)
        if family != "bodies":
            raise InputError(f"{key} is {where!r}; {where[0]!r} is not a body, and only a body takes a position")
        return self._on_body(index, where[1], False)

    def _owner(self, name: Any, where: Any, key: str) -> tuple[str, int]:
        """Family and index of the part that a point is on."""
        family, index = self.names.get(name, ("", -1))
        if family not in _PLACES:
            if name in self.specs:
                kind = type(self.specs[name]).__name__
                advice = (
                    f"; its end is {name + '.tip'!r}; a mass at its end is its key `tip_mass`, a point it is fixed to "
                    f"its key `end`"
                    if family == "threads"
                    else ""
                )
                raise InputError(f"{key} is {where!r}; {name!r} is a {kind}, not a body, point or beam{advice}")
            known = [n for n, (f, _) in self.names.items() if f in _PLACES]
            raise InputError(
                f"{key} is {where!r}; no body, point, beam or rod is called {name!r}; {nearest(str(name), known)}"
            )
        return family, index

    def _on_body(self, index: int, local: Any, alone: bool) -> Location:
        at, pose = np.array(local, dtype=float), self.poses[index]
        d = product(pose.R, at)
        return Location("bodies", index, at, -1, -1, -1, pose.x + d, pose.v + np.cross(pose.w, d), alone)

    def _number(self, where: str, name: str, on: str | int | None, last: int, key: str, what: str) -> int:
        """Number of a node of a beam or rod, from 0 to `last`."""
        number = {"root": 0, "tip": last}.get(on) if isinstance(on, str) else on
        if number is None or number > last:
            wanted = f"'{name}.root', '{name}.tip' or a node from '{name}[0]' to '{name}[{last}]'"
            found = f"is a {what}" if on is None else f"has no {'node ' if isinstance(on, int) else ''}{on!r}"
            raise InputError(f"{key} is {where!r}; {name!r} {found}; give {wanted}")
        return number

    def _node(self, where: str, index: int, name: str, on: str | int | None, key: str) -> Location:
        row = self.rows["beams"][index]
        number = self._number(where, name, on, row["nodes"] - 1, key, "beam")
        size = 3 * ancf_beams.NODE_VECTORS[row["kind"]]
        iq, iv = row["iq"] + size * number, row["iv"] + size * number
        x, v = np.array(self.q[iq : iq + 3]), np.array(self.v[iv : iv + 3])
        return Location("beams", index, np.zeros(3), iq, iv, row["kind"], x, v, False)

    def _rod_node(self, where: str, index: int, name: str, on: str | int | None, key: str) -> Location:
        row = self.rows["rods"][index]
        number = self._number(where, name, on, row["elements"], key, "rod")
        elements, last = self.rows["rod_elements"], number == row["elements"]
        if row["payout"] and not last and number > 0:
            raise InputError(
                f"{key} is {where!r}, a node of a mesh through which material flows ({name}.payout); give "
                f"'{name}.root' or '{name}.tip'"
            )
        local = elements[row["first_element"] + number - last]["arm_b" if last else "arm_a"]
        return self._on_body(row["first_body"] + number, local, False)

    def _interface(self, where: str, index: int, name: str, on: str | int | None, key: str) -> Location:
        """An interface node of a reduced body."""
        row, names = self.rows["reduced_bodies"][index], [*self.body_points[name]]
        number = names.index(on) if on in names else on
        if not isinstance(number, int) or number >= len(names):
            found = "names no interface node of it" if on is None else f"has no node {on!r}"
            raise InputError(f"{key} is {where!r}, which {found}; {nearest(str(on), names)}")
        return self._on_body(row["first_body"] + 1 + number, (0.0, 0.0, 0.0), False)

    def velocity_of(self, where: Any, key: str = "a point") -> Array:
        """Velocity of a point at the start (`location`), m/s, inertial axes."""
        return self.location(where, key).v

    def marker(self, where: Any, key: str = "a point", *, nodes: bool = False) -> int:
        """Marker of a point (`location`) on a body or of a point; a node of a beam is refused, unless `nodes`."""
        at = self.location(where, key)
        if at.family == "beams" and nodes:
            points = self.rows["points"]
            same = (i for i, row in enumerate(points) if row["mass"] == 0.0 and row["iq"] == at.iq)
            index = next(same, -1)
            if index < 0:
                index = self.add("points", iq=at.iq, iv=at.iv, mass=0.0, compliance=0.0)
            return self.add("markers", kind=springs.ON_POINT, index=index, local=at.local)
        if at.family == "beams":
            raise InputError(
                f"{key} is {where!r}, a node of a beam, which this part cannot act on; add a Point with at={where!r} "
                f"and name that"
            )
        kind = springs.ON_BODY if at.family == "bodies" else springs.ON_POINT
        return self.add("markers", kind=kind, index=at.row, local=at.local)

    def marker_state(self, marker: int) -> tuple[Array, Array]:
        """Position and velocity of a marker at the start."""
        row = self.rows["markers"][marker]
        if row["kind"] == springs.ON_POINT:
            point = self.rows["points"][row["index"]]
            return np.array(self.q[point["iq"] :][:3]), np.array(self.v[point["iv"] :][:3])
        at = self._on_body(row["index"], row["local"], False)
        return at.x, at.v

    # -------------------------------------------------------------------------------------------- assembly

    def build(self) -> Assembly:
        """All families as arrays, constraint rows ordered for a narrow band, scratch memory, initial state."""
        for finish in self.at_end:
            finish(self)
        n_q, n_v = len(self.q), len(self.v)
        families = {name: self._family(name, rows) for name, rows in self.rows.items()}
        self._check_copies()
        n_threads = len(self.rows["threads"])
        s = self._switches(families)
        accounts = mdl.N_ACCOUNTS
        if self.rows["beams"] or self.rows["rods"]:
            accounts += mdl.IMPULSE + len(self.rows["contact_surfaces"])
        accounts += self._number_accounts(families, n_q + n_v + accounts)
        scratch = self._scratch(families, s)
        families |= constraint_families(families, scratch["masses"], n_q)
        of = families["row_sides"]["row"]
        bandwidth = int((of[families["row_pairs"]["a"]] - of[families["row_pairs"]["b"]]).max(initial=0))
        y = np.array(self.q + self.v + [0.0] * accounts)
        y[families["bristles"]["account"]] = families["bristles"]["force0"]
        info = zeros_record(
            mdl.RECORDS["info"], nq=n_q, nv=n_v, ny=y.size, ns=s.size,
            ne=2 * n_threads + len(self.rows["events"]) + self._latches() + self._brakes(), brakes=self._brakes(),
            bandwidth=bandwidth, gravity=self.gravity,
            rubbed=self.rubbed, causes=bool(self.rows["beams"] or self.rows["rods"]),
            penalties=sum(row["stiffness"] > 0.0 for row in self.rows["joints"]),
        )  # fmt: skip
        mark_outside(families, info)
        values = np.array(self.values, dtype=float)
        values[self.velocity_parameters] += n_q
        model = mdl.Model(
            info=info,
            breaks=np.array(sorted(self.breaks | self._ends()), dtype=float),
            parameters=values,
            blocks=blocks_of(families, self.pools),
            A=np.zeros((families["rows"].size, bandwidth + 1)),
            la=np.zeros(families["rows"].size),
            scratch=np.zeros((3, 3)),
            pose=np.zeros(12),
            dy=np.zeros((2, y.size)),
            sums=np.zeros((2, mdl.N_INVENTORY)),
            **scratch,
            **families,
        )
        if np.any(self.gravity):
            needs.load(model, add_weight)
            add_weight(self.gravity, n_q, model, model.G)
        assembly = Assembly(
            model, y, s, dict(self.names), dict(self.laws), list(self.joint_parts), dict(self.specs),
            dict(self.expressions),
        )  # fmt: skip
        check_constraints(assembly)
        return assembly

    def _ends(self) -> set[float]:
        """Times at which joints are released, motors switched off, and beam loads start or end."""
        times = [row["until"] for family in ("joints", "motors") for row in self.rows[family]]
        times += [row[key] for row in self.rows["beam_loads"] for key in ("start", "end")]
        return {float(t) for t in times if np.isfinite(t)}

    def _switches(self, families: dict[str, Array]) -> Array:
        """Switches at the start: released nodes, turns and latches of coordinates, those of events, senses of spools.

        An event has one for each joint that it releases and each motor that it switches off, 0 until it has; where a
        latch does that, its own switch serves. Those of spools with friction stand last.
        """
        n, coordinates, threads = len(self.rows["threads"]), families["coordinates"], families["threads"]
        at = 2 * n + 2 * coordinates.size
        for rows in (families["joints"], families["motors"]):
            by_event = rows["event"] >= 0
            rows["switch"][by_event] = at + np.arange(np.sum(by_event))
            at += int(np.sum(by_event))
            by_latch = rows["event"] <= -2
            rows["switch"][by_latch] = 2 * (n - 2 - rows["event"][by_latch]) + 1
        own = self.rows["resistances"]
        families["resistances"]["switch"] = at + np.arange(len(own))
        at += len(own)
        s = np.zeros(at + self._brakes(), dtype=np.int64)
        s[at - len(own) : at] = [row["start"] for row in own]
        for i, p in enumerate(np.flatnonzero(threads["spool_friction"] > 0.0).tolist()):
            threads["spool_switch"][p] = at + i
            s[at + i] = np.sign(self.v[self.rows["threads"][p]["spool_v"]])
        s[:n] = self.released
        for k in range(coordinates.size):
            coordinates["switch"][k] = at = 2 * (n + k)
            s[at] = (
                round(float(coordinates["angle"][k]) / axial.QUARTER) if coordinates["kind"][k] == axial.ANGLE else 0
            )
            s[at + 1] = abs(coordinates["angle"][k] - coordinates["latch"][k]) <= coordinate.REACHED
        return s

    def _number_accounts(self, families: dict[str, Array], first: int) -> int:
        """Give coordinates and what acts on them their accounts, from index `first` of the state on."""
        at = first
        own = (
            ("coordinates", mdl.COORDINATE_ACCOUNTS), ("motors", 1), ("synchronizations", 1), ("resistances", 1),
            ("bristles", 1), ("drivetrains", mdl.DRIVETRAIN_ACCOUNTS), ("bearings", 1),
        )  # fmt: skip
        for name, count in own:
            size = families[name].size
            families[name]["account"] = at + count * np.arange(size)
            at += count * size
        self.rubbed, one = -1, np.ones(families["body_contacts"].size, dtype=int)
        rub = ("coordinates", "contact_surfaces", "body_contacts")
        rubs = any(np.any(families[name]["friction"] > 0.0) for name in rub)
        if rubs or families["bristles"].size or families["drivetrains"].size:
            self.rubbed, at = at, at + 1
        points = families["contact_surfaces"]["last"] - families["contact_surfaces"]["first"]
        for name, counts in (("contact_surfaces", points), ("body_contacts", one)):
            sizes = np.where(families[name]["friction"] > 0.0, 3 * counts, 0)
            families[name]["account"] = np.where(sizes > 0, at + np.cumsum(sizes) - sizes, -1)
            at += int(sizes.sum())
        return at - first

    def _brakes(self) -> int:
        """Number of the spools that friction can hold."""
        return sum(row["spool_friction"] > 0.0 for row in self.rows["threads"])

    def _latches(self) -> int:
        """Number of the events of joint coordinates: one each, where any of them has a latch."""
        rows = self.rows["coordinates"]
        return len(rows) if any(np.isfinite(row["latch"]) for row in rows) else 0

    def _scratch(self, families: dict[str, Array], s: Array) -> dict[str, Array]:
        """Pools of constants that elements share, and scratch memory."""
        n_v = len(self.v)
        beams = families["beams"]
        return dict(
            G=np.zeros(n_v),
            switches=s.copy(),
            strands=np.zeros((len(self.rows["nodes"]) + 1, 9)),
            angles=np.zeros(len(self.rows["beam_nodes"])),
            custom=np.zeros(max((custom.scratch_size(row["points"]) for row in self.rows["custom_forces"]), default=0)),
            masses=factored_masses(beams, families["elements"], self.pools["M"]),
            rod=np.zeros(rod_strains.WORK),
            F=np.zeros(n_v),
            P=np.zeros(n_v),
            work=np.zeros(ancf.WORK),
            e=np.zeros((3, 24)),
            f=np.zeros(24),
            K24=np.zeros((24, 24)),
            K12=np.zeros((12, 12)),
            J=np.zeros((3, 3, 9)),
            **{name: _stacked(self.pools[name], ndim) for name, ndim in _POOLS.items()},
        )

    def _check_copies(self) -> None:
        """Refuse loads that differ from copy to copy of a thread that stands for several."""
        names = {found: name for name, found in self.names.items()}
        for p, row in enumerate(self.rows["threads"]):
            if row["copies"] == 1:
                continue
            body = self.rows["bodies"][row["body"]]
            axis = body["R0"] @ body["axis"]
            differ = ["gravity"] if off_axis(axis, self.gravity) else []
            for k, load in enumerate(self.rows["loads"]):
                if load["kind"] >= loads.AT_MARKER or load["target"] != p:
                    continue
                values = np.array(self.values[load["first"] : load["last"]])
                if load["kind"] == loads.NODE:
                    off = load["law"] != 0 or off_axis(body["axis"] if values[3] != 0.0 else axis, values[:3])
                elif load["kind"] == loads.UNIFORM:
                    off = off_axis(body["axis"] if values[3] != 0.0 else axis, values[:3])
                else:
                    off = load["kind"] == loads.LAW or off_axis(axis, values[:3])
                differ += [names["loads", k]] if off else []
            if differ:
                raise InputError(
                    f"{names['threads', p]!r} stands for {row['copies']} copies, but {differ[0]!r} is not the same for "
                    "all of them; add a thread for each"
                )

    def _family(self, name: str, rows: list[dict[str, Any]]) -> Array:
        """One record a row; scratch fields stay zero."""
        family = mdl.zeros(name, len(rows))
        for k, row in enumerate(rows):
            if name == "bodies":
                family["R"][k], family["x"][k] = row["R0"], row["x0"]
            for field, value in row.items():
                if field in _VELOCITY_OFFSETS:
                    value = np.where(np.asarray(value) >= 0, np.asarray(value) + len(self.q), value)
                family[field][k] = value
        return family


def _stacked(entries: list[Any], ndim: int) -> Array:
    """Arrays as one, each in the first places of the shape of the largest, 0 elsewhere."""
    shape = tuple(max((value.shape[k] for value in entries), default=0) for k in range(ndim))
    found = np.zeros((len(entries), *shape))
    for k, value in enumerate(entries):
        own: tuple[Any, ...] = (k, *(slice(size) for size in value.shape))
        found[own] = value
    return found
