"""`evolvent identify`: recordings of a vibrating body and a description of its stand in, a certificate out.

>>> from evolvent.weighing import vibration, weigh
>>> weighing = weigh("knock.csv", "stand.yaml")  # doctest: +SKIP
>>> weighing["Ixx"], weighing.std  # doctest: +SKIP
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from evolvent.weighing.certificate import write
    from evolvent.weighing.command import identify
    from evolvent.weighing.description import json_schema, load
    from evolvent.weighing.found import Evaluation, Weighing
    from evolvent.weighing.weighing import vibration, weigh

__all__ = ["Evaluation", "Weighing", "identify", "json_schema", "load", "vibration", "weigh", "write"]

#: Where each name stands; loaded when first asked for, so that the command line starts quickly.
_LAZY = {
    "Evaluation": "found",
    "Weighing": "found",
    "identify": "command",
    "json_schema": "description",
    "load": "description",
    "vibration": "weighing",
    "weigh": "weighing",
    "write": "certificate",
}


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(f"evolvent.weighing.{_LAZY[name]}"), name)
    raise AttributeError(f"module 'evolvent.weighing' has no attribute {name!r}")
