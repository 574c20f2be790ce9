"""Public functions state their parameters and what they return, in sections of numpydoc."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from evolvent_base.schema import Section

#: Modules whose `__all__` is the public interface; classes stand for their methods, but sections for their keys.
PUBLIC = (
    "evolvent", "evolvent.design.studies", "evolvent.design.dispersions", "evolvent.design.optimization",
    "evolvent.design.calibration", "evolvent.closed_forms", "evolvent_massprops",
)  # fmt: skip
#: Sections one of which says what comes back.
BACK = ("Returns", "Yields")


def functions() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Public functions, and public methods that public classes define, by name."""
    for module in PUBLIC:
        found = importlib.import_module(module)
        for name in getattr(found, "__all__", ()):
            value = getattr(found, name)
            if not str(getattr(value, "__module__", "")).startswith("evolvent"):
                continue
            if inspect.isfunction(value):
                yield f"{module}.{name}", value
            elif inspect.isclass(value) and not issubclass(value, Section):
                own = ((key, inspect.unwrap(one)) for key, one in vars(value).items() if not key.startswith("_"))
                yield from ((f"{module}.{name}.{key}", one) for key, one in own if inspect.isfunction(one))


def section(text: str, title: str) -> str | None:
    """A section of a docstring; None where it has none of that title."""
    match = re.search(rf"^{title}\n-+\n(.*?)(?=^\S[^\n]*\n---|\Z)", text, re.DOTALL | re.MULTILINE)
    return None if match is None else match[1]


def missing(function: Callable[..., Any]) -> list[str]:
    """What the docstring of a function does not state."""
    text, signature = inspect.getdoc(function) or "", inspect.signature(function)
    heads = [line.partition(":")[0] for line in (section(text, "Parameters") or "").splitlines() if line[:1].strip()]
    named = set(re.findall(r"\w+", " ".join(heads)))
    # several parameters may be stated in one line
    named |= set(re.findall(r"\w+", " ".join(re.findall(r"[;,] ((?:\w+, )*\w+) :", section(text, "Parameters") or ""))))
    given = [name for name in signature.parameters if name not in ("self", "cls")]
    if text and not given:  # its first sentence says what it returns
        return []
    found = [name for name in given if name not in named]
    returned = signature.return_annotation
    if returned not in (None, "None", inspect.Signature.empty) and all(section(text, title) is None for title in BACK):
        found.append("what it returns")
    return found


@pytest.mark.parametrize(("name", "function"), [*functions()], ids=lambda one: one if isinstance(one, str) else "")
def test_parameters_and_what_is_returned_are_stated(name: str, function: Callable[..., Any]) -> None:
    assert not missing(function), f"{name} does not state {', '.join(missing(function))}"
