"""Users' laws: they are tried before a run, and what they raise in one is put into a sentence."""

from __future__ import annotations

import contextlib
import dataclasses
import traceback
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import owner
from evolvent.base.errors import EvolventError, InputError
from evolvent.compiled import laws
from evolvent.flow.impulse import prepare
from evolvent.kernels import coordinate, coordinate_laws, drive, loads, springs
from evolvent.kernels.blocks import POSITION, THREAD

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
        if _is_of_time(use):
            for time in (start, end):
                _try(assembly, use, time, (time,))
            continue
        if not placed:
            needs.load(assembly.model, prepare)
            prepare(start, y, s, assembly.model)
            placed = True
        for arguments in _arguments(assembly, use, (start, y, s), everywhere=False):
            _try(assembly, use, start, arguments)
            if use.family == "custom_forces":
                _note_stated(assembly, use, arguments, end - start)


def largest_works(assembly: Assembly, time: float) -> float:
    """Sum of the forces of all laws at the start, `time`, each times the largest coordinate, J.

    A state is known to some 1e-16 of its coordinates, and so is the work of the laws.
    """
    y, s, found = assembly.y.copy(), assembly.s.copy(), 0.0
    assembly = dataclasses.replace(assembly, model=assembly.model.copy())  # the state of which is that at the start
    uses = [use for use in _uses(assembly) if use.family != "events" and not _is_of_time(use)]
    if not uses:
        return 0.0
    needs.load(assembly.model, prepare)
    prepare(time, y, s, assembly.model)
    for use in uses:
        for arguments in _arguments(assembly, use, (time, y, s), everywhere=False):
            room = _room(use)
            values = _law(assembly, use)[0](*arguments, _parameters(assembly, use), *room)
            found += float(np.abs(room[0] if room else values).max())
    return found * float(np.abs(y[: int(assembly.model.info.nq)]).max(initial=1.0))


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
    moments : the states at which the law may have been called last; they distinguish laws where the exception does not

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


def broken_law(assembly: Assembly, moments: Iterable[Moment]) -> str:
    """A half sentence on the first of the user's laws that does not return finite numbers at the moments; else ''."""
    try:
        for use, arguments, time in _calls(assembly, moments):
            law, described = _law(assembly, use)
            try:
                laws.try_law(
                    law, *arguments, described=described, parameters=_parameters(assembly, use), kind=_kind(use)
                )
            except InputError as found:
                return f"; at t = {time:.6g} s {owner(assembly, use.family, use.number)!r}: {found}"
    except (ArithmeticError, ValueError, IndexError):  # a state from which the arguments cannot be found
        pass
    return ""


#: Value of a law that no structure has: a force in N, a torque, an acceleration, an angle.
BEYOND = 1e9


def large_law(assembly: Assembly, moments: Iterable[Moment]) -> str:
    """A half sentence on the user's law with the largest value at the moments, if that is above `BEYOND`; else ''."""
    largest, found = BEYOND, ""
    try:
        for use, arguments, time in _calls(assembly, moments):
            law, described = _law(assembly, use)
            with contextlib.suppress(InputError):
                given = laws.try_law(law, *arguments, described=described, parameters=_parameters(assembly, use))
                size = max(map(abs, given))
                if size > largest and use.family != "events":
                    name = owner(assembly, use.family, use.number)
                    largest, found = size, f"; at t = {time:.6g} s the law of {name!r} has the value {size:.2g}"
    except (ArithmeticError, ValueError, IndexError):  # as in `broken_law`
        pass
    return found


def _kind(use: _Use) -> str:
    """Kind of the law that a row calls, of `laws.RETURNS`."""
    if _is_of_time(use):
        return "drive"
    return _KINDS[use.family]


#: Kinds of the laws of families, but for drives.
_KINDS = {
    "springs": "spring", "spools": "spring", "wheels": "spring", "loads": "force", "beam_loads": "force",
    "fields": "force", "events": "event", "custom_forces": "element", "motors": "motor",
}  # fmt: skip


def what_may_jump(assembly: Assembly) -> str:
    """A half sentence on the user's laws of a model as a possible reason for a failure; empty where there is none."""
    names = list(dict.fromkeys(owner(assembly, use.family, use.number) for use in _uses(assembly)))
    if not names:
        return ""
    return f", or a law of the user's jumps ({', '.join(repr(name) for name in names[:3])})"


def states_energy(assembly: Assembly) -> str:
    """A half sentence on laws between points, whose energy may not be that of their forces; '' where there is none."""
    stated = np.flatnonzero(assembly.model.custom_forces["stated"])
    names = [repr(owner(assembly, "custom_forces", int(k))) for k in stated[:3]]
    return f", or the energy that {' or '.join(names)} states is not that of its forces" if names else ""


