"""YAML as cases are written: read without surprises, refused by one sentence, written back."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import yaml

from evolvent_base.errors import HIDDEN, InputError
from evolvent_base.schema import shown

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
        if name.tag == "tag:yaml.org,2002:merge":  # whose keys stand where the mapping has none of its own
            if "<<" in keys:
                problem = "the merge key '<<' is given twice; give it a list, <<: [*one, *other]"
                raise yaml.constructor.ConstructorError(None, None, problem, name.start_mark)
            keys.add("<<")
            continue
        key = loader.construct_object(name, deep=True)
        problem = key_problem(key) or (f"the key {key!r} is given twice" if key in keys else "")
        if problem:
            raise yaml.constructor.ConstructorError(None, None, problem, name.start_mark)
        keys.add(key)
    return loader.construct_mapping(node, deep=True)


_SlowLoader.add_constructor("tag:yaml.org,2002:map", _mapping)
_Loader.yaml_implicit_resolvers = _SlowLoader.yaml_implicit_resolvers
_Loader.yaml_constructors = _SlowLoader.yaml_constructors


def key_problem(key: Any) -> str:
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
    (r"for merging", "the merge key '<<' takes a mapping, as in <<: *name, or a list of mappings"),
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
        except (yaml.scanner.ScannerError, yaml.parser.ParserError, yaml.composer.ComposerError) as error:
            # the slow loader takes time that grows with the square of the depth
            if len(source) > _LONGEST_SLOW or "nesting depth" in str(error.problem):
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


def dump(content: Mapping[str, Any]) -> str:
    """Plain content of a case as YAML: block style, lines of at most 99 letters where the values allow it.

    A text is broken at the first blank behind 80 letters.
    """
    return str(
        yaml.dump(content, Dumper=_Dumper, sort_keys=False, default_flow_style=False, width=80, allow_unicode=True)
    )
