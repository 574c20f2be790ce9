"""Runs: xarray.DataTrees with units on every variable, their case and the solver's account; NetCDF in and out."""

from __future__ import annotations

import datetime
import functools
import hashlib
import importlib.metadata
import json
import numbers
import os
import pathlib
import platform
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from evolvent import cases
from evolvent.results import limits as limits, netcdf, variables
from evolvent.results.fine_samples import MARK
from evolvent_base import __version__, safe_open
from evolvent_base.errors import HIDDEN, InputError
from evolvent_base.figures import Number, numbers_of
from evolvent_base.files import _named, write_file

#: How a run can end.
STATUSES = ("success", "stopped by event", "interrupted", "failed")
#: Those of runs that did what they were asked to.
WELL = STATUSES[:2]
#: Attributes of a run, as `attributes` gives them; those of `_JSON` hold a mapping.
_TEXTS = (
    "title",
    "system",
    "case",
    "version",
    "method",
    "status",
    "message",
    "statistics",
    "laws",
    "date",
    "made_with",
)
_NUMBERS = ("wall_time_s", "compile_time_s")
#: Levels of lists and mappings in attributes in JSON, at most.
_DEEPEST = 12
#: Attribute of the root and of every group: its numeric variables, name -> {dimension: size, null of time}, JSON.
_VARIABLES = "variables"
#: Attribute of a file with the `digest` of what evolvent wrote.
DIGEST = "digest"


#: Warning of a run whose digest is not that of its values.
_ALTERED = "the file was altered after evolvent wrote it; its numbers may not be those of its case"
#: Attribute ``holds`` of files of modes.
MODES = "modes"


def variable(dims: tuple[str, ...], values: Any, units: str, long_name: str, **attrs: Any) -> xr.Variable:
    """A variable with its units and name."""
    return xr.Variable(dims, np.asarray(values), {"units": units, "long_name": long_name, **attrs})


def unfinished(run: Any) -> str:
    """What to write on what is drawn of a run that did not end as it should; '' of one that did."""
    status = run.attrs["status"]
    if status in WELL:
        return ""
    message = run.attrs["message"].removeprefix(status).strip(" :")
    return f"{status.upper()}: {message}" if message else status.upper()


def regular_samples(run: Any) -> np.ndarray:
    """Numbers of the samples of a run that are not fine ones."""
    if MARK not in run.data_vars:
        return np.arange(run.sizes["time"])
    return np.flatnonzero(run[MARK].values == 0)


def regular(run: Any) -> Any:
    """A run at its regular samples alone: without those that were kept where the motion is fast."""
    if MARK not in run.data_vars:
        return run
    samples = regular_samples(run)
    if not isinstance(run, xr.DataTree):
        return variables.at_samples(run, samples).drop_vars(MARK)
    groups = {name: group.to_dataset(inherit=False) for name, group in run.children.items()}
    return xr.DataTree(
        variables.at_samples(run.to_dataset(), samples).drop_vars(MARK),
        children={name: xr.DataTree(variables.at_samples(group, samples)) for name, group in groups.items()},
    )


def attributes(
    *, system: str, case: str, method: str, solution: Any, laws: Mapping[str, str], date: datetime.datetime
) -> dict[str, Any]:
    """Where a run comes from and how it ended: the attributes of its results.

    Parameters
    ----------
    case : str, the whole case as YAML; '' where laws in Python keep it from being written
    solution : evolvent.solvers.Solution
    laws : mapping, name -> name of the user's law that replaced it (a case cannot hold those)
    date : datetime.datetime, end of the run
    """
    moment = date.isoformat(timespec="seconds")
    return netcdf.CONVENTIONS | {
        "title": f"evolvent run of {system}",
        "source": f"evolvent {__version__}",
        "history": f"{moment}: simulated by evolvent {__version__}",
        "system": system,
        "case": case,
        "version": __version__,
        "method": method,
        "status": solution.status,
        "message": solution.message,
        "statistics": json.dumps({k: v if np.isfinite(v) else None for k, v in solution.statistics.items()}),
        "wall_time_s": float(solution.wall_time),
        "compile_time_s": float(solution.compile_time),
        "laws": json.dumps(dict(laws)),
        "date": moment,
        "made_with": made_with(),
        "credibility": credibility(),
    }