def _note_stated(assembly: Assembly, use: _Use, arguments: tuple[Any, ...], span: float) -> None:
    """Note whether a law between points gives an energy or a power: one without either does work, as a load.

    Parameters
    ----------
    arguments : time, positions and velocities at the start
    span : float, s, of the run

    Notes
    -----
    A law whose energy is zero at the start by chance gives it a little later, or where its points stand a little aside.
    """
    law, parameters, (t, x, v) = _law(assembly, use)[0], _parameters(assembly, use), arguments
    apart = max(float(np.ptp(x.reshape(-1, 3), axis=0).max()), 1e-3)
    aside = 1e-3 * apart * np.random.default_rng(0).standard_normal(x.size)
    for time, place in ((t, x), (t + 1e-3 * span, x + 1e-3 * span * v), (t, x + aside)):
        with contextlib.suppress(Exception):  # outside the range of the law
            energy, power = law(time, place, v, parameters, *_room(use))
            if energy != 0.0 or power != 0.0:
                assembly.model.custom_forces["stated"][use.number] = 1.0


def _users(assembly: Assembly, law: Any) -> str:
    """Names of the parts that call a law."""
    names = [owner(assembly, use.family, use.number) for use in _uses(assembly) if _law(assembly, use)[0] is law]
    names = list(dict.fromkeys(names))
    return " and ".join(repr(name) for name in names[:3]) + (" and others" if len(names) > 3 else "")


def _uses(assembly: Assembly) -> Iterator[_Use]:
    """Every row that calls a user's law, drives first."""
    model = assembly.model
    for family, rows in (("threads", model.threads), ("joints", model.joints)):
        for k, row in enumerate(rows):
            if row["law"] != 0 and row["drive"] == drive.LAW:
                yield _Use(family, k, row)
    for k, row in enumerate(model.bodies):
        if row["path_law"] != 0:
            yield _Use("bodies", k, row)
    for k, row in enumerate(model.controllers):
        if row["law"] != 0 and row["path"] == drive.LAW:
            yield _Use("controllers", k, row)
    for family, rows in (
        ("springs", model.springs),
        ("loads", model.loads),
        ("wheels", model.wheels),
        ("events", model.events),
        ("beam_loads", model.beam_loads),
    ):
        for k, row in enumerate(rows):
            if row["law"] != 0:
                yield _Use(family, k, row)
    for k, row in enumerate(model.fields):
        if row["law"] != 0:
            yield _Use("fields", k, row)
    for k, row in enumerate(model.threads):
        if row["motor_law"] != 0:
            law = {"law": row["motor_law"], "first": row["motor_first"], "last": row["motor_last"]}
            yield _Use("spools", k, {**law, "spool_q": row["spool_q"], "spool_v": row["spool_v"]})
    for k, row in enumerate(model.custom_forces):
        yield _Use("custom_forces", k, row)
    for k, row in enumerate(model.motors):
        follows = row["kind"] == coordinate_laws.BY_MOTION
        if row["kind"] == coordinate_laws.BY_LAW or (follows and row["drive"] == drive.LAW):
            yield _Use("motors", k, row)


def _is_of_time(use: _Use) -> bool:
    """Whether a row's law is one of time alone: a drive."""
    if use.family == "motors":
        return bool(use.row["kind"] == coordinate_laws.BY_MOTION)
    return use.family in ("threads", "joints", "bodies", "controllers")


