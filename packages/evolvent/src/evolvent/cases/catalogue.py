"""Systems and built-in cases by name, those of other packages too."""

from __future__ import annotations

import contextlib
import functools
import importlib.util
import pathlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from evolvent_base import packages, plugins
from evolvent_base.errors import InputError, nearest

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

#: Group of entry points by which packages offer systems.
GROUP = "evolvent.systems"


@functools.cache
def _entries() -> dict[str, EntryPoint]:
    """Where each system is."""
    return {point.name: point for point in plugins.entry_points(GROUP)}


@functools.cache
def systems() -> tuple[str, ...]:
    """Names of all systems (`evolvent.analysis.definition`)."""
    return tuple(_entries())


@functools.cache
def system(name: str) -> Any:
    """The definition of a system, an `evolvent.analysis.definition.SystemDefinition`.

    Raises
    ------
    InputError
        If there is no such system, or that of another package cannot be loaded.
    """
    if name not in systems():
        missing = packages.lacking("system", str(name))
        raise InputError(missing or f"no system is called {name!r}; {nearest(str(name), systems())}")
    point = _entries()[name]
    made = plugins.load(point, f"the system {name!r} of {point.value!r}")
    try:
        found = made() if isinstance(made, type) else made
        called = found.Case.model_fields["system"].default
        if called != name:
            raise TypeError(f"its Case.system is {called!r}, not {name!r}")
    except (Exception, SystemExit) as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(f"the system {name!r} of {point.value!r} cannot be loaded: {why}") from error
    return found


def presenter(run: Any) -> Any:
    """The definition whose tables and figures a run is shown by.

    That of its system; of a run with parts, whose system is of a package that is not installed, that of any structure.

    Raises
    ------
    InputError
        If the system is not known, and the run has no parts.
    """
    name = run.attrs["system"]
    if getattr(run, "children", None) and not _is_usable(name):
        return system("structure")
    return system(name)


def _is_usable(name: Any) -> bool:
    """Whether there is a system of that name, which can be loaded."""
    try:
        system(name)
    except InputError:
        return False
    return True


def lacks_package(content: Any) -> bool:
    """Whether a case has a system, or parts of a kind, that is not known here: those of a package outside."""
    from evolvent.parts import registry  # loads the engine, which a list of cases does not need

    if not isinstance(content, Mapping) or not isinstance(content.get("system"), str):
        return False
    parts = content.get("parts")
    given = parts.values() if content["system"] == "structure" and isinstance(parts, Mapping) else ()
    kinds = [part.get("kind") for part in given if isinstance(part, Mapping)]
    return not _is_usable(content["system"]) or any(kind not in registry.kinds() for kind in kinds)


@functools.cache
def files() -> tuple[pathlib.Path, ...]:
    """YAML files beside the systems of evolvent's own packages: built-in cases, and studies ``*.study.yaml``."""
    found: list[pathlib.Path] = []
    for point in _entries().values():
        spec = importlib.util.find_spec(point.module) if packages.is_own(point.module) else None
        if spec is not None and spec.origin is not None:
            found += sorted(pathlib.Path(spec.origin).parent.rglob("*.yaml"))
    return tuple(found)


@functools.cache
def built_in_files() -> dict[str, pathlib.Path]:
    """Files of the cases that come with evolvent's own packages, by name."""
    found = {path.stem.replace("_", "-"): path for path in files() if not path.name.endswith(".study.yaml")}
    return dict(sorted(found.items()))


@functools.cache
def _outside_cases() -> dict[str, str]:
    """Cases of systems of other packages, name -> YAML text; a system that cannot be loaded has none."""
    found: dict[str, str] = {}
    for name in (point.name for point in plugins.outside(GROUP)):
        with contextlib.suppress(InputError):  # reported where that system is used
            found |= {case: source for case, source in system(name).cases.items() if case not in built_in_files()}
    return found


def unusable() -> list[str]:
    """Sentences on systems and parts of other packages that cannot be loaded."""
    found: list[str] = []
    if plugins.outside("evolvent.parts") or plugins.outside("evolvent.families"):  # they take long to load
        from evolvent.parts import registry  # loads the engine, which a list of cases does not need

        found += registry.unusable().values()
    for name in (point.name for point in plugins.outside(GROUP)):
        try:
            system(name)
        except InputError as error:
            found.append(str(error))
    return found


def built_in() -> dict[str, str]:
    """Built-in cases, name -> what it is (the first line of its text); last those of systems of other packages."""
    first = {name: text(name).partition("\n")[0] for name in [*built_in_files(), *_outside_cases()]}
    return {name: line.lstrip("# ").strip() for name, line in first.items()}


def text(name: str) -> str:
    """A built-in case as the text that a user edits.

    Raises
    ------
    InputError
        If there is no such case.
    """
    if name in built_in_files():
        return built_in_files()[name].read_text(encoding="utf-8")
    if name in _outside_cases():
        return _outside_cases()[name]
    missing = packages.lacking("case", name)
    raise InputError(missing or f"no case is called {name!r}; {nearest(name, [*built_in_files(), *_outside_cases()])}")
