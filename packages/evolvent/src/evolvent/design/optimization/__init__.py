"""Design: values of keys that minimize a result and meet requirements; what governs them, and what tolerances cost."""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader as lazy

if TYPE_CHECKING:
    from evolvent.design.optimization.answer import Design as Design
    from evolvent.design.optimization.search import optimize as optimize

__getattr__, __dir__, __all__ = lazy.attach(__name__, submod_attrs={"answer": ["Design"], "search": ["optimize"]})
