"""Runs of a case with changed keys, and of a built structure with other values: what is kept of them by name."""

from __future__ import annotations

import dataclasses
import functools
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from evolvent import cases
from evolvent.analysis import simulation
from evolvent.analysis.many_runs import ManyRuns
from evolvent.analysis.margins.kept_margins import others_of
from evolvent.analysis.sensitivity import adjoint_cost
from evolvent.assembly.variants import Variants
from evolvent.design.evaluator import record
from evolvent.design.evaluator.task import Check, EvaluationTask, Point, Runs
from evolvent.results.kept import Kept
from evolvent.results.variables import names
from evolvent_base.errors import InputError

if TYPE_CHECKING:
    from evolvent.analysis.system import System

#: Threads beyond which Python's share of runs made one by one keeps others waiting; processes then serve better.
MOST_THREADS = 4
#: A run, what is kept of it, or why there is none.
Run = xr.Dataset | xr.DataTree | Kept | Exception


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class SystemRuns(Runs):
    """Variants of a built structure, whose points are as of `evolvent.System.with_values`.

    Attributes
    ----------
    system : System
    keep : names that its runs have
    settings : mapping, arguments of `evolvent.System.simulate`
    points : sequence of Point, all that will be asked for, where they are known
    """

    system: System
    keep: Sequence[str]
    settings: Mapping[str, Any]
    points: Sequence[Point] = ()

    @property
    def most_threads(self) -> int:
        """Any number: the structure stays in this process."""
        return sys.maxsize

    def outcomes(self, task: EvaluationTask, check: Check | None = None) -> list[record.Outcome]:
        """What is kept of variants."""
        found = _variants(self.system, self._many, task.points, self.keep, check, self.settings)
        return [record.outcome(k, run, self.keep) for k, run in zip(task.numbers, found, strict=True)]

    @functools.cached_property
    def _many(self) -> ManyRuns | None:
        """Runs of the variants, prepared once; None where each is made by itself."""
        found = _many(self.system, self.keep, self.settings)
        if found is not None:
            found.expect(self.points)
        return found


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class CaseRuns(Runs):
    """Runs of a case with changed keys.

    Attributes
    ----------
    content : mapping, the case
    keep : names of what is kept; empty for all that has no time
    base : mapping, keys of the case that the structure is built with, of which others are variants
    varied : tuple of str, keys in which points differ
    """

    content: Mapping[str, Any]
    keep: Sequence[str]
    base: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    varied: tuple[str, ...] = ()

    def __getstate__(self) -> dict[str, Any]:
        """What goes to other processes, which build the structure themselves."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    @functools.cached_property
    def _system(self) -> System | None:
        """The structure of which the runs are variants; None for other systems, and if all is kept."""
        if self.content.get("system") != "structure" or not self.keep:
            return None
        try:
            case = cases.load(self.content, self.base)
        except InputError:
            return None
        return cases.system(case.system).system(case)

    @functools.cached_property
    def _shared(self) -> Variants:
        return Variants()

    @property
    def most_threads(self) -> int:
        """Several where the runs are variants of one structure: they differ in keys of its parts alone."""
        if not self._are_of_parts(self.varied):
            return 1
        return MOST_THREADS if self._many is None else sys.maxsize

    def _are_of_parts(self, keys: Iterable[str]) -> bool:
        words, system = [key.split(".") for key in keys], self._system
        return system is not None and all(
            one[0] == "parts" and len(one) > 2 and one[1] in system.parts for one in words
        )

    def solver(self, point: Point) -> str:
        """Name of the compiled solver of a point; '' where it has none or cannot be run."""
        try:
            case = cases.load(self.content, point)
            return str(cases.system(case.system).plan(case).solver or "")
        except InputError:
            return ""

    def outcomes(self, task: EvaluationTask, check: Check | None = None) -> list[record.Outcome]:
        """What is kept of the runs at points, which are keys of the case and their values."""
        found = self._batch(task) or self._runs(task, check)
        return [record.outcome(k, run, self.keep) for k, run in zip(task.numbers, found, strict=True)]

    def adjoint_cost(self, point: Point, keys: Sequence[str]) -> float:
        """Estimated time of the derivatives of what needs a run by the adjoint, beside that of the run."""
        case = cases.load(self.content, point)
        return adjoint_cost(cases.system(case.system).system(case), others_of(self.keep), keys)

    def _runs(self, task: EvaluationTask, check: Check | None) -> Sequence[Run]:
        """Runs at points: variants of the built structure together, others one by one."""
        found: list[Run | None] = [None] * len(task.points)
        changes = [self._own_keys(point) for point in task.points]
        variants = [k for k, own in enumerate(changes) if not task.level and self._are_of_parts(own)]
        if variants:
            assert self._system is not None
            made = _variants(self._system, self._many, [changes[k] for k in variants], self.keep, check, {})
            for k, one in zip(variants, made, strict=True):
                found[k] = one if isinstance(one, Kept) and not one.missing else None  # whose case names the key
        return [
            self._run(point, task.level, check) if one is None else one
            for point, one in zip(task.points, found, strict=True)
        ]

    @functools.cached_property
    def _many(self) -> ManyRuns | None:
        """Runs of variants of the built structure, prepared once; None where each is made by itself."""
        return None if self._system is None else _many(self._system, self.keep, {})

    def _own_keys(self, point: Point) -> Point:
        """Keys in which a point differs from the case that the structure is built with."""
        return {key: value for key, value in point.items() if key not in self.base or value != self.base[key]}

    def derivatives(
        self, point: Point, keys: Sequence[str], level: float = 0.0, mode: str = "forward"
    ) -> np.ndarray:  # fmt: skip
        """Derivatives of what needs a run by keys of the case, those of the discrete solution: (names, keys)."""
        case = cases.load(self.content, point)
        system = cases.system(case.system).finer(level).system(case)
        found = system.sensitivity(
            others_of(self.keep), keys, fine=False, check=False, mode=mode, progress=lambda t: None
        )  # fmt: skip
        return np.stack([found.dataset.derivative.sel(key=key).values for key in keys], axis=1)

    def _batch(self, task: EvaluationTask) -> Sequence[Run]:
        """Runs that their system makes together; none where it does not, or where one fails."""
        run_batch = cases.system_of(self.content).run_batch
        if run_batch is None or task.level:
            return ()
        try:
            return [uninterrupted(one) for one in run_batch([cases.load(self.content, one) for one in task.points])]
        except Exception:  # noqa: BLE001  (the cases one by one then show which of them is to blame)
            return ()

    def _run(self, point: Point, level: float, check: Check | None) -> Run:
        """The run of a whole case, or what is kept of it, or why there is none."""
        try:
            case = cases.load(self.content, point)
            plan = cases.system(case.system).finer(level).plan(case, keep=self.keep, variants=self._shared)
            if plan.keep is None:
                return uninterrupted(plan.run(None))
            found = uninterrupted(plan.keep())
            if found.missing and plan.start is not None:  # for the sentence that names the nearest one
                known = (*names(plan.start(), over_time=False), *found.attrs["statistics"])
                found = dataclasses.replace(found, known=known)
            return found
        except Exception as error:  # noqa: BLE001  (whatever a case raises is the reason that is recorded)
            return error


def files_of(content: Mapping[str, Any], changes: Iterable[Point]) -> dict[str, str]:
    """Files that a case reads with any of several changes -> SHA-256 of what they hold (`cases.files_of`)."""
    found: dict[str, str] = {}
    for one in changes:
        found |= cases.files_of(cases.content_of(content, one))
    return found


def uninterrupted(run: Any) -> Any:
    """A run, or what is kept of it.

    Raises
    ------
    KeyboardInterrupt
        If the user ended it.
    """
    if run.attrs["status"] == "interrupted":
        raise KeyboardInterrupt
    return run


def _many(system: System, keep: Sequence[str], settings: Mapping[str, Any]) -> ManyRuns | None:
    """Runs of variants of a structure, prepared once; None where each is made by itself."""
    if [*others_of(keep)] != [*keep]:  # margins, which follow from the structure as well
        return None
    try:
        given = system._run_settings(settings)
    except InputError:
        return None
    return ManyRuns.of(system, keep, given)


def _variants(
    system: System, many: ManyRuns | None, points: Sequence[Point], keep: Sequence[str], check: Check | None,
    settings: Mapping[str, Any],
) -> list[Kept | Exception]:  # fmt: skip
    """What is kept of variants of a structure, or why there is nothing."""
    made: Iterable[Kept | None] = [None] * len(points) if many is None else many.kept(points, check)
    return [
        _variant(system, point, keep, check, settings) if one is None else one
        for point, one in zip(points, made, strict=True)
    ]


def _variant(
    system: System, changes: Point, keep: Sequence[str], check: Check | None, settings: Mapping[str, Any]
) -> Kept | Exception:
    """What is kept of a variant of a structure, or why there is nothing."""
    try:
        found: Kept = uninterrupted(simulation.kept_of_variant(system, changes, keep, check, settings))
    except Exception as error:  # noqa: BLE001  (whatever a run raises is the reason that is recorded)
        return error
    return found
