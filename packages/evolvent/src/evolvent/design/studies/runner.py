"""Conduct a study: evaluate its cases, go on after any end, and label the results."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import tempfile
from collections.abc import Mapping, Sequence
from typing import Any

import xarray as xr

from evolvent.design.evaluator.evaluator import Evaluator, Progress
from evolvent.design.evaluator.pools import Report
from evolvent.design.evaluator.runs import CaseRuns
from evolvent.design.evaluator.task import Point, Runs
from evolvent.design.studies import accessor, label, store  # noqa: F401  (accessor registers found.ev)
from evolvent.design.studies.stages import StageRuns
from evolvent.design.studies.study import Study, read as read_study
from evolvent_base.errors import InputError


def sweep(
    study: str | os.PathLike[str] | Mapping[str, Any] | Study,
    *,
    output: str | os.PathLike[str] | None = None,
    workers: int | None = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
    report: Report | None = None,
) -> xr.Dataset:
    """Run all cases of a study and return what is kept of them, labelled.

    Parameters
    ----------
    study : str, path, mapping or Study
        Name of a built-in study, a YAML file, or content.
    output : path, optional
        Folder of the study. Finished batches are kept there at once, so that the same call goes on after any end of
        the process; a study that is finished is only read. Without it nothing is left behind.
    workers : int or None
        Processes: 1 computes here, None takes all cores where the work is worth their start. A script that asks for
        several keeps its own work under ``if __name__ == "__main__":``, since they import it. Up to four are threads of
        this process where the cases are variants of one structure, which differ in keys of its parts.
    scheduler : str, optional
        Address of a Dask scheduler (``tcp://host:8786``) whose workers have the same evolvent.
    progress : called with the number of cases done and of all
    report : called with a sentence about what a user should know (a compilation, a worker that died)

    Returns
    -------
    xarray.Dataset
        Over the varied keys of a grid, or over ``case``, with ``status`` and ``reason`` of every case; what a failed
        case lacks is NaN. Its bits do not depend on the number of workers, on batches or on interruptions.

    Raises
    ------
    InputError
        If the study, the folder or the scheduler cannot be used; the message is one sentence.
    KeyboardInterrupt
        On Ctrl-C; what was finished is kept in `output`.

    Examples
    --------
    >>> import evolvent
    >>> study = {"case": "heliogyro", "over": {"spool.rate": [3.0, 3.5]}, "keep": ["body_rate.last"]}
    >>> evolvent.sweep(study).body_rate_last  # doctest: +SKIP
    """
    check_installed(scheduler)
    if workers is not None and (isinstance(workers, bool) or not isinstance(workers, int) or workers < 1):
        raise InputError(f"workers is {workers!r}; it must be a whole number from 1, or left out")
    if scheduler is not None and workers not in (None, 1):
        raise InputError("workers and scheduler are both given; a scheduler has its own workers")
    asked = study if isinstance(study, Study) else read_study(study)
    with contextlib.ExitStack() as stack:
        if output is None:
            output = stack.enter_context(tempfile.TemporaryDirectory(prefix="evolvent-study-"))
        log = stack.enter_context(store.opened(output, asked))
        say = report or (lambda sentence: None)
        if log.damaged:
            say(log.sentence())
        evaluator = stack.enter_context(
            Evaluator(
                runs_of(asked, output), log=log, workers=workers, scheduler=scheduler, batch=asked.batch,
                one_thread=True, progress=progress, report=say,
            )
        )  # fmt: skip
        evaluator.of(Points(asked), numbered=True)
        if not os.path.exists(os.path.join(output, store.RESULTS)):
            store.write(output, label.dataset(asked, evaluator.table()))
        return store.read(output)


class Points(Sequence[Point]):
    """What the cases of a study change, each found as it is asked for: keys of the case, of stages by their names."""

    def __init__(self, study: Study) -> None:
        self._study = study

    def __len__(self) -> int:
        return self._study.count

    def __getitem__(self, index: Any) -> Any:
        stages = [stage.name for stage in self._study.stages]
        return {name: self._study.overrides(index, name) for name in stages} or self._study.overrides(index)


def runs_of(study: Study, folder: str | os.PathLike[str]) -> Runs:
    """The runs of a study, whose stages' runs are kept in its folder."""
    shared: dict[str, Any] = {"content": study.content, "keep": study.keep, "files": study.files}
    if study.stages:
        return StageRuns(**shared, start_key=study.start_key, folder=os.path.abspath(folder))
    return CaseRuns(**shared, base=study.overrides(0), varied=tuple(axis.path for axis in study.axes))


def check_installed(scheduler: str | None = None) -> None:
    """Refuse a sweep without the packages that it needs.

    Raises
    ------
    InputError
        With the command that installs them.
    """
    wanted = ["threadpoolctl", "zarr"] if scheduler is None else ["dask", "distributed", "threadpoolctl", "zarr"]
    missing = [name for name in wanted if importlib.util.find_spec(name) is None]
    if missing:
        raise InputError(f"a sweep needs {', '.join(missing)}; install them with: pip install 'evolvent[sweep]'")
