"""A form from the pydantic model of a case: its fields with units, help and limits, and what was typed as a case."""

from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Iterator, Mapping, Sequence
from types import NoneType
from typing import Any, Literal, get_args, get_origin

import yaml
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from evolvent import cases
from evolvent.parts.applies import When
from evolvent.parts.base import Part, Reference
from evolvent.parts.repetition import APPLIES as REPEAT_APPLIES, KEY as REPEAT, Repeat
from evolvent_base.errors import InputError
from evolvent_base.schema import Meant, Section, descriptions
from evolvent_base.units import OneOrMore, Quantity, Whole
from evolvent_studio import fieldtypes


@dataclasses.dataclass(frozen=True, kw_only=True)
class Field:
    """One value of a case.

    Attributes
    ----------
    key : str, dotted
    name : str, as it is shown
    kind : "text", "choice" or "switch"; a text is YAML, such as ``5 m`` or ``[1 m, 2 m]``
    unit : str, of a plain number, '' for none
    help : str, what it is and what is allowed
    default : str, what stands for it where it is left out, as text
    choices : tuple of str
    open : bool, whether something beside the choices may be given
    required : bool
    numeric : bool, whether the choices are numbers
    wide : bool, whether it is a mapping or a table, which needs a whole line
    columns : tuple of str, of a table: what each holds, and its unit in brackets
    refers : bool, whether it names other parts
    when : tuple of When, conditions on other fields under which it applies
    decides : bool, whether other fields apply by its value, so that it is always shown
    """

    key: str
    name: str
    kind: str
    unit: str
    help: str
    default: str
    choices: tuple[str, ...]
    open: bool
    required: bool
    numeric: bool = False
    wide: bool = False
    columns: tuple[str, ...] = ()
    refers: bool = False
    when: tuple[When, ...] = ()
    decides: bool = False

    def leads(self, defaults: Mapping[str, str]) -> bool:
        """Whether it is not folded away where it applies: it decides on others, or is asked for by a choice."""
        return self.decides or any(w.values and defaults.get(w.keys[0]) not in w.values for w in self.when)

    def applies(self, texts: Mapping[str, str], defaults: Mapping[str, str]) -> bool:
        """Whether it is shown beside what is typed in other fields, which have defaults: it applies, or is given."""
        return bool(texts.get(self.key)) or all(
            when.holds({key: texts.get(key) or (defaults.get(key, "") if when.values else "") for key in when.keys})
            for when in self.when
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Group:
    """A section of a case.

    Attributes
    ----------
    key : str, dotted, '' for the case itself
    name : str
    help : str, what the section is
    optional : bool, whether it may be left out and then is none
    parts : tuple of Field and Group
    whole : bool, whether all its fields are shown at once, also those at their defaults
    """

    key: str
    name: str
    help: str
    optional: bool
    parts: tuple[Field | Group, ...]
    whole: bool = False

    def fields(self) -> Iterator[Field]:
        """All fields, those of inner sections too."""
        for part in self.parts:
            if isinstance(part, Group):
                yield from part.fields()
            else:
                yield part

    def groups(self) -> Iterator[Group]:
        """The section itself and all inner ones."""
        yield self
        for part in self.parts:
            if isinstance(part, Group):
                yield from part.groups()


@functools.cache
def describe(kind: type[Section], *, skip: tuple[str, ...] = (), flat: bool = False, repeats: bool = False) -> Group:
    """The form of a model.

    Parameters
    ----------
    kind : a case, or another section
    skip : dotted keys that are left out
    flat : bool, whether inner sections are single fields, written as YAML mappings, where they may be written in short
    repeats : bool, whether a section says last how a part is repeated
    """
    if flat:
        texts = descriptions(kind)
        names = _names(kind)
        applies, needed = (kind.applies, kind.needed) if issubclass(kind, Part) else ({}, ())
        decide = {when.keys[0] for conditions in applies.values() for when in conditions if when.values}
        fields: list[Field | Group] = []
        for key, info in kind.model_fields.items():
            if key in skip:
                continue
            if fieldtypes.is_mapping_alone(info):
                fields.append(_inner_group(key, key, info, texts[key], skip))
            else:
                field = _one(key, key, info, texts[key])
                known = names.get(key) if field.wide else None
                help_ = f"{field.help}; or one of the names {', '.join(known)}" if known else field.help
                own: dict[str, Any] = {"help": help_, "when": applies.get(key, ()), "decides": key in decide}
                own["required"] = field.required or key in needed
                fields.append(dataclasses.replace(field, **own))
        if repeats:
            fields.append(_repetition())
        return Group(key="", name="", help=_summary(kind), optional=False, parts=tuple(fields))
    return _group(kind, key="", name="", text=_summary(kind), optional=False, skip=skip)


def _repetition() -> Group:
    """The section that says how a part is repeated."""
    found = _group(Repeat, key=REPEAT, name=REPEAT, text=_summary(Repeat), optional=True, skip=())

    def inside(when: When) -> When:
        return dataclasses.replace(when, keys=tuple(f"{REPEAT}.{key}" for key in when.keys))

    when = {f"{REPEAT}.{key}": tuple(map(inside, conditions)) for key, conditions in REPEAT_APPLIES.items()}
    fields = [dataclasses.replace(one, when=when.get(one.key, ())) for one in found.fields()]
    return dataclasses.replace(found, parts=tuple(fields), whole=True)


@functools.cache
def _names(kind: type[Section]) -> Mapping[str, Sequence[str]]:
    """Names that may stand for inner sections, such as those of materials, by the key of the section."""
    properties = kind.model_json_schema().get("properties", {})
    found = {
        key: [one for shape in text.get("anyOf", ()) for one in shape.get("enum", ())]
        for key, text in properties.items()
    }
    return {key: names for key, names in found.items() if names}


def _group(kind: type[Section], *, key: str, name: str, text: str, optional: bool, skip: tuple[str, ...]) -> Group:
    parts: list[Field | Group] = []
    texts = descriptions(kind)
    for own, info in kind.model_fields.items():
        dotted = f"{key}.{own}" if key else own
        if dotted in skip:
            continue
        if fieldtypes.section_of(info.annotation) is None:
            parts.append(_one(dotted, own, info, texts[own]))
        else:
            parts.append(_inner_group(dotted, own, info, texts[own], skip))
    return Group(key=key, name=name, help=text, optional=optional, parts=tuple(parts))


def _inner_group(key: str, name: str, info: FieldInfo, text: str, skip: tuple[str, ...]) -> Group:
    """The section that a field holds."""
    section = fieldtypes.section_of(info.annotation)
    assert section is not None
    summary = _summary(section)
    help_ = f"{summary} ({text.rstrip('.')})" if text else summary
    return _group(section, key=key, name=_words(name), text=help_, optional=info.default is None, skip=skip)


def _summary(kind: type[Section]) -> str:
    return (kind.__doc__ or "").strip().partition("\n")[0].rstrip(".").replace("`", "")


def _words(name: str) -> str:
    return name.replace("_", " ")


def _one(key: str, name: str, info: FieldInfo, text: str) -> Field:
    marks = [mark for mark in fieldtypes.marks_of(info) if not isinstance(mark, Meant)]
    unit = next((unit for mark in marks if (unit := fieldtypes.unit_of(mark))), "")
    literals = [c for a in fieldtypes.literals_of(info.annotation) for c in a]
    choices = tuple(str(c) for c in literals)
    whole = next((m for m in marks if isinstance(m, Whole)), None)
    limits = next((m.allowed for m in marks if getattr(m, "allowed", "")), "")
    if whole is not None:
        limits = f"a whole number from {whole.least} to {whole.most}"
        limits += f", or {' or '.join(choices)}" if choices else ""
    plain = [a for a in (get_args(info.annotation) or (info.annotation,)) if a is not NoneType]
    closed = bool(choices) and not marks and (get_origin(info.annotation) is Literal or len(plain) == 1)
    kind = "switch" if info.annotation is bool else "choice" if closed else "text"
    direct = list(fieldtypes.direct(info))
    whole_text = any(isinstance(m, OneOrMore) for m in marks) or any(fieldtypes.of_the_whole(m) for m in direct)
    shape = "" if whole_text else fieldtypes.shape_of(info.annotation)
    structured, rows = fieldtypes.structure_of(info), fieldtypes.rows_of(info)
    columns = fieldtypes.columns_of(info)
    if rows:
        alone = [mark for mark in direct if isinstance(mark, Quantity)]
        unit, limits = (alone[0].unit, f"{alone[0].allowed}, or {rows}") if alone else ("", rows)
    elif structured and structured not in limits:
        limits = f"{limits}: {structured}" if limits else structured
    elif shape:
        limits = f"{shape}, each {limits}" if limits and whole is None else shape
        limits = f"{' or '.join(choices)}, or {limits}" if choices else limits
    has_default = not info.is_required() and info.default not in (None, PydanticUndefined)
    default = text_of(fieldtypes.written(info, marks)) if has_default else ""
    default = re.sub(r"(?<=\d)\.0(?=[\s,\]]|$)", "", default)
    return Field(
        key=key,
        name=_words(name),
        kind=kind,
        unit=unit,
        help="; ".join(part.rstrip(".") for part in (text, limits) if part),
        default=default,
        choices=choices,
        open=not closed,
        required=info.is_required(),
        numeric=bool(literals) and all(isinstance(c, int) for c in literals),
        wide=bool(structured or rows or columns),
        columns=columns,
        refers=any(isinstance(m, Reference) for m in marks),
    )


# ------------------------------------------------------------------------------------------------ values


def text_of(value: Any) -> str:
    """A value of a case as the text that is typed for it."""
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple, dict)):
        shown = yaml.safe_dump(
            _plain(value), default_flow_style=True, width=10_000, allow_unicode=True, sort_keys=False
        )
        return shown.strip()
    return repr(value)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(v) for key, v in value.items()}
    return [_plain(v) for v in value] if isinstance(value, (list, tuple)) else value


