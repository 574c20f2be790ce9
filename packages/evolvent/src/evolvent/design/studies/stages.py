"""Stages of a study: runs that follow one another in every case, each from the end of the one before."""

from __future__ import annotations

import dataclasses
import pathlib
import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import xarray as xr

from evolvent import cases, results
from evolvent.design.evaluator import record
from evolvent.design.evaluator.runs import CaseRuns, uninterrupted
from evolvent.design.evaluator.task import Check, EvaluationTask, Point, Runs
from evolvent.results import variables
from evolvent.results.kept import check_names as check_kept_names
from evolvent_base import files
from evolvent_base.errors import InputError, nearest
from evolvent_base.schema import shown

#: Folder of the stages' runs in a study's folder.
FOLDER = "stages"
_KEYS = ("name", "set")
#: Stands for the run of the stage before while a study is checked.
UNKNOWN = "before.nc"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Stage:
    """A stage: its name, and what it changes in every case."""

    name: str
    set: Mapping[str, Any]


def read(content: Mapping[str, Any]) -> tuple[Stage, ...]:
    """The stages of a study's content; none if it has none.

    Raises
    ------
    InputError
        One sentence that names the key, its value and what is allowed.
    """
    if "stages" not in content:
        return ()
    given = content["stages"]
    if not isinstance(given, list) or len(given) < 2 or not all(isinstance(one, dict) for one in given):
        raise InputError(
            f"stages is {shown(given)}; it must be a list of two or more, such as {{name: wind, set: {{phase: wind}}}}"
        )
    found: list[Stage] = []
    for k, one in enumerate(given):
        for key in one:
            if key not in _KEYS:
                raise InputError(f"unknown key 'stages.{k}.{key}'; {nearest(str(key), _KEYS)}")
        name, changes = one.get("name"), one.get("set") or {}
        if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z]\w*", name):
            raise InputError(f"stages.{k}.name is {shown(name)}; it must be a word, such as 'wind'")
        if name in [stage.name for stage in found]:
            raise InputError(f"stages.{k}.name is {name!r}, as of a stage before it; names must differ")
        if not isinstance(changes, dict):
            raise InputError(f"stages.{k}.set is {shown(changes)}; it must be a mapping of keys of the case to values")
        found.append(Stage(name=name, set=changes))
    return tuple(found)


def start_key(stages: Sequence[Stage], module: Any, system: str, given: Collection[str]) -> str:
    """Key of the case that takes the run before; '' without stages.

    Parameters
    ----------
    given : keys that the study sets in all stages

    Raises
    ------
    InputError
        If the system cannot start from a run, or the study sets that key where the stage before gives it.
    """
    if not stages:
        return ""
    key = module.start_key
    if not key:
        raise InputError(f"stages are given, but no run of {system!r} can start from another; leave them out")
    own = [f"stages.{k}.set" for k, stage in enumerate(stages) if k and key in stage.set]
    where = "set" if key in given else own[0] if own else ""
    if where:
        raise InputError(f"{where} gives {key!r}, but a stage starts from the end of the one before; leave it out")
    return str(key)


def check_keep(keep: Sequence[str], stages: Sequence[Stage]) -> None:
    """Refuse names of `keep` that do not say whose they are."""
    names = [stage.name for stage in stages]
    for wanted in keep if names else ():
        if wanted.partition(".")[0] not in names:
            raise InputError(f"keep holds {wanted!r}; it must begin with a stage's name, such as {names[-1]}.{wanted}")


def own_keep(keep: Sequence[str], name: str) -> list[str]:
    """What is kept of one stage."""
    return [wanted.partition(".")[2] for wanted in keep if wanted.partition(".")[0] == name]