def statistics_of(run: Any) -> dict[str, Any]:
    """The solver's account of a run, numbers by name; None for what is not finite."""
    found: dict[str, Any] = json.loads(run.attrs["statistics"])
    return found


def closing_numbers(run: Any) -> list[Number]:
    """The rows of a run's table that are common to all runs: its warning, steps, and the time that they took."""
    found = []
    if run.attrs.get("warning"):
        found.append(Number(label="warning", value=run.attrs["warning"]))
    statistics = statistics_of(run)
    steps = f"{int(statistics.get('steps') or 0):,} of {run.attrs['method']}"
    for key, what in (("rejected_steps", "rejected"), ("iterations", "iterations")):
        if statistics.get(key):
            steps += f", {int(statistics[key]):,} {what}"
    if statistics.get("step"):
        steps += f", {statistics['step']:.4g} s each"
    counts = [(statistics.get(key), "1", what) for key, what in (("steps", ""), ("rejected_steps", "rejected"))]
    counts += [(statistics.get("iterations"), "1", "iterations"), (statistics.get("step"), "s", "size of a step")]
    solve, compiling = run.attrs["wall_time_s"], run.attrs["compile_time_s"]
    text = f"{solve:.3g} s (compiling or loading compiled code: {compiling:.2g} s)"
    return found + numbers_of(
        [
            ("steps", steps, *(one for one in counts if one[0] is not None)),
            ("time of the solve", text, (solve, "s"), (compiling, "s", "compiling or loading compiled code")),
        ]
    )


@functools.cache
def made_with() -> str:
    """What results depend on besides the case: versions and the kind of machine, one sentence."""
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("numpy", "numba"))
    machine = f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}"
    return f"evolvent {__version__}, Python {platform.python_version()}, {versions}; {machine}"


@functools.cache
def credibility() -> str:
    """What is verified and validated, one sentence: that of `evolvent_papers.laboratory.credibility`, from its file."""
    return pathlib.Path(__file__).with_name("credibility.txt").read_text(encoding="utf-8").strip()


def open(path: str | os.PathLike[str]) -> Any:  # noqa: A001  (evolvent.open is the public name)
    """Read a run that was saved as NetCDF.

    Parameters
    ----------
    path : str or path, of the file

    Returns
    -------
    xarray.DataTree, with a group a part; of a run without groups, a Dataset

    Raises
    ------
    InputError
        If the file cannot be read, or holds something else.
    """
    dataset, found = _opened(path)
    held = dataset.attrs.pop(DIGEST, "")
    if held == found:
        return dataset
    if held:
        before = dataset.attrs.get("warning", "")
        dataset.attrs["warning"] = f"{before}; {_ALTERED}" if before else _ALTERED
    _check_shown(dataset, os.fspath(path))
    return dataset


def open_unaltered(path: str | os.PathLike[str]) -> Any:
    """As `open`, but only what is as evolvent wrote it.

    Raises
    ------
    InputError
        If the file cannot be read, holds something else, or was altered.
    """
    dataset, found = _opened(path)
    if dataset.attrs.pop(DIGEST, "") != found:
        raise InputError(f"cannot use {os.fspath(path)!r}: {_ALTERED}")
    return dataset


