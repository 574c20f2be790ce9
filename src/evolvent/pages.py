"""HTML pages from the templates in `templates/`: every value is escaped, pages need no other file and no network."""

from __future__ import annotations

import base64
import functools
import pathlib
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    import jinja2

_TEMPLATES = pathlib.Path(__file__).parent / "templates"


class Picture(NamedTuple):
    """An image inside a page.

    Attributes
    ----------
    source : str, a data URI
    alt : str, what it shows, in words
    """

    source: str
    alt: str


def picture(content: bytes, kind: str, alt: str) -> Picture:
    """An image of its file's content.

    Parameters
    ----------
    content : bytes
    kind : str, the subtype of its media type: "png" or "svg+xml"
    alt : str
    """
    return Picture(f"data:image/{kind};base64,{base64.b64encode(content).decode()}", alt)


@functools.cache
def _environment() -> jinja2.Environment:
    import jinja2
    from markupsafe import Markup

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    # `tojson` also replaces <, >, & and ', so that no value can close a script
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":")}
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
