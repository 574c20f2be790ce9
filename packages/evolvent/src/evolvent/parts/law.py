"""Annotations of the keys that hold a law: of a spring, a load, an event or a drive."""

from __future__ import annotations

from evolvent.parts.drive import Drive, PathDrive
from evolvent.parts.expression import (
    Constants,
    DriveLaw,
    EventLaw,
    ForceLaw,
    Parameters,
    SpringLaw,
    refuse_without_law,
    write_law,
)

__all__ = [
    "Constants",
    "Drive",
    "DriveLaw",
    "EventLaw",
    "ForceLaw",
    "Parameters",
    "PathDrive",
    "SpringLaw",
    "refuse_without_law",
    "write_law",
]
