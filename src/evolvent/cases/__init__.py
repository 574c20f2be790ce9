"""Cases: found by name or read from a file, overridden key by key, checked, and written back as YAML."""

from __future__ import annotations

import contextlib
import difflib
import functools
import importlib
import os
import pathlib
import pkgutil
import re
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import yaml
from pydantic import ValidationError

from evolvent.base import plugins, safe_open
from evolvent.base.errors import HIDDEN, InputError, nearest
from evolvent.base.schema import Section, by_name, dotted, keys, locate, sentence, shown
from evolvent.base.units import UnitError, shared_unit, unit_of

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

_FOLDER = pathlib.Path(__file__).parents[1] / "systems"


class Plan(NamedTuple):
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
    """

    duration: float
    run: Callable[[Callable[[float], None] | None], Any]
    solver: str = ""
    note: str = ""
    start: Callable[[], Any] | None = None
    observe: Callable[[Iterable[str]], Any] | None = None


# ------------------------------------------------------------------------------------------------ systems


#: Group of entry points by which packages outside add systems.
GROUP = "evolvent.systems"


@functools.cache
def _outside() -> dict[str, EntryPoint]:
    """Systems of other packages: name -> where they are."""
    return {point.name: point for point in plugins.entry_points(GROUP)}


@functools.cache
def systems() -> tuple[str, ...]:
    """Names of all systems: those of `evolvent.systems` and of other packages (`evolvent.analysis.definition`)."""
    found = (m.name for m in pkgutil.iter_modules([str(_FOLDER)]) if not m.name.startswith("_"))
    return tuple(sorted({name.replace("_", "-") for name in found} | set(_outside())))


@functools.cache
def system(name: str) -> Any:
    """The definition of a system, an `evolvent.analysis.definition.SystemDefinition`.

    Raises
    ------
    InputError
        If there is no such system, or that of another package cannot be loaded.
    """
    if name not in systems():
        raise InputError(f"no system is called {name!r}; {nearest(str(name), systems())}")
    if name not in _outside():
        return importlib.import_module(f"evolvent.systems.{name.replace('-', '_')}").SYSTEM
    point = _outside()[name]
    made = plugins.load(point, f"the system {name!r} of {point.value!r}")
    try:
        found = made() if isinstance(made, type) else made
        called = found.Case.model_fields["system"].default
        if called != name:
            raise TypeError(f"its Case.system is {called!r}, not {name!r}")
    except (Exception, SystemExit) as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(f"the system {name!r} of {point.value!r} cannot be loaded: {why}") from error
    return found


def presenter(run: Any) -> Any:
    """The definition whose tables and figures a run is shown by.

    That of its system; of a run with parts, whose system is of a package that is not installed, that of any structure.

    Raises
    ------
    InputError
        If the system is not known, and the run has no parts.
    """
    name = run.attrs["system"]
    if getattr(run, "children", None) and not _is_usable(name):
        return system("structure")
    return system(name)


def _is_usable(name: Any) -> bool:
    """Whether there is a system of that name, which can be loaded."""
    try:
        system(name)
    except InputError:
        return False
    return True


def lacks_package(content: Any) -> bool:
    """Whether a case has a system, or parts of a kind, that is not known here: those of a package outside."""
    from evolvent.parts import registry

    if not isinstance(content, Mapping) or not isinstance(content.get("system"), str):
        return False
    parts = content.get("parts")
    given = parts.values() if content["system"] == "structure" and isinstance(parts, Mapping) else ()
    kinds = [part.get("kind") for part in given if isinstance(part, Mapping)]
    return not _is_usable(content["system"]) or any(kind not in registry.kinds() for kind in kinds)


@functools.cache
def _files() -> dict[str, pathlib.Path]:
    """Files of the cases that come with the package, by name."""
    every = (path for path in _FOLDER.rglob("*.yaml") if not path.name.endswith(".study.yaml"))
    found = {path.stem.replace("_", "-"): path for path in every}
    return dict(sorted(found.items()))


@functools.cache
def _outside_cases() -> dict[str, str]:
    """Cases of systems of other packages, name -> YAML text; a system that cannot be loaded has none."""
    found: dict[str, str] = {}
    for name in _outside():
        with contextlib.suppress(InputError):  # reported where that system is used
            found |= {case: source for case, source in system(name).cases.items() if case not in _files()}
    return found


def unusable() -> list[str]:
    """Sentences on systems and parts of other packages that cannot be loaded."""
    found: list[str] = []
    if plugins.entry_points("evolvent.parts"):  # parts take long to load
        from evolvent.parts import registry

        found += registry.unusable().values()
    for name in _outside():
        try:
            system(name)
        except InputError as error:
            found.append(str(error))
    return found


def built_in() -> dict[str, str]:
    """Built-in cases, name -> what it is (the first line of its text); last those of systems of other packages."""
    first = {name: text(name).partition("\n")[0] for name in [*_files(), *_outside_cases()]}
    return {name: line.lstrip("# ").strip() for name, line in first.items()}


def text(name: str) -> str:
    """A built-in case as the text that a user edits.

    Raises
    ------
    InputError
        If there is no such case.
    """
    if name in _files():
        return _files()[name].read_text(encoding="utf-8")
    if name in _outside_cases():
        return _outside_cases()[name]
    raise InputError(f"no case is called {name!r}; {nearest(name, [*_files(), *_outside_cases()])}")


def json_schema(name: str) -> dict[str, Any]:
    """JSON schema of a system's cases, for editors."""
    schema: dict[str, Any] = system(name).Case.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