def value_of(text: str, key: str) -> Any:
    """What was typed as a value.

    Raises
    ------
    InputError
        If it is no YAML; the sentence begins with the key.
    """
    try:
        return cases.parse_yaml(text, key)
    except InputError as error:
        problem = str(error).partition(": ")[2] or str(error)
        raise InputError(f"{key} is {text!r}; it cannot be read: {problem}") from None


def texts(form: Group, content: Mapping[str, Any]) -> dict[str, str]:
    """Texts of a form's fields that show a case; '' where it holds nothing."""
    return {field.key: text_of(_at(content, field.key)) for field in form.fields()}


def given(form: Group, content: Mapping[str, Any]) -> set[str]:
    """Keys of the optional sections that a case holds."""
    return {g.key for g in form.groups() if g.optional and isinstance(_at(content, g.key), Mapping)}


def unknown_content(form: Group, content: Mapping[str, Any], skip: tuple[str, ...] = ()) -> dict[str, Any]:
    """What a case holds that its form has no field for, dotted key -> value.

    Parameters
    ----------
    skip : dotted keys that the form leaves out
    """
    fields = {field.key for field in form.fields()} | set(skip)
    groups = {group.key for group in form.groups()}

    def found(inner: Mapping[str, Any], before: str) -> Iterator[tuple[str, Any]]:
        for name, value in inner.items():
            key = f"{before}{name}"
            if key in groups and isinstance(value, Mapping):
                yield from found(value, f"{key}.")
            elif key not in fields and (key not in groups or value is not None):
                yield key, value

    return dict(found(content, ""))


