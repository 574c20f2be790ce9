"""Parameters of the copies of a run: what of the model and of the plan each has of its own."""

from __future__ import annotations

import dataclasses
import functools
import math
import threading
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numba import config
from pydantic import ValidationError

from evolvent.analysis import traced, variation
from evolvent.analysis.start_motion import follows_masses
from evolvent.analysis.storage import storage_of
from evolvent.analysis.varied_numbers import Together, VariedNumbers, replaced
from evolvent.assembly import needs
from evolvent.assembly.variants import Change, Changes, Variants
from evolvent.model.memory import take
from evolvent.solvers.common.coordinates import with_positions
from evolvent.solvers.common.start import check_start, misfits
from evolvent.solvers.time.copies import TOGETHER, Copies
from evolvent.solvers.time.implicit.many_steps import misfit_many
from evolvent.solvers.time.run import MotionRun
from evolvent_base.columns import UndecidedError, stacked
from evolvent_base.errors import InputError

Array = np.ndarray
#: Bytes of a number.
WORD = 8
#: Array of the model, field of its records ("" of an array of numbers), and row.
Place = tuple[str, str, int]


class _Key(NamedTuple):
    """What follows from a key whose values lie from `low` to `high`.

    Attributes
    ----------
    accepted : set of numbers that the part has accepted
    places : of the fields that hold the very number that is given, where these are all that it changes, and no plan
        follows from them; else empty
    without : numbers of which that is not known
    """

    low: float
    high: float
    accepted: set[float]
    places: tuple[Place, ...] = ()
    without: frozenset[float] = frozenset()


