"""Which families of records there are, and what they answer.

A topic is a folder of the package `evolvent.families`. Its modules whose names begin with "family" declare families,
those with "part" what users write, those with "observer" what results show of them (`beside`); the others are the
formulas of these. A module of another distribution, which has an entry point of the group `evolvent.families`, may hold
all of it. Nothing else names a family: whatever the package asks about parts, it asks every family of a model.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
import pkgutil
import typing
from collections.abc import Callable, Collection, Iterator, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from evolvent.compiled import lookups
from evolvent.model.family import Family
from evolvent.model.fields import ModelFields
from evolvent.model.layout import Events
from evolvent.model.questions import CONSTRAINT
from evolvent_base import plugins
from evolvent_base.errors import InputError

Array = np.ndarray

#: Group of entry points, and package, of modules that declare families.
GROUP, PACKAGE = "evolvent.families", "evolvent.families"


@functools.cache
def module_names(role: str) -> tuple[str, ...]:
    """Names of the modules of all topics with a role, with which they begin: "family", "part" or "observer"."""
    package, found = importlib.import_module(PACKAGE), []
    for topic in pkgutil.iter_modules(package.__path__, f"{PACKAGE}."):
        folder = importlib.import_module(topic.name)
        for one in pkgutil.iter_modules(folder.__path__):
            if one.name == role or one.name.startswith(f"{role}_"):
                found.append(f"{topic.name}.{one.name}")
    return tuple(sorted(found))


@functools.cache
def beside(role: str) -> tuple[Any, ...]:
    """Modules of all topics with a role (`module_names`); this loads them."""
    return tuple(importlib.import_module(name) for name in module_names(role))


def module_source(module: str) -> str | None:
    """Source code of a module of a package, which is not imported; None if only compiled code is distributed."""
    package, _, name = module.rpartition(".")
    try:
        found = pkgutil.get_data(package, f"{name}.py")
    except OSError:
        return None
    return None if found is None else found.decode()


@functools.cache
def _modules_and_failures() -> tuple[list[Any], dict[str, str]]:
    """Modules that declare families: those of the package, then those of other distributions; and why others do not."""
    found, wrong = [*beside("family")], dict[str, str]()
    for entry in plugins.entry_points(GROUP):
        try:
            found.append(plugins.load(entry, f"the families of the entry point {entry.name!r}"))
        except InputError as error:
            wrong[entry.name] = str(error)
    return found, wrong


def _is_own(module: Any) -> bool:
    """Whether a module is one of the package."""
    return bool(module.__name__.startswith(f"{PACKAGE}."))


def modules() -> list[Any]:
    """Modules that declare families: those of the package, then those of other distributions that can be loaded."""
    return _modules_and_failures()[0]


def unusable() -> Mapping[str, str]:
    """Sentences on modules and families of other distributions that cannot be used, by their names."""
    families()
    return _modules_and_failures()[1]


def _refused(family: Family, taken: Collection[str]) -> str:
    """Why a family of another distribution cannot be used; '' where it can."""
    if family.name in taken:
        return f"the family {family.name!r} has the name of a field of the model; it needs one of its own"
    if unknown := family.concerned.keys() - {*QUESTIONS}:
        return f"the family {family.name!r} says what {min(unknown)!r} concerns, which is not asked of families"
    if any(one.values is None or one.fire is None for one in family.events):
        return f"the family {family.name!r} has events without `values` or `fire`, which all methods need"
    if any(one.is_watched and not _WATCHED[0] < one.order < _WATCHED[1] for one in family.events):
        return f"the events of the family {family.name!r} have an order outside {_WATCHED[0]} to {_WATCHED[1]}"
    if family.rows is not None and family.rows.kind != CONSTRAINT:
        return f"the family {family.name!r} has rows of the kind {family.rows.kind}; `CONSTRAINT` alone serves all"
    lacking = [question for question in QUESTIONS if question.startswith("rows.") and answer(family, question) is None]
    if family.rows is not None and lacking:
        return f"the family {family.name!r} states rows of constraint without `{lacking[0]}`, which all methods need"
    shares = family.in_margins
    if family.rows is not None and (family.rows.alone is not None or (shares is not None and shares.rules)):
        return f"the family {family.name!r} has rows of constraint; rows `alone` and shares in margins are not for them"
    names = family.record.names or ()
    if family.rows is not None and "event" in names and "switch" not in names:
        return f"records of the family {family.name!r} have a field `event` without `switch`, which it turns"
    if any(not one.is_watched for one in family.events):
        return f"the events of the family {family.name!r} are not watched; implicit methods would not find them"
    if family.inertia.force or family.step.inertia:
        return f"the family {family.name!r} states inertia; gravity acts on the masses of the package's own families"
    return _refused_force(family)


def _refused_force(family: Family) -> str:
    """Why the forces of a family of another distribution are not complete; '' where they are."""
    if (family.explicit.force or family.step.force) and not (family.force or family.torques.apply):
        return f"the family {family.name!r} has a force of some methods without `force`, which the others need"
    if family.force and not family.tangent:
        return f"the family {family.name!r} has a force without its tangent, which statics and modes need"
    if family.force and family.ends is None:
        return f"the family {family.name!r} has a force without `ends`, which say what it couples"
    return ""


def _declared(wrong: dict[str, str]) -> Iterator[Family]:
    """Families of the package by their order, then those of other distributions; into `wrong` why some are not used."""
    taken = {*ModelFields._declared}
    for is_own in (True, False):
        found: dict[str, Family] = {}
        for module in modules():
            if _is_own(module) != is_own:
                continue
            for family in (value for value in vars(module).values() if isinstance(value, Family)):
                why = "" if is_own else _refused(family, {*taken, *found})
                if why:
                    wrong[family.name] = why
                else:
                    found[family.name] = family
        taken |= found.keys()
        yield from sorted(found.values(), key=lambda family: (family.order, family.name))


@functools.cache
def families() -> dict[str, Family]:
    """All families, by name and in their order; families of other distributions come last."""
    return {family.name: family for family in _declared(_modules_and_failures()[1])}


@functools.cache
def of_others() -> tuple[str, ...]:
    """Names of the families of other distributions."""
    own = {
        one.name for module in modules() if _is_own(module) for one in vars(module).values() if isinstance(one, Family)
    }
    return tuple(name for name in families() if name not in own)


def whole() -> Iterator[Family]:
    """Families of records that belong to no other family's."""
    return (family for family in families().values() if not family.of)


