"""Kinds of parts by name - built in, and of packages outside - and parts as a case file holds them."""

from __future__ import annotations

import contextlib
import difflib
import functools
import math
import re
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import GetJsonSchemaHandler, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from evolvent import parts
from evolvent.assembly.references import check_name
from evolvent.model import registry as family_registry
from evolvent.parts import repetition
from evolvent.parts.base import Part, kind_of
from evolvent_base import plugins
from evolvent_base.errors import InputError, nearest
from evolvent_base.schema import Annotation, error_priority, literals, marks, sentence, shown
from evolvent_base.units import Either

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

#: Entry points by which a package outside adds parts: name of a kind -> class.
GROUP = "evolvent.parts"
#: From which likeness on a word is taken for a misspelt kind, and for a misspelt type.
ALIKE, ALIKE_TYPE = 0.75, 0.8
#: Letters of a word without its ending that must stand in a description, and most kinds that are named for that.
LEAST_STEM, MOST_DESCRIBED = 4, 4


def kinds() -> Mapping[str, type[Part]]:
    """Every kind of part that a case file may name: "rigid-body" -> RigidBody, and so on.

    Built in are those of `evolvent.parts`. A package outside adds one by an entry point of the group
    ``evolvent.parts``, whose object is a subclass of `parts.base.Part` with a field ``kind`` of its own, or beside the
    family of its records, in a module of the group ``evolvent.families``. Those that cannot be used are left out, see
    `unusable`.
    """
    return _kinds_and_failures()[0]


def unusable() -> Mapping[str, str]:
    """Sentences on parts of packages outside that cannot be loaded, are none, or have a kind that is taken, by name."""
    return _kinds_and_failures()[1]


def not_known(kind: Any) -> str:
    """What to say of a kind that no part has: why that of a package cannot be used, or what may be meant.

    That is a kind of nearly this name, one with such a type, or one whose keys or description have the word.
    """
    if isinstance(kind, str) and kind in unusable():
        return unusable()[kind]
    word = str(kind).lower()
    close = difflib.get_close_matches(word, kinds(), n=1, cutoff=ALIKE)
    if close:
        return f"did you mean {close[0]!r}?"
    own = difflib.get_close_matches(word, _of_types(), n=1, cutoff=ALIKE_TYPE)
    if own:
        return _of_type(own[0])
    heads = [one for one in kinds() if one.rpartition("-")[2] == word.rpartition("-")[2]]
    if heads:
        return nearest(word, heads)
    found = _described(word)
    return f"{word!r} occurs in the description of {', '.join(found)}" if found else nearest("", kinds())


def _of_types() -> dict[str, list[str]]:
    """The words that a key `type` of a part may have, and the kinds of which each is a type."""
    found: dict[str, list[str]] = {}
    for name, part in kinds().items():
        field = part.model_fields.get("type")
        for own in literals(field.annotation) if field is not None else ():
            found.setdefault(own, []).append(name)
    return found


def _of_type(word: Any) -> str:
    """The kinds that have a type, as the end of a sentence; all kinds where none has."""
    of = _of_types().get(word, []) if isinstance(word, str) else []
    if not of:
        return nearest("", kinds())
    return f"{word!r} is a type: give {' or '.join(f'kind: {one}, type: {word}' for one in of)}"


def _described(word: str) -> list[str]:
    """Kinds in whose docstrings all parts of a word occur, but for its ending; none where it is in many of them."""
    stems = [one[: max(LEAST_STEM, len(one) - 2)] for one in re.findall(r"[a-z]+", word)]
    texts = {name: (part.__doc__ or "").lower() for name, part in kinds().items()}
    found = [name for name, text in texts.items() if stems and all(re.search(rf"\b{stem}", text) for stem in stems)]
    return found if len(found) <= MOST_DESCRIBED else []


