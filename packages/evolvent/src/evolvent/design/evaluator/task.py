"""A task: a batch of points, evaluated where the task runs."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent import cases
from evolvent.design.evaluator import record, sources
from evolvent_base.errors import EvolventError, InputError

#: Keys of a case and their values; of a study with stages, those of every stage by its name.
Point = Mapping[str, Any]
#: Called from time to time while a point is evaluated; raises KeyboardInterrupt where it is to end.
Check = Callable[[float], None]


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Runs:
    """What is evaluated; it goes to other processes as a pickle.

    Attributes
    ----------
    files : mapping, files that the runs read -> SHA-256 that they must have
    """

    files: Mapping[str, str] = dataclasses.field(default_factory=dict)

    @property
    def most_threads(self) -> int:
        """Threads of one process that may evaluate them, as variants of one structure; 1 for others."""
        return 1

    def solver(self, point: Point) -> str:
        """Name of the compiled solver of a point; '' where it has none or cannot be run."""
        return ""

    def outcomes(self, task: EvaluationTask, check: Check | None = None) -> list[record.Outcome]:
        """What is kept at the points of a task; a run that fails is an outcome with its reason."""
        raise NotImplementedError

    def derivatives(self, point: Point, keys: Sequence[str], level: float = 0.0) -> np.ndarray:
        """Derivatives of numbers that are kept by keys of a point, those of the discrete solution: (numbers, keys).

        Raises
        ------
        EvolventError
            Where there are none.
        """
        raise InputError("runs of this kind have none")


@dataclasses.dataclass(frozen=True, kw_only=True)
class EvaluationTask:
    """Points that are evaluated together.

    Attributes
    ----------
    runs : Runs
    numbers : sequence of int, of the points, rising
    points : sequence of Point
    level : float, of finer integration (`evolvent.analysis.accuracy`)
    owner : str, name of the evaluator; a process keeps the runs of one, with what they have built
    one_thread : bool, whether linear algebra takes one thread, whose number may change its last bits
    sources : str, hash that the sources must have where the task runs; '' where that is known
    """

    runs: Runs
    numbers: Sequence[int]
    points: Sequence[Point]
    level: float = 0.0
    owner: str = ""
    one_thread: bool = False
    sources: str = ""


class EvaluationResult(NamedTuple):
    """What a task gives back.

    Attributes
    ----------
    rows : record.Table, of its points
    seconds : float, that it took
    refused : str, why all others would lack what is to be kept; else empty
    notes : sequence of str, sentences on what was computed again
    """

    rows: record.CaseTable
    seconds: float
    refused: str = ""
    notes: Sequence[str] = ()


#: The runs of the evaluator that has had the last task of this process.
_OWN: dict[str, Runs] = {}


def compute(task: EvaluationTask, check: Check | None = None) -> EvaluationResult:
    """Evaluate the points of a task.

    Raises
    ------
    EvolventError
        If the sources here are not those of the evaluator's process, or a file was changed.
    KeyboardInterrupt
        If the user ended a run.
    """
    if task.sources and sources.sources() != task.sources:
        raise EvolventError("a worker has other sources of evolvent than this process; install the same everywhere")
    if task.owner not in _OWN:
        _OWN.clear()
        _OWN[task.owner] = task.runs
    began, refused = time.perf_counter(), ""
    with one_thread(task.one_thread):
        outcomes = _OWN[task.owner].outcomes(task, check)
    cases.check_files(task.runs.files)
    try:
        record.check_kept(outcomes)
    except InputError as error:
        refused = str(error)
    notes = [note for one in outcomes for note in one.notes]
    return EvaluationResult(record.table(outcomes), time.perf_counter() - began, refused, notes)


def one_thread(is_wanted: bool) -> contextlib.AbstractContextManager[Any]:
    """A context in which linear algebra takes one thread, if that is wanted."""
    if not is_wanted:
        return contextlib.nullcontext()
    from threadpoolctl import threadpool_limits  # an extra

    return threadpool_limits(limits=1)
