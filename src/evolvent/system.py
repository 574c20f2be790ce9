"""System: parts by name, assembled once into a Model and an initial state. It knows no kind of part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from evolvent.builder import Assembly, Builder
from evolvent.errors import InputError, nearest
from evolvent.parts.base import Part, check_name


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
        if isinstance(part, type) or not hasattr(part, "write"):
            raise InputError(f"{part!r} is not a part; add one of evolvent.parts, such as parts.Point(mass=1.0)")
        if name is None:
            kind = type(part).__name__.lower()
            number = 1 + sum(type(other) is type(part) for other in self._parts.values())
            name = f"{kind}-{number}"
        if check_name(name) in self._parts:
            raise InputError(f"the name {name!r} is already taken by another part")
        self._parts[name] = part
        return name

    @property
    def parts(self) -> Mapping[str, Part]:
        """All parts by name, in the order in which they were added."""
        return MappingProxyType(self._parts)

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
            If a part refers to one that is not there, parts refer to one another in a circle, or the start breaks a
            constraint.
        """
        builder = Builder(self._gravity)
        for name in self._in_order():
            part = self._parts[name]
            builder.specs[name] = part
            builder.part = name
            part.write(builder, name)
        return builder.build()

    def _in_order(self) -> list[str]:
        """Names in an order in which every part follows those that it refers to, else as they were added."""
        found: dict[str, None] = {}
        path: list[str] = []

        def visit(name: str) -> None:
            if name in path:
                circle = " -> ".join([*path[path.index(name) :], name])
                raise InputError(f"the parts {circle} refer to one another in a circle; one of them must come first")
            if name in found:
                return
            path.append(name)
            for other in getattr(self._parts[name], "references", tuple)():
                if other not in self._parts:
                    raise InputError(
                        f"{name!r} refers to {other!r}, but no part is called that; {nearest(other, self._parts)}"
                    )
                visit(other)
            path.pop()
            found[name] = None

        for name in self._parts:
            visit(name)
        return list(found)
