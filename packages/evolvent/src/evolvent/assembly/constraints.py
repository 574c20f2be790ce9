"""Rows of constraint, and those that explicit methods solve for: what they act on, their order and couplings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.assembly.assembled import Array
from evolvent.assembly.ends import ends_of
from evolvent.assembly.order import reverse_cuthill_mckee
from evolvent.kernels import ancf_beams, rigid
from evolvent.model.family import End
from evolvent.model.questions import CONSTRAINT
from evolvent.model.registry import asked, constraining, families as every, first_row
from evolvent_base.errors import InputError

#: What rows are without fields of their records.
_ALWAYS = {
    "stiffness": 0.0, "damping": 0.0, "until": np.inf, "latest": np.inf, "event": -1, "switch": -1,
    "prony": 0, "prony_end": 0, "branch": 0,
}  # fmt: skip


def constraints_of(found: Mapping[str, Array]) -> Array:
    """Records `constraints` of all families, whose records have their switches."""
    names = constraining()
    table, first = mdl.zeros("constraints", sum(found[name].size for name in names)), 0
    for number, name in enumerate(name for name in names if found[name].size):
        records, rows = found[name], every()[name].rows
        own = table[first : first + records.size]
        own["family"], own["record"] = number, np.arange(records.size)
        for field, value in _ALWAYS.items():
            own[field] = records[field] if field in (records.dtype.names or ()) else value
        if "latest" not in (records.dtype.names or ()):
            own["latest"] = own["until"]
        for field in ("turns", "drives", "couples", "ends", "alone"):
            mask = getattr(rows, field)
            own[field] = (field == "couples") if mask is None else mask(records)
        first += records.size
    return table


def family_of(model: mdl.Model, k: int) -> tuple[str, int]:
    """Family and record of row k of the constraints."""
    names = [name for name in constraining() if getattr(model, name).size]
    return names[model.constraints["family"][k]], int(model.constraints["record"][k])


def ends_of_row(model: mdl.Model, k: int) -> Iterator[End]:
    """What row k of the constraints acts on."""
    family, index = family_of(model, k)
    return ends_of(family, getattr(model, family)[index], lambda name: getattr(model, name))


def row_of(model: mdl.Model, family: str, index: int) -> int:
    """Row of the constraints of a record of a family."""
    return first_row(family, lambda name: getattr(model, name)) + index


def _held(name: str, found: Mapping[str, Array]) -> Iterator[tuple[int, list[tuple[str, int]]]]:
    """Rows of all records that are no penalties, and their ends."""
    ends, first = every()[name].ends, first_row(name, found.__getitem__)
    for k, row in enumerate(found[name]):
        if ends is not None and found["constraints"]["stiffness"][first + k] == 0.0:
            yield k, list(dict.fromkeys(ends(row, found.__getitem__)))


def _entries(found: Mapping[str, Array]) -> Iterator[tuple[int, int, list[tuple[str, int]], str, int]]:
    """Kind, index and ends of each row that explicit methods solve for, and its family and record."""
    for name, rows in sorted(asked("rows").items(), key=lambda own: own[1].kind):
        first = first_row(name, found.__getitem__) if rows.kind == CONSTRAINT else 0
        for k, ends in _held(name, found) if rows.of is None else rows.of(found[name], found.__getitem__):
            yield rows.kind, first + k, ends, name, k


def constraint_families(families: dict[str, Array], masses: Array, n_q: int) -> dict[str, Array]:
    """The families `rows`, in reverse Cuthill-McKee order, `row_sides` and `row_pairs`.

    Beams of which vectors are held are marked, and records with a field `nodes` that hold them.
    """
    entries = list(_entries(families))
    inverse = _Masses(families, masses, n_q)
    for _, _, ends, name, _ in entries:
        if name != constraining()[0] and any(what == "reduced_bodies" for what, _ in ends):
            raise InputError(f"rows of constraint of the family {name!r} act on a reduced body, which joints alone may")
    found = [(r, *inverse.side(*end)) for r, (_, _, ends, *_) in enumerate(entries) for end in ends]
    shared: dict[tuple[str, int], list[int]] = {}
    for i, (_, family, index, _) in enumerate(found):
        if family != "bodies" or families["bodies"]["motion"][index] != rigid.DRIVEN:
            shared.setdefault((family, index), []).append(i)
    pairs = [(a, b) for group in shared.values() for a in group for b in group if found[a][0] != found[b][0]]
    n = len(entries)
    order = reverse_cuthill_mckee(((found[a][0], found[b][0]) for a, b in pairs), n)
    place = np.empty(n, dtype=np.int64)
    place[order] = np.arange(n)
    row_of = [int(place[r]) for r, *_ in found]
    new = np.empty(len(found), dtype=np.int64)  # number of each side, which stand row by row
    new[np.argsort(row_of, kind="stable")] = np.arange(len(found))
    coupled = [(a, b) for a, b in pairs if row_of[b] < row_of[a]]
    coupled += [
        (a, b) for (family, _), group in shared.items() if family == "beams"
        for i, a in enumerate(group) for b in group[:i] if row_of[a] == row_of[b]
    ]  # fmt: skip
    rows, own, couplings = (
        mdl.zeros("rows", n),
        mdl.zeros("row_sides", len(found)),
        mdl.zeros("row_pairs", len(coupled)),
    )
    for r, entry in enumerate(order):
        rows["kind"][r], rows["index"][r] = entries[entry][:2]
    rows["first"], rows["last"] = (np.searchsorted(np.sort(row_of), np.arange(n), side) for side in ("left", "right"))
    for i, (_, family, index, at) in enumerate(found):
        k = new[i]
        own["row"][k], own["at"][k] = row_of[i], at
        for name in _FIELDS:
            own[_FIELDS[name]][k] = index if name == family else -1
        own["mass"][k] = inverse.of(family, index, at, at)
        if family == "beams":
            families["beams"]["held"][index] = 1
            holder, k = entries[found[i][0]][3:]
            if "nodes" in (families[holder].dtype.names or ()) and entries[found[i][0]][0] == CONSTRAINT:
                families[holder]["nodes"][k] = 1
    for i, (a, b) in enumerate(coupled):
        couplings["a"][i], couplings["b"][i] = new[a], new[b]
        couplings["mass"][i] = inverse.of(*found[a][1:3], found[a][3], found[b][3])
    return {"rows": rows, "row_sides": own, "row_pairs": couplings}


def note_masses(model: Any) -> None:
    """Take over masses of points, as blocks have them, into the sides of rows on points, and pairs of them."""
    sides, pairs, blocks, masses = model.row_sides, model.row_pairs, model.blocks, np.zeros(int(model.info.nv))
    masses[blocks["iv"] - int(model.info.nq)] = blocks["inertia"][:, 0]
    for rows, of in ((sides, sides), (pairs, sides[pairs["a"]])):
        own = of["point"] >= 0
        rows["mass"][own] = masses[of["at"][own]]


#: Families that a side belongs to, and its fields.
_FIELDS = {"bodies": "body", "points": "point", "beams": "beam", "reduced_bodies": "reduced"}


class _Masses:
    """Owners of vectors, and the inverses of their entries in M^-1."""

    def __init__(self, families: dict[str, Array], masses: Array, n_q: int) -> None:
        self.bodies, self.points, self.n_q = families["bodies"], families["points"], n_q
        self.reduced = families["reduced_bodies"]
        self.beams, self.masses = families["beams"], masses
        self.point = {int(row["iv"]): k for k, row in enumerate(self.points) if row["mass"] > 0.0}
        sizes = np.array(ancf_beams.NODE_VECTORS, dtype=np.int64)[self.beams["kind"]] * self.beams["nodes"]
        self.first, self.last = np.cumsum(sizes) - sizes, np.cumsum(sizes)  # rows of `Model.masses`
        self._columns: dict[tuple[int, int], Array] = {}

    def side(self, what: str, index: int) -> tuple[str, int, int]:
        """Family and number of what an end is on, and where it stands among the velocities."""
        if what == "bodies":
            return "bodies", index, int(self.bodies["iv"][index]) - self.n_q
        if what == "reduced_bodies":
            return what, index, int(self.reduced["iv"][index]) - self.n_q
        if index in self.point:
            return "points", self.point[index], index - self.n_q
        iv = self.beams["iv"]
        beam = int(np.flatnonzero((iv <= index) & (index < iv + 3 * (self.last - self.first)))[0])
        return "beams", beam, index - self.n_q

    def of(self, family: str, index: int, at: int, other: int) -> float:
        """Inverse of the entry of M^-1 of two vectors at velocities of one point mass or beam; 0 of others."""
        if family in ("bodies", "reduced_bodies"):
            return 0.0
        if family == "points":
            return float(self.points["mass"][index])
        first = int(self.beams["iv"][index]) - self.n_q
        value = self._column(index, (at - first) // 3)[(other - first) // 3]
        return float(np.divide(1.0, value)) if value != 0.0 else np.inf

    def _column(self, beam: int, vector: int) -> Array:
        """Column of M^-1 of a beam."""
        if (beam, vector) not in self._columns:
            L = self.masses[self.first[beam] : self.last[beam]]
            n, w = len(L), L.shape[1] - 1
            x = np.zeros(n)
            x[vector] = 1.0
            for i in range(vector + 1, n):
                k = min(i, w)
                x[i] -= L[i, 1 : k + 1] @ x[i - k : i][::-1]
            x *= L[:, 0]
            for i in range(n - 2, -1, -1):
                k = np.arange(1, min(n - 1 - i, w) + 1)
                x[i] -= L[i + k, k] @ x[i + k]
            self._columns[beam, vector] = x
        return self._columns[beam, vector]
