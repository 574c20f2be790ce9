"""Parameters of the copies of a run: what of the model and of the plan each has of its own."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent.analysis import variation
from evolvent.analysis.start_motion import follows_masses
from evolvent.analysis.storage import storage_of
from evolvent.assembly import needs
from evolvent.assembly.variants import Change, Changes, Variants
from evolvent.model.memory import take
from evolvent.solvers.time.implicit.copies import Copies
from evolvent.solvers.time.implicit.plan import planned_again
from evolvent.solvers.time.implicit.run import ImplicitRun
from evolvent.solvers.time.implicit.setup import error_sizes, shares, stops_of
from evolvent_base.errors import InputError

Array = np.ndarray
#: Fields of the workspace that a plan has made.
_PLANNED = ("options", "weight", "error_weight", "shares", "stops")
#: Array of the model, field of its records ("" of an array of numbers), and row.
Place = tuple[str, str, int]


class _Key(NamedTuple):
    """What follows from a key whose values lie from `low` to `high`.

    Attributes
    ----------
    places : of the fields that hold the very number that is given, where these are all that it changes; else empty
    plans : bool, whether the plan of a run follows from it
    """

    low: float
    high: float
    places: tuple[Place, ...]
    plans: bool


class VariedRun:
    """A prepared run of a system, and what follows from keys of the system.

    What follows from a key is found by its least and largest value, and one between them: the numbers of the model that
    it changes, and whether the plan of the run is another one.

    Parameters
    ----------
    system, variants : System and the Variants by which it was assembled first
    run : ImplicitRun, prepared

    Attributes
    ----------
    changed : mapping, place -> Change, of all that was changed
    parts : list of mappings, parts of systems with changed keys, by which it is found what follows from these
    plans : bool, whether plans of copies follow from their keys
    """

    def __init__(self, system: Any, variants: Variants, run: ImplicitRun) -> None:
        self.system, self._variants, self.run = system, variants, run
        self._keys: dict[str, _Key] = {}
        self._lock = threading.Lock()
        self._scratch = run.model.copy()
        self.changed: dict[Place, Change] = {}
        self.parts: list[Mapping[str, Any]] = []
        # both are refused where a key is looked at
        self.plans = storage_of(system.sections) is not None or follows_masses(system.sections)

    def places(self, key: str, values: Sequence[Any]) -> tuple[Place, ...]:
        """Fields that hold the numbers of a key as they are given, and are all that follows; else empty.

        Raises
        ------
        InputError
            As of `changes`.
        """
        if not all(type(value) in (int, float) for value in values):
            self.plans = True
            return ()
        with self._lock:
            low, high = float(min(values)), float(max(values))
            known = self._keys.get(key)
            if known is None or low < known.low or high > known.high:
                probes = {low, high} if known is not None else {low, high, float(values[len(values) // 2])}
                self._keys[key] = known = self._joined(known, [self._probed(key, one) for one in sorted(probes)])
                self.plans |= known.plans
            return known.places

    def _joined(self, known: _Key | None, found: Sequence[_Key | None]) -> _Key:
        """What is known of a key by several values of it."""
        own = [one for one in (known, *found) if one is not None]
        if not own:  # all values are those of the system
            return _Key(np.inf, -np.inf, (), plans=False)
        places = own[0].places if all(one.places == own[0].places for one in own) else ()
        return _Key(
            min(one.low for one in own), max(one.high for one in own), places, plans=any(one.plans for one in own)
        )

    def _probed(self, key: str, value: float) -> _Key | None:
        """What follows from a value of a key; None from that of the system."""
        changes, parts = self.changes({key: value})
        if not changes.records and not changes.parameters:
            return None
        self.parts.append(self.run.assembly.parts | dict(parts))
        touched = self.written(changes, self._scratch)
        plans = self._changes_plan(self.plan(self._scratch))
        own = {("parameters", "", k): one for k, one in changes.parameters.items()}
        own |= {(one.family, one.field, one.row): one.value for one in changes.records}
        same = all(not np.ndim(one) and float(one) == value for one in own.values())
        nominal = {float(self.nominal(place)) for place in own} if same else set()
        of_part = self._is_of_part(key, value, parts)
        simple = same and len(nominal) == 1 and of_part and not plans and touched == {place[0] for place in own}
        return _Key(value, value, tuple(sorted(own)) if simple else (), plans)

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
                "copies of a system that spins about its centre of mass cannot have their own values; give `about` in "
                "`spin`, or use evolvent.simulate_many"
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
        return found, own.parts

    def written(self, changes: Changes, scratch: Any) -> frozenset[str]:
        """Write changes into a copy of the run's model; returns the arrays in which it may differ then."""
        take(scratch, self.run.model)
        for one in changes.records:
            self.changed.setdefault((one.family, one.field, one.row), one)
        for index in changes.parameters:
            self.changed.setdefault(("parameters", "", index), Change("parameters", index, "", 0.0))
        return self._variants.write(changes, scratch)

    def plan(self, scratch: Any) -> dict[str, Any]:
        """What the plan of a run of another model has; the scratch fields of its records change.

        Raises
        ------
        InputError
            As of `planned_again`.
        """
        needs.note_alike(self.run.model, scratch)
        assembly = dataclasses.replace(self.run.assembly, model=scratch, shared=None, touched=None)
        weight, options = planned_again(self.run.plan, assembly)
        stops, conserves = stops_of(assembly, self.run.plan.times), bool(options.midpoint)
        if stops.shape != self.run.work.stops.shape:
            raise InputError(
                "other values change the number of times at which loads change; use evolvent.simulate_many"
            )
        found = {
            "options": options, "weight": weight, "stops": stops,
            "error_weight": error_sizes(scratch, weight, conserves=conserves),
            "shares": shares(scratch, weight, conserves=conserves),
        }  # fmt: skip
        return {name: found[name] for name in _PLANNED}

    def _changes_plan(self, found: Mapping[str, Any]) -> bool:
        """Whether a plan is another one than that of the run."""
        work = self.run.work
        return any(np.asarray(found[name]).tobytes() != np.asarray(getattr(work, name)).tobytes() for name in _PLANNED)