# ------------------------------------------------------------------------------------------------ YAML


#: Values, aliases, beginnings and ends of lists and mappings in a YAML text, at most, and values where aliases are
#: written out; levels of lists and mappings in one another, at most.
_MOST_EVENTS, _DEEPEST = 200_000, 100
#: Letters of a text that is read again by the slow loader for its message.
_LONGEST_SLOW = 50_000


class _Tree:
    """A loader that refuses a text whose aliases would fill the memory."""

    def get_single_node(self) -> yaml.Node | None:
        """The text's only document."""
        node: yaml.Node | None = super().get_single_node()  # type: ignore[misc]
        if node is not None:
            _count(node, {})
        return node


class _SlowLoader(_Tree, yaml.SafeLoader):
    """YAML with the numbers and truth values of version 1.2 (``1e4`` is a number, ``on`` is a word)."""


class _Loader(_Tree, getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """The same by the library in C, where there is one: five times as fast; its messages say less."""


def _check_events(source: str) -> None:
    """Refuse a text of too many values, or too many levels, before any is kept."""
    deep = 0
    for count, event in enumerate[Any](yaml.parse(source, Loader=_Loader)):
        deep += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        problem = f"its lists and mappings are nested more than {_DEEPEST} levels deep" if deep > _DEEPEST else ""
        if count >= _MOST_EVENTS:
            problem = f"it holds more than {_MOST_EVENTS} values; give long tables as files of data"
        if problem:
            raise yaml.constructor.ConstructorError(None, None, problem, event.start_mark)


def _count(node: yaml.Node, known: dict[int, int]) -> int:
    """Values of a node, those that aliases repeat counted each time."""
    if isinstance(node, yaml.ScalarNode):
        hidden = HIDDEN.search(node.value)
        if hidden is not None:
            problem = f"the character {hidden[0]!a} is not allowed"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
        return 1
    if id(node) not in known:
        known[id(node)] = -1
        inner = node.value if isinstance(node, yaml.SequenceNode) else [part for pair in node.value for part in pair]
        known[id(node)] = 1 + sum(_count(part, known) for part in inner)
        if known[id(node)] > _MOST_EVENTS:
            problem = f"it holds more than {_MOST_EVENTS} values, aliases written out"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
    elif known[id(node)] < 0:
        raise yaml.constructor.ConstructorError(None, None, "an alias is inside what it names", node.start_mark)
    return known[id(node)]


_SlowLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag.rpartition(":")[2] in ("null", "merge")]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_SlowLoader.add_implicit_resolver(
    "tag:yaml.org,2002:bool", re.compile(r"(?:true|True|TRUE|false|False|FALSE)\Z"), list("tTfF")
)
_SlowLoader.add_implicit_resolver("tag:yaml.org,2002:int", re.compile(r"[-+]?[0-9]+\Z"), list("-+0123456789"))
_SlowLoader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?\Z|[-+]?\.(inf|Inf|INF)\Z|\.(nan|NaN|NAN)\Z"),
    list("-+.0123456789"),
)
# an integer of more digits than a float can hold is infinite, and refused as such by the key that it is for
_SlowLoader.add_constructor(
    "tag:yaml.org,2002:int", lambda _, node: int(node.value) if len(node.value) < 310 else float(node.value)
)


