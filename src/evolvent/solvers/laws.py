"""Users' laws: they are tried before a run, and what they raise in one is put into a sentence."""

from __future__ import annotations

import contextlib
import traceback
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from evolvent import laws
from evolvent.builder import Assembly
from evolvent.errors import EvolventError, InputError
from evolvent.families import owner
from evolvent.flow.impulse import prepare
from evolvent.flow.needs import load_preparation
from evolvent.kernels import custom, drive, loads, springs

Array = np.ndarray
#: A time (s) and the states y and s at which a run was then.
Moment = tuple[float, Array, Array]


class _Use(NamedTuple):
    """A row of the model that calls a user's law."""

    family: str
    number: int
    row: Any


def try_laws(assembly: Assembly, start: float, end: float) -> None:
    """Evaluate every law of a model: drives at `start` and `end`, loads at the reel, all others at the start.

    Raises
    ------
    InputError
        If a law raises an exception or returns anything but finite numbers.
    """
    if not assembly.laws and not assembly.expressions:
        return
    y, s = assembly.y.copy(), assembly.s.copy()
    placed = False
    for use in _uses(assembly):
        if use.family in ("threads", "joints", "controllers"):
            for time in (start, end):
                _try(assembly, use, time, (time,))
            continue
        if not placed:
            load_preparation(assembly.model)
            prepare(start, y, s, assembly.model)
            placed = True
        for arguments in _arguments(assembly, use, (start, y, s), everywhere=False):
            _try(assembly, use, start, arguments)


@contextlib.contextmanager
def refusing_laws(assembly: Assembly) -> Iterator[None]:
    """Turn what a user's law raises inside, before a run, into an InputError."""
    try:
        yield
    except EvolventError:
        raise
    except Exception as error:
        raise InputError(law_failure(assembly, error)) from error


def law_failure(assembly: Assembly, error: Exception, moments: Iterable[Moment] = ()) -> str:
    """A sentence on what a user's law has raised in compiled code; any other exception is raised again.

    Parameters
    ----------
    error : Exception
    moments : the states at which the law may have been called last; they tell laws apart where the exception does not

    Notes
    -----
    An exception that a law raises by itself carries the law's name and file. An index out of bounds does not: its law
    is the one that raises it again at one of the moments.
    """
    states = list(moments)
    when = f"at t = {states[0][0]:.6g} s " if states else ""
    for use, arguments, time in _calls(assembly, states):
        law, described = _law(assembly, use)
        try:
            laws.try_law(law, *arguments, described=described, parameters=_parameters(assembly, use))
        except InputError as found:
            if isinstance(found.__cause__, type(error)):
                return f"at t = {time:.6g} s {owner(assembly, use.family, use.number)!r}: {found}"
    frames = [(frame.f_code.co_filename, frame.f_code.co_name) for frame, _ in traceback.walk_tb(error.__traceback__)]
    suspects = []
    for law in {id(law): law for law in assembly.laws.values()}.values():
        code = getattr(law, "py_func", law).__code__
        if (code.co_filename, code.co_name) in frames:
            return f"{when}{laws.describe_law(law)} of {_users(assembly, law)} raises {type(error).__name__}: {error}"
        suspects.append(law)
    if not suspects or not isinstance(error, IndexError):
        raise error
    named = " or ".join(f"{laws.describe_law(law)} of {_users(assembly, law)}" for law in suspects)
    return f"{when}{named} raises {type(error).__name__}: {error}"


def what_may_jump(assembly: Assembly) -> str:
    """A half sentence on the user's laws of a model as a possible reason for a failure; empty where there is none."""
    names = list(dict.fromkeys(owner(assembly, use.family, use.number) for use in _uses(assembly)))
    if not names:
        return ""
    return f", or a law of the user's jumps ({', '.join(repr(name) for name in names[:3])})"


def _users(assembly: Assembly, law: Any) -> str:
    """Names of the parts that call a law."""
    names = [owner(assembly, use.family, use.number) for use in _uses(assembly) if _law(assembly, use)[0] is law]
    names = list(dict.fromkeys(names))
    return " and ".join(repr(name) for name in names[:3]) + (" and others" if len(names) > 3 else "")


