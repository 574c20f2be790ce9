"""A system's composition: parts by name, assembled once into a Model, and as a case. It knows no kind of part."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Self

import numpy as np
from pydantic_core import PydanticCustomError

from evolvent import cases
from evolvent.analysis.settings import seconds, settings_of
from evolvent.analysis.start_motion import StartMotion, started
from evolvent.analysis.start_state import KEY as START
from evolvent.analysis.storage import Aged, storage_of, stored
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.builder import Builder
from evolvent.assembly.order import in_order
from evolvent.assembly.variants import Variants
from evolvent.parts import registry
from evolvent.parts.base import Part, check_name
from evolvent_base import units
from evolvent_base.errors import InputError, nearest
from evolvent_base.schema import check_visible


def _check_part(part: Any) -> None:
    if not isinstance(part, Part):
        raise InputError(f"{part!r} is not a part; add one of evolvent.parts, such as parts.Point(mass=1.0)")


_GRAVITY = units.Vector(quantity=units.Quantity(what="an acceleration", unit="m/s^2", example="9.81 m/s^2"))


class Composition:
    """Parts by name, what acts on all of them, and how they are simulated.

    Parameters
    ----------
    gravity, title, settings, sections, spin, velocity, start : as of `evolvent.System`
    """

    def __init__(
        self,
        gravity: Sequence[Any] = (0.0, 0.0, 0.0),
        *,
        title: str = "",
        settings: Mapping[str, Any] | None = None,
        sections: Mapping[str, Any] | None = None,
        spin: Any = None,
        velocity: Any = None,
        start: str | os.PathLike[str] | None = None,
    ) -> None:
        try:
            self._gravity = np.array(_GRAVITY.read(gravity))
        except PydanticCustomError as error:
            raise InputError(f"gravity is {gravity!r}; {error.message()}") from None
        self._parts: dict[str, Part] = {}
        self.settings = dict(settings or {})
        self.sections = {
            name: dict(content) if isinstance(content, Mapping) else content
            for name, content in (sections or {}).items()
        }
        moves = {key: value for key, value in (("spin", spin), ("velocity", velocity)) if value is not None}
        self.sections |= StartMotion.of(moves).written() if moves else {}
        if start is not None:
            self.sections[START] = os.fspath(start) if isinstance(start, os.PathLike) else start
        self._variants: Variants | None = None
        self._found: set[str] = set()
        self._aged: Aged | None = None
        check_visible("title", title)
        self.title = title

    def add(self, part: Part, name: str | None = None) -> str:
        """Add a part; later parts refer to it by the name that is returned.

        Parameters
        ----------
        part : a part of `evolvent.parts`
        name : str, optional; made from the part's kind and a number if left out

        Raises
        ------
        InputError
            If `part` is none, or the name is taken.
        """
        _check_part(part)
        if name is None:
            kind = type(part).__name__.lower()
            number = 1 + sum(type(other) is type(part) for other in self._parts.values())
            name = f"{kind}-{number}"
        if check_name(name) in self._parts:
            raise InputError(f"the name {name!r} is already taken by another part")
        self._parts[name] = part
        self._found, self._variants = set(), None
        return name

    def remove(self, name: str) -> Part:
        """Take a part out; returns it.

        Parameters
        ----------
        name : str

        Raises
        ------
        InputError
            If no part has the name, or other parts refer to it; the sentence names them.
        """
        self._check_known(name)
        refer = [other for other, part in self._parts.items() if other != name and name in part.references()]
        if refer:
            verb, them = ("refers", "it") if len(refer) == 1 else ("refer", "them")
            names = ", ".join(map(repr, refer))
            raise InputError(f"{name!r} cannot be removed: {names} {verb} to it; remove {them} first")
        self._found, self._variants = set(), None
        return self._parts.pop(name)

    def replace(self, name: str, part: Part) -> Part:
        """Put another part in the place of one, under its name; returns the one before.

        Parts that refer to the name refer to the new part. Whether it has the points that they name is checked when the
        system is assembled. `with_values` changes single keys of a part.

        Parameters
        ----------
        name : str
        part : a part of `evolvent.parts`

        Raises
        ------
        InputError
            If no part has the name, or `part` is none.
        """
        self._check_known(name)
        _check_part(part)
        before, self._parts[name] = self._parts[name], part
        self._found, self._variants = set(), None
        return before

    def _check_known(self, name: Any) -> None:
        if name not in self._parts:
            raise InputError(f"no part is called {name!r}; {nearest(str(name), self._parts)}")

    @property
    def parts(self) -> Mapping[str, Part]:
        """All parts by name, in the order in which they were added."""
        return MappingProxyType(self._parts)

    def copy(self) -> Self:
        """The same parts in its own system."""
        other = type(self)(
            gravity=self._gravity.tolist(), title=self.title, settings=self.settings, sections=self.sections
        )
        other._parts, other._aged = dict(self._parts), self._aged
        return other

    def assemble(self, variants: Variants | None = None) -> Assembly:
        """All parts as one Model of flat arrays, with the initial state; after storage where `sections` have `store`.

        Parameters
        ----------
        variants : what systems of mostly the same parts share, which are then assembled faster

        Raises
        ------
        InputError
            If there is no part, a part refers to one that is not there, parts refer to one another in a circle, or the
            start breaks a constraint; where storage comes to no equilibrium.
        """
        found, section = self._unstored(variants), storage_of(self.sections)
        if section is not None:
            if self._aged is None or not self._aged.is_of(section, found):
                self._aged = Aged(section, found, stored(found, section).assembly)
            found = self._aged.again(found)
        return started(found, self.sections)

    def _unstored(self, variants: Variants | None = None) -> Assembly:
        """The assembly as its parts are written, before any storage."""
        if not self._parts:
            raise InputError("the system has no parts; add one of evolvent.parts, or name one under `parts` in a case")
        shared = variants or self._variants
        if shared is not None:
            found = shared.assembled(self._gravity, self._parts) or shared.assemble(self._gravity, self._parts)
            return found if variants else dataclasses.replace(found, shared=None)
        builder = Builder(self._gravity)
        for name in in_order(self._parts):
            builder.write(name, self._parts[name])
        return builder.build()

    def _assembled(self) -> Assembly:
        """The assembly, which shares what follows from the structure with those of the runs before and of variants."""
        self._variants = self._variants or Variants()
        return self.assemble(self._variants)

    def _run_settings(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """How the motion is run: `settings` with what is given in their place, times in seconds."""
        return settings_of(self.settings, given)

    def to_yaml(self, **settings: Any) -> str:
        """The system as a case file, which `evolvent.load` and ``evolvent run`` read.

        Parameters
        ----------
        settings : arguments of `simulate`, such as until="20 s"

        Raises
        ------
        InputError
            If a part holds a law in Python, which no file can hold; the sentence names the part.
        """
        parts = registry.with_units({name: self._written(name) for name in self._parts})
        return cases.dump(self._content(**settings) | {"parts": parts})

    def _content(self, **settings: Any) -> dict[str, Any]:
        """Content of a case file without the parts."""
        found = self.settings | settings
        for name in ("until", "every", "step"):
            if found.get(name) is not None:
                found[name] = f"{seconds(name, found[name])!r} s"
        content: dict[str, Any] = {"system": "structure"}
        if self.title:
            content["title"] = self.title
        if np.any(self._gravity):
            content["gravity"] = _GRAVITY.write(tuple(self._gravity.tolist()))
        content["parts"] = {}
        if found:
            content["simulate"] = found
        return content | self.sections

    def _written(self, name: str) -> dict[str, Any]:
        """A part as a case file holds it."""
        part = self._parts[name]
        try:
            return part.as_keys()
        except InputError as error:
            raise InputError(f"{name!r} cannot be written: {error}") from None

    def _case(self, settings: Mapping[str, Any]) -> str:
        """The system as a case, '' where it cannot be written."""
        try:
            return self.to_yaml(**settings)
        except InputError:
            return ""