def _mapping(loader: Any, node: yaml.MappingNode) -> dict[Any, Any]:
    """A mapping whose keys are words, none of them twice."""
    keys: set[str] = set()
    for name, _ in node.value:
        if name.tag == "tag:yaml.org,2002:merge":
            problem = "the merge key '<<' is not supported; write the keys of the other mapping out"
            raise yaml.constructor.ConstructorError(None, None, problem, name.start_mark)
        key = loader.construct_object(name, deep=True)
        problem = _key_problem(key) or (f"the key {key!r} is given twice" if key in keys else "")
        if problem:
            raise yaml.constructor.ConstructorError(None, None, problem, name.start_mark)
        keys.add(key)
    return loader.construct_mapping(node, deep=True)


_SlowLoader.add_constructor("tag:yaml.org,2002:map", _mapping)
_Loader.yaml_implicit_resolvers = _SlowLoader.yaml_implicit_resolvers
_Loader.yaml_constructors = _SlowLoader.yaml_constructors


def _key_problem(key: Any) -> str:
    """What is wrong with a key; '' for nothing."""
    return "" if isinstance(key, str) else f"the key {shown(key)} is not a word, such as 'body'"


#: What the YAML library says, and what it means to the author of a case; {0} is the group that the pattern finds.
_YAML_PROBLEMS = (
    (r"found character '\\t' that cannot start", "a tab is not allowed here; indent with spaces"),
    (r"found character '(.)' that cannot start", "a value cannot begin with {0}; put it in quotation marks"),
    (r"undefined alias '(.*)'", "*{0} refers to &{0}, which is not defined above; put a text in quotation marks"),
    (r"expected ',' or '([]}}])'", "a comma or the closing {0} is missing before this character"),
    (r"mapping values are not allowed", "a ':' is not allowed here; check the indentation of this line, and put a "
     "text that contains ': ' in quotation marks"),
    (r"expected <block end>", "this line does not fit those above; indent keys of one mapping, and entries of one "
     "list, equally"),
    (r"unexpected end of stream", "a quotation mark is opened but not closed"),
    (r"found another document", "a second document begins with '---'; a file holds one"),
    (r"second occurrence", "this anchor, &..., is defined twice; give it another name"),
    (r"unknown escape character '(.)'", "\\{0} is no escape sequence; write \\\\{0}, or use single quotation marks"),
    (r"constructor for the tag '(?:tag:yaml.org,2002:)?!?(.*)'", "the tag !{0} is not supported; write a plain value"),
    (r"decode base64", "the tag !!binary is not supported; write a plain value"),
    (r"could not find expected ':'", "a ':' is missing after a key"),
    (r"maximum nesting depth", f"its lists and mappings are nested more than {_DEEPEST} levels deep"),
    (r"expected alphabetic or numeric character", "a name must follow & and *; put a text in quotation marks"),
)  # fmt: skip


def _yaml_problem(error: yaml.MarkedYAMLError) -> str:
    """What is wrong with a YAML text, in words for the author of a case."""
    problem = str(error.problem)
    for pattern, text in _YAML_PROBLEMS:
        found = re.search(pattern, problem)
        if found:
            return text.format(*found.groups())
    own = isinstance(error, yaml.constructor.ConstructorError) and error.context is None
    return problem if own else f"this is not YAML ({problem})"


