"""References: how parts name one another and points on one another, such as 'hub', 'boom.tip' or 'boom[5]'."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np

from evolvent_base.errors import InputError

#: A name: no dot, bracket or slash, which stand between a part and what is on it, or between groups of a file.
_NAME = re.compile(r"[^\W\d][\w -]*(?<! )")
#: Names of the variables of a whole run, which stand beside its parts.
OF_THE_RUN = frozenset(
    (
        *(
            "time",
            "fine_sample",
            "axis",
            "cause",
            "energy_losses",
            "momentum",
            "angular_momentum",
            "work_loads",
            "work_drives",
            "work_spools",
        ),
        *("energy", "energy_kinetic", "energy_elastic", "energy_dissipated", "energy_released", "energy_defect"),
        "energy_moved",
    )
)
#: What numbers of the nodes of a thread mean; those of a beam count from its root.
FROM_TIP = "node, 0 at the tip"
_REFERENCE = re.compile(r"(?P<name>[^\W\d][\w -]*)(?:\.(?P<point>[^\W\d][\w -]*(?:\[\d+\])?)|\[(?P<node>\d+)\])?")


class Location(NamedTuple):
    """A point of a part, as the builder finds it.

    Attributes
    ----------
    family : str, the one whose coordinates move it, row : int, in that family
    local : (3,) float, m, body axes; zero of points and nodes
    iq, iv : int, offsets of the place's first coordinate and velocity as the builder counts; -1 of bodies
    beam : int, kind of the beam (`kernels.ancf_beams`); -1 of bodies and points
    x, v : (3,) float, m and m/s, inertial axes, at the start
    alone : bool, whether a body was named without a point
    """

    family: str
    row: int
    local: np.ndarray
    iq: int
    iv: int
    beam: int
    x: np.ndarray
    v: np.ndarray
    alone: bool


class Named(NamedTuple):
    """A reference to a point of a part by the part's name.

    Attributes
    ----------
    where : str, or (name, position), as it was given, key : str, what it is given for, such as "spring.a"
    name : str, of the part, row : int, in its family
    on : str or int, point or number of the node; None where the part alone is named
    """

    where: Any
    key: str
    name: str
    row: int
    on: str | int | None

    def number(self, last: int, what: str) -> int:
        """Number of a node that is meant, of those from 0, the root, to `last`, the tip.

        Parameters
        ----------
        what : str, what messages call the part
        """
        number = {"root": 0, "tip": last}.get(self.on) if isinstance(self.on, str) else self.on
        if number is None or number > last:
            name, on = self.name, self.on
            wanted = f"'{name}.root', '{name}.tip' or a node from '{name}[0]' to '{name}[{last}]'"
            found = f"is a {what}" if on is None else f"has no {'node ' if isinstance(on, int) else ''}{on!r}"
            raise InputError(f"{self.key} is {self.where!r}; {name!r} {found}; give {wanted}")
        return number


def check_name(name: Any) -> str:
    """The name of a part; refused where it cannot be one.

    Raises
    ------
    InputError
    """
    if not isinstance(name, str) or _NAME.fullmatch(name) is None:
        raise InputError(
            f"the name of a part is {name!r}; it must start with a letter and hold letters, digits, '-', '_' and blanks"
        )
    if name == "ground":
        raise InputError("the name of a part is 'ground', which is the inertial frame; use another")
    if name in OF_THE_RUN:
        raise InputError(f"the name of a part is {name!r}, which is a result of the whole run; use another")
    return name


def is_name(text: Any) -> bool:
    """Whether a text can name a part, or a point of a body."""
    return isinstance(text, str) and _NAME.fullmatch(text) is not None


def split_reference(text: str) -> tuple[str, str | int | None]:
    """Name of a part, and what on it: 'hub' -> (hub, None), 'boom.tip' -> (boom, tip), 'boom[5]' -> (boom, 5).

    Of an edge: 'panel.edge[2]' -> (panel, edge[2]).
    """
    match = _REFERENCE.fullmatch(text.strip())
    if match is None:
        raise InputError(f"{text!r} is no reference; give a name, or one such as 'boom.tip' or 'boom[5]'")
    if match["node"] is not None:
        return match["name"], int(match["node"])
    return match["name"], match["point"]
