"""Annotations of the keys that hold a law: a function under a decorator of `evolvent`."""

from __future__ import annotations

from typing import Any

SpringLaw = Any
ForceLaw = Any
DriveLaw = Any
EventLaw = Any
#: How a spool or a driven coordinate moves.
Drive = Any