def _opened(path: str | os.PathLike[str]) -> tuple[Any, str]:
    """A run as its file holds it, and the digest of what was read."""
    name = _named(path, "read")
    with safe_open.binary(name) as file:
        if file.read(1):
            hint = "; `evolvent show` prints a case" if name.endswith((".yaml", ".yml")) else ""
            try:
                safe_open.check_hdf5(file, name)
                dataset = netcdf.read(file)
                found = digest(dataset)
                if "solver" in dataset.attrs:  # the name of this attribute before version 0.3
                    dataset.attrs.setdefault("method", dataset.attrs.pop("solver"))
            except InputError as error:
                raise InputError(f"{error}{hint}") from None
            except Exception:  # noqa: BLE001  (the back end raises many kinds of errors on a damaged file)
                raise InputError(f"cannot read {name!r}: it is not a NetCDF file, or it is damaged{hint}") from None
        else:
            raise InputError(f"cannot read {name!r}: it is empty")
    if dataset.attrs.get("holds") == MODES:
        raise InputError(f"cannot read {name!r}: it holds modes, not a run; xarray.open_dataset reads them")
    if not {"system", "case", "version", "status"} <= set(dataset.attrs):
        raise InputError(f"cannot read {name!r}: it is a NetCDF file, but not a run of evolvent")
    try:
        _check(dataset)
    except InputError as error:
        raise InputError(f"cannot read {name!r}: it is no whole run of evolvent: {error}") from None
    return dataset, found


def _check_shown(run: Any, name: str) -> None:
    """Refuse a run that was altered so that it cannot be shown: no check of single keys finds all that may be wrong."""
    shown = cases.presenter(run)
    try:
        for show in (shown.numbers, shown.figures, shown.motion):
            show(run)
    except InputError as error:
        raise InputError(f"cannot read {name!r}: {_ALTERED}: {error}") from None
    except Exception as error:  # (what follows from a value in a wrong place may be any error)
        why = f"{type(error).__name__}: {error}"
        raise InputError(f"cannot read {name!r}: it is no whole run of evolvent: it cannot be shown ({why})") from error


def _check(run: Any) -> None:
    """Refuse a run without what its system shows of it."""
    attrs = run.attrs
    for key in (*_TEXTS, *_NUMBERS):
        kind, what = (str, "a text") if key in _TEXTS else (numbers.Real, "a number")
        if key not in attrs:
            raise InputError(f"its attribute {key!r} is missing")
        if not isinstance(attrs[key], kind):
            raise InputError(f"its attribute {key!r} is {attrs[key]!s:.60}; it must be {what}")
    if attrs["status"] not in STATUSES:
        raise InputError(f"its attribute 'status' is {attrs['status']!r}; known: {', '.join(STATUSES)}")
    if not isinstance(attrs.get("warning", ""), str):
        raise InputError(f"its attribute 'warning' is {attrs['warning']!s:.60}; it must be a text")
    for key, of, what in (("statistics", (numbers.Real, type(None)), "numbers"), ("laws", (str,), "texts")):
        for value in _json(attrs, key, dict).values():
            if not isinstance(value, of):
                raise InputError(f"its attribute {key!r} holds {value!s:.60}; it must hold {what}")
    _check_events(attrs)
    for row in _json(attrs, "limits", list, missing="[]"):
        kinds: tuple[Any, ...] = (str, (numbers.Real, type(None)), str, bool)
        if not (
            isinstance(row, list) and len(row) == 4 and all(isinstance(*one) for one in zip(row, kinds, strict=True))
        ):
            raise InputError("its attribute 'limits' must hold rows of a text, a value, its unit and whether it is met")
    if attrs["case"]:  # there is none of a system composed in Python with laws in Python
        content = cases.parse_yaml(attrs["case"], "its case")
        lacking = getattr(run, "children", None) and cases.lacks_package(content)
        of = content.get("system", "structure") if lacking else cases.load(content).system
        if of != attrs["system"]:
            raise InputError(f"its attribute 'system' is {attrs['system']!r}, but its case is of {of!r}")
    _check_texts(run)
    _check_groups(run)
    _check_variables(run, "")
    for name, group in getattr(run, "children", {}).items():
        _check_variables(group, f"{name}.")
    times = run["time"].values if "time" in run.coords else np.zeros(1)
    if not np.all(np.diff(times) > 0.0):
        raise InputError("the variable 'time' does not rise from sample to sample")


