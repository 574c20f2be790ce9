"""A prepared run of a system, and what follows from keys of the system."""

from __future__ import annotations

import dataclasses
import functools
import math
import threading
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from evolvent.analysis import traced, variation
from evolvent.analysis.start_motion import follows_masses
from evolvent.analysis.storage import storage_of
from evolvent.analysis.varied_numbers import Together, VariedNumbers
from evolvent.assembly import needs
from evolvent.assembly.variants import Change, Changes, Variants
from evolvent.model.memory import take
from evolvent.solvers.common.coordinates import with_positions
from evolvent.solvers.common.start import check_start
from evolvent.solvers.time.run import MotionRun
from evolvent_base.columns import UndecidedError, stacked
from evolvent_base.errors import InputError

Array = np.ndarray
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
        except (Exception, UndecidedError):  # noqa: BLE001  (whatever the part does with what is no number)
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
            count = len(next(iter(found.numbers.values())))
            own = {k: stacked(one, count) for k, one in self._variants.inertias(found.changes).items()}
        except (Exception, UndecidedError):  # noqa: BLE001  (whatever a family does with what is no number)
            return None
        for k in (0, -1):
            take(self._scratch, self.run.model)
            for (array, field, row), values in found.numbers.items():
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

    def has_derived(self, found: Together, *, inertia: bool = True) -> bool:
        """Whether other fields of the model must be derived from those of points; `inertia` as of `Variants.derive`."""
        return self._variants.has_derived(found.changes, inertia=inertia)

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