def _uses(assembly: Assembly) -> Iterator[_Use]:
    """Every row that calls a user's law, drives first."""
    model = assembly.model
    for family, rows in (("threads", model.threads), ("joints", model.flexible.joints)):
        for k, row in enumerate(rows):
            if row["law"] != 0 and row["drive"] == drive.LAW:
                yield _Use(family, k, row)
    for k, row in enumerate(model.controllers):
        if row["law"] != 0 and row["path"] == drive.LAW:
            yield _Use("controllers", k, row)
    for family, rows in (
        ("springs", model.springs),
        ("loads", model.loads),
        ("wheels", model.wheels),
        ("events", model.events),
    ):
        for k, row in enumerate(rows):
            if row["law"] != 0 and (family != "loads" or row["kind"] == loads.LAW):
                yield _Use(family, k, row)
    for k, row in enumerate(model.threads):
        if row["motor_law"] != 0:
            law = {"law": row["motor_law"], "first": row["motor_first"], "last": row["motor_last"]}
            yield _Use("spools", k, {**law, "spool_q": row["spool_q"], "spool_v": row["spool_v"]})
    for k, row in enumerate(model.flexible.custom_forces):
        yield _Use("custom_forces", k, row)


def _arguments(assembly: Assembly, use: _Use, moment: Moment, *, everywhere: bool) -> Iterator[tuple[Any, ...]]:
    """Arguments (but for the parameters) with which a row calls its law; of a load at every node, or at its reel."""
    model, (time, y, _) = assembly.model, moment
    if use.family in ("threads", "joints", "controllers"):
        yield (time,)
    elif use.family == "springs":
        a, b = (
            np.array(springs.marker_kinematics(y, model.markers, model.points, model.bodies, use.row[side]))
            for side in ("a", "b")
        )
        length = float(np.linalg.norm(b[:3] - a[:3]))
        rate = float((b - a)[:3] @ (b - a)[3:]) / length if length > 0.0 else 0.0
        yield length - float(use.row["length"]), rate, time
    elif use.family == "spools":
        yield float(y[use.row["spool_q"]]), float(y[use.row["spool_v"]]), time
    elif use.family == "wheels":
        yield float(y[use.row["iq"]]), float(y[use.row["iv"]]), time
    elif use.family == "loads":
        thread = model.threads[use.row["target"]]
        if everywhere:  # where the last evaluation of the forces has put them
            for node in model.nodes[int(thread["node"]) : int(thread["node"] + thread["n"])]:
                yield node["x"].copy(), node["v"].copy(), time
        yield thread["Q"][:3].copy(), thread["Q"][3:].copy(), time
    elif use.family == "custom_forces":
        yield time, *custom.states_of_places(model, y, use.number)
    else:
        yield time, y


def _calls(assembly: Assembly, moments: Iterable[Moment]) -> Iterator[tuple[_Use, tuple[Any, ...], float]]:
    """Calls of laws at some states: row, arguments and time."""
    for time, y, s in moments:
        if not np.all(np.isfinite(y)):
            continue
        placed = False
        for use in _uses(assembly):
            parameters = _parameters(assembly, use)
            if use.family not in ("threads", "joints", "controllers", "loads") and not placed:
                with contextlib.suppress(Exception):  # a drive that raises is found by itself
                    prepare(time, y.copy(), s.copy(), assembly.model)
                placed = True
            for arguments in _arguments(assembly, use, (time, y, s), everywhere=True):
                yield use, (*arguments, parameters, *_room(use)), time


def _law(assembly: Assembly, use: _Use) -> tuple[Any, str]:
    """The law that a row calls, and, of an expression, what messages call it."""
    if use.row["last"] > use.row["first"] and int(use.row["first"]) in assembly.expressions:
        return assembly.expressions[int(use.row["first"])]
    return assembly.laws[int(use.row["law"])], ""


def _parameters(assembly: Assembly, use: _Use) -> Array:
    """The parameters that a row gives its law, in an array of their own."""
    found: Array = assembly.model.parameters[int(use.row["first"]) : int(use.row["last"])].copy()
    return found


def _try(assembly: Assembly, use: _Use, time: float, arguments: tuple[Any, ...]) -> None:
    """Evaluate the law of one row."""
    parameters, room = _parameters(assembly, use), _room(use)
    try:
        law, described = _law(assembly, use)
        laws.try_law(law, *arguments, parameters, *room, described=described, parameters=parameters)
        if room and not np.all(np.isfinite(room[0])):
            raise InputError(f"{laws.describe_law(law)} writes {room[0].tolist()} to f; forces must be finite numbers")
    except InputError as error:
        raise InputError(f"{owner(assembly, use.family, use.number)!r} at t = {time:g} s: {error}") from error


def _room(use: _Use) -> tuple[Array, ...]:
    """Room for the forces that a law between places writes; nothing for other laws."""
    return (np.zeros(3 * int(use.row["places"])),) if use.family == "custom_forces" else ()
