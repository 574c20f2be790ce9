"""Schema: what a user writes as mappings of keys, in Python and in files; errors about it are one sentence."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import inspect
import re
import types
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple, Protocol, Self, Union, get_args, get_origin, runtime_checkable

from pydantic import (
    BaseModel,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationError,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError, PydanticSerializationError, core_schema

from evolvent_base.errors import HIDDEN, InputError, nearest


def check_visible(key: str, value: Any) -> None:
    """Refuse a text with characters that are not seen, such as those that turn the direction of writing.

    Raises
    ------
    InputError
    """
    hidden = HIDDEN.search(value) if isinstance(value, str) else None
    if hidden is not None:
        raise InputError(f"{key} is {shown(value)}; the character {hidden[0]!a} is not allowed in it")


class Annotation:
    """What a pydantic annotation of a key does: `read` checks a value, `write` gives it as a file holds it."""

    def read(self, value: Any) -> Any:
        """The checked value."""
        raise NotImplementedError

    def write(self, value: Any) -> Any:
        """`value` as a file holds it."""
        return value

    def meant(self, *, second: bool | None) -> Annotation:
        """The annotation of one of two quantities; itself where it is of one alone."""
        return self

    def inner_keys(self) -> Mapping[str, tuple[Any, Any]]:
        """Keys of a mapping that may stand for the value: the type of each and its annotation, None for none."""
        return {}

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A validator, and a serializer."""
        return core_schema.no_info_plain_validator_function(
            self.read,
            serialization=core_schema.plain_serializer_function_ser_schema(self.write, when_used="json"),
        )


class Section(BaseModel):
    """A mapping of known keys to values: frozen, and every key must be known.

    Made in Python by keyword arguments, it raises an `InputError` of one sentence; inside a larger mapping, pydantic's
    error with the path of the key.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    def __init__(self, /, **values: Any) -> None:
        try:
            self.__pydantic_validator__.validate_python(values, self_instance=self)
        except ValidationError as error:
            kind = type(self)
            raise InputError(sentence(error.errors(include_url=False), kind, before=f"{kind.__name__}.")) from None

    @model_validator(mode="after")
    def _refuse(self) -> Self:
        for key, value in self.__dict__.items():
            if isinstance(value, str):
                check_visible(key, value)
        for text in self.refusals():
            raise InputError(text)
        return self

    def refusals(self) -> Iterator[str]:
        """A sentence for each rule between keys that the section breaks; the first one is raised as an `InputError`."""
        yield from ()

    @classmethod
    def type_of(cls, key: str, content: Any) -> Any:
        """The type of a key, which may depend on the other keys of the section as a file holds it."""
        return cls.model_fields[key].annotation

    # pydantic then validates inner sections itself, and keeps the path of what is wrong
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    def __setattr__(self, name: str, value: Any) -> None:
        raise InputError(f"{type(self).__name__}.{name} cannot be changed; make another one, with replaced({name}=...)")

    def replaced(self, **changes: Any) -> Self:
        """The same section with other values of some keys, checked like a new one."""
        return type(self)(**{key: getattr(self, key) for key in self.model_fields_set} | changes)

    def model_dump(self, **options: Any) -> dict[str, Any]:
        """The section as a mapping; ``mode="json"``: as a file holds it.

        Raises
        ------
        InputError
            If a value cannot stand in a file, such as a Python function.
        """
        try:
            return super().model_dump(**options)
        except PydanticSerializationError as error:
            if isinstance(error.__cause__, InputError):
                raise error.__cause__ from None
            raise

    @classmethod
    def model_parametrized_name(cls, params: tuple[type[Any], ...]) -> str:  # type: ignore[override]
        """Name of a section of other units: that of the section."""
        return cls.__name__

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The keys, each described by the class's docstring where its field has no description of its own."""
        found = handler(schema)
        target = handler.resolve_ref_schema(found)
        if cls.__doc__:
            target["description"] = " ".join(inspect.cleandoc(cls.__doc__).split("\n\n")[0].split())
        for key, text in descriptions(cls).items():
            if text and key in target.get("properties", {}):
                target["properties"][key]["description"] = text
        return found


@functools.cache
def descriptions(kind: type[Section]) -> Mapping[str, str]:
    """What each key of a section means: its field's description, else its text in the numpydoc docstring."""
    texts: dict[str, str] = {"kind": "Kind of the part."} if "kind" in kind.model_fields else {}
    for one in reversed(kind.__mro__):
        texts |= parameters(one.__doc__ or "")
    return {key: field.description or texts.get(key, "") for key, field in kind.model_fields.items()}