def put(content: dict[str, Any], key: str, value: Any) -> None:
    """Put a value at a dotted key, where no value of another kind stands in its way; an empty section replaces none."""
    *path, last = key.split(".")
    for part in path:
        inner = content.setdefault(part, {})
        if not isinstance(inner, dict):
            return
        content = inner
    if value != {} or not isinstance(content.get(last), dict):
        content[last] = value


def _at(content: Any, key: str) -> Any:
    for part in key.split("."):
        if not isinstance(content, Mapping) or part not in content:
            return None
        content = content[part]
    return content


def content_of(form: Group, typed: Mapping[str, str], sections: set[str]) -> tuple[dict[str, Any], dict[str, str]]:
    """What was typed as a case, and what of it cannot be read, key -> sentence.

    Parameters
    ----------
    typed : key -> text; '' is left out
    sections : optional sections that are given
    """
    content: dict[str, Any] = {}
    wrong: dict[str, str] = {}
    left_out = {g.key for g in form.groups() if g.optional and g.key not in sections}

    def is_inside(key: str) -> bool:
        return any(key == one or key.startswith(f"{one}.") for one in left_out)

    for group in form.groups():
        if group.key and not is_inside(group.key):
            put(content, group.key, {})
    for field in form.fields():
        text = typed.get(field.key, "").strip()
        if not text or is_inside(field.key):
            continue
        try:
            is_word = field.kind == "choice" and not field.numeric
            put(content, field.key, text if is_word else value_of(text, field.key))
        except InputError as error:
            wrong[field.key] = str(error)
    for group in reversed(list(form.groups())):  # a section that may be left out need not stand there empty
        if group.key and not group.optional and _at(content, group.key) == {} and not _requires(group):
            _drop(content, group.key)
    return content, wrong


def _requires(group: Group) -> bool:
    return any(field.required for field in group.fields())


def _drop(content: dict[str, Any], key: str) -> None:
    *path, last = key.split(".")
    for part in path:
        content = content[part]
    content.pop(last, None)


def nearest_field(form: Group, key: str) -> str:
    """The field or section that shows a dotted key: itself, or the field that holds it; '' for none."""
    fields = {field.key for field in form.fields()}
    if key in {group.key for group in form.groups()}:
        return key
    while key and key not in fields:
        key = key.rpartition(".")[0]
    return key


def problems(found: Mapping[str, str], wrong: Mapping[str, str]) -> dict[str, str]:
    """What is wrong with a form, key -> sentence without the key and value that stand beside it.

    Parameters
    ----------
    found : what is wrong with its content; where something cannot be read, nothing else is reported
    wrong : what cannot be read
    """
    return {key: _short(key, sentence) for key, sentence in (wrong or found).items()}


def _short(key: str, sentence: str) -> str:
    """The part of a sentence that the field beside it does not show already."""
    head, found, tail = sentence.partition("; ")
    if found and key and head.startswith(f"{key} is ") and tail:
        return tail[:1].upper() + tail[1:]
    return sentence[:1].upper() + sentence[1:] if not key or not sentence.startswith(key) else sentence