class _Kinds(Mapping[str, type[Part]]):
    """Kinds of parts; the module of a built-in part is imported when its kind is looked up.

    Parameters
    ----------
    names : mapping, kind -> name of the class in `evolvent.parts`
    added : mapping, kind -> class of another package
    """

    def __init__(self, names: Mapping[str, str], added: Mapping[str, type[Part]]) -> None:
        self._names, self._added = names, added

    def __getitem__(self, kind: str) -> type[Part]:
        if kind in self._added:
            return self._added[kind]
        found: type[Part] = getattr(parts, self._names[kind])
        return found

    def __contains__(self, kind: object) -> bool:
        return kind in self._names or kind in self._added

    def __iter__(self) -> Iterator[str]:
        yield from self._names
        yield from self._added

    def __len__(self) -> int:
        return len(self._names) + len(self._added)


@functools.cache
def _kinds_and_failures() -> tuple[Mapping[str, type[Part]], Mapping[str, str]]:
    """Kinds of parts that can be used, and why others cannot."""
    wrong = dict(family_registry.unusable())
    names = {one.kind: name for name, one in parts.definitions().items() if one.kind}
    added: dict[str, type[Part]] = {}

    def add(kind: str, part: type[Part], name: str, by: str) -> None:
        if kind in names or kind in added:
            wrong[name] = f"{by} adds a part of kind {kind!r}, which is already known"
        else:
            added[kind] = part

    for module in family_registry.modules():
        for part in vars(module).values():
            if kind_of(part) and part.__module__ == module.__name__:
                add(kind_of(part), part, kind_of(part), f"the module {module.__name__!r}")
    for entry in plugins.entry_points(GROUP):
        try:
            kind, part = _load(entry)
        except InputError as error:
            wrong[entry.name] = str(error)
            continue
        add(kind, part, entry.name, f"the plug-in {_called(entry)}")
    return _Kinds(names, added), MappingProxyType(wrong)


def _called(entry: EntryPoint) -> str:
    package = f" of the package {entry.dist.name!r}" if entry.dist is not None else ""
    return f"{entry.name!r}{package}"


def _load(entry: EntryPoint) -> tuple[str, type[Part]]:
    """Kind and class of a package's part."""
    part = plugins.load(entry, f"the plug-in {_called(entry)}")
    kind = kind_of(part)
    if not kind:
        raise InputError(
            f"the plug-in {_called(entry)} is {shown(part)}; it must be a subclass of evolvent.parts.base.Part with a "
            f"field 'kind', such as kind: Literal['hoop'] = 'hoop'"
        )
    return kind, part


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

    def read(name: str, given: Mapping[str, Any]) -> Part | None:
        here = f"{key}.{name}"
        if "kind" not in given:
            meant = [word for word in sorted(kinds()) if given.get("type") == word]
            advice = f"give kind: {meant[0]} in place of type" if meant else _of_type(given.get("type"))
            advice = _numbers_of(values, name) or advice
            wrong(f"{here}.kind is missing; {advice}", given, name, "kind")
        elif not isinstance(given["kind"], str) or given["kind"] not in kinds():
            word = given["kind"]
            wrong(f"{here}.kind is {shown(word)}; {not_known(word)}", word, name, "kind")
        else:
            part = kinds()[given["kind"]]
            try:
                read_part: Part = part.__pydantic_validator__.validate_python(dict(given))
            except ValidationError as error:
                for one in sorted(error.errors(include_url=False), key=error_priority):
                    wrong(sentence([one], part, before=f"{here}."), one["input"], name, *one["loc"])
            else:
                return read_part
        return None

    several, single = [], set[str]()
    for name, given in values.items():
        try:
            check_name(name)
        except InputError as error:
            wrong(f"{key}: {error}", name, str(name))
            continue
        if isinstance(given, Part):
            found[name] = given
        elif not isinstance(given, Mapping):
            wrong(f"{key}.{name} is {shown(given)}; it must be a mapping of keys to values", given, name)
        elif repetition.KEY in given:
            several.append(name)
        elif _copy_of(values, name) is not None:
            single.add(name)
        else:
            part = read(name, given)
            if part is not None:
                found[name] = part
    if not several:
        return found, errors
    fixed, members = dict(found), dict[str, list[str]]()
    for name in several:
        members[name] = []
        how, given = _how(values[name], f"{key}.{name}", name, wrong)
        first = None if how is None else read(name, how.numbered(given, 0))
        if how is None or first is None:
            continue
        try:
            if len(found) + how.count > repetition.MOST:
                raise InputError(
                    f"{key}.{name}.{repetition.KEY}: the case would have more than {repetition.MOST} parts"
                )
            for number, content in repetition.repeated(name, given, how, first, f"{key}.{name}", fixed):
                if (number in values and number not in single) or number in found:
                    raise InputError(f"{key}.{name}.repeat: the name {number!r} is taken by another part")
                one = read(number, {**content, **(values[number] if number in single else {})})
                if one is None and number in single:
                    continue
                if one is None:
                    break
                found[number] = one
                members[name].append(number)
        except InputError as error:
            wrong(str(error), values[name][repetition.KEY], name, repetition.KEY)
    order = [one for name in values if name not in single for one in members.get(name, [name]) if one in found]
    return {name: found[name] for name in order}, errors