def parameters(doc: str) -> dict[str, str]:
    """Text of every name in the section "Parameters" of a numpydoc docstring; its type where it has no text."""
    match = re.search(r"\nParameters\n-+\n(.*?)(?=\n\n[A-Z][\w ]*\n-+\n|\Z)", inspect.cleandoc(doc), re.DOTALL)
    found: dict[str, str] = {}
    entry = r"^(?P<names>\w+(?:, \w+)*) : (?P<type>.*)(?P<text>(?:\n(?: .*|(?=\n )))*)"
    for one in re.finditer(entry, match[1] if match else "", re.MULTILINE):
        # a text that begins with a small letter goes on with the line of the type, without its words of Python
        text = " ".join(one["text"].split())
        if not text[:1].isupper():
            text = f"{_PYTHON.sub('', one['type'])} {text}".lstrip(", ").rstrip()
            if re.match(r"(?!(?:rad|deg|kg|mm|mol)\b)[a-z]{2}", text):  # a word, and not a unit
                text = text[0].upper() + text[1:]
        found |= dict.fromkeys(one["names"].split(", "), text)
    return found


#: Of the type of a parameter in a docstring: a shape, a type of Python or its words, and whether it may be left out.
_PYTHON = re.compile(r"^(?:\([^)]*\) )?(?:float|str|int|bool)\b|^\{[^}]*\} ?|,? optional\b")


@dataclasses.dataclass(frozen=True, eq=False)
class OneOf:
    """A pydantic annotation: a section of one of several kinds, in a file under the name of its kind.

    ``{tube: {radius: 1 cm, thickness: 0.3 mm}}``; of a kind with a single key, the value alone: ``{circle: 1 cm}``.

    Parameters
    ----------
    kinds : mapping, name of the kind -> section
    """

    kinds: Mapping[str, type[Section]]

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        return f"a mapping with one of the keys {', '.join(sorted(self.kinds))}"

    def _choose(self, value: Any) -> str:
        """Name of the kind of a value."""
        for name, kind in self.kinds.items():
            if type(value) is kind:
                return name
        if isinstance(value, Mapping) and len(value) == 1:
            (name,) = value
            if name in self.kinds:
                return str(name)
            message = f"{name!r} is none of its kinds; {nearest(str(name), self.kinds)}"
            raise PydanticCustomError("kind", "{message}", {"message": message})
        raise PydanticCustomError("kind", "it must be {allowed}", {"allowed": self.allowed})

    def _inner(self, value: Any) -> Any:
        """The section, or its keys."""
        name = self._choose(value)
        kind = self.kinds[name]
        if isinstance(value, kind):
            return value
        keys, inner = list(kind.model_fields), value[name]
        return {keys[0]: inner} if len(keys) == 1 and not isinstance(inner, (Mapping, kind)) else inner

    def write(self, value: Section) -> dict[str, Any]:
        """A section as a file holds it."""
        return {self._choose(value): value.model_dump(mode="json", exclude_defaults=True)}

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A union of the kinds."""
        choices: dict[Any, Any] = {
            name: core_schema.no_info_before_validator_function(self._inner, handler.generate_schema(kind))
            for name, kind in self.kinds.items()
        }
        # the union itself must not see what it cannot choose for: its own error says less
        return core_schema.no_info_before_validator_function(
            lambda value: (self._choose(value), value)[1],
            core_schema.tagged_union_schema(choices, discriminator=self._choose),
            serialization=core_schema.plain_serializer_function_ser_schema(self.write, when_used="json"),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """One object with one key."""
        shapes = []
        for name, inner in schema["schema"]["choices"].items():
            properties = {name: handler(inner["schema"])}
            shapes.append(
                {"type": "object", "properties": properties, "required": [name], "additionalProperties": False}
            )
        return {"oneOf": shapes}


@runtime_checkable
class SectionsByName(Protocol):
    """A pydantic annotation: a mapping of names, which a user chooses, to sections whose kind their content says."""

    def section_of(self, content: Any) -> type[Section] | None:
        """The kind of the section with such content; None where it says none that is known."""

    def content_of(self, contents: Any, name: str) -> Any:
        """Content of the section of a name, also where another one stands for it; None without any."""

    def written_out(self, contents: Mapping[str, Any], name: str, key: str) -> Mapping[str, Any]:
        """The contents with a place for one key of the section of a name, also where another one stands for it."""

    def expanded(self, contents: Mapping[str, Any]) -> Mapping[str, Any]:
        """The contents with each section by itself for which another one stands."""

    def is_second(self, contents: Any, name: str) -> bool | None:
        """Whether keys of one of two quantities (`units.Either`) mean the second one in the section of a name."""

    def members_of(self, content: Any) -> Iterable[Any]:
        """The contents of the sections for which one stands that is repeated; of others its own."""


def sections(annotation: Any) -> Iterator[type[Section]]:
    """Sections that an annotation holds, within unions and sequences."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation
    for argument in get_args(annotation):
        yield from sections(argument)