def check_names(keep: Sequence[str], stages: Sequence[Stage], run: xr.DataTree) -> None:
    """Refuse names of `keep` of which a run of the system has the part or variable, but not what is asked of it.

    Parameters
    ----------
    run : the results at the start of a stage; others may have more parts
    """
    known = {*variables.parts(run), *map(str, variables.root_dataset(run).variables)}
    for stage in stages:
        try:
            check_kept_names([one for one in own_keep(keep, stage.name) if variables.owner(one) in known], run)
        except InputError as error:
            raise InputError(f"stage {stage.name!r}: {error}") from None


# ------------------------------------------------------------------------------------------------ running


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class StageRuns(Runs):
    """Runs of a case that follow one another; those in the folder are not run again.

    Attributes
    ----------
    content : mapping, the case
    start_key : str, key of the case that takes the run before
    keep : names of what is kept, each with the name of its stage
    folder : str, of the study
    """

    content: Mapping[str, Any]
    start_key: str
    keep: Sequence[str]
    folder: str

    def solver(self, point: Point) -> str:
        """Name of the compiled solver of the first stage of a point."""
        return CaseRuns(content=self.content, keep=()).solver(next(iter(point.values())))

    def outcomes(self, task: EvaluationTask, check: Check | None = None) -> list[record.Outcome]:
        """What is kept of the stages at points, which are the keys of the case in every stage by its name."""
        return [self._chain(number, point) for number, point in zip(task.numbers, task.points, strict=True)]

    def _chain(self, number: int, point: Point) -> record.Outcome:
        """What is kept of the stages of a case, up to one that fails.

        Raises
        ------
        KeyboardInterrupt
            If the user ended a run, which is not kept.
        """
        found: dict[str, Any] = {"variables": {}, "coordinates": {}, "missing": (), "known": ()}
        notes: list[str] = []
        before = status = reason = ""
        for name, changes in point.items():
            path = pathlib.Path(self.folder) / FOLDER / f"{number:06d}-{name}.nc"
            start = {self.start_key: before} if before else {}
            own = own_keep(self.keep, name)
            one = record.outcome(number, _run(self.content, {**changes, **start}, path, notes), own)
            before, status = str(path), one.status
            if own or not self.keep:
                found["variables"] |= {f"{name}_{key}": _named(of, name, key) for key, of in one.variables.items()}
            found["coordinates"] |= {
                f"{name}_{dim}": xr.Variable((f"{name}_{dim}",), of.values, of.attrs)
                for dim, of in one.coordinates.items()
            }
            for which in ("missing", "known"):
                found[which] += tuple(f"{name}.{wanted}" for wanted in getattr(one, which))
            if status == "failed":
                reason = f"stage {name!r}: {one.reason}"
                break
        return record.Outcome(index=number, status=status, reason=reason, notes=tuple(notes), **found)


def _run(
    content: Mapping[str, Any], overrides: Mapping[str, Any], path: pathlib.Path, notes: list[str]
) -> xr.Dataset | Exception:
    """The run of a stage, from its file if it is there; else computed and kept, a failed one too.

    A file that is damaged or was altered gives one more sentence of `notes`.
    """
    try:
        case = cases.load(content, overrides)
        if path.exists():
            try:
                found = results.open_unaltered(path)
            except InputError:
                notes.append(f"{str(path)!r} is damaged or was altered; the run of this stage is computed again")
            else:
                same_files = cases.files_of_run(found) == cases.files_of_case(case)
                if same_files and found.attrs["case"] == cases.to_yaml(case):
                    return found
        run: xr.Dataset = uninterrupted(cases.system(case.system).plan(case).run(None))
        files.make_folder(path.parent)
        results.save(run, path)
        return results.open(path)  # what is kept is the same whether it was computed now or before
    except Exception as error:  # noqa: BLE001  (whatever a case raises is the reason that is recorded)
        return error


def _named(values: xr.Variable, stage: str, name: str) -> xr.Variable:
    """A variable of a stage, its dimensions those of the stage."""
    attrs = {**values.attrs, "long_name": f"{stage}: {values.attrs.get('long_name', name)}"}
    return xr.Variable(tuple(f"{stage}_{dim}" for dim in values.dims), values.values, attrs)
