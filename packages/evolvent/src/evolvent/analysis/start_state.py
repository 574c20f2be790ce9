"""Where a structure starts from the end of a run of it: the key `start` of a system."""

from __future__ import annotations

import base64
import dataclasses
import functools
import json
import os
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from evolvent import results
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.checks import check_constraints
from evolvent.assembly.constraints import family_of
from evolvent.kernels.blocks import ROTATION
from evolvent.model.layout import counted
from evolvent.model.registry import families
from evolvent.results.variables import root_dataset
from evolvent.solvers.common.closing import project_velocities
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.modal.positions import moving
from evolvent_base.errors import InputError, nearest

Array = np.ndarray
#: Key of a system, and attribute of a run with the state at its end.
KEY, ATTRIBUTE = "start", "end_state"
#: By how much velocities of a run may miss the constraints, beside the largest coordinate or rate: methods with
#: midpoints meet them in the middle of a step.
RATES = 1e-3
_FLOAT, _INT = "<f8", "<i8"


class _Place(NamedTuple):
    """Where coordinates of a part stand: kinds of its blocks, and indices in the state of coordinates and of rates."""

    kinds: Array
    q: Array
    v: Array


def end_of(solution: Solution) -> str:
    """The state at the end of a run as text, by parts; '' where none can start from it.

    Parts with a history beside their coordinates (`_with_history`) leave none, nor does a failed run.
    """
    assembly = solution.assembly
    if not solution.t.size or solution.status == "failed" or _with_history(assembly):
        return ""
    y, s = solution.y[-1], solution.s[-1]
    moving = {
        name: {"kinds": _text(place.kinds, _INT), "q": _text(y[place.q], _FLOAT), "v": _text(y[place.v], _FLOAT)}
        for name, place in _places(assembly)
    }
    switches = {name: s[first : first + count].tolist() for name, first, count in _switches(assembly)}
    rows = assembly.model.constraints
    ended = (rows["until"] <= solution.t[-1]) | ((rows["switch"] >= 0) & (s[rows["switch"]] != 0 if s.size else False))
    released = sorted({assembly.row_parts[k] for k in np.flatnonzero(ended).tolist()})
    return json.dumps({"moving": moving, "switches": switches, "released": released})


def started_from(assembly: Assembly, sections: Mapping[str, Any]) -> Assembly:
    """An assembly that starts from the end of the run that its system names; itself where it names none.

    Raises
    ------
    InputError
        For a file that is no run, or of another structure; the sentence names the part that differs.
    """
    path = sections.get(KEY)
    if not path:
        return assembly
    if not isinstance(path, (str, os.PathLike)):
        raise InputError(f"{KEY} is a {type(path).__name__}; it must be the file of a run, such as 'stowed.nc'")
    path = os.fspath(path)
    if "store" in sections:
        raise InputError(f"{KEY} and store are both given; a run starts from storage or from the end of another run")
    if history := _with_history(assembly):
        raise InputError(f"{KEY} is {path!r}, but {history}, which a run does not keep; leave {KEY} out")
    end = _read(path, *_stamp(path))
    y, s = assembly.y.copy(), assembly.s.copy()
    known = dict(end["moving"])
    for name, place in _places(assembly):
        if name not in known:
            raise InputError(f"{KEY} is {path!r}, a run without {name!r}; {nearest(name, dict(end['moving']))}")
        own = {key: _values(known[name][key], kind) for key, kind in (("kinds", _INT), ("q", _FLOAT), ("v", _FLOAT))}
        if not np.array_equal(own["kinds"], place.kinds):
            raise InputError(
                f"{KEY} is {path!r}, in which {name!r} has {own['v'].size} coordinates; here it has {place.v.size} "
                f"or others"
            )
        y[place.q], y[place.v] = own["q"], own["v"]
        known.pop(name)
    if known:
        raise InputError(
            f"{KEY} is {path!r}, a run with {next(iter(known))!r}, which does not move or is not there here"
        )
    for name, first, count in _switches(assembly):
        before = end["switches"].get(name)
        if before is not None and len(before) == count:
            s[first : first + count] = before
    model = assembly.model.copy()
    gone = np.array([name in end["released"] for name in assembly.row_parts], dtype=bool)
    for k in np.flatnonzero(gone).tolist():
        of, index = family_of(model, k)
        _release(model.constraints, k)
        _release(families()[of].records(model), index)
    for one in families().values():
        if {"switch", "latest"} <= set(one.record.names or ()):
            rows = one.records(model)
            for k in np.flatnonzero(rows["switch"] >= 0).tolist():
                if s[rows["switch"][k]] != 0:
                    _release(rows, k)
    found = dataclasses.replace(assembly, model=model, y=y, s=s, touched=None)
    check_constraints(found, RATES)
    return project_velocities(found, RATES)