def literals(annotation: Any) -> list[str]:
    """The words that an annotation allows, within unions."""
    if get_origin(annotation) is Literal:
        return [one for one in get_args(annotation) if isinstance(one, str)]
    return [one for argument in get_args(annotation) for one in literals(argument)]


@dataclasses.dataclass(frozen=True, eq=False)
class Meant:
    """An annotation of a key with few words: what other words mean, by which a refusal names the right one."""

    words: Mapping[str, str]


def marks(field: Any) -> Iterator[Any]:
    """Annotations of a field, of its type and of the types that a union offers, such as `Quantity`."""
    yield from field.metadata
    for argument in get_args(field.annotation):
        yield from getattr(argument, "__metadata__", ())


def keys(kind: type[Section], before: str = "") -> list[str]:
    """All dotted keys of a case."""
    found = []
    for name, field in kind.model_fields.items():
        found.append(before + name)
        for section in sections(field.annotation):
            found += keys(section, f"{before}{name}.")
        for choice in (one for one in marks(field) if isinstance(one, OneOf)):
            for word, section in choice.kinds.items():
                found += [f"{before}{name}.{word}", *keys(section, f"{before}{name}.{word}.")]
    return found


@functools.cache
def by_name(kind: type[Section]) -> tuple[str, ...]:
    """Keys of a section that hold sections by names which a user chooses."""
    return tuple(
        key for key, field in kind.model_fields.items() if any(isinstance(m, SectionsByName) for m in marks(field))
    )


class Located(NamedTuple):
    """A key of a case.

    Attributes
    ----------
    types : (type, annotations) of each kind of value that it may have
    text : str, what it means
    entry : bool, whether it is an entry of a list
    """

    types: Sequence[tuple[Any, tuple[Any, ...]]]
    text: str
    entry: bool


