"""HTML pages from the templates in `templates/`: every value is escaped, pages need no other file and no network."""

from __future__ import annotations

import base64
import functools
import json
import pathlib
import re
from typing import TYPE_CHECKING, Any, NamedTuple

import lazy_loader as lazy
from markupsafe import Markup

from evolvent_base.errors import visible

if TYPE_CHECKING:
    import jinja2
else:
    jinja2 = lazy.load("jinja2")

#: What a hidden character becomes in JSON.
_ESCAPE = re.compile(r"\\u(00[0189]|007f|202|206|d[89a-f]|fff)|\\[bf]")
_TEMPLATES = pathlib.Path(__file__).parent / "templates"


class Picture(NamedTuple):
    """An image inside a page.

    Attributes
    ----------
    source : str, a data URI
    alt : str, what it shows, in words
    titled : bool, whether the image itself has this title
    """

    source: str
    alt: str
    titled: bool = False


def picture(content: bytes, kind: str, alt: str, *, titled: bool = False) -> Picture:
    """An image of its file's content.

    Parameters
    ----------
    content : bytes
    kind : str, the subtype of its media type: "png" or "svg+xml"
    alt : str
    titled : bool, whether the image itself has this title
    """
    return Picture(f"data:image/{kind};base64,{base64.b64encode(content).decode()}", alt, titled)


def sentence(text: str) -> str:
    """A text as a sentence of a page: its first word with a capital, unless it is a key, a name or a method.

    Examples
    --------
    >>> sentence("every margin holds"), sentence("spool.rate is 3 rad/s"), sentence("'hinge 1' holds")
    ('Every margin holds', 'spool.rate is 3 rad/s', "'hinge 1' holds")
    """
    return text[0].upper() + text[1:] if re.match("[a-z]+[ ,:;]", text) else text


def _json(value: Any, **options: Any) -> str:
    """A value as JSON in ASCII; its texts are made visible."""
    text = json.dumps(value, **options)
    return json.dumps(_visible(value), **options) if _ESCAPE.search(text) else text


def _visible(value: Any) -> Any:
    if isinstance(value, dict):
        return {_visible(key): _visible(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_visible(one) for one in value]
    return visible(value) if isinstance(value, str) else value


@functools.cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        finalize=lambda value: visible(value) if type(value) is str else value,
    )
    # `tojson` also replaces <, >, & and ', so that no value can close a script
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":")}
    environment.policies["json.dumps_function"] = _json
    environment.filters["sentence"] = sentence
    environment.globals["style"] = lambda name: Markup((_TEMPLATES / name).read_text(encoding="utf-8"))
    return environment


def render(template: str, **values: Any) -> str:
    """The page of a template.

    Parameters
    ----------
    template : str, a file of `templates/`
    **values
        What the template names. Text is escaped; `markupsafe.Markup` is not, and is for the package's own files alone.
    """
    return _environment().get_template(template).render(values)
