"""Sphinx extension ``evolvent.sphinxext``: pages made from the code itself, for this package and others that add to it.

Directives of MyST pages: ``{keys}`` (of cases and parts), ``{parts}``, ``{case-file}``, ``{built-in}``, ``{commands}``,
``{families}``; packages add theirs by entry points of the group ``evolvent.directives``.
"""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Iterable
from typing import Any

import click
from docutils import nodes
from pydantic_core import PydanticUndefined
from sphinx.util.docutils import SphinxDirective

from evolvent import cases
from evolvent.design import studies
from evolvent.model import family, registry as family_registry
from evolvent.parts import registry
from evolvent.parts.base import Part, Reference
from evolvent.parts.expression import Law
from evolvent.parts.profile import Profile
from evolvent_base import cli, plugins, units
from evolvent_base.errors import InputError, nearest
from evolvent_base.schema import OneOf, Section, descriptions, marks

#: Group of entry points by which packages add directives.
GROUP = "evolvent.directives"


class Commands(SphinxDirective):
    """``{commands}``: a section for every command of `evolvent`, from the very objects that parse it."""

    def run(self) -> list[nodes.Node]:
        """Write the sections."""
        text = [f"## evolvent {name}\n\n{command_text(name)}" for name in command_names()]
        return self.parse_text_to_nodes("\n".join(text), allow_section_headings=True)


def command_names() -> list[str]:
    """The commands of `evolvent`, in the order of its help."""
    return cli.commands.list_commands(
        click.Context(cli.commands, info_name="evolvent", **cli.commands.context_settings)
    )


def command_text(name: str) -> str:
    """Usage, help and options of a command of `evolvent`, in Markdown."""
    root = click.Context(cli.commands, info_name="evolvent", **cli.commands.context_settings)
    command = cli.commands.get_command(root, name)
    assert command is not None
    context = click.Context(command, info_name=name, parent=root)
    lines = ["```text", " ".join(command.get_usage(context).split()[1:]), "```", ""]
    for paragraph in inspect.cleandoc(command.help or "").split("\n\n"):
        if paragraph.startswith("\b"):  # click's mark of lines that stay as they are
            lines += ["```text", *paragraph.removeprefix("\b").strip().splitlines(), "```", ""]
        else:
            lines += [_prose(paragraph), ""]
    for option in command.params:
        record = option.get_help_record(context)
        if record is not None and record[1]:
            lines += [f"`{record[0]}`", f": {_prose(record[1])}", ""]
    return "\n".join(lines)


class Keys(SphinxDirective):
    """``{keys}``: for every system a section with every key of its cases, its unit, default and meaning.

    ``{keys} pantograph tension-cable``: for these systems and kinds of parts alone.
    """

    optional_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        """Write a table for each section of each case."""
        names = self.arguments[0].split() if self.arguments else cases.systems()
        return self.parse_text_to_nodes(keys_text(names), allow_section_headings=True)


def keys_text(names: Iterable[str]) -> str:
    """Sections of Markdown with tables of the keys of systems and kinds of parts.

    Raises
    ------
    InputError
        If a name is neither.
    """
    text: list[str] = []
    for name in names:
        kind = _kind_of(name)
        text += [f"## {name.replace('-', ' ').capitalize()}", ""]
        if issubclass(kind, Part):
            text += [_cell(_first_line(kind)), ""]
        _section(kind, "", text)
    return "\n".join(text)


def keys_table(name: str) -> str:
    """Tables of the keys of a system or kind of part in Markdown, without a heading and without the parts of a system.

    Raises
    ------
    InputError
        If the name is neither.
    """
    text: list[str] = []
    _section(_kind_of(name), "", text, parts=False)
    return "\n".join(text)


def _kind_of(name: str) -> type[Section]:
    """The section that holds the keys of a system or of a kind of part."""
    if name in registry.kinds():
        return registry.kinds()[name]
    if name in cases.systems():
        return cases.system(name).Case
    known = nearest(name, [*cases.systems(), *registry.kinds()])
    raise InputError(f"no system and no kind of part is called {name!r}; {known}")