def parse_yaml(source: str, name: str) -> Any:
    """Content of a YAML text; `name` says where it comes from, for messages.

    Raises
    ------
    InputError
        If it is not YAML.
    """
    try:
        try:
            _check_events(source)
            return yaml.load(source, Loader=_Loader)  # noqa: S506  (a SafeLoader)
        except (yaml.scanner.ScannerError, yaml.parser.ParserError, yaml.composer.ComposerError):
            if len(source) > _LONGEST_SLOW:
                raise
            return yaml.load(source, Loader=_SlowLoader)  # noqa: S506  (a SafeLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f", line {mark.line + 1}, column {mark.column + 1}" if mark is not None else ""
        raise InputError(f"{name}{where}: {_yaml_problem(error)}") from None
    except yaml.reader.ReaderError as error:
        raise InputError(
            f"{name}: the character {chr(int(error.character))!r} at position {error.position} is not allowed"
        ) from None
    except (yaml.YAMLError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"{name}: this is not YAML ({' '.join(str(error).split())})") from None


#: Longest list, in letters, that is written on one line.
_LONGEST_LIST = 60
#: The one of C, where the library has it, which is ten times faster.
_PlainDumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


class _Dumper(_PlainDumper):  # type: ignore[misc]
    """YAML in block style; only short lists of plain values, such as vectors, stand on one line."""

    def represent_sequence(self, tag: str, sequence: Any, flow_style: bool | None = None) -> Any:
        node = super().represent_sequence(tag, sequence, flow_style)
        plain = all(isinstance(part, yaml.ScalarNode) for part in node.value)
        node.flow_style = plain and _letters(node) <= _LONGEST_LIST
        return node


def _letters(node: yaml.SequenceNode) -> int:
    """About how many letters a list takes on one line."""
    return 2 + sum(len(part.value) + 2 for part in node.value)


def to_yaml(case: Section, written: Any = None) -> str:
    """The whole case, defaults included, as YAML that can be run again and gives the same numbers.

    Parameters
    ----------
    case : Section
    written : mapping, optional
        The content that the case was read from; its values are kept with their units, such as "5 mm".
    """
    content = case.model_dump(mode="json", exclude_none=True)
    if isinstance(written, Mapping):
        kept = _with_written(content, written)
        with contextlib.suppress(InputError):
            if load(kept) == case:
                content = kept
    return dump(content)


def _with_written(full: Any, written: Any) -> Any:
    """Full content with the values of another in place that mean the same; plain numbers take the unit of the full."""
    if isinstance(full, Mapping) and isinstance(written, Mapping):
        return {key: _with_written(value, written[key]) if key in written else value for key, value in full.items()}
    number = isinstance(written, (int, float)) and not isinstance(written, bool)
    return full if written is None or (number and isinstance(full, str)) else written


def dump(content: Mapping[str, Any]) -> str:
    """Plain content of a case as YAML: block style, lines of at most 99 letters where the values allow it."""
    return str(
        yaml.dump(content, Dumper=_Dumper, sort_keys=False, default_flow_style=False, width=99, allow_unicode=True)
    )


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
    """Keys of a case that say what arguments of the solvers do: argument -> key (`evolvent.base.errors.in_keys`)."""
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
            raise InputError(f"among the overrides {_key_problem(key)}")
        if kind is not None:
            _write_out(kind, content, key)
        override(content, key, value)
    for key in overrides:
        owner, _, rest = key.partition(".")
        name = rest.partition(".")[0]
        if name and owner in named and name not in named[owner] and "kind" not in content[owner][name]:
            raise InputError(f"cannot set {key!r}: no part is called {name!r}; {nearest(name, named[owner])}")


