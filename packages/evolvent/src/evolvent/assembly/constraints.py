"""Rows of constraint of explicit methods (`kernels.constraint_rows`): what they act on, their order and couplings."""

from __future__ import annotations

import numpy as np

from evolvent import model as mdl
from evolvent.assembly.assembled import Array
from evolvent.assembly.order import reverse_cuthill_mckee
from evolvent.kernels import ancf_beams, constraint_rows, rigid
from evolvent.model.registry import asked


def constraint_families(families: dict[str, Array], masses: Array, n_q: int) -> dict[str, Array]:
    """The families `rows`, in reverse Cuthill-McKee order, `row_sides` and `row_pairs`; beams and joints are marked."""
    joints = families["joints"]
    entries = [
        (rows.kind, index, ends)
        for name, rows in sorted(asked("rows").items(), key=lambda own: own[1].kind)
        for index, ends in rows.of(families[name], families.__getitem__)
    ]
    inverse = _Masses(families, masses, n_q)
    found = [(r, *inverse.side(*end)) for r, (_, _, ends) in enumerate(entries) for end in ends]
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
            if entries[found[i][0]][0] == constraint_rows.JOINT:
                joints["nodes"][entries[found[i][0]][1]] = 1
    for i, (a, b) in enumerate(coupled):
        couplings["a"][i], couplings["b"][i] = new[a], new[b]
        couplings["mass"][i] = inverse.of(*found[a][1:3], found[a][3], found[b][3])
    return {"rows": rows, "row_sides": own, "row_pairs": couplings}


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