def _check_events(attrs: Mapping[str, Any], part: str = "") -> None:
    """Refuse events that are no columns of one length: times, names of parts, and what happened."""
    columns = _json(attrs, "events", dict, part, "{}")
    kinds = {"time": numbers.Real, "part": str, "what": str} if columns else {}
    if set(columns) != set(kinds) or not all(
        isinstance(columns[name], list)
        and len(columns[name]) == len(columns["time"])
        and all(isinstance(one, kind) for one in columns[name])
        for name, kind in kinds.items()
    ):
        raise InputError(f"{_attribute('events', part)} must hold columns of one length: time, part and what")


def _json(attrs: Mapping[str, Any], key: str, kind: type, part: str = "", missing: str = "") -> Any:
    """An attribute of a run or of a part in JSON, a mapping or a list without deep levels."""
    text = attrs.get(key, missing)
    try:
        found = json.loads(text) if isinstance(text, str) else None
        if isinstance(found, kind) and _levels(found) <= _DEEPEST:
            return found
    except (ValueError, RecursionError):
        pass
    what = "mapping" if kind is dict else "list"
    raise InputError(f"{_attribute(key, part)} is {str(text)[:40]!r}; it must be a {what} in JSON")


def _attribute(key: str, part: str) -> str:
    return f"the attribute {key!r} of its part {part!r}" if part else f"its attribute {key!r}"


def _levels(value: Any) -> int:
    """Levels of nested lists and mappings."""
    levels, inside = 0, [value]
    while inside:
        entries = [one.values() if isinstance(one, dict) else one for one in inside if isinstance(one, (list, dict))]
        inside = [one for each in entries for one in each]
        levels += 1
    return levels


def _check_texts(run: Any) -> None:
    """Refuse hidden characters in names and attributes, and names of the root that would be read as those of parts."""
    parted = bool(getattr(run, "children", {}))
    for group, held in netcdf.datasets(run).items():
        texts = [group, *held.attrs.values()]
        for name, values in held.variables.items():
            if parted and not re.fullmatch(r"\w+", str(name)):
                raise InputError(f"a variable is called {str(name)[:60]!r}; it must be letters, digits and '_'")
            texts += [str(name), *values.attrs.values()]
        hidden = next((text for text in texts if isinstance(text, str) and HIDDEN.search(text)), None)
        if hidden is not None:
            raise InputError(f"it holds the text {hidden[:60]!r}, with characters that are not seen")


def variables_of(dataset: Any) -> str:
    """What a group's attribute 'variables' holds: see `_VARIABLES`."""
    held = dataset.to_dataset(inherit=False) if isinstance(dataset, xr.DataTree) else dataset
    numeric = {name: v for name, v in held.variables.items() if v.dtype.kind in "biuf"}
    return json.dumps(
        {n: {d: None if d == "time" else s for d, s in v.sizes.items()} for n, v in sorted(numeric.items())}
    )


def _listed(run: Any) -> Any:
    """A run whose lists of variables are those that it has now: a caller may have selected some of it."""
    if _VARIABLES not in run.attrs:
        return run
    found = run.copy()
    for group in (found, *getattr(found, "children", {}).values()):
        group.attrs = group.attrs | {_VARIABLES: variables_of(group)}
    if hasattr(found, "children"):
        found.attrs = found.attrs | {"parts": json.dumps(list(found.children))}
    return found


def _check_variables(group: Any, prefix: str) -> None:
    """Refuse a group without a variable that was written, or with one over other dimensions."""
    listed = _json(group.attrs, _VARIABLES, dict, prefix[:-1], "{}")
    for own, sizes in listed.items():
        if not isinstance(sizes, dict) or not all(size is None or isinstance(size, int) for size in sizes.values()):
            raise InputError(f"{_attribute(_VARIABLES, prefix[:-1])} is damaged at {own[:60]!r}")
        name = f"{prefix}{own}"
        if own not in group.variables:
            raise InputError(f"the variable {name!r} is missing")
        variable = group.variables[own]
        found = dict(variable.sizes)
        if list(found) != list(sizes):
            raise InputError(f"the variable {name!r} is over {tuple(found)}; it must be over {tuple(sizes)}")
        for dimension, size in sizes.items():
            if found[dimension] < (size is None) or size not in (None, found[dimension]):
                wanted = "at least one" if size is None else str(size)
                raise InputError(
                    f"the variable {name!r} has {found[dimension]} of {dimension!r}; it must have {wanted}"
                )
        if variable.dtype.kind not in "biuf":
            raise InputError(f"the variable {name!r} holds no numbers")
        if own in group.dims and not np.all(np.isfinite(variable.values)):
            raise InputError(f"the variable {name!r} is not finite")


