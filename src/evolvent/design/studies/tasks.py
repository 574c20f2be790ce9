"""A task: a batch of cases, computed where the task runs, and given back as bytes."""

from __future__ import annotations

import dataclasses
import json
import os
import time
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import xarray as xr

from evolvent import cases
from evolvent.assembly.variants import Variants
from evolvent.base.errors import EvolventError, InputError
from evolvent.design.studies import record, stages, store, variants
from evolvent.design.studies.study import Study
from evolvent.results.kept import Kept
from evolvent.results.variables import names


@dataclasses.dataclass(frozen=True, kw_only=True)
class Task:
    """Cases that are computed together.

    Attributes
    ----------
    content : mapping, the case that varies
    indices : tuple of int, of the cases
    overrides : tuple of mapping, for each case: stage -> what it changes; the one stage '' without stages
    start_key : str, key of the case that takes the run of the stage before; '' without stages
    folder : str, of the study
    keep : tuple of str
    sources : str, hash that the sources must have where the task runs
    base : mapping, what the first case of the study changes, as of `overrides`
    files : mapping, files that the cases read -> SHA-256 that they must have
    """

    content: Mapping[str, Any]
    indices: tuple[int, ...]
    overrides: tuple[Mapping[str, Mapping[str, Any]], ...]
    start_key: str
    folder: str
    keep: tuple[str, ...]
    sources: str
    base: Mapping[str, Any]
    files: Mapping[str, str]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Result:
    """What a task gives back.

    Attributes
    ----------
    content : bytes, of a `record.Table`
    seconds : float, that it took
    refused : str, why the study cannot go on; else empty
    notes : tuple of str, sentences on what was computed again
    """

    content: bytes
    seconds: float
    refused: str
    notes: tuple[str, ...] = ()


def task(study: Study, indices: Sequence[int], folder: str | os.PathLike[str] = ".") -> Task:
    """The task of some cases of a study, whose stages' runs are kept in its folder."""
    names = [stage.name for stage in study.stages] or [""]
    return Task(
        content=study.content,
        indices=tuple(indices),
        overrides=tuple({name: study.overrides(index, name or None) for name in names} for index in indices),
        start_key=study.start_key,
        folder=os.path.abspath(folder),
        keep=study.keep,
        sources=store.sources(),
        base=study.overrides(0),
        files=study.files,
    )


def compute(task: Task, workers: int = 1) -> Result:
    """Run the cases of a task; a case that fails is kept with its reason.

    Parameters
    ----------
    workers : int, threads of cases that are variants of one structure (`are_variants`); others run one by one

    Raises
    ------
    EvolventError
        If the sources here are not those that the study was started with.
    KeyboardInterrupt
        If the user ended a run.
    """
    from threadpoolctl import threadpool_limits

    if store.sources() != task.sources:
        raise EvolventError("a worker has other sources of evolvent than this process; install the same everywhere")
    began = time.perf_counter()
    refused = ""
    notes: list[str] = []
    with threadpool_limits(limits=1):  # the number of threads may change the last bits of linear algebra
        if task.start_key:
            outcomes, refused = _chains(task, notes)
        else:
            outcomes = _outcomes(task, workers)
            try:
                record.check_kept(outcomes)
            except InputError as error:
                refused = str(error)
    cases.check_files(task.files)
    content = record.encode(record.table(outcomes))
    return Result(content=content, seconds=time.perf_counter() - began, refused=refused, notes=tuple(notes))


def _chains(task: Task, notes: list[str]) -> tuple[list[record.Outcome], str]:
    """What is kept of every case, in order, whose stages follow one another; and why the study cannot go on."""
    outcomes, stages_of_each = [], []
    for index, overrides in zip(task.indices, task.overrides, strict=True):
        one, each, own = stages.chain(
            task.content, overrides, index=index, start_key=task.start_key, keep=task.keep, folder=task.folder
        )
        outcomes.append(one)
        stages_of_each.append(each)
        notes += own
    try:
        stages.check_kept(stages_of_each)
    except InputError as error:
        return outcomes, str(error)
    return outcomes, ""


def are_variants(study: Study) -> bool:
    """Whether the cases of a study are variants of one structure: they differ in keys of its parts alone."""
    return not study.stages and _structure(task(study, [0]), [axis.path for axis in study.axes]) is not None


#: The structure whose variants were run last, by what it was made from.
_BUILT: dict[str, Any] = {}