class BuiltIn(SphinxDirective):
    """``{built-in}``: the cases and studies that come with the package."""

    def run(self) -> list[nodes.Node]:
        """Write two lists."""
        text = [f"- `{name}`: {what}" for name, what in cases.built_in().items()]
        text += [f"- `{name}` (a study): {what}" for name, what in studies.built_in().items()]
        return self.parse_text_to_nodes("\n".join(text))


class Families(SphinxDirective):
    """``{families}``: which solver supports which family of parts, from the table that the solvers ask."""

    def run(self) -> list[nodes.Node]:
        """Write a table."""
        return self.parse_text_to_nodes(families_table())


def families_table() -> str:
    """The families of parts and the solvers, as a table in Markdown."""
    text = [
        f"| family of parts | {' | '.join(family.SOLVERS.values())} | instead |",
        "|---" * (len(family.SOLVERS) + 2) + "|",
    ]
    for row in (kind for one in family_registry.families().values() for kind in one.kinds):
        cells = ["supported" if solver in row.solvers else "refused" for solver in family.SOLVERS]
        text.append(f"| {' | '.join([row.name, *cells, _cell(row.advice)])} |")
    return "\n".join(text)


class Parts(SphinxDirective):
    """``{parts}``: every kind of part with what it is and its keys, with units; needed keys in bold.

    ``{parts} tension-cable``: these kinds alone.
    """

    optional_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        """Write a table."""
        return self.parse_text_to_nodes(parts_table(self.arguments[0].split() if self.arguments else None))


def parts_table(names: Iterable[str] | None = None) -> str:
    """The kinds of parts, all unless some are named, as a table in Markdown."""
    wanted = registry.kinds() if names is None else list(names)
    text = [":::{table}", ":class: keys", ":align: left", "", "| kind | what it is | keys |", "|---|---|---|"]
    for kind in sorted(wanted):
        part = registry.kinds()[kind]
        keys = []
        for name, field in part.model_fields.items():
            if name == "kind":
                continue
            unit = next((f" {found}" for mark in marks(field) if (found := _unit_of(mark))), "")
            keys.append((f"**`{name}`**" if field.is_required() or name in part.needed else f"`{name}`") + _cell(unit))
        text.append(f"| `{kind}` | {_cell(_first_line(part))} | {', '.join(keys)} |")
    return "\n".join([*text, "", ":::"])


def _unit_of(mark: Any) -> str:
    """Unit of the values that an annotation reads, '' for none."""
    return str(getattr(getattr(mark, "quantity", mark), "unit", ""))


def _first_line(kind: type[Section]) -> str:
    """First line of a section's docstring, without quotation marks of code."""
    return (inspect.getdoc(kind) or "").partition("\n")[0].replace("`", "")


class CaseFile(SphinxDirective):
    """``{case-file} heliogyro``: a built-in case or study as it would be edited."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Write its text."""
        name = self.arguments[0]
        text = studies.text(name) if name in studies.built_in() else cases.text(name)
        return [nodes.literal_block(text, text, language="yaml")]


def _prose(text: str) -> str:
    """Help as one paragraph of Markdown."""
    return " ".join(text.replace("\b", "").split()).replace("*", "\\*").replace("_", "\\_").replace("<", "\\<")


def _section(kind: type[Section], before: str, text: list[str], *, parts: bool = True) -> None:
    """Add a table of the keys of `kind`, then those of its sections, and where asked those of every kind of part."""
    rows, inner = [], []
    texts = descriptions(kind)
    for name, field in kind.model_fields.items():
        below, many = (None, False) if issubclass(kind, Part) else _below(field.annotation)
        key = f"{before}{name}"
        if below is not None:
            inner.append((below, f"{key}.{'N.' if many else ''}"))
            if not field.is_required() and field.default in (None, ()):
                rows.append(
                    (
                        key,
                        "section" if not many else "list",
                        "none",
                        (inspect.getdoc(below) or "").partition("\n")[0].rstrip("."),
                    )
                )
            continue
        default = "needed" if field.is_required() else _value(field.get_default(call_default_factory=True))
        rows.append((key, _kind(field.annotation, field.metadata), default, texts[name]))
    if rows:
        doc = (inspect.getdoc(kind) or "").partition("\n")[0]
        text += ["", doc if before else "", "", ":::{table}", ":class: keys", ":align: left", ""]
        text += ["| key | value | default | |", "|---|---|---|---|"]
        text += [f"| `{key}` | {kind_} | {default} | {_cell(what)} |" for key, kind_, default, what in rows]
        text += ["", ":::", ""]
    for below, path in inner:
        if below is Part and parts:
            for name, part in sorted(registry.kinds().items()):
                text += ["", f"### {name}", "", _cell(_first_line(part)), ""]
                _section(part, "", text)
        elif below is not Part:
            _section(below, path, text, parts=parts)


