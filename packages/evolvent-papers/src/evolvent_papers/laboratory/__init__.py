"""The laboratory book: measured motion, predicted with a stated band and then compared (`evolvent validate`).

`SETS` names the sets of measurements. Each is a module with `SET`, a `book.Set`, whose function `run` predicts and
compares. Measurements are in `data/`, with source and licence in its README.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from evolvent_base.errors import InputError, nearest

if TYPE_CHECKING:
    from evolvent_papers.laboratory.book import Set

#: Sets of measurements, and their modules.
SETS = {
    "double-pendulum": "pendulum",
    "triple-pendulum": "pendulum",
    "wing-spar": "wing_spar",
    "rotating-beam": "rotating_beam",
    "composite-strips": "composite_strips",
    "driven-arm": "arm",
    "rbsp": "rbsp",
    "trifilar": "trifilar",
    "torsion": "torsion",
    "tosses": "tosses",
}


def found(name: str) -> Set:
    """The set of a name.

    Raises
    ------
    InputError
        If there is none; the sentence names the nearest.
    """
    if name not in SETS:
        raise InputError(f"no set of measurements is called {name!r}; {nearest(name, SETS)}")
    of: Set = importlib.import_module(f"evolvent_papers.laboratory.{SETS[name]}").SETS[name]
    return of