def _how(
    content: Mapping[str, Any], here: str, name: str, wrong: Callable[..., None]
) -> tuple[repetition.Repeat | None, dict[str, Any]]:
    """How a part is repeated, None where it does not say so correctly, and its other keys."""
    given = {key: value for key, value in content.items() if key != repetition.KEY}
    try:
        return repetition.Repeat.__pydantic_validator__.validate_python(content[repetition.KEY]), given
    except ValidationError as error:
        for one in sorted(error.errors(include_url=False), key=error_priority):
            before = f"{here}.{repetition.KEY}."
            wrong(sentence([one], repetition.Repeat, before=before), one["input"], name, repetition.KEY, *one["loc"])
    return None, given


def _copy_of(contents: Mapping[str, Any], name: Any) -> tuple[str, dict[str, Any]] | None:
    """The repeated part that stands for a part, which may have other values of some keys, and its keys; None of others.

    A part with a kind, or repeated, stands for itself.
    """
    own = contents.get(name, {})
    if not isinstance(name, str) or not isinstance(own, Mapping) or "kind" in own or repetition.KEY in own:
        return None
    written, _, number = name.rpartition(" ")
    given = contents.get(written)
    if not (number.isdecimal() and isinstance(given, Mapping) and repetition.KEY in given):
        return None
    how, content = _how(given, written, written, lambda *_: None)
    stands = how is not None and how.first <= int(number) < how.first + how.count and number == str(int(number))
    return (written, content) if stands else None


def _numbers_of(contents: Mapping[str, Any], name: str) -> str:
    """For which parts a repeated one stands that has the name but for its number; '' for none."""
    written = name.rpartition(" ")[0]
    given = contents.get(written)
    if not isinstance(given, Mapping) or repetition.KEY not in given:
        return ""
    how, _ = _how(given, written, written, lambda *_: None)
    return (
        ""
        if how is None
        else f"{written!r} stands for '{written} {how.first}' to '{written} {how.first + how.count - 1}'"
    )