@functools.cache
def motions() -> str:
    """The family whose records are motions between parts (`Parts.is_motion`)."""
    return next(name for name, family in families().items() if family.parts.is_motion)


def motions_of(model: Any) -> Any:
    """Records of motions between parts of a model."""
    return getattr(model, motions())


def frames_of(model: Any) -> list[tuple[str, Any, Any]]:
    """Family, rate of the frame (`Statics.frame`) and record of each force on all masses of a model."""
    own = ((name, frame, getattr(model, name)) for name, frame in asked("statics.frame").items())
    return [(name, frame(row), row) for name, frame, rows in own for row in rows]


@functools.cache
def constraining() -> tuple[str, ...]:
    """Families whose records have rows in `Model.constraints`, in the order of these."""
    return tuple(f.name for f in families().values() if f.rows is not None and f.rows.kind == CONSTRAINT)


def first_row(family: str, records: Any) -> int:
    """Row of `Model.constraints` of the first record of a family.

    Parameters
    ----------
    records : function of the name of a family to its records
    """
    every = constraining()
    return sum(records(name).size for name in every[: every.index(family)])


@functools.cache
def acting() -> tuple[Family, ...]:
    """Families that act between parts, but those whose ends are those of another family."""
    every = families()
    found = [family for family in every.values() if family.ends is not None and not family.coupling.through]
    return tuple(family for family in found if not family.of or every[family.of].ends is None)


def forget_steps(model: Any) -> None:
    """Make all records of a model forget the steps before."""
    for forget in asked("implicit.forget").values():
        forget(model)


def cubic(model: Any) -> str:
    """Name of the first family of a model whose forces are cubic (`AdjointSupport.cubic`), '' for none."""
    own = ((name, support) for name, support in asked("adjoint").items() if support.cubic)
    return next((name for name, _ in own if families()[name].records(model).size), "")


def along_axes(model: Any) -> list[Array]:
    """Bodies that are nodes along an axis, part by part."""
    return [np.array(nodes) for axes in asked("state.axes").values() for nodes in axes(model)]


@functools.cache
def events() -> tuple[tuple[Family, Events], ...]:
    """Events of all families, in the order of their numbers."""
    own = ((family, one) for family in families().values() for one in family.events)
    return tuple(sorted(own, key=lambda found: found[1].order))


def event_of(records: Any, number: int) -> tuple[Family, int, str]:
    """Family and record of an event of a model, and what happens.

    Parameters
    ----------
    records : function of the name of a family to its records
    number : of the event, among all of the model
    """
    for family, own in events():
        found = records(family.name)
        count = int(own.count(found))
        if number < count:
            return (family, *own.what(found, number))
        number -= count
    raise IndexError(number)


def answer(family: Family, question: str) -> Any:
    """Answer of a family to a question; None where it has none.

    Parameters
    ----------
    question : str, attribute of `Family`, as "force", or of one of its groups, as "samples.evaluate"
    """
    group, _, name = question.rpartition(".")
    own = getattr(family, group) if group else family
    return None if own is None else getattr(own, name)


@functools.cache
def asked(question: str) -> Mapping[str, Any]:
    """Answers of the families that have one to a question (see `answer`), by name."""
    found = ((name, answer(family, question)) for name, family in families().items())
    return MappingProxyType({name: own for name, own in found if own is not None})


def is_by_rates(model: Any) -> bool:
    """Whether explicit methods find the fastest mode of some part of a model from its rates (`Stability.by_rates`)."""
    return any(family.is_by_rates(model) for family in families().values())


#: Orders between which events of other distributions lie: those of users before, latches behind.
_WATCHED = 1.0, 2.0
#: Functions that families call of the equations, which stand above them, by their modules.
_EQUATIONS = {"rhs": "evolvent.equations.rhs", "inventory": "evolvent.equations.inventory"}


