"""Parameters of the copies of a batch: what of the model and of the plan each has of its own."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evolvent.analysis import runs, variation
from evolvent.analysis.storage import storage_of
from evolvent.assembly.variants import Changes, Variants
from evolvent.solvers.time.implicit.copies import Copies
from evolvent.solvers.time.implicit.run import ImplicitRun
from evolvent.solvers.time.implicit.setup import error_sizes, shares, stops_of
from evolvent_base.errors import InputError

Array = np.ndarray
#: Copies by which it is found what follows from a key: those with the least and the largest value, and others.
PROBES = 5
#: Fields of the workspace that a plan has made.
_PLANNED = ("options", "weight", "error_weight", "shares", "stops")


class BatchParameters:
    """What copies have of their own.

    Attributes
    ----------
    touched : list of Changes, by which copies differ from the batch's system
    """

    def __init__(
        self, system: Any, variants: Variants, run: ImplicitRun, copies: Copies, times: Array,
        settings: Mapping[str, Any],
    ) -> None:  # fmt: skip
        self._system, self._variants, self._run, self._copies = system, variants, run, copies
        self._times, self._settings = times, dict(settings)
        self._values: list[dict[str, Any]] = [{} for _ in range(copies.count)]
        self._own: dict[tuple[str, ...], Array] = {}
        self._fields: dict[tuple[str, str, int], Array] = {}
        self._in_fields: set[str] = set()
        self._plans = False
        self._scratch = run.model.copy()
        self.touched: list[Changes] = []

    def expand(self, key: str, values: Any, which: Array) -> None:
        """Give copies their own value of a key: see `evolvent.analysis.batch.Batch.expand`."""
        if storage_of(self._system.sections) is not None:
            raise InputError(f"a batch cannot vary {key!r} of a system with `store`; use evolvent.simulate_many")
        given = _listed(values, which.size)
        probes = _probes(given)
        found = {i: self._changes(int(which[i]), self._values[which[i]] | {key: given[i]}) for i in probes}
        self.touched += found.values()
        alone = {i: self._changes(int(which[i]), {key: given[i]}) for i in probes}
        if not self._plans and any(self._changes_plan(int(which[i]), alone[i]) for i in probes):
            self._plans = True
            for k in np.flatnonzero([bool(own) for own in self._values]).tolist():  # those of other keys
                self._take(k, self._changes(k, self._values[k]))
        fields = self._fields_of(key, given, alone, which)
        for k, value in zip(which.tolist(), given, strict=True):
            self._values[k] = self._values[k] | {key: value}
        if fields:
            self._in_fields.add(key)
            for place in fields:
                own = self._fields.setdefault(place, self._nominal(place))
                own[which] = given
            return
        if key in self._in_fields:
            raise InputError(f"{key!r} was given other kinds of values before; give a new batch those")
        for i, k in enumerate(which.tolist()):
            self._take(k, found[i] if i in found else self._changes(k, self._values[k]))

    def write(self, which: Array) -> None:
        """Write what is their own into the blocks of copies."""
        memory, blocks = self._copies.memory, self._copies.blocks
        for path, own in self._own.items():
            memory.values(blocks, *path)[which] = own[which]
        for (array, field, row), own in self._fields.items():
            found = memory.values(blocks, "model", array)
            (found[field] if field else found)[which, row] = own[which]

    # ------------------------------------------------------------------------------------------------ one copy

    def _changes(self, k: int, values: Mapping[str, Any]) -> Changes:
        """What a copy with other values has of its own."""
        try:
            own = variation.with_values(self._system, values)
            found = self._variants.changes(own._gravity, own.parts)
            if found is None:
                own.assemble()  # whose sentence says what is wrong with the values
        except InputError as error:
            raise InputError(f"copy {k}: {error}") from None
        if found is None:
            raise InputError(
                f"a batch cannot vary {', '.join(map(repr, values))} to "
                f"{', '.join(map(repr, values.values()))} (copy {k}): more follows from it than records of the model; "
                f"use evolvent.simulate_many"
            )
        return found

    def _written(self, changes: Changes) -> frozenset[str]:
        """The scratch model with changes; returns the arrays in which it may differ from the run's."""
        self._scratch.take(self._run.model)
        return self._variants.write(changes, self._scratch)

    def _take(self, k: int, changes: Changes) -> None:
        """Take over what a copy has of its own."""
        for name in self._written(changes):
            self._set(("model", name), k, getattr(self._scratch, name))
        if self._plans:
            for name, value in self._plan(k).items():
                if ("work", name) in self._copies.memory.places:
                    self._set(("work", name), k, value)

    def _set(self, path: tuple[str, ...], k: int, value: Any) -> None:
        if path not in self._own:
            struct = {"model": self._run.model, "work": self._run.work}[path[0]]
            nominal = np.asarray(getattr(struct, path[1]))
            self._own[path] = np.repeat(nominal[None], self._copies.count, axis=0)
        self._own[path][k] = value

    def _plan(self, k: int) -> dict[str, Any]:
        """What the plan of a run of the scratch model has."""
        model = self._scratch.copy()
        assembly = dataclasses.replace(self._run.assembly, model=model, shared=None, touched=None)
        try:
            plan, _ = runs.plan(assembly, self._times, own=True, **self._settings)
        except InputError as error:
            raise InputError(f"copy {k}: {error}") from None
        conserves, model, weight = bool(plan.options.midpoint), plan.assembly.model, plan.weight
        stops = stops_of(plan.assembly, self._times)
        if stops.shape != self._run.work.stops.shape:
            raise InputError(f"copy {k} has other times at which loads change than the first; use simulate_many")
        found = {
            "options": plan.options, "weight": weight, "stops": stops,
            "error_weight": error_sizes(model, weight, conserves=conserves),
            "shares": shares(model, weight, conserves=conserves),
        }  # fmt: skip
        return {name: found[name] for name in _PLANNED}

    def _changes_plan(self, k: int, changes: Changes) -> bool:
        """Whether the plan of a run with changes is another one."""
        self._written(changes)
        found, work = self._plan(k), self._run.work
        return any(np.asarray(found[name]).tobytes() != np.asarray(getattr(work, name)).tobytes() for name in _PLANNED)

    # ------------------------------------------------------------------------------------------------ many copies

    def _fields_of(
        self, key: str, given: Sequence[Any], alone: Mapping[int, Changes], which: Array
    ) -> list[tuple[str, str, int]]:
        """Fields that hold the very number that is given, and are all that it changes; none where others do."""
        if self._plans or not all(type(value) in (int, float) for value in given):
            return []
        found: set[tuple[str, str, int]] | None = None
        for i, changes in alone.items():
            own = {("parameters", "", k): value for k, value in changes.parameters.items()}
            own |= {(one.family, one.field, one.row): one.value for one in changes.records}
            if not own:  # the value of the system
                continue
            if self._written(changes) != {place[0] for place in own}:
                return []
            if any(np.ndim(value) or float(value) != float(given[i]) for value in own.values()):
                return []
            if found is not None and found != own.keys():
                return []
            found = set(own)
        taken = {path[1] for path in self._own if path[0] == "model"}
        if not found or any(place[0] in taken for place in found):
            return []
        nominal = {float(self._nominal(place)[0]) for place in found}
        return sorted(found) if len(nominal) == 1 else []

    def _nominal(self, place: tuple[str, str, int]) -> Array:
        """The value of a field in all copies where they have none of their own."""
        array, field, row = place
        found = getattr(self._run.model, array)
        return np.full(self._copies.count, float((found[field] if field else found)[row]))


def _listed(values: Any, count: int) -> list[Any]:
    """A value for each of so many copies."""
    found = values.tolist() if isinstance(values, np.ndarray) else values
    if isinstance(found, str) or not isinstance(found, Sequence) or len(found) != count:
        size = len(found) if isinstance(found, Sequence) and not isinstance(found, str) else "none"
        raise InputError(f"values has {size} entries; it must have one for each of the {count} copies")
    return list(found)


def _probes(given: Sequence[Any]) -> list[int]:
    """Places by which it is found what follows from values: the least and the largest number, and others."""
    spread = np.linspace(0, len(given) - 1, min(PROBES - 2, len(given))).astype(int).tolist()
    if all(isinstance(value, int | float) for value in given):
        spread += [int(np.argmin(given)), int(np.argmax(given))]
    return sorted(set(spread))
