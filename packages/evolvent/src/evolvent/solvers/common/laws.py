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
from evolvent.compiled import laws
from evolvent.kernels.impulse import prepare
from evolvent.model.questions import EVENT, Law, Moment
from evolvent.model.registry import families
from evolvent_base.errors import EvolventError, InputError

Array = np.ndarray


class _Use(NamedTuple):
    """A record of the model that calls a user's law."""

    family: str
    number: int
    row: Any
    law: Law


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
        if use.law.is_of_time:
            for time in (start, end):
                _try(assembly, use, time, (time,))
            continue
        if not placed:
            needs.load(assembly.model, prepare)
            prepare(start, y, s, assembly.model)
            placed = True
        for arguments in _arguments(assembly, use, (start, y, s), everywhere=False):
            _try(assembly, use, start, arguments)
            if use.law.stated:
                _note_stated(assembly, use, arguments, end - start)


def largest_works(assembly: Assembly, time: float) -> float:
    """Sum of the forces of all laws at the start, `time`, each times the largest coordinate, J.

    A state is known to some 1e-16 of its coordinates, and so is the work of the laws.
    """
    if not any(use.law.is_force for use in _uses(assembly)):
        return 0.0
    y, s, found = assembly.y.copy(), assembly.s.copy(), 0.0
    assembly = dataclasses.replace(assembly, model=assembly.model.copy())  # the state of which is that at the start
    uses = [use for use in _uses(assembly) if use.law.is_force]
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
                    law, *arguments, described=described, parameters=_parameters(assembly, use), kind=use.law.kind
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
                if size > largest and use.law.kind != EVENT:
                    name = owner(assembly, use.family, use.number)
                    largest, found = size, f"; at t = {time:.6g} s the law of {name!r} has the value {size:.2g}"
    except (ArithmeticError, ValueError, IndexError):  # as in `broken_law`
        pass
    return found


def what_may_jump(assembly: Assembly) -> str:
    """A half sentence on the user's laws of a model as a possible reason for a failure; empty where there is none."""
    names = list(dict.fromkeys(owner(assembly, use.family, use.number) for use in _uses(assembly)))
    if not names:
        return ""
    return f", or a law of the user's jumps ({', '.join(repr(name) for name in names[:3])})"


def states_energy(assembly: Assembly) -> str:
    """A half sentence on laws between points, whose energy may not be that of their forces; '' where there is none."""
    stated = [use for use in _uses(assembly) if use.law.stated and use.row[use.law.stated]]
    names = [repr(owner(assembly, use.family, use.number)) for use in stated[:3]]
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
                getattr(assembly.model, use.family)[use.law.stated][use.number] = 1.0


def _users(assembly: Assembly, law: Any) -> str:
    """Names of the parts that call a law."""
    names = [owner(assembly, use.family, use.number) for use in _uses(assembly) if _law(assembly, use)[0] is law]
    names = list(dict.fromkeys(names))
    return " and ".join(repr(name) for name in names[:3]) + (" and others" if len(names) > 3 else "")


def _uses(assembly: Assembly) -> Iterator[_Use]:
    """Records that call users' laws: drives first, then laws that take what the last forces have left."""
    found = list[_Use]()
    for family in families().values() if assembly.laws or assembly.expressions else ():
        rows = family.records(assembly.model)
        for law in family.laws if rows.size else ():
            found += [_Use(family.name, k, rows[k], law) for k in np.flatnonzero(law.which(rows)).tolist()]
    yield from sorted(found, key=lambda use: (not use.law.is_of_time, not use.law.as_left))


def _arguments(assembly: Assembly, use: _Use, moment: Moment, *, everywhere: bool) -> Iterator[tuple[Any, ...]]:
    """Arguments (but for the parameters) with which a record calls its law."""
    if use.law.arguments is None:
        return iter([moment[:1]])
    return use.law.arguments(assembly.model, use.number, moment, everywhere)


def _calls(assembly: Assembly, moments: Iterable[Moment]) -> Iterator[tuple[_Use, tuple[Any, ...], float]]:
    """Calls of laws at some states: row, arguments and time."""
    for time, y, s in moments:
        if not np.all(np.isfinite(y)):
            continue
        placed = False
        for use in _uses(assembly):
            parameters = _parameters(assembly, use)
            if not placed and not use.law.as_left and not use.law.is_of_time:
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
    return assembly.laws[int(use.row[use.law.field])], ""


def _parameters(assembly: Assembly, use: _Use) -> Array:
    """The parameters that a row gives its law, in an array of their own."""
    first, last = _range(use)
    found: Array = assembly.model.parameters[first:last].copy()
    return found


def _range(use: _Use) -> tuple[int, int]:
    """Where the parameters of a row's law stand."""
    return int(use.row[use.law.before + "first"]), int(use.row[use.law.before + "last"])


def _try(assembly: Assembly, use: _Use, time: float, arguments: tuple[Any, ...]) -> None:
    """Evaluate the law of one row."""
    parameters, room = _parameters(assembly, use), _room(use)
    try:
        law, described = _law(assembly, use)
        laws.try_law(law, *arguments, parameters, *room, described=described, parameters=parameters, kind=use.law.kind)
        if room and not np.all(np.isfinite(room[0])):
            raise InputError(f"{laws.describe_law(law)} writes {room[0].tolist()} to f; forces must be finite numbers")
    except InputError as error:
        raise InputError(f"{owner(assembly, use.family, use.number)!r} at t = {time:g} s: {error}") from error


def _room(use: _Use) -> tuple[Array, ...]:
    """Room for the forces that a law between points writes; nothing for other laws."""
    return (np.zeros(use.law.room(use.row)),) if use.law.room is not None else ()
