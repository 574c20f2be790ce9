"""Schema: what a user writes as mappings of keys, in Python and in files; errors about it are one sentence."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Self, get_args

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationError
from pydantic_core import PydanticCustomError, PydanticSerializationError, core_schema

from evolvent.errors import InputError, nearest


class Section(BaseModel):
    """A mapping of known keys to values: frozen, and every key must be known.

    Made in Python by keyword arguments, it raises an `InputError` of one sentence; inside a larger mapping, pydantic's
    error with the place of the key.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, /, **values: Any) -> None:
        try:
            self.__pydantic_validator__.validate_python(values, self_instance=self)
        except ValidationError as error:
            kind = type(self)
            raise InputError(sentence(error.errors(include_url=False), kind, before=f"{kind.__name__}.")) from None

    # pydantic then validates inner sections itself, and keeps the place of what is wrong
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
        # a text that begins with a small letter goes on with the line of the type
        text = one["text"].strip()
        text = " ".join((text if text[:1].isupper() else f"{one['type']} {text}").split())
        found |= dict.fromkeys(one["names"].split(", "), text)
    return found


@dataclasses.dataclass(frozen=True, eq=False)
class OneOf:
    """A pydantic annotation: a section of one of several kinds, in a file under the name of its kind.

    ``{tube: {radius: 1 cm, thickness: 0.3 mm}}``; of a kind with a single key, the value alone: ``{rod: 1 cm}``.

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
        # the union itself must not see what it cannot choose for: its own error tells less
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


def sections(annotation: Any) -> Iterator[type[Section]]:
    """Sections that an annotation holds, within unions and sequences."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation
    for argument in get_args(annotation):
        yield from sections(argument)


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


def _nearest_key(kind: type[Section], location: tuple[Any, ...], start: str) -> str:
    """A closing half sentence for an unknown key: the nearest beside it, or one of that name elsewhere."""
    *path, last = (str(part) for part in location if not isinstance(part, int))
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


def urgent(error: Any) -> tuple[bool, bool]:
    """Key by which pydantic's errors are sorted: what a user should read first comes first.

    Unknown keys explain others; last come the words that a list might have been, for what is wrong with it tells more.
    """
    kind = error["type"]
    return kind != "extra_forbidden", kind == "literal_error" and isinstance(error["input"], (list, dict))


def sentence(errors: Sequence[Any], kind: type[Section], *, before: str = "") -> str:
    """The first of pydantic's errors as one sentence; an unknown key comes first, for it often explains the others.

    Parameters
    ----------
    errors : of a `ValidationError`
    kind : the section that was read
    before : str, put before every key
    """
    first = sorted(errors, key=urgent)[0]
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
                return f"{key} is {value!r}; {nearest(str(value), known)}"
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


def _wanted(kind: type[Section], location: tuple[Any, ...]) -> str:
    """What a missing key wants, where its annotation says so."""
    here, choice = kind, None
    for part in location[:-1]:
        if choice is not None and part in choice.kinds:
            here, choice = choice.kinds[part], None
        elif part in here.model_fields:
            field = here.model_fields[part]
            choice = next((mark for mark in marks(field) if isinstance(mark, OneOf)), None)
            here = next(sections(field.annotation), here)
    last = here.model_fields.get(str(location[-1]))
    for annotation in marks(last) if last is not None else ():
        allowed = getattr(annotation, "allowed", None)
        if allowed:
            return f"; it must be {allowed}"
    return ""


def shown(value: Any) -> str:
    """`value` in a few words."""
    try:
        text = "empty" if value is None else repr(value)
    except ValueError:  # Python does not write integers of more than some thousand digits
        text = "a number of very many digits"
    return text if len(text) <= 80 else text[:77] + "..."
