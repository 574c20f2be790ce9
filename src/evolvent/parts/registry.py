"""Kinds of parts by name - built in, and of packages outside - and parts as a case file holds them."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import GetJsonSchemaHandler, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from evolvent.assembly.references import check_name
from evolvent.base import plugins
from evolvent.base.errors import InputError, nearest
from evolvent.base.schema import Annotation, error_priority, sentence, shown
from evolvent.parts.base import Part

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

#: Entry points by which a package outside adds parts: name of a kind -> class.
GROUP = "evolvent.parts"


def kinds() -> Mapping[str, type[Part]]:
    """Every kind of part that a case file may name: "rigid-body" -> RigidBody, and so on.

    A package outside adds one by an entry point of the group ``evolvent.parts``, whose object is a subclass of
    `parts.base.Part` with a field ``kind`` of its own. Those that cannot be used are left out, see `unusable`.
    """
    return _kinds_and_failures()[0]


def unusable() -> Mapping[str, str]:
    """Sentences on parts of packages outside that cannot be loaded, are none, or have a kind that is taken, by name."""
    return _kinds_and_failures()[1]


def not_known(kind: Any) -> str:
    """What to say of a kind that no part has: why that of a package cannot be used, or the nearest one."""
    if isinstance(kind, str) and kind in unusable():
        return unusable()[kind]
    return nearest(str(kind), kinds())


@functools.cache
def _kinds_and_failures() -> tuple[Mapping[str, type[Part]], Mapping[str, str]]:
    """Kinds of parts that can be used, and why others cannot."""
    from evolvent import parts

    wrong: dict[str, str] = {}
    found: dict[str, type[Part]] = {}
    for name in parts.__all__:
        part = getattr(parts, name)
        if isinstance(part, type) and issubclass(part, Part):
            found[part.model_fields["kind"].default] = part
    for entry in plugins.entry_points(GROUP):
        try:
            kind, part = _load(entry)
        except InputError as error:
            wrong[entry.name] = str(error)
            continue
        if kind in found:
            wrong[entry.name] = f"the plug-in {_called(entry)} adds a part of kind {kind!r}, which is already known"
        else:
            found[kind] = part
    return MappingProxyType(found), MappingProxyType(wrong)


def _called(entry: EntryPoint) -> str:
    package = f" of the package {entry.dist.name!r}" if entry.dist is not None else ""
    return f"{entry.name!r}{package}"


def _load(entry: EntryPoint) -> tuple[str, type[Part]]:
    """Kind and class of a package's part."""
    part = plugins.load(entry, f"the plug-in {_called(entry)}")
    field = part.model_fields.get("kind") if isinstance(part, type) and issubclass(part, Part) else None
    if field is None or not isinstance(field.default, str):
        raise InputError(
            f"the plug-in {_called(entry)} is {shown(part)}; it must be a subclass of evolvent.parts.base.Part with a "
            f"field 'kind', such as kind: Literal['hoop'] = 'hoop'"
        )
    return field.default, part


def read_parts(values: Any, key: str = "parts") -> dict[str, Part]:
    """Parts by name, of a mapping as a case file holds it: name -> keys, with the kind of the part.

    Parameters
    ----------
    values : mapping
    key : str, that stands before the names in messages

    Raises
    ------
    InputError
        If a name, kind, key or value cannot be used; one sentence.

    Examples
    --------
    >>> read_parts({"bob": {"kind": "point", "mass": "200 g"}})["bob"].mass
    0.2
    """
    found, errors = _read(values, key)
    if errors:
        raise InputError(str(errors[0]["type"]))
    return found


def _read(values: Any, key: str) -> tuple[dict[str, Part], list[InitErrorDetails]]:
    """Parts by name, and what is wrong: sentences with the key of each."""
    found: dict[str, Part] = {}
    errors: list[InitErrorDetails] = []

    def wrong(text: str, value: Any, *where: Any) -> None:
        error = PydanticCustomError("sentence", "{text}", {"text": text})
        errors.append(InitErrorDetails(type=error, loc=where, input=value))

    if not isinstance(values, Mapping):
        wrong(f"{key} is {shown(values)}; it must be a mapping of names to parts", values)
        return found, errors
    for name, given in values.items():
        try:
            check_name(name)
        except InputError as error:
            wrong(f"{key}: {error}", name, str(name))
            continue
        here = f"{key}.{name}"
        if isinstance(given, Part):
            found[name] = given
        elif not isinstance(given, Mapping):
            wrong(f"{here} is {shown(given)}; it must be a mapping of keys to values", given, name)
        elif "kind" not in given:
            wrong(f"{here}.kind is missing; known: {', '.join(sorted(kinds()))}", given, name, "kind")
        elif not isinstance(given["kind"], str) or given["kind"] not in kinds():
            word = given["kind"]
            wrong(f"{here}.kind is {shown(word)}; {not_known(word)}", word, name, "kind")
        else:
            part = kinds()[given["kind"]]
            try:
                found[name] = part.__pydantic_validator__.validate_python(dict(given))
            except ValidationError as error:
                for one in sorted(error.errors(include_url=False), key=error_priority):
                    wrong(sentence([one], part, before=f"{here}."), one["input"], name, *one["loc"])
    return found, errors


class _ByName(Annotation):
    """A pydantic annotation: parts by name, as `read_parts` reads them."""

    allowed = "a mapping of names to parts"

    def section_of(self, content: Any) -> type[Part] | None:
        """The class of a part as a case file holds it; None where its kind is not known."""
        kind = content.get("kind") if isinstance(content, Mapping) else None
        return kinds().get(kind) if isinstance(kind, str) else None

    def read(self, values: Any) -> dict[str, Part]:
        """The parts; errors have the path of the key, and the whole sentence."""
        found, errors = _read(values, "parts")
        if errors:
            raise ValidationError.from_exception_data("parts", errors)
        return found

    def write(self, values: Mapping[str, Part]) -> dict[str, Any]:
        """The parts as a case file holds them."""
        return {name: part.as_keys() for name, part in values.items()}

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """An object, each of whose values is one of the kinds."""
        parts = [{**handler(part.__pydantic_core_schema__), "required": ["kind"]} for part in kinds().values()]
        return {"type": "object", "additionalProperties": {"oneOf": parts}}


#: The key ``parts`` of a case: names, and for each the keys of a part, with its kind.
PartsByName = Annotated[dict[str, Part], _ByName()]
