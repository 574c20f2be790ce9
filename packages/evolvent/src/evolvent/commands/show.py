"""The commands `evolvent list`, `show`, `parts`, `schema`, `info` and `plot`."""

from __future__ import annotations

import inspect
import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, Protocol, get_args, get_origin, runtime_checkable

import click
import lazy_loader as lazy

from evolvent.commands.run import beside, draw, list_names, print_rows, table
from evolvent_base import files, plugins, schema as base_schema
from evolvent_base.console import echo, figure_format, once, say
from evolvent_base.errors import InputError

if TYPE_CHECKING:
    from evolvent.parts.base import Part
    from evolvent_base.schema import Section

cases = lazy.load("evolvent.cases", suppress_warning=True)
plots = lazy.load("evolvent_base.plots", suppress_warning=True)
results = lazy.load("evolvent.results", suppress_warning=True)
studies = lazy.load("evolvent.design.studies", suppress_warning=True)
view_show = lazy.load("evolvent.view.show", suppress_warning=True)


@click.command("list")
def list_cases() -> None:
    """List the built-in cases, and the studies for `evolvent sweep`."""
    found = cases.built_in() | {name: f"study: {what}" for name, what in studies.built_in().items()}
    width = max(len(name) for name in found)
    for name, what in found.items():
        echo(f"{name:<{width}}  {what}")
    _say_unusable(cases.unusable())


def _say_unusable(sentences: Iterable[str]) -> None:
    """Say why plug-ins cannot be used, unless that was said as they were loaded."""
    for sentence in sentences:
        if sentence not in plugins.said:
            echo(f"evolvent: {sentence}", err=True)


@click.command()
@click.argument("case", metavar="CASE|FILE")
@click.option("--expand", is_flag=True, help="Write out the parts for which a repeated one stands.")
def show(case: str, expand: bool) -> None:
    """Print a built-in CASE or study, to be kept in a file and edited; of a case FILE all keys, defaults included."""
    if expand:
        content = cases.expanded(cases.content_of(case))
        cases.load(content)
        echo(cases.dump(content), nl=False)
    elif case in studies.built_in():
        echo(studies.text(case), nl=False)
    elif case not in cases.built_in() and re.search(r"[./\\]", case):
        echo(cases.to_yaml(cases.load(case), cases.content_of(case)), nl=False)
    else:
        echo(cases.text(case), nl=False)


@click.command("parts")
@click.argument("kind", required=False)
def list_parts(kind: str | None) -> None:
    """List the kinds of parts of a structure, or the keys of one KIND with units and defaults."""
    from evolvent.parts import registry  # loads the engine

    words = {one.__name__: name for name, one in registry.kinds().items()}
    if kind is None:
        _say_unusable(registry.unusable().values())
        heads = {name: inspect.cleandoc(one.__doc__ or "").splitlines()[0] for name, one in registry.kinds().items()}
        print_rows([(name, _worded(head, words)) for name, head in heads.items()])
        return
    part = registry.kinds().get(kind)
    if part is None:
        raise InputError(f"no part is of the kind {kind!r}; {registry.not_known(kind)}")
    say(_worded(inspect.cleandoc(part.__doc__ or "").splitlines()[0], words))
    print_rows(_rows_of_keys(part, words))


def _rows_of_keys(part: type[Part], words: Mapping[str, str]) -> list[tuple[str, str]]:
    """Keys of a part with units and defaults, and what they mean; keys with all of this alike are one row."""
    found: dict[tuple[str, str], list[str]] = {}
    texts = base_schema.descriptions(part)
    for name, field in part.model_fields.items():
        if name == "kind":
            continue
        own = list(base_schema.marks(field))
        unit = next((f" [{found_unit}]" for mark in own if (found_unit := _unit_of(mark))), "")
        default = field.get_default(call_default_factory=True)
        if field.is_required() or name in part.needed:
            value = ", required"
        else:
            value = "" if default in (None, (), {}, "") else f" = {_written(default)}"
        text = " ".join(filter(None, [_worded(texts[name], words), _choices(field.annotation, own)]))
        found.setdefault((f"{unit}{value}", text), []).append(name)
    return [(f"{', '.join(names)}{after}", text) for (after, text), names in found.items()]


def _worded(text: str, words: Mapping[str, str]) -> str:
    """The text of a key as it is printed: kinds in place of classes, no marks of code, the point of a sentence."""
    plain = re.sub(r"`(\w+)`", lambda match: words.get(match[1], match[0]), text.replace("``", ""))
    return plain if not plain or plain[-1] in ".:" else f"{plain}."