def _compiled(group: Any) -> list[str]:
    """Questions of a family or of a group of them whose answers are compiled functions."""
    return [field.name for field in dataclasses.fields(group) if field.type == "Call"]


#: Groups of questions of a family with compiled answers, by its fields.
_GROUPS = {
    name: one
    for name, hint in typing.get_type_hints(Family).items()
    for one in (hint, *typing.get_args(hint))
    if isinstance(one, type) and dataclasses.is_dataclass(one) and _compiled(one)
}

#: Questions whose answers are compiled functions (see `answer`), and those that are asked where there is no answer.
QUESTIONS = (*_compiled(Family), *(f"{name}.{one}" for name, group in _GROUPS.items() for one in _compiled(group)))
_OTHERWISE: Mapping[str, str] = {
    f"{name}.{one}": other for name, group in _GROUPS.items() for one, other in getattr(group, "OTHERWISE", {}).items()
}
_OF_EVENTS = "values", "fire"


def _table(question: str) -> str:
    """Name of the field of models with the functions that answer a question."""
    return f"{question.replace('.', '_')}_calls"


#: Fields of models that are tables of calls: of questions, of the equations, and of the groups of events.
TABLES = tuple(sorted(map(_table, (*QUESTIONS, *_EQUATIONS, *(f"event_{name}" for name in _OF_EVENTS)))))


def _slots(question: str, present: Collection[str], idle: Collection[tuple[str, str]]) -> Array:
    """Slots of the answers of some families to a question, in their order, each once; without those that are idle."""
    found = []
    for family in families().values():
        if family.name not in present or (family.name, question) in idle:
            continue
        own = answer(family, question)
        if own is None and question in _OTHERWISE:
            own = answer(family, _OTHERWISE[question])
        if own is None and question == "samples.evaluate" and family.results:
            own = family.force
        if own:
            found.append(lookups.slot(own))
    one_each = question.startswith("rows.")  # by the number of the family in `Model.constraints`
    return np.array(found if one_each else [*dict.fromkeys(found)], dtype=np.int64)


def _concerned(family: Family) -> Mapping[str, Callable[[Array], Array]]:
    """Masks of the records of a family that questions concern, but for those that concern all."""
    rubs = family.friction.rubs
    return family.concerned if rubs is None else {**family.concerned, "friction.until_turn": rubs}


@functools.cache
def _tables(present: tuple[str, ...], idle: tuple[tuple[str, str], ...]) -> dict[str, Array]:
    """Tables of calls of models with records of some families, some of which a question does not concern."""
    found = {question: _slots(question, present, idle) for question in QUESTIONS}
    for name, module in _EQUATIONS.items():
        found[name] = np.array([lookups.slot(getattr(importlib.import_module(module), name))])
    return {_table(question): slots for question, slots in found.items()}


def calls_of(model: Mapping[str, Any]) -> dict[str, Array]:
    """Tables of calls of a model, of the families of which it has records; they are those of all models alike."""
    present = tuple(name for name in families() if model[name].size)
    masks = ((name, question, mask) for name in present for question, mask in _concerned(families()[name]).items())
    found = _tables(present, tuple((name, question) for name, question, mask in masks if not np.any(mask(model[name]))))
    groups, first = list[tuple[Events, int]](), 0
    for family, own in events():
        count = own.count(model[family.name])
        groups += [(own, first)] if own.values is not None and count else []
        first += count
    own_of = [(_table(f"event_{name}"), [lookups.slot(getattr(own, name)) for own, _ in groups]) for name in _OF_EVENTS]
    firsts = [("event_firsts", [number for _, number in groups])]
    return found | {name: np.array(values, dtype=np.int64) for name, values in (*own_of, *firsts)}


def watched(records: Mapping[str, Any]) -> list[Array]:
    """Which events that implicit methods watch stop a run, (n,) bool of each group."""
    found = []
    for family, own in events():
        if own.is_watched and own.values is not None:
            rows = records[family.name]
            found.append(np.zeros(own.count(rows), dtype=bool) if own.stops is None else np.asarray(own.stops(rows)))
    return found


def kept_of(model: Mapping[str, Any], places: Mapping[str, int]) -> Array:
    """Fields that a run keeps at its samples, in their order: (m, 6) int.

    Parameters
    ----------
    places : of each family, the word of the model at which its records are found

    Returns
    -------
    Of each field the place of its family, bytes from record to record, number of records, bytes of the field in a
    record, number of its numbers, and how it is kept (`Samples.kept`)
    """
    found = []
    for family in families().values():
        own = family.samples
        if own.kept and (own.keeps is None or own.keeps(model.__getitem__)):
            record, size = family.record, model[family.name].size
            for field, how in own.kept.items():
                kind, offset = record.fields[field][:2]  # type: ignore[index]
                found.append((places[family.name], record.itemsize, size, offset, kind.itemsize // 8, how))
    return np.array(sorted(found, key=lambda row: row[-1]), dtype=np.int64).reshape(-1, 6)
