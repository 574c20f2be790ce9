"""What `evolvent identify` runs: recordings of a vibrating body and a description of its stand in, a certificate out.

>>> from evolvent_massprops import vibration, mass_properties
>>> measured = mass_properties("knock.csv", "stand.yaml")  # doctest: +SKIP
>>> measured["Ixx"], measured.std  # doctest: +SKIP
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from evolvent_massprops.certificate import MassProperties
    from evolvent_massprops.description import json_schema, load
    from evolvent_massprops.estimates import Evaluation
    from evolvent_massprops.measurement import mass_properties, vibration

__all__ = ["Evaluation", "MassProperties", "json_schema", "load", "mass_properties", "vibration"]

#: Where each name stands; loaded when first asked for, so that the command line starts quickly.
_LAZY = {
    "Evaluation": "estimates",
    "MassProperties": "certificate",
    "json_schema": "description",
    "load": "description",
    "vibration": "measurement",
    "mass_properties": "measurement",
}


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(f"evolvent_massprops.{_LAZY[name]}"), name)
    raise AttributeError(f"module 'evolvent_massprops' has no attribute {name!r}")