class VariedRun:
    """A prepared run of a system, and what follows from keys of the system.

    A key stands in fields as it is given where its part writes a stand-in of all numbers between two values of it there
    (`traced.AnyNumber`), and either of these changes nothing else. The plan of the run follows from the fields that
    its numbers are found from (`traced.reads`).

    Parameters
    ----------
    system, variants : System and the Variants by which it was assembled first
    run : MotionRun, prepared

    Attributes
    ----------
    changed : mapping, place -> Change, of all that was changed
    parts : list of mappings, parts of systems with changed keys, by which it is found what follows from these
    joined : bool, whether there are constraints, which the start has to meet
    """

    def __init__(self, system: Any, variants: Variants, run: MotionRun) -> None:
        self.system, self._variants, self.run = system, variants, run
        self._keys: dict[str, _Key] = {}
        self.numbers = VariedNumbers(system, variants)
        self._lock = threading.Lock()
        self._scratch = run.model.copy()
        needs.note_alike(run.model, self._scratch)
        self.changed: dict[Place, Change] = {}
        self.parts: list[Mapping[str, Any]] = []
        self.joined = bool(run.model.constraints.size)

    @functools.cached_property
    def _reads(self) -> frozenset[traced.Read] | None:
        """Fields of the model from which the plan follows; None where that is not known."""
        return traced.reads(self.plan, self.run.model)

    def changes_plan(self, places: Iterable[Place], touched: Iterable[str]) -> bool:
        """Whether the plan of a run may follow from fields, and from arrays of which others are written."""
        if self._reads is None:
            return True
        fields, arrays = {place[:2] for place in places}, {array for array, _ in self._reads}
        others = {*touched} - {array for array, _ in fields}
        return bool(others & arrays or any((array, "") in self._reads for array, _ in fields) or fields & self._reads)

    def places(self, key: str, values: Sequence[Any]) -> tuple[Place, ...]:
        """Fields that hold the numbers of a key as they are given, and are all that follows; else empty.

        Raises
        ------
        InputError
            As of `changes`.
        """
        if not all(type(value) in (int, float) and math.isfinite(value) for value in values):
            return ()
        if self.run.assembly.directions is not None:  # the state at the start may follow
            return ()
        with self._lock:
            low, high = float(min(values)), float(max(values))
            known = self._keys.get(key)
            if known is None or low < known.low or high > known.high:
                if known is not None:
                    low, high = min(low, known.low), max(high, known.high)
                self._keys[key] = known = self._found(key, low, high)
        if not known.places or not known.without.isdisjoint(values):
            return ()
        name, _, field = key.removeprefix("parts.").partition(".")
        part = self.run.assembly.parts[name]
        assign, room = type(part).__pydantic_validator__.validate_assignment, part.model_copy()
        try:
            for value in {*values} - known.accepted:
                assign(room, field, value)
                known.accepted.add(value)
        except ValidationError:
            self.changes({key: value})  # which says why
            return ()
        return known.places

    def _found(self, key: str, low: float, high: float) -> _Key:
        """What is known of a key by its least and largest value, and by what the part does with all between."""
        found = [own for one in {low, high} if (own := self._probed(key, one)) is not None]
        if not found or any(one != found[0] for one in found) or not found[0]:
            return _Key(low, high, set())
        name, _, field = key.removeprefix("parts.").partition(".")
        between = traced.AnyNumber(low, high)
        part = self.run.assembly.parts[name].model_copy(update={field: between})
        try:
            held = self._variants.holding(name, part, between)
        except (Exception, traced.UndecidedError):  # noqa: BLE001  (whatever the part does with what is no number)
            return _Key(low, high, set())
        if held != found[0]:
            return _Key(low, high, set())
        return _Key(low, high, set(), tuple(sorted(found[0])), frozenset(between.without))

    def _probed(self, key: str, value: float) -> frozenset[Place] | None:
        """Fields in which a value of a key stands, empty where more follows; None of the value of the system."""
        changes, parts = self.changes({key: value})
        if not changes.records and not changes.parameters:
            return None
        self.parts.append(self.run.assembly.parts | dict(parts))
        touched = self.written(changes, self._scratch)
        own = {("parameters", "", k): one for k, one in changes.parameters.items()}
        own |= {(one.family, one.field, one.row): one.value for one in changes.records}
        same = all(not np.ndim(one) and float(one) == value for one in own.values())
        nominal = {float(self.nominal(place)) for place in own} if same else set()
        simple = same and len(nominal) == 1 and self._is_of_part(key, value, parts)
        if simple and touched == {place[0] for place in own} and not self.changes_plan(own, touched):
            return frozenset(own)
        return frozenset()

    def _is_of_part(self, key: str, value: float, parts: Mapping[str, Any]) -> bool:
        """Whether a part holds a value as it is given under a key of its own (`with_number`)."""
        name, _, field = key.removeprefix("parts.").partition(".")
        return name in parts and "." not in field and getattr(parts[name], field, None) == value

    def with_numbers(self, values: Mapping[str, float], parts: Mapping[str, Any]) -> dict[str, Any]:
        """Parts with numbers under keys that have `places`."""
        found = dict(parts)
        for key, value in values.items():
            name, _, field = key.removeprefix("parts.").partition(".")
            number = value if isinstance(getattr(found[name], field), int) else float(value)
            found[name] = found[name].model_copy(update={field: number})
        return found

    def nominal(self, place: Place) -> Any:
        """The number at a place where nothing has changed it."""
        array, field, row = place
        found = getattr(self.run.model, array)
        return (found[field] if field else found)[row]

    def changes(self, values: Mapping[str, Any]) -> tuple[Changes, Mapping[str, Any]]:
        """What a system with other values changes, and its parts.

        Raises
        ------
        InputError
            For keys and values that a case would refuse, and where more follows than records of the model.
        """
        if storage_of(self.system.sections) is not None:
            raise InputError("copies of a system with `store` cannot have their own values; use evolvent.simulate_many")
        if follows_masses(self.system.sections):
            raise InputError(
                "copies of a system that spins about its centre of mass, or starts from a run, cannot have their own "
                "values; give `about` in `spin`, or use evolvent.simulate_many"
            )
        own = variation.with_values(self.system, values)
        alike = own.settings == self.system.settings and own.sections == self.system.sections
        found = self._variants.changes(own._gravity, own.parts) if alike else None
        if found is None or found.gravity is not None:
            own.assemble()  # whose sentence says what is wrong with the values
            raise InputError(
                f"{', '.join(map(repr, values))} cannot be varied here to {', '.join(map(repr, values.values()))}: "
                f"more follows from it than records of the model; use evolvent.simulate_many"
            )
        if self.run.assembly.directions is not None:
            self._check_positions(own)
        return found, own.parts

    def _check_positions(self, own: Any) -> None:
        """Refuse a system whose positions at the start are others (`coordinates.with_positions`)."""
        assembly = self._variants.assembled(own._gravity, own.parts)
        start = with_positions(assembly, float(self.run.plan.times[0])).y if assembly is not None else None
        if start is None or start.tobytes() != self.run.assembly.y.tobytes():
            raise InputError("other values change the state at the start; use evolvent.simulate_many")

    def together(self, points: Sequence[Mapping[str, Any]]) -> Together | None:
        """What follows from points at once; None where it has to be found one by one."""
        if self.run.assembly.directions is not None or storage_of(self.system.sections) is not None:
            return None
        if follows_masses(self.system.sections):
            return None
        with self._lock:
            try:
                return self.numbers.together(points, lambda point: self.changes(point)[0])
            except InputError:  # of a point, which is then made by itself
                return None

    def inertias(self, found: Together) -> dict[Place, Array] | None:
        """Inertia of blocks that follows from points, (n, 3) each; None where it has to be found one by one."""
        try:
            count = len(next(iter(found.fields.values())))
            own = {k: stacked(one, count) for k, one in self._variants.inertias(found.changes).items()}
        except (Exception, UndecidedError):  # noqa: BLE001  (whatever a family does with what is no number)
            return None
        for k in (0, -1):
            take(self._scratch, self.run.model)
            for (array, field, row), values in found.fields.items():
                of = getattr(self._scratch, array)
                (of[field] if field else of)[row] = values[k]
            self._variants.derive(found.changes, self._scratch)
            expected = self.run.model.blocks["inertia"].copy()
            for row, values in own.items():
                expected[row] = values[k]
            if expected.tobytes() != np.ascontiguousarray(self._scratch.blocks["inertia"]).tobytes():
                return None
        return {("blocks", "inertia", row): values for row, values in own.items()}

    def derive(self, found: Together, model: Any, *, inertia: bool) -> frozenset[str]:
        """Write what follows from one of many points into a model that has its fields; returns the arrays of that."""
        return self._variants.derive(found.changes, model, inertia=inertia)

    def has_derived(self, found: Together) -> bool:
        """Whether more follows from points than the fields that they have."""
        return self._variants.has_derived(found.changes)

    def written(self, changes: Changes, scratch: Any) -> frozenset[str]:
        """Write changes into a copy of the run's model; returns the arrays in which it may differ then."""
        take(scratch, self.run.model)
        for one in changes.records:
            self.changed.setdefault((one.family, one.field, one.row), one)
        for index in changes.parameters:
            self.changed.setdefault(("parameters", "", index), Change("parameters", index, "", 0.0))
        return self._variants.write(changes, scratch)

    def check_start(self, scratch: Any) -> None:
        """Refuse a model whose constraints the start does not meet (`start.check_start`)."""
        if self.joined:
            check_start(self._with(scratch), float(self.run.plan.times[0]))

    def _with(self, scratch: Any) -> Any:
        """The assembly with another model."""
        return dataclasses.replace(self.run.assembly, model=scratch, shared=None, touched=None)

    def plan(self, scratch: Any) -> dict[str, Any]:
        """What the plan of a run of another model has.

        Raises
        ------
        InputError
            As of `again` of the plan.
        """
        found: dict[str, Any] = self.run.plan.again(self._with(scratch))
        return found


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
        self._rows: dict[Place, Array] = {}  # of keys that are looked at together, where others write none of their own
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
            self._meet(sorted({*which.tolist()} - {*found}))

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
        others = {k: own for k, point in enumerate(points) if (own := self._others(point))}
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
        for place, values in found.fields.items():
            self._field(place, self._rows)[copies] = values
            varied.changed.setdefault(place, Change(place[0], place[2], place[1], values[0]))
        touched = {array for array, _, _ in found.fields}
        if varied.has_derived(found):
            inertias = varied.inertias(found)
            for place, values in ({} if inertias is None else inertias).items():
                self._field(place, self._rows)[copies] = values
                touched.add(place[0])
            for k, model in self._models(copies):
                for name in varied.derive(found, model, inertia=inertias is None):
                    self._set("model", name, k, getattr(model, name))
                    touched.add(name)
        if varied.changes_plan(found.fields, touched):
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
        copies, size = self._copies, min(TOGETHER, which.size)
        blocks = copies.memory.room(size)
        views = [copies.memory.views(block)["model"] for block in blocks]
        for view in views:
            needs.note_alike(self._varied.run.model, view)
        for first in range(0, which.size, max(size, 1)):
            some = which[first : first + size]
            at = np.arange(some.size)
            copies.memory.fill(blocks, at)
            self._write_to(blocks, at, some)
            yield from zip(some.tolist(), views[: some.size], strict=True)

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
