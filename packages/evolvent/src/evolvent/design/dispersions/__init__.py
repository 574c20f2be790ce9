"""Dispersions: what a study with drawn keys says of its results: bounds, quantiles, sensitivities, worst cases.

`disperse` runs a study (`evolvent.design.studies`) and evaluates it; `evaluate` takes one that was swept before.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from evolvent.design.dispersions.answer import Dispersion
    from evolvent.design.dispersions.dispersed import disperse, evaluate

__all__ = ["Dispersion", "disperse", "evaluate"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        return getattr(importlib.import_module("evolvent.design.dispersions.dispersed"), name)
    raise AttributeError(f"module 'evolvent.design.dispersions' has no attribute {name!r}")