def _members(contents: Mapping[str, Any], name: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """The parts for which a repeated one stands, without what is given of single ones: names and keys."""
    alone = {
        one: given
        for one, given in contents.items()
        if not (isinstance(given, Mapping) and repetition.KEY in given) and _copy_of(contents, one) is None
    }
    fixed, (how, given) = read_parts(alone), _how(contents[name], f"parts.{name}", name, _refuse)
    if how is not None:
        first = read_parts({name: how.numbered(given, 0)})[name]
        yield from repetition.repeated(name, given, how, first, f"parts.{name}", fixed)


def _rounded(value: Any) -> Any:
    """A value for a reader: of lists of numbers without the round-off of a turn, to 15 digits of the largest."""
    if isinstance(value, dict):
        return {key: _rounded(one) for key, one in value.items()}
    if not isinstance(value, (list, tuple)):
        return value
    numbers = [abs(one) for one in value if isinstance(one, float)]
    if not numbers or max(numbers) == 0.0:
        return [_rounded(one) for one in value]
    digits = 14 - math.floor(math.log10(max(numbers)))
    return [round(one, digits) + 0.0 if isinstance(one, float) else _rounded(one) for one in value]


def _refuse(text: str, *_: Any) -> None:
    """Raise what is wrong as an InputError."""
    raise InputError(text)


class _ByName(Annotation):
    """A pydantic annotation: parts by name, as `read_parts` reads them."""

    allowed = "a mapping of names to parts"

    def section_of(self, content: Any) -> type[Part] | None:
        """The class of a part as a case file holds it; None where its kind is not known."""
        kind = content.get("kind") if isinstance(content, Mapping) else None
        return kinds().get(kind) if isinstance(kind, str) else None

    def content_of(self, contents: Any, name: str) -> Any:
        """Content of a part; of one for which a repeated part stands, that of this with the keys of its own."""
        if not isinstance(contents, Mapping):
            return None
        own, copy = contents.get(name), _copy_of(contents, name)
        return own if copy is None else {**copy[1], **(own or {})}

    def written_out(self, contents: Mapping[str, Any], name: str, key: str) -> Mapping[str, Any]:
        """The contents with a place for one key of a part by itself, also where a repeated part stands for it.

        Raises
        ------
        InputError
            If the place of this part cannot be found, for other parts are wrong.
        """
        copy = _copy_of(contents, name)
        if copy is None or key in (contents.get(name) or {}):
            return contents
        member = next((one for number, one in _members(contents, copy[0]) if number == name), {})
        return {**contents, name: {**(contents.get(name) or {}), **({key: member[key]} if key in member else {})}}

    def expanded(self, contents: Mapping[str, Any]) -> dict[str, Any]:
        """The contents with each repeated part written out.

        Raises
        ------
        InputError
            If parts are wrong.
        """
        found: dict[str, Any] = {}
        for name, own in contents.items():
            if isinstance(own, Mapping) and repetition.KEY in own:
                members = _members(contents, name)
                found |= {number: {**_rounded(one), **(contents.get(number) or {})} for number, one in members}
            elif _copy_of(contents, name) is None:
                found[name] = own
        return found

    def is_second(self, contents: Any, name: str) -> bool | None:
        """Whether keys of an angle or a travel are of a travel in the part of a name."""
        seen: set[str] = set()

        def travels(where: Any) -> bool:
            """Whether the coordinate of a part, which may be repeated, is a travel."""
            if not isinstance(where, str) or where in seen:
                return False
            seen.add(where)
            content = self.content_of(contents, repetition.NUMBERED.sub("", where))
            part = self.section_of(content)
            return part is not None and part.has_travel(content, travels)

        content = self.content_of(contents, name)
        part = self.section_of(content)
        return None if part is None else part.acts_on_travel(content, travels)

    def members_of(self, content: Any) -> Iterator[Any]:
        """The contents of the parts for which one stands, with their numbers put into texts."""
        if not isinstance(content, Mapping) or repetition.KEY not in content:
            yield content
            return
        with contextlib.suppress(ValidationError, InputError):
            how = repetition.Repeat.__pydantic_validator__.validate_python(content[repetition.KEY])
            for k in range(how.count):
                yield how.numbered({key: one for key, one in content.items() if key != repetition.KEY}, k)

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
        how = handler(repetition.Repeat.__pydantic_core_schema__)
        parts = []
        for part in kinds().values():
            found = handler(part.__pydantic_core_schema__)
            handler.resolve_ref_schema(found).setdefault("properties", {})[repetition.KEY] = how
            parts.append({**found, "required": ["kind"]})
        single = {"type": "object", "not": {"required": ["kind"]}}  # other values of one part of a repeated one
        return {"type": "object", "additionalProperties": {"oneOf": [*parts, single]}}


def with_units(contents: Mapping[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Parts as a case file holds them, with units at plain numbers of an angle or a travel too: those of its joint."""
    named, found = _ByName(), {name: dict(content) for name, content in contents.items()}
    for name, content in contents.items():
        part = named.section_of(content)
        for key, field in part.model_fields.items() if part is not None else ():
            mark = next((one for one in marks(field) if isinstance(one, Either)), None)
            if mark is not None and isinstance(content.get(key), float):
                found[name][key] = mark.meant(second=named.is_second(contents, name)).write(content[key])
    return found


#: The key ``parts`` of a case: names, and for each the keys of a part, with its kind.
PartsByName = Annotated[dict[str, Part], _ByName()]
