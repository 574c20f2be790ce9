"""Schema: what a user writes as mappings of keys, in Python and in files; errors about it are one sentence."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any, get_args

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import PydanticSerializationError

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


def sections(annotation: Any) -> Iterator[type[Section]]:
    """Sections that an annotation holds, within unions and sequences."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation
    for argument in get_args(annotation):
        yield from sections(argument)


def keys(kind: type[Section], before: str = "") -> list[str]:
    """All dotted keys of a case."""
    found = []
    for name, field in kind.model_fields.items():
        found.append(before + name)
        for section in sections(field.annotation):
            found += keys(section, f"{before}{name}.")
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


def sentence(errors: Sequence[Any], kind: type[Section], *, before: str = "") -> str:
    """The first of pydantic's errors as one sentence; an unknown key comes first, for it often explains the others.

    Parameters
    ----------
    errors : of a `ValidationError`
    kind : the section that was read
    before : str, put before every key
    """

    def order(e: Any) -> tuple[bool, bool]:
        """Last come the words that a list might have been: what is wrong with the list tells more."""
        return e["type"] != "extra_forbidden", e["type"] == "literal_error" and isinstance(e["input"], (list, dict))

    first = sorted(errors, key=order)[0]
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
            return f"{key} is {value!r}; {nearest(str(value), known)}"
        case "model_type":
            message = "it must be a mapping of keys to values"
        case "bool_type" | "bool_parsing":
            message = "it must be true or false"
        case "tuple_type" | "list_type":
            message = "it must be a list"
        case "too_short" | "too_long":
            limit = context.get("max_length", context.get("min_length"))
            message = f"it must have {limit} values, not {context['actual_length']}"
    return f"{key} is {shown(value)}; {message}"


def _wanted(kind: type[Section], location: tuple[Any, ...]) -> str:
    """What a missing key wants, where its annotation says so."""
    here = kind
    for part in location[:-1]:
        inner = list(sections(here.model_fields[part].annotation)) if not isinstance(part, int) else []
        here = inner[0] if inner else here
    field = here.model_fields.get(str(location[-1]))
    for annotation in field.metadata if field is not None else ():
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
