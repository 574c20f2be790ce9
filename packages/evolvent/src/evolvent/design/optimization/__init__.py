"""Design: values of keys that minimize a result and meet requirements; what governs them, and what tolerances cost."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from evolvent.design.optimization.answer import Design
    from evolvent.design.optimization.search import optimize

__all__ = ["Design", "optimize"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        return getattr(importlib.import_module("evolvent.design.optimization.search"), name)
    raise AttributeError(f"module 'evolvent.design.optimization' has no attribute {name!r}")
