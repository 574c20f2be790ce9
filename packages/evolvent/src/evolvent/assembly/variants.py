"""Variants: assemblies of systems that differ from one another in values of a few parts.

The first system is assembled whole, and what every part has written is kept. Of another one the parts that differ write
themselves again, behind what stood there before them. Where their rows then differ in fields (`Parts.changes`) and in
parameters alone, which nothing else of a model follows from, a copy of the first model takes them; all else is
assembled whole.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from evolvent.assembly import needs
from evolvent.assembly.alike import alike, different, equal_lists
from evolvent.assembly.assembled import Array, Assembly
from evolvent.assembly.blocks import inertias_of, is_of, note_inertia, owners
from evolvent.assembly.builder import Builder
from evolvent.assembly.constraints import note_masses
from evolvent.assembly.order import in_order
from evolvent.equations.implicit import add_weight
from evolvent.model import Model
from evolvent.model.family import Family
from evolvent.model.records import OWN_RECORDS
from evolvent.model.registry import constraining, families
from evolvent_base.columns import has_columns
from evolvent_base.errors import InputError

#: Lists of a builder that parts append to, beside its rows.
_LISTS = ("q", "v", "released", "values", "velocity_parameters", "poses", "row_parts", "at_end")
#: Mappings and sets that parts add to.
_TABLES = ("names", "specs", "body_points", "laws", "expressions", "relaxations", "breaks")


class _State(NamedTuple):
    """Sizes of what a builder holds."""

    rows: Mapping[str, int]
    lists: Mapping[str, int]
    tables: Mapping[str, Any]

    @classmethod
    def of(cls, builder: Builder) -> _State:
        return cls(
            {family: len(rows) for family, rows in builder.rows.items()},
            {name: len(getattr(builder, name)) for name in _LISTS},
            {name: getattr(builder, name).copy() for name in _TABLES},
        )


class _Written(NamedTuple):
    """What a part has written: the builder before it, and the rows and lists that it has added."""

    before: _State
    rows: Mapping[str, list[dict[str, Any]]]
    lists: Mapping[str, list[Any]]
    tables: Mapping[str, Any]
    others: bool  # whether it has changed what other parts had written


class Change(NamedTuple):
    """A field of a record that another value has."""

    family: str
    row: int
    field: str
    value: Any


class Changes(NamedTuple):
    """What a variant has that the first system has not: fields of records, parameters by their index, a gravity."""

    records: list[Change]
    parameters: dict[int, float]
    gravity: Array | None = None


class _Mutated(Exception):
    """A part changes a row that another part has written."""


class _Sealed(dict[str, Any]):
    """A row that may be read alone."""

    def __setitem__(self, key: str, value: Any) -> None:
        raise _Mutated

    def update(self, *others: Any, **fields: Any) -> None:
        raise _Mutated

    __delitem__ = pop = setdefault = update


@dataclasses.dataclass(frozen=True, eq=False)
class _Base:
    """The system that was assembled whole; `listed` are its parts as they were added."""

    gravity: Array
    listed: list[str]
    builder: Builder
    written: Mapping[str, _Written]
    assembly: Assembly

    @functools.cached_property
    def sealed(self) -> dict[str, list[_Sealed]]:
        """All rows that were written, by family."""
        return {family: [_Sealed(row) for row in rows] for family, rows in self.builder.rows.items()}

    @functools.cached_property
    def beside(self) -> dict[str, set[str]]:
        """Families of the records that parts have written which refer to a part, by its name."""
        found: dict[str, set[str]] = {}
        for name, part in self.assembly.parts.items():
            for other in part.references():
                found.setdefault(other, set()).update(self.written[name].rows if name in self.written else ("",))
        return found


class Variants:
    """Assemblies of systems that share most of their parts.

    Attributes
    ----------
    fast, whole : int, systems that were assembled from the first one, and whole
    """

    def __init__(self) -> None:
        self._base: _Base | None = None
        self.fast = self.whole = 0

    def __reduce__(self) -> tuple[type[Variants], tuple[()]]:
        """A copy, also in another process, assembles its first system whole."""
        return Variants, ()

    @property
    def first(self) -> Assembly:
        """The first system, which is not to be changed."""
        assert self._base is not None
        return self._base.assembly

    def assembled(self, gravity: Array, parts: Mapping[str, Any]) -> Assembly | None:
        """The assembly of parts by name, from that of the first system; None where they must be assembled whole."""
        base, found = self._base, self.changes(gravity, parts)
        changed = None if base is None or found is None else _changed(base, found, {**base.assembly.parts, **parts})
        self.fast += changed is not None
        return changed

    def changes(self, gravity: Array, parts: Mapping[str, Any]) -> Changes | None:
        """What differs from the first system in records and parameters; None where more does, or there is no first."""
        base = self._base
        if base is None or list(parts) != base.listed or not alike(gravity, base.gravity):
            return None
        found = Changes([], {}, None if np.array_equal(gravity, base.gravity) else gravity)
        for name, part in parts.items():
            old = base.assembly.parts[name]
            if part is old or part == old:
                continue
            if not _refer_alike(part, old) or not _add_changes(base, name, part, found.records, found.parameters):
                return None
        return found if _are_allowed(base, found) else None

    def columns(self, gravity: Array, parts: Mapping[str, Any]) -> Changes | None:
        """What differs where some parts hold columns of numbers: of all values; None where more does for one of them.

        What the parts do with columns may raise `evolvent_base.columns.UndecidedError`.
        """
        base = self._base
        if base is None or not np.array_equal(gravity, base.gravity):
            return None
        found = Changes([], {})
        for name, part in parts.items():
            old = base.assembly.parts[name]
            if not _refer_alike(part, old) or not _add_changes(base, name, part, found.records, found.parameters):
                return None
        return found if _are_allowed(base, found) else None

    def nominal(self, family: str, field: str, row: int) -> Any:
        """The number at a place of the first system: family, field ("" of an array of numbers) and row."""
        assert self._base is not None
        found = getattr(self._base.assembly.model, family)
        return (found[field] if field else found)[row]

    def holding(self, name: str, part: Any, value: object) -> frozenset[tuple[str, str, int]]:
        """Places at which a part writes an object that it holds: family, field and row, or "parameters", "", index.

        The object may stand for numbers (`evolvent.analysis.traced.AnyNumber`); what it raises is raised.
        """
        assert self._base is not None
        new, before = _written_again(self._base, name, part), self._base.written[name].before
        found = {
            (of, field, before.rows[of] + k)
            for of, rows in new.rows.items()
            for k, row in enumerate(rows)
            for field, held in row.items()
            if held is value
        }
        first = before.lists["values"]
        found |= {("parameters", "", first + k) for k, held in enumerate(new.lists["values"]) if held is value}
        return frozenset(found)

    def write(self, changes: Changes, model: Model) -> frozenset[str]:
        """Write changes into a model of the first system; returns the arrays in which it may differ then."""
        assert self._base is not None
        return _write(self._base, changes, model)

    def derive(self, changes: Changes, model: Model, *, inertia: bool = True) -> frozenset[str]:
        """Write what follows from records that have changed into a model of the first system; returns the arrays.

        Parameters
        ----------
        inertia : whether the inertia of its blocks follows as well, or is written already (`inertias`)
        """
        assert self._base is not None
        return _derive(self._base, changes, model, inertia=inertia)

    def inertias(self, changes: Changes) -> dict[int, Any]:
        """Inertia of blocks, (3,) by their number, that follows where changes are columns of numbers.

        What the families do with columns may raise `evolvent_base.columns.UndecidedError`.
        """
        assert self._base is not None
        model, found = self._base.assembly.model, dict[int, Any]()
        changed: dict[str, dict[int, dict[str, Any]]] = {}
        for one in changes.records:
            changed.setdefault(one.family, {}).setdefault(one.row, {})[one.field] = one.value
        for family, rows in changed.items():
            found |= inertias_of(family, rows, model)
        return found

    def has_derived(self, changes: Changes, *, inertia: bool = True) -> bool:
        """Whether other fields of a model must be derived from the changed records; `inertia` as of `derive`."""
        base = self._base
        assert base is not None
        if changes.gravity is not None or not _has_inertial(base, changes):
            return changes.gravity is not None
        return inertia or _has_points(base.assembly.model) or bool(np.any(base.gravity))

    def assemble(self, gravity: Array, parts: Mapping[str, Any]) -> Assembly:
        """Assemble parts by name whole.

        Raises
        ------
        InputError
            As of `evolvent.System.assemble`.
        """
        builder, written = Builder(gravity), {}
        for name in in_order(parts):
            before = _State.of(builder)
            builder.write(name, parts[name])
            written[name] = _written(builder, before)
        self.whole += 1
        found = builder.build()
        if self._base is None:
            model = found.model.copy()
            needs.load(model)  # finds what variants do not need either
            none: frozenset[str] = frozenset()
            kept = dataclasses.replace(
                found, model=model, y=found.y.copy(), s=found.s.copy(), shared={}, touched=none
            )  # fmt: skip
            self._base = _Base(gravity.copy(), list(parts), builder, written, kept)
            found.shared, found.touched = kept.shared, none
        return found


def _refer_alike(part: Any, old: Any) -> bool:
    """Whether a part refers to what another one does; a number holds no name."""
    pairs = [(value, old.__dict__.get(key)) for key, value in part.__dict__.items()]
    others = [a for a, b in pairs if a is not b and not (isinstance(a, int | float) and isinstance(b, int | float))]
    if type(part) is type(old) and not others:
        return True
    return list(part.references()) == list(old.references())


def _written(builder: Builder, before: _State, others: bool = False) -> _Written:
    return _Written(
        before,
        {
            family: [dict(row) for row in rows[before.rows[family] :]]
            for family, rows in builder.rows.items()
            if len(rows) > before.rows[family]
        },
        {name: getattr(builder, name)[size:] for name, size in before.lists.items()},
        {name: getattr(builder, name).copy() for name in _TABLES},
        others,
    )


def _written_again(base: _Base, name: str, part: Any) -> _Written:
    """What another part of that name would have written in its place."""
    before, old = base.written[name].before, base.builder
    builder = Builder(base.gravity)
    builder.rows = {family: list[Any](base.sealed[family][:size]) for family, size in before.rows.items()}
    for one, size in before.lists.items():
        setattr(builder, one, getattr(old, one)[:size])
    for one, table in before.tables.items():
        setattr(builder, one, table.copy())
    mutated = False
    try:
        builder.write(name, part)
    except _Mutated:
        mutated = True
    sizes = {one: before.lists[one] for one in ("q", "v")}
    moved = any(getattr(builder, one)[:size] != getattr(old, one)[:size] for one, size in sizes.items())
    return _written(builder, before, mutated or moved)


def _add_changes(base: _Base, name: str, part: Any, changes: list[Change], values: dict[int, float]) -> bool:
    """Add what a part changes in the records and parameters of the model; whether that is all."""
    old = base.written[name]
    family, _ = base.builder.names.get(name, ("", 0))
    own_fields = {one: _changes(one) for one in (family, *old.rows)}
    if any(fields is None for fields in own_fields.values()):
        return False
    if _is_read(family) and any(_changes(one) is None for one in base.beside.get(name, ())):
        return False
    try:
        new = _written_again(base, name, part)
    except InputError:  # which the whole assembly states
        return False
    if new.lists["at_end"] or old.lists["at_end"]:
        return False
    own = {one: table for one, table in new.tables.items() if one != "specs"}
    if new.others or set(new.rows) != set(old.rows) or own != {one: old.tables[one] for one in own}:
        return False
    for of, rows in new.rows.items():
        if len(rows) != len(old.rows[of]):
            return False
        for k, (row, before) in enumerate(zip(rows, old.rows[of], strict=True)):
            for field in different(row, before):
                if field not in (own_fields[of] or ()) or not alike(row.get(field), before.get(field)):
                    return False
                changes.append(Change(of, old.before.rows[of] + k, field, row[field]))
    for one, listed in new.lists.items():
        if one != "values" and not equal_lists(one, listed, old.lists[one]):
            return False
    mine, before_values = np.array(new.lists["values"]), np.array(old.lists["values"])
    if has_columns(mine) and mine.shape == before_values.shape:
        others = {k: one for k, one in enumerate(mine.tolist()) if has_columns(one) or one != before_values[k]}
        if not all(alike(one, float(before_values[k])) for k, one in others.items()):
            return False
        values.update({old.before.lists["values"] + k: one for k, one in others.items()})
        return True
    if mine.shape != before_values.shape:
        return False
    at = np.flatnonzero(mine != before_values)
    if not alike(mine[at], before_values[at]):
        return False
    values.update({old.before.lists["values"] + int(k): float(mine[k]) for k in at})
    return True


def _changes(name: str) -> frozenset[str] | None:
    """Fields of records that a variant may change; a zero, an infinity and a sign stay what they are."""
    family = families().get(name)
    if family is None:
        return frozenset() if name in OWN_RECORDS else None
    return None if family.parts.changes is None else frozenset(family.parts.changes.split())


def _is_read(name: str) -> bool:
    """Whether heat and contacts of other parts read what a part of a family has written."""
    own = families().get(name)
    return own is not None and not (own.parts.heat is None and own.parts.touches is None)


def _reads_inertia(family: Family) -> bool:
    """Whether parts or checks of a family read the inertia of others."""
    if family.parts.reads_inertia is None:
        return _reads_inertia(families()[family.of]) if family.of else True
    return family.parts.reads_inertia


def _has_inertia(change: Change, blocks: Array) -> bool:
    """Whether a record has inertia, also one that is driven, without coordinates."""
    if change.family not in owners():
        return False
    own = blocks[is_of(blocks, change.family) & (blocks["owner"] == change.row)]
    return not own.size or bool(np.any(own["inertia"] != 0.0))


def _has_inertial(base: _Base, changes: Changes) -> bool:
    """Whether a change is one of something with inertia."""
    return any(_has_inertia(change, base.assembly.model.blocks) for change in changes.records)


def _has_points(model: Model) -> bool:
    """Whether constraint rows act on points, and so hold their masses."""
    return bool(np.any(model.row_sides["point"] >= 0))


def _are_allowed(base: _Base, changes: Changes) -> bool:
    """Whether no other parts or tables of the model follow from changes."""
    old = base.assembly
    if _has_inertial(base, changes):
        if any(family.records(old.model).size and _reads_inertia(family) for family in families().values()):
            return False
        if any(family == "reels" for family, _ in old.names.values()):  # which have no records of their own
            return False
    if any(change.family in constraining() for change in changes.records):  # from which rows of constraint follow
        return False
    return not any(index in base.builder.velocity_parameters for index in changes.parameters)


def _write(base: _Base, changes: Changes, model: Model) -> frozenset[str]:
    """Write changes into a model; returns the arrays in which it differs then."""
    touched = {change.family for change in changes.records} | ({"parameters"} if changes.parameters else set())
    for change in changes.records:
        getattr(model, change.family)[change.field][change.row] = change.value
    for index, value in changes.parameters.items():
        model.parameters[index] = value
    return frozenset(touched) | _derive(base, changes, model)


def _derive(base: _Base, changes: Changes, model: Model, *, inertia: bool = True) -> frozenset[str]:
    """Write what follows from the records of a model that have changed; returns the arrays in which that stands."""
    touched = set[str]()
    if _has_inertial(base, changes):
        touched |= {"blocks"} if inertia else set()
        for name in {change.family for change in changes.records} if inertia else ():
            note_inertia(name, {change.row for change in changes.records if change.family == name}, model)
        if _has_points(model):
            touched |= {"row_sides", "row_pairs"}
            note_masses(model)
    gravity = base.gravity if changes.gravity is None else changes.gravity
    if changes.gravity is not None:
        touched.add("info")
        model.info.gravity[:] = gravity
    if (_has_inertial(base, changes) or changes.gravity is not None) and np.any(gravity):
        touched.add("G")
        model.G[:] = 0.0
        needs.load(model, add_weight)
        add_weight(gravity, int(model.info.nq), model, model.G)
    return frozenset(touched)


def _changed(base: _Base, changes: Changes, parts: dict[str, Any]) -> Assembly:
    """The base with changes."""
    old = base.assembly
    model = old.model.copy()
    needs.note_alike(old.model, model)
    touched = _write(base, changes, model)
    return dataclasses.replace(
        old, model=model, y=old.y.copy(), s=old.s.copy(), names=dict(old.names), laws=dict(old.laws), parts=parts,
        expressions=dict(old.expressions), touched=touched,
    )  # fmt: skip