def _structure(task: Task, keys: Iterable[str]) -> Any:
    """The structure of the first case of a study, built once in a process, of which the cases are variants.

    None where there is none: of another system, of cases that keep all, and where not all of the keys in which they
    differ are keys of its parts.
    """
    if task.content.get("system") != "structure" or not task.keep:
        return None
    made_from = json.dumps([task.content, task.base, dict(task.files)], sort_keys=True)
    if made_from not in _BUILT:
        case = _loaded(task.content, task.base)
        _BUILT.clear()
        _BUILT[made_from] = None if isinstance(case, Exception) else cases.system(case.system).system(case)
    system = _BUILT[made_from]
    words = [key.split(".") for key in keys]
    if system is None or not all(one[0] == "parts" and len(one) > 2 and one[1] in system.parts for one in words):
        return None
    return system


def _variants(task: Task, workers: int) -> list[Any] | None:
    """What is kept of cases that are variants of one structure; None of others.

    What a case is refused for is found again as that of any other case, whose sentence names its key.
    """
    changes = [
        {key: value for key, value in own[""].items() if key not in task.base or value != task.base[key]}
        for own in task.overrides
    ]
    system = _structure(task, dict.fromkeys(key for one in changes for key in one))
    if system is None:
        return None
    found: list[Any] = variants.runs(system, changes, task.keep, workers=workers)
    shared = Variants()
    for k, one in enumerate(found):
        if isinstance(one, Exception) or one.missing:
            case = _loaded(task.content, task.overrides[k][""])
            found[k] = case if isinstance(case, Exception) else _run(case, task.keep, shared)
    return found


def _outcomes(task: Task, workers: int) -> list[record.Outcome]:
    """What is kept of every case, in order."""
    alike = _variants(task, workers)
    if alike is not None:
        return [record.outcome(k, one, task.keep) for k, one in zip(task.indices, alike, strict=True)]
    loaded = [_loaded(task.content, overrides[""]) for overrides in task.overrides]
    sound = [case for case in loaded if not isinstance(case, Exception)]
    if not sound:
        return [record.outcome(k, case, task.keep) for k, case in zip(task.indices, loaded, strict=True)]
    module = cases.system(sound[0].system)
    run_batch = module.run_batch
    runs = None
    if run_batch is not None and len(sound) == len(loaded) and len({case.system for case in sound}) == 1:
        try:
            runs = run_batch(loaded)
        except Exception:  # noqa: BLE001  (the cases one by one then show which of them is to blame)
            runs = None
    found, shared = [], Variants()
    for k, (index, case) in enumerate(zip(task.indices, loaded, strict=True)):
        run = case if isinstance(case, Exception) else runs[k] if runs is not None else _run(case, task.keep, shared)
        if not isinstance(run, Exception) and run.attrs["status"] == "interrupted":
            raise KeyboardInterrupt
        found.append(record.outcome(index, run, task.keep))
    return found


def outcome_of(
    content: Mapping[str, Any],
    overrides: Mapping[str, Any],
    keep: Sequence[str],
    variants: Variants,
    level: float = 0.0,
) -> record.Outcome:
    """What is kept of the run of one case, or the reason why there is none.

    Parameters
    ----------
    content : mapping, a case
    overrides : mapping, its keys that change
    keep : names of what is kept
    variants : what the runs of similar cases share
    level : of finer integration (`evolvent.analysis.accuracy`)

    Raises
    ------
    KeyboardInterrupt
        If the user ended the run.
    """
    case = _loaded(content, overrides)
    run = case if isinstance(case, Exception) else _run(case, keep, variants, level)
    if not isinstance(run, Exception) and run.attrs["status"] == "interrupted":
        raise KeyboardInterrupt
    return record.outcome(0, run, keep)


def _loaded(content: Mapping[str, Any], overrides: Mapping[str, Any]) -> Any:
    """A checked case, or why it is none."""
    try:
        return cases.load(content, overrides)
    except InputError as error:
        return error


def _run(
    case: Any, keep: Sequence[str], variants: Variants, level: float = 0.0
) -> xr.Dataset | xr.DataTree | Kept | Exception:
    """The run of a case, or what is kept of it, or why there is none."""
    try:
        plan = cases.system(case.system).finer(level).plan(case, keep=keep, variants=variants)
        if plan.keep is None:
            return plan.run(None)
        found = plan.keep()
        if found.missing and plan.start is not None:  # for the sentence that names the nearest one
            known = (*names(plan.start(), over_time=False), *found.attrs["statistics"])
            found = dataclasses.replace(found, known=known)
        return found
    except Exception as error:  # noqa: BLE001  (whatever a case raises is the reason that is recorded)
        return error