def _below(annotation: Any) -> tuple[type[Section] | None, bool]:
    """The section that a field holds, and whether it holds a list of them."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return annotation, False
    many = typing.get_origin(annotation) is tuple
    for part in typing.get_args(annotation):
        found, inside = _below(part)
        if found is not None:
            return found, many or inside
    return None, False


def _kind(annotation: Any, metadata: Any = ()) -> str:
    """What a key takes: a unit, a choice, a number."""
    for item in metadata:
        if isinstance(item, (units.Quantity, units.Either)):
            return _unit(item)
        if isinstance(item, units.OneOrMore):
            return f"{_unit(item.quantity)}, or a list"
        if isinstance(item, units.Whole):
            return "whole number"
        if isinstance(item, units.Orientation):
            return "quaternion, `{axis, angle}` or `{euler, order}`"
        if isinstance(item, units.Vector):
            return f"3 of: {_unit(item.quantity)}"
        if isinstance(item, Reference):
            return item.what
        if isinstance(item, OneOf):
            return "one of " + ", ".join(f"`{name}`" for name in item.kinds)
        if isinstance(item, units.Tensor):
            return f"number, 3 or 3 x 3 of: {_unit(item.quantity)}"
        if isinstance(item, Law):
            return "expression, or a function" if item.python else "expression"
    origin, parts = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is typing.Annotated:
        return _kind(parts[0], parts[1:])
    if origin is typing.Literal:
        return ", ".join(f"`{part}`" for part in parts)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(dict.fromkeys(_kind(part) for part in parts if part is not type(None)))
    if origin is tuple:
        if len(parts) == 2 and parts[1] is Ellipsis:
            return f"list of: {_kind(parts[0])}"
        each = [_kind(part) for part in parts]
        return f"{len(parts)} of: {each[0]}" if len(set(each)) == 1 else ", ".join(each)
    if isinstance(annotation, type) and issubclass(annotation, Profile):
        return "profile"
    return {bool: "`true` or `false`", str: "text", float: "number", int: "whole number"}.get(annotation, "value")


def _unit(quantity: units.Quantity | units.Either) -> str:
    """Unit of a quantity, as text."""
    return (quantity.unit or "number") + (" or `auto`" if getattr(quantity, "auto", False) else "")


def _value(default: Any) -> str:
    """A default, as a user would write it."""
    if default is None or default is PydanticUndefined or default == ():
        return "none"
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    if isinstance(default, tuple):
        return f"`[{', '.join(f'{v:g}' if isinstance(v, float) else str(v) for v in default)}]`"
    return f"`{default:g}`" if isinstance(default, float) else f"`{default}`"


def _cell(text: str) -> str:
    """Text for a cell of a table; in code only the mark between cells is escaped."""
    pieces = text.replace("|", "\\|").split("`")
    pieces[::2] = [piece.replace("_", "\\_").replace("*", "\\*").replace("<", "\\<") for piece in pieces[::2]]
    return "`".join(pieces)


def setup(app: Any) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("commands", Commands)
    app.add_directive("keys", Keys)
    app.add_directive("built-in", BuiltIn)
    app.add_directive("case-file", CaseFile)
    app.add_directive("families", Families)
    app.add_directive("parts", Parts)
    for entry in plugins.entry_points(GROUP):
        app.add_directive(entry.name, plugins.load(entry, f"the directive {entry.name!r}"))
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