def _check_groups(run: Any) -> None:
    """Refuse a run without the group of a part, and groups that do not say how they are shown."""
    groups = getattr(run, "children", {})
    listed = _json(run.attrs, "parts", list, missing="[]")
    missing = [name for name in listed if name not in list(groups)]
    if missing:
        raise InputError(f"the results of its part {missing[0]!s:.60} are missing")
    for name, group in groups.items():
        if name not in listed and listed:
            raise InputError(f"it has results of {name!r}, which is none of its parts")
        for key, kind, unless in (("drawn", dict, ""), ("plots", str, ""), ("given", str, "[]")):
            if not all(isinstance(one, kind) for one in _json(group.attrs, key, list, name, unless)):
                raise InputError(f"{_attribute(key, name)} is damaged")
        _check_events(group.attrs, name)
        words = _json(group.attrs, "one_sided", dict, name, "{}")
        if not all(isinstance(word, str) for word in words.values()):
            raise InputError(f"{_attribute('one_sided', name)} is damaged")
        if group.children:
            raise InputError(f"the part {name!r} has groups of its own")
        if not isinstance(group.attrs.get("kind"), str):
            raise InputError(f"the attribute 'kind' of its part {name!r} is missing")


def save(dataset: Any, path: str | os.PathLike[str]) -> None:
    """Write a run as NetCDF, whole or not at all; it takes as much memory again.

    Parameters
    ----------
    dataset : xarray.DataTree or Dataset
    path : str

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    write_file(path, image(dataset))


def image(dataset: Any) -> memoryview:
    """A run or data set as the bytes of a NetCDF file, with its digest."""
    stated = _listed(dataset)
    if stated is dataset:
        stated = dataset.copy()
    stated.attrs = netcdf.CONVENTIONS | stated.attrs
    stated.attrs = stated.attrs | {DIGEST: digest(stated)}
    return netcdf.image(stated)


def digest(run: Any) -> str:
    """SHA-256 of the names, dimensions, values and attributes of a run or data set, the same after it was read."""
    found = hashlib.sha256()
    for group, held in sorted(netcdf.datasets(run).items()):
        found.update(repr((group, _plain_attributes(held.attrs))).encode("utf-8", "replace"))
        for name, values in sorted(held.variables.items(), key=lambda item: str(item[0])):
            about = str(name), values.dims, values.shape, _plain_attributes(values.attrs)
            found.update(repr(about).encode("utf-8", "replace"))
            found.update(_plain_bytes(values.values))
    return found.hexdigest()


def _plain_attributes(attributes: Mapping[Any, Any]) -> list[tuple[str, list[Any]]]:
    """Attributes as they are read back, in order."""
    known = {str(name): value for name, value in attributes.items() if name not in (DIGEST, "_FillValue")}
    return [(name, np.ravel(np.asarray(value)).tolist()) for name, value in sorted(known.items())]


def _plain_bytes(values: np.ndarray) -> bytes:
    """Values in their widest type; all that are not a number are alike."""
    kind = values.dtype.kind
    if kind == "f":
        wide = values.astype("<f8")
        wide[np.isnan(wide)] = np.nan
        return wide.tobytes()
    if kind in "biuc":
        return values.astype("<c16" if kind == "c" else "<i8").tobytes()
    return json.dumps([str(value) for value in values.ravel()]).encode()