def _write_out(kind: type[Section], content: Any, key: str) -> None:
    """Write out what stands for a section in short, where a key goes into it: rows that stand for {table: rows}."""
    path = key.split(".")
    place = content
    for k, name in enumerate(path[:-1]):
        if isinstance(place, list) and name.isdecimal() and int(name) < len(place):
            place = place[int(name)]
            continue
        if not isinstance(place, dict) or place.get(name) is None:
            return
        inner, wanted = place[name], path[k + 1]
        if not isinstance(inner, dict) and not (isinstance(inner, list) and wanted.isdecimal()):
            with contextlib.suppress(InputError):
                for one, _ in locate(kind, ".".join(path[: k + 1]), content).types:
                    if isinstance(one, type) and issubclass(one, Section) and wanted in one.model_fields:
                        with contextlib.suppress(ValidationError):
                            one.model_validate({wanted: inner})
                            place[name] = {wanted: inner}
        place = place[name]


def _kind(content: Mapping[str, Any]) -> type[Section]:
    """The model of a case's system."""
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
    kind: type[Section] = system(content["system"]).Case
    return kind


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
    if name in _files() or (is_word and not os.path.exists(name)):
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


def copied(content: Any) -> Any:
    """A copy of nested mappings and sequences as dicts and lists, which may be changed."""
    if isinstance(content, Mapping):
        for key in content:
            if not isinstance(key, str):
                raise InputError(f"in the case {_key_problem(key)}")
        return {key: copied(value) for key, value in content.items()}
    return [copied(value) for value in content] if isinstance(content, (list, tuple)) else content


def parse_assignment(assignment: str) -> tuple[str, Any]:
    """Key and value of ``key.path=value``; the value is read as YAML.

    Raises
    ------
    InputError
        If it has no ``=`` or no key.
    """
    key, equals, value = assignment.partition("=")
    if not equals or not re.fullmatch(r"\w+(\.\w[\w -]*)*", key.strip()):
        raise InputError(f"--set {assignment!r} is not of the form key.path=value, such as blade.nodes=40")
    return key.strip(), parse_yaml(value, f"--set {assignment}")


def parse_assignments(assignments: Iterable[str]) -> dict[str, Any]:
    """What several ``--set`` change; no key twice."""
    found: dict[str, Any] = {}
    for assignment in assignments:
        key, value = parse_assignment(assignment)
        if key in found:
            raise InputError(f"--set gives {key!r} twice; give it once")
        found[key] = value
    return found


def override(content: dict[str, Any], key: str, value: Any) -> None:
    """Put `value` in the place of a dotted key; a number in the key counts the entries of a list, from 0."""
    *path, last = parts = key.split(".")
    place: Any = content
    shared = False
    for k, name in enumerate(path):
        if isinstance(place, dict) and name not in place:
            if parts[k + 1].isdecimal():
                raise InputError(f"cannot set {key!r}: {'.'.join(path[: k + 1])!r} is not given; give the whole list")
            place[name] = {}
        place = place[_subscript(place, name, key, ".".join(path[:k]))]
        shared = (isinstance(place, list) and _write_units(place)) or shared
    at = _subscript(place, last, key, ".".join(path))
    if shared and isinstance(value, (int, float)) and not isinstance(value, bool):
        value = f"{value!r} {unit_of(place[at])}"  # in the unit of its list
    place[at] = value


def _write_units(values: list[Any]) -> bool:
    """Give each entry of a list the unit that stands in the last one alone, and so each column of a table.

    Returns whether a unit was added.
    """
    before = list(values)
    with contextlib.suppress(UnitError):
        if all(isinstance(row, list) and len(row) == len(before[0]) for row in before):
            columns = [shared_unit(list(column)) for column in zip(*before, strict=True)]
            values[:] = [list(row) for row in zip(*columns, strict=True)]
        elif not any(isinstance(value, (list, dict)) for value in before):
            values[:] = shared_unit(before)
    return values != before


def _subscript(place: Any, name: str, key: str, before: str) -> str | int:
    """What `name` stands for in a dict or list at the key `before`."""
    if isinstance(place, dict):
        return name
    if not isinstance(place, list):
        raise InputError(f"cannot set {key!r}: {before!r} is {shown(place)}, which has no keys")
    if name.isdecimal() and name in map(str, range(len(place))):
        return int(name)
    raise InputError(f"cannot set {key!r}: {before!r} is a list of {len(place)}, counted from 0; it has no {name!r}")