class BatchParameters:
    """What copies of a varied run have of their own.

    Keys that stand in fields as they are given (`VariedRun.places`) are written into these alone. Of the others every
    copy has the arrays that its parts have written, and its plan where it follows from them.

    Attributes
    ----------
    values : list of mappings, key -> value, of each copy
    """

    def __init__(self, varied: VariedRun, copies: Copies) -> None:
        self._varied, self._copies = varied, copies
        self._scratch = varied.run.model.copy()
        self.values: list[dict[str, Any]] = [{} for _ in range(copies.count)]
        self._plain: dict[str, tuple[Place, ...]] = {}
        self._own: dict[tuple[str, str], Array] = {}
        self._fields: dict[Place, Array] = {}
        self._parts: dict[int, Mapping[str, Any]] = {}

    def expand(self, key: str, values: Any, which: Array) -> None:
        """Give copies their own value of a key: see `evolvent.analysis.batch.Batch.expand`."""
        given = _listed(values, which.size)
        planned, places = self._varied.plans, self._places(key, given, which)
        known = [k for k, own in enumerate(self.values) if key in own]
        if key not in self._plain and known:
            places = ()
        new = {k: self.values[k] | {key: value} for k, value in zip(which.tolist(), given, strict=True)}
        again = set[int]()
        if not places:  # also of those that had numbers before
            again |= {*known, *which.tolist()}
        if self._varied.plans and not planned:
            again |= {k for k, own in enumerate(self.values) if self._others(own)}
        plain = {**self._plain, key: places} if places else {one: of for one, of in self._plain.items() if one != key}
        found = {k: self._changes(k, self._others(new.get(k, self.values[k]), plain)) for k in sorted(again)}
        for place in () if places else self._plain.get(key, ()):
            del self._fields[place]
        self._plain = plain
        for k, own in new.items():
            self.values[k] = own
            self._parts.pop(k, None)
        for place in places:
            self._field(place)[which] = given
        for k, (changes, _) in found.items():
            self._take(k, changes)

    def assign(self, points: Sequence[Mapping[str, Any]]) -> dict[int, InputError]:
        """Give the first copies all of their own values; returns why some have none.

        Copies have nothing else of their own afterwards.
        """
        self._plain, self._own, self._fields, self._parts, refused = {}, {}, {}, {}, dict[int, InputError]()
        self.values[: len(points)] = [dict(point) for point in points]
        for key in dict.fromkeys(key for point in points for key in point):
            own = [k for k, point in enumerate(points) if key in point]
            given = [points[k][key] for k in own]
            try:
                places = self._varied.places(key, given)
            except InputError:  # of some of the points, which are refused below
                places, self._varied.plans = (), True
            for place in places:
                self._plain[key] = places
                self._field(place)[own] = given
        for k, point in enumerate(points):
            try:
                if others := self._others(point):
                    changes, self._parts[k] = self._varied.changes(others)
                    self._take(k, changes)
            except InputError as error:
                refused[k] = error
        return refused

    def parts(self, k: int) -> Mapping[str, Any]:
        """Parts of the system of a copy, and those that parts have made."""
        own = self.values[k]
        others = self._others(own)
        if others and k not in self._parts:
            self._parts[k] = self._varied.changes(others)[1]
        numbers = {key: value for key, value in own.items() if key in self._plain}
        every = self._varied.run.assembly.parts | (dict(self._parts[k]) if others else {})
        return self._varied.with_numbers(numbers, every)

    def _others(self, values: Mapping[str, Any], plain: Collection[str] | None = None) -> dict[str, Any]:
        """Values of keys that are not written into fields as they are given."""
        fields = self._plain if plain is None else plain
        return {key: value for key, value in values.items() if key not in fields}

    def _field(self, place: Place) -> Array:
        """Numbers of a field in all copies."""
        if place not in self._fields:
            self._fields[place] = np.full(self._copies.count, self._varied.nominal(place))
        return self._fields[place]

    def write(self, which: Array) -> None:
        """Write what is their own into the blocks of copies."""
        memory, blocks = self._copies.memory, self._copies.blocks
        for path, own in self._own.items():
            memory.values(blocks, *path)[which] = own[which]
        for (array, field, row), own in self._fields.items():
            found = memory.values(blocks, "model", array)
            (found[field] if field else found)[which, row] = own[which]

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

    def _take(self, k: int, changes: Changes) -> None:
        """Take over what a copy has of its own."""
        for name in self._varied.written(changes, self._scratch):
            self._set("model", name, k, getattr(self._scratch, name))
        if not self._varied.plans:
            return
        try:
            planned = self._varied.plan(self._scratch)
        except InputError as error:
            raise InputError(f"copy {k}: {error}") from None
        for name, value in planned.items():
            if ("work", name) in self._copies.memory.places:
                self._set("work", name, k, value)

    def _set(self, struct: str, name: str, k: int, value: Any) -> None:
        if (struct, name) not in self._own:
            run = self._varied.run
            nominal = np.asarray(getattr(run.model if struct == "model" else run.work, name))
            self._own[struct, name] = np.repeat(nominal[None], self._copies.count, axis=0)
        self._own[struct, name][k] = value


def _listed(values: Any, count: int) -> list[Any]:
    """A value for each of so many copies."""
    found = values.tolist() if isinstance(values, np.ndarray) else values
    is_list = isinstance(found, Sequence) and not isinstance(found, str)
    if not is_list or len(found) != count:
        size = f"{len(found)} entries" if is_list else "none"
        raise InputError(f"values has {size}; it must have one for each of the {count} copies")
    return list(found)
