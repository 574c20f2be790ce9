"""System: parts by name, assembled once into a Model and an initial state. It knows no kind of part."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from evolvent.builder import Assembly, Builder
from evolvent.errors import InputError


@runtime_checkable
class Part(Protocol):
    """A frozen specification that can write itself into a `Builder`."""

    def write(self, builder: Builder, name: str) -> None:
        """Append rows, coordinates and parameters; register `name`."""


class System:
    """A mechanical system, composed part by part.

    Parameters
    ----------
    gravity : (3,) float, m/s2, inertial frame; acts on every mass

    Examples
    --------
    >>> from evolvent import System, parts
    >>> system = System(gravity=(0.0, 0.0, -9.81))
    >>> bob = system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)))
    >>> rod = system.add(parts.Link(a=(0.0, 0.0, 0.0), b=bob, length=1.0))
    >>> assembly = system.assemble()
    """

    def __init__(self, gravity: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        self._gravity = np.array(gravity, dtype=float)
        if self._gravity.shape != (3,) or not np.all(np.isfinite(self._gravity)):
            raise InputError(f"gravity is {gravity!r}; it must be 3 finite numbers")
        self._parts: dict[str, Part] = {}

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
        if isinstance(part, type) or not isinstance(part, Part):
            raise InputError(f"{part!r} is not a part; add one of evolvent.parts, such as parts.Point(mass=1.0)")
        if name is not None and not isinstance(name, str):
            raise InputError(f"the name of a part is {name!r}; it must be a word")
        if name is None:
            kind = type(part).__name__.lower()
            number = 1 + sum(type(other) is type(part) for other in self._parts.values())
            name = f"{kind}-{number}"
        if name in self._parts or name == "ground":
            raise InputError(f"the name {name!r} is already taken by another part")
        self._parts[name] = part
        return name

    def copy(self) -> System:
        """The same parts in a system of its own."""
        other = System(gravity=self._gravity.tolist())
        other._parts = dict(self._parts)
        return other

    def assemble(self) -> Assembly:
        """All parts as one Model of flat arrays, with the initial state.

        Raises
        ------
        InputError
            If a part refers to one that was not added before it, or the start breaks a constraint.
        """
        builder = Builder(self._gravity)
        for name, part in self._parts.items():
            builder.specs[name] = part
            builder.part = name
            part.write(builder, name)
        return builder.build()