def locate(kind: type[Section], key: str, content: Any = None) -> Located:
    """What stands at a dotted key of a case; a number in the key counts the entries of a list, from 0.

    Parameters
    ----------
    kind : of the case
    key : str, such as "parts.boom.length" or "blade.nodes"
    content : mapping, the case as it is written, which says what kind a part is of

    Raises
    ------
    InputError
        If the case has no such key; the sentence names the nearest.
    """
    found, names = Located([(kind, ())], "", entry=False), key.split(".")
    second: bool | None = None
    for k, name in enumerate(names):
        inner = within(found, name, content)
        if inner is None:
            raise InputError(_unlocated(kind, key, names[:k], name, found, content))
        mark = _by_name_mark(found)
        if mark is not None:
            second = mark.is_second(content, name)
            content = mark.content_of(content, name)
        else:
            content = content.get(name) if isinstance(content, Mapping) else None
        found = inner

    def meant(own: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(one.meant(second=second) if isinstance(one, Annotation) else one for one in own)

    return found._replace(types=[(one, meant(own)) for one, own in found.types])


def has_columns(place: Located) -> bool:
    """Whether a list at a place is a row whose entries are of different quantities, such as [share, time]."""
    rows = [get_args(kind) for kind, _ in place.types if get_origin(kind) is tuple]
    return any(Ellipsis not in row and any(one != row[0] for one in row) for row in rows)


def _by_name_mark(place: Located) -> SectionsByName | None:
    return next((one for _, own in place.types for one in own if isinstance(one, SectionsByName)), None)


def member(values: Mapping[str, Any], name: str) -> str:
    """A name of checked sections: of one that stands for several, "hinge", the first of these, "hinge 1"."""
    return next(iter(members(values, name)), name)


def members(names: Iterable[Any], name: str) -> list[str]:
    """What a name stands for: itself, or "rib 1", "rib 2" and so on where none of the names is "rib"; else nothing."""
    known = [str(one) for one in names]
    if name in known:
        return [name]
    return [one for one in known if re.fullmatch(rf"{re.escape(name)} [0-9]+", one)]


def inner(place: Located, name: str, content: Any) -> Located:
    """What a name refers to at a place that holds `content`; a place without types if nothing can stand there."""
    return within(place, name, content) or Located([], "", entry=False)


def within(place: Located, name: str, content: Any) -> Located | None:
    """What a name of a section refers to; None if nothing can."""
    for kind, own_marks in place.types:
        for mark in own_marks:
            if isinstance(mark, SectionsByName):
                section = mark.section_of(mark.content_of(content, name))
                return None if section is None else Located([(section, ())], "", entry=False)
            if isinstance(mark, Annotation) and name in mark.inner_keys():
                inner_kind, inner_mark = mark.inner_keys()[name]
                return Located([(inner_kind, () if inner_mark is None else (inner_mark,))], place.text, entry=False)
            if isinstance(mark, OneOf) and name in mark.kinds:
                section = mark.kinds[name]
                only = _field(section, next(iter(section.model_fields))) if len(section.model_fields) == 1 else None
                return Located([(section, ()), *(only.types if only else ())], only.text if only else "", entry=False)
        if isinstance(kind, type) and issubclass(kind, Section) and name in kind.model_fields:
            return _field(kind, name, content)
        arguments = get_args(kind)
        if get_origin(kind) is dict:
            return Located(_types(arguments[1]), place.text, entry=False)
        if name.isdecimal() and get_origin(kind) in (tuple, list):
            last = min(int(name), len([a for a in arguments if a is not Ellipsis]) - 1)
            inner = [(one, (*own, *own_marks)) for one, own in _types(arguments[last])]
            return Located(inner, place.text, entry=True)
    return place._replace(entry=True) if name.isdecimal() else None


def _field(kind: type[Section], name: str, content: Any = None) -> Located:
    found = [(one, (*own, *kind.model_fields[name].metadata)) for one, own in _types(kind.type_of(name, content))]
    return Located(found, descriptions(kind)[name], entry=False)


def _types(annotation: Any) -> list[tuple[Any, tuple[Any, ...]]]:
    """Types that an annotation allows, each with its own annotations; of sections first."""
    if get_origin(annotation) in (Union, types.UnionType):
        found = [one for argument in get_args(annotation) for one in _types(argument)]
        return sorted(found, key=lambda one: not (isinstance(one[0], type) and issubclass(one[0], Section)))
    if hasattr(annotation, "__metadata__"):
        inner, *own = get_args(annotation)
        return [(kind, (*more, *own)) for kind, more in _types(inner)]
    return [(annotation, ())]


def _unlocated(kind: type[Section], key: str, path: Sequence[str], name: str, place: Located, content: Any) -> str:
    """Why a key does not stand in a case, and the nearest that does."""
    if any(isinstance(mark, SectionsByName) for _, annotations in place.types for mark in annotations):
        known = list(content) if isinstance(content, Mapping) else []
        if name not in known:
            return f"{key!r}: no part is called {name!r}; {nearest(name, known)}"
        return f"{key!r}: the kind of {name!r} is not known"
    if not any(isinstance(one, type) and issubclass(one, Section) for one, _ in place.types):
        return f"unknown key {key!r}; {'.'.join(path)!r} has no keys"
    before = "".join(f"{part}." for part in path)
    kinds = [(one, mark) for one, marks_ in place.types for mark in marks_ if isinstance(mark, OneOf)]
    beside = [before + word for _, mark in kinds for word in mark.kinds]
    sections_here = [one for one, _ in place.types if isinstance(one, type) and issubclass(one, Section)]
    beside += [k for one in sections_here if not kinds for k in keys(one, before)]
    known = sorted({*beside, *(keys(kind) if not path else ())})
    alike = [k for k in known if k.rpartition(".")[2] == key.rpartition(".")[2]]
    close = difflib.get_close_matches(key, alike, n=1, cutoff=0.0)
    if close:
        return f"unknown key {key!r}; did you mean {close[0]!r}?"
    level = [k for k in known if "." not in k[len(before) :]]
    guesses = nearest(before + name, level), nearest(key, known), nearest(before + name, known)
    return f"unknown key {key!r}; " + next((guess for guess in guesses if guess[:3] == "did"), guesses[-1])


def _nearest_key(kind: type[Section], location: tuple[Any, ...], start: str) -> str:
    """A closing half sentence for an unknown key: the nearest beside it, or one of that name elsewhere."""
    *path, last = (part for part in dotted(location).split(".") if not part.isdigit())
    before = start + (".".join(path) + "." if path else "")
    every = keys(kind, start)
    beside = {k for k in every if k.startswith(before) and "." not in k[len(before) :]}
    guess = nearest(before + last, beside)
    if guess.startswith("did you mean"):
        return guess
    elsewhere = [k for k in every if k.rpartition(".")[2] == last]
    return f"did you mean {elsewhere[0]!r}?" if elsewhere else guess


def dotted(location: Sequence[Any]) -> str:
    """A location as a dotted key."""
    # pydantic names the branch of a union by its kind, such as "function-plain[read()]"; that is no key
    return ".".join(str(part) for part in location if not re.fullmatch(r"[\w-]+\[.*\]", str(part)))


def error_priority(error: Any) -> tuple[bool, int]:
    """Key by which pydantic's errors are sorted: what a user should read first comes first.

    Unknown keys explain others; last come the numbers and then the words that a list might have been, since its errors
    say more.
    """
    rank, lists = {"literal_error": (2, (list, dict)), "quantity": (1, (list, tuple))}.get(error["type"], (0, ()))
    return error["type"] != "extra_forbidden", rank if isinstance(error["input"], lists) else 0


def sentence(errors: Sequence[Any], kind: type[Section], *, before: str = "") -> str:
    """The first of pydantic's errors as one sentence; an unknown key comes first, for it often explains the others.

    Parameters
    ----------
    errors : of a `ValidationError`
    kind : the section that was read
    before : str, put before every key
    """
    first = sorted(errors, key=error_priority)[0]
    key = before + dotted(first["loc"])
    value, message, context = first["input"], first["msg"], first.get("ctx", {})
    match first["type"]:
        case "sentence":
            return str(message)
        case "extra_forbidden":
            return f"unknown key {key!r}; {_nearest_key(kind, first['loc'], before)}"
        case "missing" if isinstance(first["loc"][-1], int):
            missing = [int(e["loc"][-1]) for e in errors if e["loc"][:-1] == first["loc"][:-1]]
            wanted = 1 + max(missing)
            key = key.rpartition(".")[0]
            message = f"it must have {wanted} values, not {min(missing)}"
        case "missing":
            return f"{key} is missing" + _wanted(kind, first["loc"])
        case "literal_error":
            known = re.findall(r"'([^']*)'", context.get("expected", ""))
            if known:
                field = _field_at(kind, first["loc"])
                others = next((mark.words for mark in marks(field) if isinstance(mark, Meant)), {}) if field else {}
                word = others.get(str(value))
                return f"{key} is {value!r}; {f'did you mean {word!r}?' if word else nearest(str(value), known)}"
            message = f"it must be {context.get('expected')}"
        case "model_type":
            message = "it must be a mapping of keys to values"
        case "bool_type" | "bool_parsing":
            message = "it must be true or false"
        case "tuple_type" | "list_type":
            message = "it must be a list"
        case "too_short" | "too_long":
            limit = context.get("max_length", context.get("min_length"))
            message = f"it must have {limit} values, not {context['actual_length']}"
    return f"{key.rstrip('.')} is {shown(value)}; {message}"


def _field_at(kind: type[Section], location: tuple[Any, ...]) -> FieldInfo | None:
    """Field of a key, where it is known."""
    here, choice = kind, None
    for part in location[:-1]:
        if choice is not None and part in choice.kinds:
            here, choice = choice.kinds[part], None
        elif part in here.model_fields:
            field = here.model_fields[part]
            choice = next((mark for mark in marks(field) if isinstance(mark, OneOf)), None)
            here = next(sections(field.annotation), here)
    return here.model_fields.get(str(location[-1]))


def _wanted(kind: type[Section], location: tuple[Any, ...]) -> str:
    """What a missing key requires, where its annotation states it."""
    last = _field_at(kind, location)
    for annotation in marks(last) if last is not None else ():
        allowed = getattr(annotation, "allowed", None)
        if allowed:
            return f"; it must be {allowed}"
    words = literals(last.annotation) if last is not None else []
    return f"; it must be one of {', '.join(words)}" if words else ""


def shown(value: Any) -> str:
    """`value` in a few words."""
    try:
        text = "empty" if value is None else repr(value)
    except ValueError:  # Python does not write integers of more than some thousand digits
        text = "a number of very many digits"
    return text if len(text) <= 80 else text[:77] + "..."
