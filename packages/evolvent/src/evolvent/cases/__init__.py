"""Cases: found by name or read from a file, overridden key by key, checked, and written back as YAML."""

from __future__ import annotations

import contextlib
import difflib
import functools
import os
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from pydantic import ValidationError

from evolvent.cases.catalogue import (
    GROUP as GROUP,
    built_in as built_in,
    built_in_files,
    files as files,
    lacks_package as lacks_package,
    presenter as presenter,
    system as system,
    systems as systems,
    text as text,
    unusable as unusable,
)
from evolvent.cases.inputs import (
    FILES as FILES,
    check_files as check_files,
    check_files_of_run as check_files_of_run,
    files_of as files_of,
    files_of_case as files_of_case,
    files_of_run as files_of_run,
    in_place as in_place,
    value_in_place as value_in_place,
)
from evolvent_base import safe_open
from evolvent_base.errors import InputError, nearest
from evolvent_base.named import Named
from evolvent_base.overrides import (
    copied as copied,
    override as override,
    parse_assignment as parse_assignment,
    parse_assignments as parse_assignments,
)
from evolvent_base.schema import (
    Section,
    SectionsByName,
    by_name,
    dotted,
    has_columns,
    keys,
    locate,
    marks,
    sentence,
    shown,
)
from evolvent_base.texts import dump as dump, key_problem, parse_yaml as parse_yaml


class CasePlan(NamedTuple):
    """A case, checked and prepared.

    Attributes
    ----------
    duration : float, s, time that the run covers
    run : function of `progress` (None, or called with the time reached, s) that returns the run as a Dataset, whatever
        its status
    solver : str, the solver that must be compiled for it, '' for none
    note : str, what to report of its cost before it starts, '' for nothing
    start : function that returns the results at the start, with all variables that the run will have; None for none
    observe : function of full names of variables that returns the run as a Dataset with these alone, which is quicker;
        None for none
    keep : function that returns what alone is asked of the run (`evolvent.results.kept.Kept`); None for none
    """

    duration: float
    run: Callable[[Callable[[float], None] | None], Any]
    solver: str = ""
    note: str = ""
    start: Callable[[], Any] | None = None
    observe: Callable[[Iterable[str]], Any] | None = None
    keep: Callable[[], Any] | None = None


# ------------------------------------------------------------------------------------------------ systems


def json_schema(name: str) -> dict[str, Any]:
    """JSON schema of a system's cases, for editors."""
    schema: dict[str, Any] = system(name).Case.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def to_yaml(case: Section, written: Any = None) -> str:
    """The whole case, defaults included, as YAML that can be run again and gives the same numbers.

    Parameters
    ----------
    case : Section
    written : mapping, optional
        The content that the case was read from; its values are kept with their units, such as "5 mm", and parts that
        are repeated stand there once.
    """
    content = case.model_dump(mode="json", exclude_none=True)
    if isinstance(written, Mapping):
        kept = _with_written(_with_repeated(content, written, type(case)), written)
        with contextlib.suppress(InputError):
            if load(kept) == case:
                content = kept
    return dump(content)


def _with_repeated(full: dict[str, Any], written: Mapping[str, Any], kind: type[Section]) -> dict[str, Any]:
    """Full content with the parts that another one repeats in place of those for which they stand."""
    found = dict(full)
    for key in by_name(kind):
        given = written.get(key)
        if isinstance(given, Mapping) and any(isinstance(one, Mapping) and "repeat" in one for one in given.values()):
            whole = full.get(key, {})
            found[key] = {name: whole[name] if name in whole and "kind" in one else one for name, one in given.items()}
    return found


def _with_written(full: Any, written: Any) -> Any:
    """Full content with the values of another in place that mean the same; plain numbers take the unit of the full."""
    if isinstance(full, Mapping) and isinstance(written, Mapping):
        return {key: _with_written(value, written[key]) if key in written else value for key, value in full.items()}
    number = isinstance(written, (int, float)) and not isinstance(written, bool)
    return full if written is None or (number and isinstance(full, str)) else written


# ------------------------------------------------------------------------------------------------ loading


def load(case: Any, overrides: Mapping[str, Any] | None = None) -> Any:
    """A checked case.

    Parameters
    ----------
    case : str, path, mapping or Case
        Name of a built-in case, a YAML file, or content.
    overrides : mapping, dotted key -> value

    Raises
    ------
    InputError
        One sentence that names the key, its value and what is allowed.
    """
    content = _content(case)
    _change(content, overrides)
    kind = _kind(content)
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise InputError(sentence(error.errors(include_url=False), kind)) from None