def _unit_of(mark: Any) -> str:
    """Unit of the values that an annotation reads, '' for none."""
    return str(getattr(getattr(mark, "quantity", mark), "unit", "") or "")


@runtime_checkable
class _WithKinds(Protocol):
    """An annotation of a key that holds one of several kinds of sections, by name."""

    kinds: Mapping[str, type[Section]]


def _choices(annotation: Any, own: Sequence[Any]) -> str:
    """The words, or the sections with their keys, that a key may take, as a sentence; '' of other keys."""
    from evolvent.parts.profile import KINDS, Profile  # loads the engine

    if get_origin(annotation) is Literal:
        return f"One of {', '.join(map(str, get_args(annotation)))}."
    if _holds(annotation, Profile):
        return f"Rows [time, value], or one of {', '.join(KINDS)}."
    for mark in own:
        if isinstance(mark, _WithKinds):
            each = (f"{name}: {{{', '.join(kind.model_fields)}}}" for name, kind in mark.kinds.items())
            return f"One of {'; '.join(each)}."
    section = _section(annotation)
    return f"Keys: {', '.join(section.model_fields)}." if section is not None and section.model_fields else ""


def _section(annotation: Any) -> type[Section] | None:
    """The section that a key holds, where it holds one of a single kind."""
    kinds = [one for one in get_args(annotation) or (annotation,) if one is not type(None)]
    single = len(kinds) == 1 and isinstance(kinds[0], type) and issubclass(kinds[0], base_schema.Section)
    return kinds[0] if single else None


def _holds(annotation: Any, kind: type) -> bool:
    """Whether a class, or one derived from it, stands in an annotation."""
    own = isinstance(annotation, type) and issubclass(annotation, kind)
    return own or any(_holds(one, kind) for one in get_args(annotation))


def _written(default: Any) -> str:
    """A default as a case file has it."""
    if isinstance(default, bool):
        return str(default).lower()
    if isinstance(default, tuple):
        return f"[{', '.join(map(_written, default))}]"
    return f"{default:g}" if isinstance(default, float) else str(default)


@click.command()
@click.argument("system")
def schema(system: str) -> None:
    """Print the JSON schema of a SYSTEM's cases, for editors."""
    echo(json.dumps(cases.json_schema(system), indent=2))


@click.command()
@click.argument("path", metavar="RUN.NC")
def info(path: str) -> None:
    """Print what a results file holds."""
    found = results.open(path)
    say(f"{found.attrs['title']}, version {found.attrs['version']}")
    table(found)
    say("\ncase:\n" + "".join(f"  {line}\n" for line in found.attrs["case"].splitlines()))
    _variables("variables:", found.variables)
    for name, group in getattr(found, "children", {}).items():
        _variables(f"{name} ({group.attrs['kind']}):", group.to_dataset(inherit=False).variables)


def _variables(title: str, variables: Mapping[Any, Any]) -> None:
    """Print names, units and dimensions of variables."""
    say(title)
    width = max((len(str(name)) for name in variables), default=0)
    for name, variable in variables.items():
        attrs = variable.attrs
        dims = ", ".join(str(d) for d in variable.dims)
        unit = attrs.get("units", "")
        say(f"  {name!s:<{width}}  {unit:<10} ({dims})  {attrs.get('long_name', '')}".rstrip())


@click.command()
@click.argument("path", metavar="RUN.NC")
@click.option(
    "--figures", multiple=True, callback=once, metavar="DIR", help="Folder to draw into.  [default: RUN-figures]"
)
@click.option(
    "--variables", multiple=True, callback=once, metavar="NAME,NAME", help="Draw these variables alone, over time."
)
@click.option("--units", type=click.Choice(("deg", "rpm", "rad")),
              help="Of angles and rates of --variables.  [default: rpm where a part's rates were written so, else deg]",
)  # fmt: skip
@figure_format
def plot(path: str, figures: str | None, variables: str | None, units: str | None, kind: str) -> None:
    """Draw figures and an animation of a results file, or the variables that are named.

    \b
    evolvent plot slew.nc
    evolvent plot slew.nc --variables hub.rate,boom.tip_deflection.y
    """  # noqa: D301
    found = results.open(path)
    drawn = None
    if variables is not None:
        names = [name.strip() for name in variables.split(",") if name.strip()]
        drawn = view_show.figure(found, names, units=units)
    folder = files.check_writable_folder(beside(path) if figures is None else figures)
    if drawn is None:
        list_names(draw(found, folder, kind, quiet=False), folder)
        return
    say(f"figures: {os.path.basename(plots.draw([drawn], folder, kind=kind)[0])} in {folder}")