def _arguments(assembly: Assembly, use: _Use, moment: Moment, *, everywhere: bool) -> Iterator[tuple[Any, ...]]:
    """Arguments (but for the parameters) with which a row calls its law; of a load at every node, or at its reel."""
    model, (time, y, _) = assembly.model, moment
    if _is_of_time(use):
        yield (time,)
    elif use.family == "springs":
        length, *_, rate = springs.spring_ends(y, 0.0, use.number, model)[2]
        yield length - float(use.row["length"]), rate, time
    elif use.family == "spools":
        yield float(y[use.row["spool_q"]]), float(y[use.row["spool_v"]]), time
    elif use.family == "loads" and use.row["kind"] >= loads.AT_MARKER:
        marker = model.markers[use.row["target"]]
        found = springs.marker_kinematics(y, model.markers, model.points, model.bodies, use.row["target"])
        is_torque = use.row["kind"] == loads.TORQUE
        body = model.bodies[marker["index"]]
        x, v = np.array(found[:3]), np.array(found[3:])
        if is_torque:
            v = body["w"].copy()
        if use.row["attitude"] != 0:
            x = np.concatenate([x, body["R"].ravel()])
        yield x, v, time
    elif use.family == "beam_loads":
        iq, iv = (int(use.row[key]) for key in ("iq", "iv"))
        if iq < 0:
            beam = model.beams[use.row["beam"]]
            iq, iv = int(beam["iq"]), int(beam["iv"])
        yield y[iq : iq + 3].copy(), y[iv : iv + 3].copy(), time
    elif use.family == "wheels":
        yield float(y[use.row["iq"]]), float(y[use.row["iv"]]), time
    elif use.family == "loads":
        thread = model.threads[use.row["target"]]
        if everywhere:  # where the last evaluation of the forces has put them
            for node in model.nodes[int(thread["node"]) : int(thread["node"] + thread["n"])]:
                yield node["x"].copy(), node["v"].copy(), time
        yield thread["Q"][:3].copy(), thread["Q"][3:].copy(), time
    elif use.family == "motors":
        coordinates, k = model.coordinates, int(use.row["coordinate"])
        coordinate.measure_coordinate(y, moment[2], coordinates, model.bodies, k)
        yield time, float(coordinates["angle"][k]), float(coordinates["rate"][k])
    elif use.family == "fields":
        for x, v in _masses(model, y):
            yield x, v, time
            if not everywhere:
                break
    elif use.family == "custom_forces":
        own = range(int(use.row["first_marker"]), int(use.row["first_marker"] + use.row["points"]))
        states = [springs.marker_kinematics(y, model.markers, model.points, model.bodies, m) for m in own]
        yield time, *(np.array(states)[:, part].ravel() for part in (slice(3), slice(3, 6)))
    else:
        yield time, y


def _masses(model: Any, y: Array) -> Iterator[tuple[Array, Array]]:
    """Positions and velocities, (3,) each, of points, free bodies, nodes of beams and threads; after `kinematics`."""
    for block in model.blocks[(model.blocks["kind"] == POSITION) & (model.blocks["family"] != THREAD)]:
        yield y[block["iq"] :][:3].copy(), y[block["iv"] :][:3].copy()
    for thread in model.threads:
        yield thread["Q"][:3].copy(), thread["Q"][3:].copy()


def _calls(assembly: Assembly, moments: Iterable[Moment]) -> Iterator[tuple[_Use, tuple[Any, ...], float]]:
    """Calls of laws at some states: row, arguments and time."""
    for time, y, s in moments:
        if not np.all(np.isfinite(y)):
            continue
        placed = False
        for use in _uses(assembly):
            parameters = _parameters(assembly, use)
            if use.family != "loads" and not placed and not _is_of_time(use):
                with contextlib.suppress(Exception):  # a drive that raises is found by itself
                    prepare(time, y.copy(), s.copy(), assembly.model)
                placed = True
            for arguments in _arguments(assembly, use, (time, y, s), everywhere=True):
                yield use, (*arguments, parameters, *_room(use)), time


def _law(assembly: Assembly, use: _Use) -> tuple[Any, str]:
    """The law that a row calls, and, of an expression, what messages call it."""
    first, last = _range(use)
    if last > first and first in assembly.expressions:
        return assembly.expressions[first]
    return assembly.laws[int(use.row["path_law" if use.family == "bodies" else "law"])], ""


def _parameters(assembly: Assembly, use: _Use) -> Array:
    """The parameters that a row gives its law, in an array of their own."""
    first, last = _range(use)
    found: Array = assembly.model.parameters[first:last].copy()
    return found


def _range(use: _Use) -> tuple[int, int]:
    """Where the parameters of a row's law stand."""
    before = ""
    if use.family == "bodies":
        before = "path_"
    elif use.family == "loads" and use.row["kind"] != loads.LAW:
        before = "law_"
    return int(use.row[before + "first"]), int(use.row[before + "last"])


def _try(assembly: Assembly, use: _Use, time: float, arguments: tuple[Any, ...]) -> None:
    """Evaluate the law of one row."""
    parameters, room = _parameters(assembly, use), _room(use)
    try:
        law, described = _law(assembly, use)
        laws.try_law(law, *arguments, parameters, *room, described=described, parameters=parameters, kind=_kind(use))
        if room and not np.all(np.isfinite(room[0])):
            raise InputError(f"{laws.describe_law(law)} writes {room[0].tolist()} to f; forces must be finite numbers")
    except InputError as error:
        raise InputError(f"{owner(assembly, use.family, use.number)!r} at t = {time:g} s: {error}") from error


def _room(use: _Use) -> tuple[Array, ...]:
    """Room for the forces that a law between points writes; nothing for other laws."""
    return (np.zeros(3 * int(use.row["points"])),) if use.family == "custom_forces" else ()