def solver_keys(case: Section) -> dict[str, str]:
    """Keys of a case that say what arguments of the solvers do: argument -> key (`evolvent_base.errors.in_keys`)."""
    solver = getattr(case, "solver", None)
    if solver is None:
        return dict(system(case.system).keys)  # type: ignore[attr-defined]
    fields = type(solver).model_fields
    return {"tolerance": "solver.rtol"} | {name: f"solver.{name}" for name in fields}


@functools.lru_cache(maxsize=16)
def of_run(text: str) -> Any:
    """The checked case that a run was made from.

    Parameters
    ----------
    text : str, the run's attribute ``case``

    Raises
    ------
    InputError
        If it cannot be used.
    """
    return load(parse_yaml(text, "the run's case"))


def content_of_run(run: Any) -> dict[str, Any]:
    """The case of a run as its file holds it, unchecked; empty where it has none that can be read."""
    try:
        content = parse_yaml(run.attrs.get("case", ""), "the run's case")
    except InputError:
        return {}
    return content if isinstance(content, dict) else {}


def content_of(case: Any, overrides: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """A case as it is written, with `overrides` in place, unchecked but for what they need.

    Parameters are those of `load`.

    Raises
    ------
    InputError
        If it cannot be read, or a key cannot be set.
    """
    content = _content(case)
    _change(content, overrides)
    return content


def written(case: Any) -> dict[str, Any]:
    """A checked case as a file holds it: its system, and what differs from the defaults."""
    found: dict[str, Any] = case.model_dump(mode="json", exclude_defaults=True)
    return {"system": case.system, **found}


def problems(content: Mapping[str, Any], kind: type[Section] | None = None) -> dict[str, str]:
    """What is wrong with a case, field by field.

    Parameters
    ----------
    content : mapping, the case
    kind : of the section that it is, that of the case's system unless given

    Returns
    -------
    dict
        Dotted key of a field, or of a section, '' for none -> one sentence. Empty if all is well.
    """
    try:
        content = with_system(copied(content)) if kind is None else copied(content)
        kind = _kind(content) if kind is None else kind
        kind.model_validate(content)
    except ValidationError as error:
        assert kind is not None
        found: dict[str, list[Any]] = {}
        for entry in error.errors(include_url=False):
            found.setdefault(_field(dotted(entry["loc"])), []).append(entry)
        return {key: sentence(entries, kind) for key, entries in found.items()}
    except InputError as error:
        known = set(keys(kind)) if kind is not None else {"system"}
        words = (_field(word.rstrip(".")) for word in re.findall(r"\w[\w.]*", str(error)))
        return {next((word for word in words if word in known), ""): str(error)}
    return {}


def _field(key: str) -> str:
    """The field that a key lies in: without what counts the entries of a list, and what follows it."""
    return re.split(r"\.\d", key)[0]


def set_value(content: dict[str, Any], key: str, value: Any) -> None:
    """Put a value in the place of a dotted key of a case with a known system, where it may be written in short.

    Raises
    ------
    InputError
        If the key cannot be set.
    """
    _override(system(content["system"]).Case, content, key, value)


def _change(content: dict[str, Any], overrides: Mapping[str, Any] | None) -> None:
    """Put overrides into the content of a case."""
    if not isinstance(overrides, Mapping | None):
        raise InputError(
            f"the overrides are {shown(overrides)}; they must be a mapping of dotted keys to values, "
            f"such as {{'blade.nodes': 40}}"
        )
    if not overrides:
        return
    known = content.get("system")
    kind: type[Section] | None = system(known).Case if isinstance(known, str) and known in systems() else None
    named = {key: set(content.get(key) or ()) for key in (by_name(kind) if kind else ())}
    for key, value in overrides.items():
        if not isinstance(key, str):
            raise InputError(f"among the overrides {key_problem(key)}")
        if kind is not None:
            _override(kind, content, key, value)
        else:
            override(content, key, value)
    for key in overrides:
        owner, _, rest = key.partition(".")
        name = rest.partition(".")[0]
        if name and owner in named and name not in named[owner] and not _is_section(kind, content, owner, name):
            raise InputError(f"cannot set {key!r}: no part is called {name!r}; {nearest(name, named[owner])}")


def _is_section(kind: type[Section] | None, content: Mapping[str, Any], owner: str, name: str) -> bool:
    """Whether the kind of the section of a name is said, there or where another one stands for it."""
    found = marks(kind.model_fields[owner]) if kind is not None else ()
    return any("kind" in mark.content_of(content[owner], name) for mark in found if isinstance(mark, SectionsByName))


def expanded(content: Mapping[str, Any]) -> dict[str, Any]:
    """Content of a case with each part by itself for which a repeated one stands.

    Raises
    ------
    InputError
        If its system is not known, or parts are wrong.
    """
    kind, found = _kind(content), copied(content)
    for key in by_name(kind):
        for mark in marks(kind.model_fields[key]):
            if isinstance(mark, SectionsByName) and isinstance(found.get(key), Mapping):
                found[key] = copied(mark.expanded(found[key]))
    return found


def _override(kind: type[Section], content: dict[str, Any], key: str, value: Any) -> None:
    """Put a value in the place of a dotted key of a case of a kind."""

    def shares_unit(place: str) -> bool:
        with contextlib.suppress(InputError):
            return not has_columns(locate(kind, place, content))
        return True

    _write_out(kind, content, key)
    override(content, key, value, shares_unit=shares_unit)


def _write_out(kind: type[Section], content: Any, key: str) -> None:
    """Write out what stands for a section in short, where a key goes into it: rows that stand for {table: rows}.

    So is a name, as of a material, and a part that stands for several, where the key is one of these.
    """
    path = key.split(".")
    place = content
    for mark in (one for name in by_name(kind) if name == path[0] for one in marks(kind.model_fields[name])):
        if isinstance(mark, SectionsByName) and len(path) > 2 and isinstance(content.get(path[0]), Mapping):
            written = mark.written_out(content[path[0]], path[1], path[2])
            if written is not content[path[0]]:
                content[path[0]] = copied(written)
    for k, name in enumerate(path[:-1]):
        if isinstance(place, list) and name.isdecimal() and int(name) < len(place):
            place = place[int(name)]
            continue
        if not isinstance(place, dict) or place.get(name) is None:
            return
        inner, wanted = place[name], path[k + 1]
        if not isinstance(inner, dict) and not (isinstance(inner, list) and wanted.isdecimal()):
            with contextlib.suppress(InputError):
                for one, own in locate(kind, ".".join(path[: k + 1]), content).types:
                    named = next((mark for mark in own if isinstance(mark, Named)), None)
                    if named is not None:
                        place[name] = named.written_out(inner)
                    elif isinstance(one, type) and issubclass(one, Section) and wanted in one.model_fields:
                        with contextlib.suppress(ValidationError):
                            one.model_validate({wanted: inner})
                            place[name] = {wanted: inner}
        place = place[name]


def _kind(content: Mapping[str, Any]) -> type[Section]:
    """The model of a case's system."""
    kind: type[Section] = system_of(content).Case
    return kind


def system_of(content: Mapping[str, Any]) -> Any:
    """The system of a case that was not checked yet.

    Raises
    ------
    InputError
        If it names none that is known.
    """
    if "system" not in content:
        for key in content:
            close = difflib.get_close_matches(key, ("system", "parts"), n=1)
            if close:
                raise InputError(f"unknown key {key!r}; did you mean {close[0]!r}?")
        raise InputError(
            f"the key 'system' is missing; known: {', '.join(systems())}; a case with the key 'parts' needs none"
        )
    if not isinstance(content["system"], str):
        raise InputError(f"system is {shown(content['system'])}; known: {', '.join(systems())}")
    return system(content["system"])


def _content(case: Any) -> dict[str, Any]:
    """Content of a case as nested dicts that may be changed, with its system."""
    return with_system(_read(case))


def with_system(content: dict[str, Any]) -> dict[str, Any]:
    """Content of a case with its key ``system``: one that has parts and no system is a structure."""
    return {"system": "structure", **content} if "parts" in content and "system" not in content else content


def _read(case: Any) -> dict[str, Any]:
    """Content of a case as it is written."""
    if isinstance(case, (Section, Mapping)):
        return copied(case.model_dump(mode="json", exclude_none=True) if isinstance(case, Section) else case)
    if not isinstance(case, (str, os.PathLike)):
        raise InputError(f"a case is a name, a file or a mapping, not {type(case).__name__}")
    name = os.fspath(case)
    is_word = not re.search(r"[./\\]", name)
    if name in built_in_files() or (is_word and not os.path.exists(name)):
        return dict(copied(_built_in_content(name)))
    content = parse_yaml(safe_open.text(name), name)
    if not isinstance(content, dict):
        what = "it is empty" if content is None else f"it holds {shown(content)}"
        raise InputError(f"{name}: {what}; a case is a mapping of keys to values, as 'evolvent show' prints one")
    return content


@functools.cache
def _built_in_content(name: str) -> Any:
    """Content of a built-in case, read once."""
    found = parse_yaml(text(name), name)
    if not isinstance(found, dict):
        raise InputError(f"the case {name!r} of another package is {shown(found)}; it must be a mapping")
    return found