def _release(rows: Array, k: int) -> None:
    """Release a record before the start, also where a solver begins again."""
    for field in ("until", "latest"):
        if field in (rows.dtype.names or ()):
            rows[field][k] = -np.inf


def _places(assembly: Assembly) -> Iterator[tuple[str, _Place]]:
    """Parts with coordinates, and where these stand in the state."""
    blocks = np.sort(assembly.model.blocks, order="iv")
    firsts, n_q = blocks["iv"], int(assembly.model.info.nq)
    for name, (_, _, where) in moving(assembly).items():
        own = blocks[np.searchsorted(firsts, where.start + n_q) : np.searchsorted(firsts, where.stop + n_q)]
        yield (
            name,
            _Place(
                own["kind"].astype(np.int64),
                _spread(own["iq"], np.where(own["kind"] == ROTATION, 4, own["count"])),
                _spread(own["iv"], own["count"]),
            ),
        )


def _spread(first: Array, counts: Array) -> Array:
    """Indices of runs of numbers: `counts` (n,) from `first` (n,) each on."""
    before = np.cumsum(counts) - counts
    return np.repeat(first - before, counts) + np.arange(int(counts.sum()))


def _switches(assembly: Assembly) -> Iterator[tuple[str, int, int]]:
    """Switches of records, of latches, stops and releases: name of each, index of the first and their number."""
    for name, family in families().items():
        records = family.records(assembly.model)
        if not records.size:
            continue
        found = [(records[one.field], counted(one.counts, records)) for one in family.switches if one.field]
        if {"event", "switch"} <= set(family.record.names or ()):
            found.append((records["switch"], (records["event"] != -1).astype(int)))
        heads = sorted((index, part) for part, (of, index) in assembly.names.items() if of == name)
        at = np.array([index for index, _ in heads])
        for k, (firsts, counts) in enumerate(found):
            for row in np.flatnonzero(counts):
                head = int(np.searchsorted(at, row, side="right")) - 1
                part = f"{heads[head][1]}+{row - at[head]}" if head >= 0 else f"+{row}"
                yield f"{name}.{k}:{part}", int(firsts[row]), int(counts[row])


def _with_history(assembly: Assembly) -> str:
    """What has states beside coordinates, rates and switches, such as friction or relaxation, in words; '' for none."""
    names = {place: name for name, place in assembly.names.items()}
    for name, family in families().items():
        records = family.records(assembly.model)
        rubs, has = family.friction.rubs, np.zeros(records.size, dtype=bool)
        if rubs is not None:
            has |= rubs(records)
        elif any(one.states for one in family.accounts):
            has |= np.any([counted(one.counts, records) > 0 for one in family.accounts if one.states], axis=0)
        has |= any(not one.field for one in family.switches)
        if np.any(has):
            part = next((names[name, k] for k in np.flatnonzero(has).tolist() if (name, k) in names), "")
            called = name.replace("_", " ")
            return f"{part!r} is one of the {called} with a history" if part else f"there are {called} with a history"
    return ""


def _text(values: Array, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def _values(text: Any, kind: str) -> Array:
    return np.frombuffer(base64.b64decode(text, validate=True), dtype=kind)


def _stamp(path: str) -> tuple[int, int]:
    """Time of change and size of a file, by which what was read of it is kept; zeros where it cannot be found."""
    try:
        found = os.stat(path)
    except OSError:
        return 0, 0
    return found.st_mtime_ns, found.st_size


@functools.lru_cache(maxsize=8)
def _read(path: str, changed: int, size: int) -> dict[str, Any]:
    """The state at the end of a saved run, checked."""
    run = root_dataset(results.open(path))
    text = run.attrs.get(ATTRIBUTE)
    if not isinstance(text, str) or not text:
        ended = run.attrs["status"]
        why = f"a run that ended as {ended}" if ended == "failed" else "which keeps no state of its end"
        raise InputError(f"{KEY} is {path!r}, {why}; none can start from it")
    try:
        found = json.loads(text)
        for own in found["moving"].values():
            sizes = [_values(own["kinds"], _INT).size]
            values = [_values(own[key], _FLOAT) for key in ("q", "v")]
            if not sizes[0] or not all(one.size and np.all(np.isfinite(one)) for one in values):
                raise ValueError
        if not all(isinstance(n, int) for own in found["switches"].values() for n in own):
            raise ValueError
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise InputError(f"{KEY} is {path!r}, whose attribute {ATTRIBUTE!r} cannot be read; run it again") from None
    return dict(found)
