"""Parameters of the copies of a run: what of the model and of the plan each has of its own."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numba import config

from evolvent.analysis.varied_numbers import Together
from evolvent.analysis.varied_run import Place, VariedRun
from evolvent.assembly import needs
from evolvent.assembly.variants import Change, Changes
from evolvent.model.memory import take
from evolvent.solvers.common.start import misfits
from evolvent.solvers.time.copies import Copies
from evolvent.solvers.time.implicit.many_steps import misfit_many
from evolvent_base.errors import InputError

Array = np.ndarray
#: Bytes of a number.
WORD = 8


class BatchParameters:
    """What copies of a varied run have of their own.

    Keys that stand in fields as they are given (`VariedRun.places`) are written into these alone. Of the others every
    copy has the arrays that its parts have written, and its plan where it follows from them.

    Attributes
    ----------
    values : list of mappings, key -> value, of each copy
    planned : set of int, copies that have a plan of their own
    """

    def __init__(self, varied: VariedRun, copies: Copies) -> None:
        self._varied, self._copies = varied, copies
        self._scratch = varied.run.model.copy()
        needs.note_alike(varied.run.model, self._scratch)
        self.values: list[dict[str, Any]] = [{} for _ in range(copies.count)]
        self._plain: dict[str, tuple[Place, ...]] = {}
        self._own: dict[tuple[str, str], Array] = {}
        self._fields: dict[Place, Array] = {}
        self._rows: dict[Place, Array] = {}  # of keys that are evaluated together, where others write none of their own
        self._parts: dict[int, Mapping[str, Any]] = {}
        self.planned = set[int]()

    def expand(self, key: str, values: Any, which: Array) -> None:
        """Give copies their own value of a key: see `evolvent.analysis.batch.Batch.expand`."""
        given = _listed(values, which.size)
        places = self._places(key, given, which)
        known = [k for k, own in enumerate(self.values) if key in own]
        if key not in self._plain and known:
            places = ()
        new = {k: self.values[k] | {key: value} for k, value in zip(which.tolist(), given, strict=True)}
        again = set[int]()
        if not places:  # also of those that had numbers before
            again |= {*known, *which.tolist()}
        again |= self.planned & {*which.tolist()}  # whose plan may follow from this one beside the others
        plain = {**self._plain, key: places} if places else {one: of for one, of in self._plain.items() if one != key}
        points = {k: self._others(new.get(k, self.values[k]), plain) for k in sorted(again)}
        at_once = self._varied.together([*points.values()])
        found = {} if at_once else {k: self._changes(k, point)[0] for k, point in points.items()}
        for place in () if places else self._plain.get(key, ()):
            del self._fields[place]
        self._plain = plain
        for k, own in new.items():
            self.values[k] = own
            self._parts.pop(k, None)
        for place in places:
            self._field(place)[which] = given
        follow = [k for k, changes in found.items() if self._take(k, changes)]
        if at_once:
            follow += self._take_together([*points], at_once)
        for k, error in self._plan(follow).items():
            raise InputError(f"copy {k}: {error}")
        if self._varied.joined:
            self._meet(sorted({*which.tolist(), *points} - {*found}))

    def assign(self, points: Sequence[Mapping[str, Any]]) -> dict[int, InputError]:
        """Give the first copies all of their own values; returns why some have none.

        Copies have nothing else of their own afterwards.
        """
        self._plain, self._own, self._fields, self._parts, refused = {}, {}, {}, {}, dict[int, InputError]()
        self._rows = {}
        self.planned.clear()
        self.values[: len(points)] = [dict(point) for point in points]
        for key in dict.fromkeys(key for point in points for key in point):
            own = [k for k, point in enumerate(points) if key in point]
            given = [points[k][key] for k in own]
            try:
                places = self._varied.places(key, given)
            except InputError:  # of some of the points, which are refused below
                places = ()
            for place in places:
                self._plain[key] = places
                self._field(place)[own] = given
        plain, follow = list[int](), list[int]()
        others = {k: left for k, point in enumerate(points) if (left := self._others(point))}
        at_once = self._varied.together([*others.values()])
        if at_once:
            follow += self._take_together([*others], at_once)
            plain += [*others] if self._varied.joined else []
        for k, point in enumerate(points):
            if at_once and k in others:
                continue
            try:
                if k in others:
                    changes, self._parts[k] = self._varied.changes(others[k])
                    if self._take(k, changes):
                        follow.append(k)
                elif point and self._varied.joined:
                    plain.append(k)
            except InputError as error:
                refused[k] = error
        refused |= self._plan(follow)
        for k in self._misfits(plain):
            try:
                self._meet([k])
            except InputError as error:
                refused[k] = error
        return refused

    def parts(self, k: int) -> Mapping[str, Any]:
        """Parts of the system of a copy, and those that parts have made."""
        own = self.values[k]
        others = self._others(own)
        if others and k not in self._parts:
            self._parts[k] = self._varied.numbers.parts(others) or self._varied.changes(others)[1]
        numbers = {key: value for key, value in own.items() if key in self._plain}
        every = self._varied.run.assembly.parts | (dict(self._parts[k]) if others else {})
        return self._varied.with_numbers(numbers, every)

    def _others(self, values: Mapping[str, Any], plain: Collection[str] | None = None) -> dict[str, Any]:
        """Values of keys that are not written into fields as they are given."""
        fields = self._plain if plain is None else plain
        return {key: value for key, value in values.items() if key not in fields}

    def _field(self, place: Place, of: dict[Place, Array] | None = None) -> Array:
        """Numbers of a field in all copies."""
        fields = self._fields if of is None else of
        if place not in fields:
            fields[place] = np.repeat(np.asarray(self._varied.nominal(place))[None], self._copies.count, axis=0)
        return fields[place]

    def write(self, which: Array) -> None:
        """Write what is their own into the blocks of copies."""
        self._write_to(self._copies.blocks, which, which)

    def _write_to(self, blocks: Array, at: Array, which: Array) -> None:
        """Write what is the own of copies into blocks: those numbered `at` (k,) get that of `which` (k,)."""
        memory = self._copies.memory
        for path, own in self._own.items():
            memory.values(blocks, *path)[at] = own[which]
        for (array, field, row), own in (*self._rows.items(), *self._fields.items()):
            found = memory.values(blocks, "model", array)
            (found[field] if field else found)[at, row] = own[which]

    def _places(self, key: str, given: Sequence[Any], which: Array) -> tuple[Place, ...]:
        """Where a key stands (`VariedRun.places`), with the number of the copy in what is refused."""
        try:
            return self._varied.places(key, given)
        except InputError as error:
            for k, value in zip(which.tolist(), given, strict=True):  # which of them is to blame
                self._changes(k, {key: value})
            raise error from None

    def _changes(self, k: int, values: Mapping[str, Any]) -> tuple[Changes, Mapping[str, Any]]:
        """What a copy with values has of its own, and its parts."""
        try:
            return self._varied.changes(values)
        except InputError as error:
            raise InputError(f"copy {k}: {error}") from None

    def _take(self, k: int, changes: Changes) -> bool:
        """Take over what a copy has of its own; returns whether its plan may follow from that (`_plan`)."""
        varied, scratch = self._varied, self._scratch
        touched = varied.written(changes, scratch)
        for name in touched:
            self._set("model", name, k, getattr(scratch, name))
        for (array, field, row), own in self._rows.items():
            one = getattr(scratch, array)
            own[k] = (one[field] if field else one)[row]
        places = [(one.family, one.field, one.row) for one in changes.records]
        places += [("parameters", "", index) for index in changes.parameters]
        try:
            self._write_numbers(k)
            varied.check_start(scratch)
        except InputError as error:
            raise InputError(f"copy {k}: {error}") from None
        if varied.changes_plan(places, touched):
            return True
        self.planned.discard(k)
        self._keep_plan(k)
        return False

    def _take_together(self, which: list[int], found: Together) -> list[int]:
        """Take over what copies have of their own; returns those whose plan may follow from that (`_plan`)."""
        varied, copies = self._varied, np.array(which)
        for (struct, name), own in self._own.items():
            if struct == "model":
                own[copies] = getattr(varied.run.model, name)
        for place, own in self._rows.items():
            own[copies] = varied.nominal(place)
        for place, values in found.numbers.items():
            self._field(place, self._rows)[copies] = values
            varied.changed.setdefault(place, Change(place[0], place[2], place[1], values[0]))
        touched = {array for array, _, _ in found.numbers}
        if varied.has_derived(found):
            inertias = varied.inertias(found)
            for place, values in ({} if inertias is None else inertias).items():
                self._field(place, self._rows)[copies] = values
                touched.add(place[0])
            derives = varied.has_derived(found, inertia=inertias is None)
            for k, model in self._models(copies) if derives else ():
                for name in varied.derive(found, model, inertia=inertias is None):
                    self._set("model", name, k, getattr(model, name))
                    touched.add(name)
        if varied.changes_plan(found.numbers, touched):
            return which
        self.planned -= {*which}
        for number in which:
            self._keep_plan(number)
        return []

    def _plan(self, which: Sequence[int]) -> dict[int, InputError]:
        """Find the plans of copies; returns why some have none."""
        refused = dict[int, InputError]()
        if not which:
            return refused
        kept = self._copies.keep_plan(np.array(which), self._write_to)
        self.planned |= {*which}
        for k in np.array(which)[kept].tolist():
            self._keep_plan(k)
        for k, model in self._models(np.array(which)[~kept]):
            try:
                found = self._varied.plan(model)
            except InputError as error:
                refused[k] = error
                continue
            for name, value in found.items():
                if ("work", name) in self._copies.memory.places:
                    self._set("work", name, k, value)
        return refused

    def _models(self, which: Array) -> Iterator[tuple[int, Any]]:
        """Copies and their models with what is their own, which are written to again after some."""
        for some, _, models in self._copies.models_apart(which, self._write_to):
            yield from zip(some.tolist(), models, strict=True)

    def _keep_plan(self, k: int) -> None:
        """Let a copy have the plan of the run, whatever it had before."""
        for name in self._varied.run.plan.made:
            if ("work", name) in self._own:
                self._set("work", name, k, getattr(self._varied.run.work, name))

    def _meet(self, which: Sequence[int]) -> None:
        """Refuse copies with numbers alone whose constraints the start does not meet."""
        for k in self._misfits(which):
            take(self._scratch, self._varied.run.model)
            self._write_numbers(k)
            try:
                self._varied.check_start(self._scratch)
            except InputError as error:
                raise InputError(f"copy {k}: {error}") from None

    def _misfits(self, which: Sequence[int]) -> Sequence[int]:
        """Copies with numbers alone whose constraints the start may not meet, among some."""
        varied, scratch, fields = self._varied, self._scratch, {**self._rows, **self._fields}
        if config.DISABLE_JIT or not which or any(own.itemsize != WORD for own in fields.values()):
            return which
        moves = np.array(scratch.moves(varied.run.model), dtype=np.int64).reshape(-1, 3)
        if np.any(moves[:, 2] % WORD):
            return which
        moves[:, 2] //= WORD
        places = np.concatenate([_addresses(scratch, place) for place in fields])
        columns = [own.reshape(len(own), -1).view(float) for own in fields.values()]
        numbers = np.ascontiguousarray(np.concatenate(columns, axis=1))
        chosen, codes = np.array(which), np.zeros(self._copies.count, dtype=np.int64)
        assembly, t = varied.run.assembly, float(varied.run.plan.times[0])
        needs.load(scratch, misfit_many)
        misfit_many(chosen, t, assembly.y.copy(), misfits(assembly), moves, places, numbers, scratch, codes)
        return chosen[codes[chosen] != 0].tolist()

    def _write_numbers(self, k: int) -> None:
        """Write the numbers of a copy that stand in fields as they are given into the scratch."""
        for (array, field, row), own in (*self._rows.items(), *self._fields.items()):
            found = getattr(self._scratch, array)
            (found[field] if field else found)[row] = own[k]

    def _set(self, struct: str, name: str, k: int, value: Any) -> None:
        if (struct, name) not in self._own:
            run = self._varied.run
            nominal = np.asarray(getattr(run.model if struct == "model" else run.work, name))
            self._own[struct, name] = np.repeat(nominal[None], self._copies.count, axis=0)
        self._own[struct, name][k] = value


def _addresses(model: Any, place: Place) -> Array:
    """Addresses of the numbers at a place of a model, (m,) int."""
    array, field, row = place
    found = getattr(model, array)
    own = np.asarray(found[field] if field else found)[row : row + 1]
    return own.ctypes.data + WORD * np.arange(own.size)


def _listed(values: Any, count: int) -> list[Any]:
    """A value for each of so many copies."""
    found = values.tolist() if isinstance(values, np.ndarray) else values
    is_list = isinstance(found, Sequence) and not isinstance(found, str)
    if not is_list or len(found) != count:
        size = f"{len(found)} entries" if is_list else "none"
        raise InputError(f"values has {size}; it must have one for each of the {count} copies")
    return list(found)
